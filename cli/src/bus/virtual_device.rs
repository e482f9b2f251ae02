//! A device that is nothing but its data sheet: the defaults are its values, and what is written is kept.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use lexican_eds::model::{self, AccessType, Condition, ConditionalRange, Value};
use lexican_runtime::device::{Behaviour, Device, Event};
use lexican_runtime::host::Node;
use lexican_runtime::object::{Access, Address, DataType, Entry, ObjectDictionary, PdoMapping};
use lexican_runtime::{AbortCode, Frame, Instant, NodeId};

use crate::values::wire::{encode, parse};

/// More than this is not kept of one entry.
const MAX_BYTES: usize = 1024 * 1024;

/// A node of a bus that serves the objects of a data sheet.
pub(crate) struct VirtualDevice {
    device: Box<Device<64, 64, 4, 32>>,
    dictionary: SheetDictionary,
}

impl VirtualDevice {
    /// A device that is switched on at `now`.
    pub(crate) fn power_on(now: Instant, node: NodeId, sheet: &model::Device) -> Self {
        let mut dictionary = SheetDictionary::new(node, sheet);
        let dummies =
            sheet.dummies.iter().filter(|dummy| dummy.code() < 32).fold(0, |set, dummy| set | 1 << dummy.code());
        let mut device = Box::new(Device::new(node, Behaviour { dummies, ..Behaviour::CIA_301 }));
        device.restart(now, &mut dictionary);
        VirtualDevice { device, dictionary }
    }

    fn follow(&mut self, now: Instant, event: Option<Event>) {
        if let Some(Event::Reset(_)) = event {
            self.dictionary.reset();
            self.device.restart(now, &mut self.dictionary);
        }
        self.device.compare(&mut self.dictionary);
    }
}

impl Node for VirtualDevice {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        let event = self.device.handle_frame(now, frame, &mut self.dictionary);
        self.follow(now, event);
    }

    fn handle_timeout(&mut self, now: Instant) {
        let event = self.device.handle_timeout(now, &mut self.dictionary);
        self.follow(now, event);
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        self.device.poll_transmit(now, &mut self.dictionary)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.device.poll_timeout()
    }
}

/// The objects of a data sheet as a dictionary.
struct SheetDictionary {
    slots: BTreeMap<Address, Slot>,
}

struct Slot {
    entry: Entry,
    default: Vec<u8>,
    value: Vec<u8>,
    /// What was written so far of a value that comes in pieces.
    coming: Vec<u8>,
    low: Option<i128>,
    high: Option<i128>,
    /// Limits that depend on other entries.
    ranges: Vec<ConditionalRange>,
    sheet_type: lexican_eds::types::DataType,
}

impl SheetDictionary {
    fn new(node: NodeId, sheet: &model::Device) -> Self {
        let slots = sheet.entries().map(|entry| (Address::new(entry.index, entry.sub), Slot::new(node, entry)));
        SheetDictionary { slots: slots.collect() }
    }

    /// Whether an entry can have a value: by its size, its limits, and those that hold while another entry has
    /// a certain value.
    fn check(&self, address: Address, data: &[u8]) -> Result<(), AbortCode> {
        let slot = self.slots.get(&address).ok_or(AbortCode::NO_SUCH_OBJECT)?;
        if let Some(size) = slot.entry.data_type.size() {
            match data.len().cmp(&size) {
                Ordering::Less => return Err(AbortCode::LENGTH_TOO_LOW),
                Ordering::Greater => return Err(AbortCode::LENGTH_TOO_HIGH),
                Ordering::Equal => {}
            }
        }
        let Some(Value::Integer(number)) = parse(slot.sheet_type, data) else { return Ok(()) };
        let holds = |when: &Condition| {
            let other = self.slots.get(&Address::new(when.index, when.sub)).and_then(Slot::number);
            other.is_some_and(|other| (other == when.value) == when.equal)
        };
        let conditional = slot.ranges.iter().filter(|range| holds(&range.when));
        let limits = conditional.map(|range| (Some(range.low), Some(range.high))).chain([(slot.low, slot.high)]);
        for (low, high) in limits {
            if low.is_some_and(|low| number < low) {
                return Err(AbortCode::VALUE_TOO_LOW);
            }
            if high.is_some_and(|high| number > high) {
                return Err(AbortCode::VALUE_TOO_HIGH);
            }
        }
        Ok(())
    }

    /// As after power-on.
    fn reset(&mut self) {
        self.slots.values_mut().for_each(|slot| slot.value.clone_from(&slot.default));
    }
}

