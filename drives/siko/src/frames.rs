//! Frames that the drives treat differently than CiA 301, on CAN and behind a gateway.

use lexican_runtime::object::Address;
use lexican_runtime::{CobId, Frame, cia301};
use simulator::Storage;

use crate::model::Model;

/// For a drive that writes by 23h only (AG02, table 18): a 23h that writes an object of one or two bytes gets that
/// size, if the number fits. Other write commands become invalid. No other frame that the drive takes has eight bytes.
pub(crate) fn with_size_of_object(model: &Model, storage: &dyn Storage, frame: &Frame) -> Frame {
    const RESERVED: u8 = 0xE0;
    let &[command @ 0x20..=0x3F, index_low, index_high, sub, a, b, c, d] = frame.data() else { return *frame };
    if !model.writes_four_bytes {
        return *frame;
    }
    let address = Address::new(u16::from_le_bytes([index_low, index_high]), sub);
    let size = storage.entry(address).ok().and_then(|entry| entry.data_type.size());
    let command = match (command, size, [b, c, d]) {
        (0x23, Some(1), [0, 0, 0]) => 0x2F,
        (0x23, Some(2), [_, 0, 0]) => 0x2B,
        (0x23, ..) => 0x23,
        _ => RESERVED,
    };
    Frame::from_array(frame.id(), [command, index_low, index_high, sub, a, b, c, d])
}

/// Whether the frame is an EMCY, and 1014h switches EMCY off.
pub(crate) fn is_switched_off(model: &Model, storage: &dyn Storage, frame: &Frame) -> bool {
    let parameter = emergency_parameter(storage);
    let silent = model.emergencies.is_some_and(|switch| (parameter & switch.bit != 0) != switch.on_when_set);
    silent && frame.id() == CobId::from_parameter(parameter)
}

pub(crate) fn emergency_parameter(storage: &dyn Storage) -> u32 {
    storage.raw(Address::new(cia301::COB_ID_EMCY, 0)).unwrap_or_default() as u32
}