impl Slot {
    fn new(node: NodeId, entry: &model::Entry) -> Self {
        // What CiA 301 does not define is a block of bytes to whoever transfers it.
        let data_type = DataType::from_code(entry.data_type.code()).unwrap_or(DataType::Domain);
        let number = |value: &Option<Value>| resolved(value.as_ref()?, node)?.as_integer();
        let default = entry.configured.as_ref().or(entry.default.as_ref()).and_then(|value| resolved(value, node));
        let default = default.and_then(|value| encode(entry.data_type, &value));
        let default = default.unwrap_or_else(|| vec![0; data_type.size().unwrap_or(0)]);
        Slot {
            entry: Entry {
                address: Address::new(entry.index, entry.sub),
                data_type,
                access: access(entry.access),
                mapping: mapping(entry),
                offset: 0,
                capacity: u16::try_from(data_type.size().unwrap_or(0)).unwrap_or(u16::MAX),
                limit: 0,
            },
            value: default.clone(),
            default,
            coming: Vec::new(),
            low: number(&entry.low),
            high: number(&entry.high),
            ranges: entry.ranges.clone(),
            sheet_type: entry.data_type,
        }
    }

    /// The number that the entry holds.
    fn number(&self) -> Option<i128> {
        parse(self.sheet_type, &self.value)?.as_integer()
    }
}

impl ObjectDictionary for SheetDictionary {
    fn entry(&self, address: Address) -> Result<Entry, AbortCode> {
        if let Some(slot) = self.slots.get(&address) {
            return Ok(slot.entry);
        }
        let all = Address::new(address.index(), 0)..=Address::new(address.index(), u8::MAX);
        Err(match self.slots.range(all).next() {
            Some(_) => AbortCode::NO_SUCH_SUB_INDEX,
            None => AbortCode::NO_SUCH_OBJECT,
        })
    }

    fn len(&self, entry: &Entry) -> Option<u32> {
        u32::try_from(self.slots.get(&entry.address)?.value.len()).ok()
    }

    fn read(&mut self, entry: &Entry, offset: u32, buffer: &mut [u8]) -> Result<usize, AbortCode> {
        let slot = self.slots.get(&entry.address).ok_or(AbortCode::NO_SUCH_OBJECT)?;
        let rest = slot.value.get(offset as usize..).unwrap_or_default();
        buffer.iter_mut().zip(rest).for_each(|(to, from)| *to = *from);
        Ok(rest.len().min(buffer.len()))
    }

    fn write(&mut self, entry: &Entry, offset: u32, data: &[u8], last: bool) -> Result<(), AbortCode> {
        let slot = self.slots.get_mut(&entry.address).ok_or(AbortCode::NO_SUCH_OBJECT)?;
        slot.coming.truncate(offset as usize);
        if slot.coming.len() + data.len() > MAX_BYTES {
            slot.coming.clear();
            return Err(AbortCode::OUT_OF_MEMORY);
        }
        slot.coming.extend(data);
        if last {
            let whole = std::mem::take(&mut slot.coming);
            self.check(entry.address, &whole)?;
            if let Some(slot) = self.slots.get_mut(&entry.address) {
                slot.value = whole;
            }
        }
        Ok(())
    }
}

fn resolved(value: &Value, node: NodeId) -> Option<Value> {
    match value {
        Value::NodeIdPlus(offset) => Some(Value::Integer(i128::from(*offset) + i128::from(node.get()))),
        other => Some(other.clone()),
    }
}

fn access(access: AccessType) -> Access {
    match access {
        AccessType::Ro => Access::Ro,
        AccessType::Wo => Access::Wo,
        AccessType::Rw | AccessType::Rwr | AccessType::Rww => Access::Rw,
        AccessType::Const => Access::Const,
    }
}

fn mapping(entry: &model::Entry) -> PdoMapping {
    match (entry.pdo_mapping, entry.access) {
        (false, _) => PdoMapping::None,
        (true, AccessType::Ro | AccessType::Const | AccessType::Rwr) => PdoMapping::Tpdo,
        (true, AccessType::Wo | AccessType::Rww) => PdoMapping::Rpdo,
        (true, AccessType::Rw) => PdoMapping::Both,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lexican_runtime::host::blocking::Network;
    use lexican_runtime::host::{AccessError, VirtualBus, VirtualLink};
    use lexican_runtime::service::sdo_client::SdoError;
    use lexican_runtime::wire::nmt::NmtState;
    use lexican_runtime::{CobId, Duration, host::Link};

    const NODE: NodeId = NodeId::literal(5);

    /// A bus with a device that has the dictionary of the shipped drive but is no drive.
    fn network() -> (VirtualBus, Network<VirtualLink>) {
        let sheet = lexican_eds::load(&lexican_eds::library::find("siko/ag03-1").unwrap().input()).0;
        let bus = VirtualBus::new();
        bus.attach(VirtualDevice::power_on(Instant::ZERO, NODE, &sheet));
        let link = bus.link();
        bus.advance(Duration::from_millis(1));
        (bus, Network::new(link))
    }

    fn aborted(result: Result<(), AccessError>) -> Option<AbortCode> {
        match result {
            Err(AccessError::Sdo { error: SdoError::Aborted { code, .. }, .. }) => Some(code),
            _ => None,
        }
    }

    #[test]
    fn defaults_are_read_and_what_is_written_is_kept() {
        let (_, mut network) = network();
        assert_eq!(network.read_bytes(NODE, Address::new(0x1400, 1)).unwrap(), 0x205_u32.to_le_bytes());
        assert_eq!(network.read_bytes(NODE, Address::new(0x1018, 1)).unwrap(), 0x195_u32.to_le_bytes());
        let a_pos = Address::new(0x2410, 4);
        network.write_bytes(NODE, a_pos, &[77]).or_else(|_| network.write_bytes(NODE, a_pos, &[77, 0])).unwrap();
        assert_eq!(network.read_bytes(NODE, a_pos).unwrap()[0], 77);
    }

    #[test]
    fn rights_sizes_and_limits_are_enforced() {
        let (_, mut network) = network();
        let mut write = |index, sub, data: &[u8]| aborted(network.write_bytes(NODE, Address::new(index, sub), data));
        assert_eq!(write(0x1018, 1, &[0; 4]), Some(AbortCode::READ_ONLY));
        assert_eq!(write(0x6060, 0, &[1, 0, 0]), Some(AbortCode::LENGTH_TOO_HIGH));
        assert_eq!(write(0x6060, 0, &[9]), Some(AbortCode::VALUE_TOO_HIGH));
        assert_eq!(write(0x6060, 0, &[0]), Some(AbortCode::VALUE_TOO_LOW));
        assert_eq!(write(0x1018, 9, &[0]), Some(AbortCode::NO_SUCH_SUB_INDEX));
        assert_eq!(write(0x7000, 0, &[0]), Some(AbortCode::NO_SUCH_OBJECT));
    }

    #[test]
    fn limits_follow_the_entry_that_decides_them() {
        let sheet = lexican_eds::load(&lexican_eds::library::find("siko/ag03-1").unwrap().input()).0;
        let mut dictionary = SheetDictionary::new(NODE, &sheet);
        let mut with_gear = |gear: u8, velocity: i32| {
            dictionary.slots.get_mut(&Address::new(0x2102, 0)).unwrap().value = vec![gear];
            dictionary.check(Address::new(0x60FF, 0), &velocity.to_le_bytes())
        };
        assert_eq!(with_gear(2, 150), Ok(()));
        assert_eq!(with_gear(2, 201), Err(AbortCode::VALUE_TOO_HIGH));
        assert_eq!(with_gear(3, 100), Ok(()));
        assert_eq!(with_gear(3, 150), Err(AbortCode::VALUE_TOO_HIGH));
        assert_eq!(with_gear(3, -150), Err(AbortCode::VALUE_TOO_LOW));
    }

    #[test]
    fn it_boots_beats_and_sends_what_was_received() {
        let (bus, mut network) = network();
        network.write_bytes(NODE, Address::new(0x1017, 0), &100_u16.to_le_bytes()).unwrap();
        let mut link = network.into_link();
        let beat = link.receive_frame(bus.now() + Duration::from_millis(150)).unwrap().unwrap();
        assert_eq!((beat.id().raw(), beat.data()), (0x705, &[NmtState::PreOperational.code()][..]));

        // RPDO3 has the target position; nothing but an SDO tells it back.
        let start = Frame::from_array(CobId::NMT, [0x01, 0x05]);
        let target = Frame::from_array(CobId::of_node(0x400, NODE), [0x1F, 0, 0x88, 0x13, 0, 0]);
        link.send(&start).unwrap();
        link.send(&target).unwrap();
        bus.advance(Duration::from_millis(1));
        let mut network = Network::new(link);
        assert_eq!(network.read_bytes(NODE, Address::new(0x607A, 0)).unwrap(), 5000_i32.to_le_bytes());
    }

    #[test]
    fn a_reset_brings_the_defaults_back() {
        let (bus, mut network) = network();
        let mode = Address::new(0x6060, 0);
        network.write_bytes(NODE, mode, &[2]).unwrap();
        network.command(lexican_runtime::wire::nmt::NmtCommand::ResetNode, Some(NODE)).unwrap();
        let until = bus.now() + Duration::from_millis(10);
        while network.next_event(until).unwrap().is_some() {}
        assert_eq!(network.read_bytes(NODE, mode).unwrap(), [1]);
    }
}
