//! The configuration of a node, written in the order in which devices accept it.

use core::marker::PhantomData;
use std::collections::{BTreeMap, BTreeSet};
use std::vec::Vec;

use super::AccessError;
use super::mapped::PdoOptions;
use crate::cia301;
use crate::id::{CobId, NodeId};
use crate::object::{Address, AnyDevice, Direction, Fits, Mapped, Object, OutOfRange, Rw, Value, Writable};
use crate::procedure::{Data, PdoSettings, Step, configure_pdo};
use crate::wire::pdo::PdoCobId;

/// 1005h, bit 30: the device produces SYNC.
const PRODUCES: u32 = 1 << 30;

/// Values for objects of a node. They are [written](super::blocking::Network::configure) in the order that CiA 301
/// requires, and not in that of the calls:
///
/// 1. objects without a required order, in the order of the calls;
/// 2. SYNC: disabled, its counter (1019h) while the period is 0, its period, then 1005h (7.5.2.5, 7.5.2.22);
/// 3. each PDO: disabled, its parameters, the number of mapped objects 0, the objects, their number, enabled (7.5.2.35
///    to 7.5.2.38). If no COB-ID is set, the PDO keeps its own;
/// 4. storing (1010h).
///
/// ```
/// use lexican_runtime::host::Settings;
/// # mod servo {
/// #     use lexican_runtime::device_model;
/// #     use lexican_runtime::object::{Rw, Unmapped};
/// #     device_model!();
/// #     pub const PRODUCER_HEARTBEAT_TIME: Object<u16, Rw> = Object::new(0x1017, 0);
/// #     pub const TPDO_1_EVENT_TIMER: Object<u16, Rw> = Object::new(0x1800, 5);
/// # }
///
/// // `servo` is generated from a data sheet.
/// let settings = Settings::of(servo::DEVICE).set(servo::PRODUCER_HEARTBEAT_TIME, 100).set(servo::TPDO_1_EVENT_TIMER, 10);
/// ```
#[derive(Clone, Debug)]
#[must_use = "nothing is written before `configure`"]
pub struct Settings<D = AnyDevice> {
    writes: Vec<Write>,
    refused: Option<OutOfRange>,
    marker: PhantomData<fn() -> D>,
}

/// The data for an entry.
#[derive(Clone, Debug)]
pub(super) struct Write {
    pub(super) address: Address,
    pub(super) data: Vec<u8>,
}

/// Values in the device, of entries of up to 32 bits.
#[derive(Debug, Default)]
pub(super) struct Found(BTreeMap<Address, u32>);

impl Found {
    /// Takes the bytes of an entry.
    pub(super) fn answer(&mut self, address: Address, bytes: &[u8]) {
        let mut raw = [0; 4];
        raw.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        self.0.insert(address, u32::from_le_bytes(raw));
    }

    fn get(&self, address: Address) -> Option<u32> {
        self.0.get(&address).copied()
    }
}

impl Write {
    fn of<T: Value>(address: Address, value: T) -> Self {
        Write { address, data: value.to_bytes().into_iter().take(T::SIZE).collect() }
    }
}

impl Settings {
    /// Settings without a dictionary, which accept handles of all devices.
    pub const fn new() -> Self {
        Settings { writes: Vec::new(), refused: None, marker: PhantomData }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Settings::new()
    }
}

impl<D> Settings<D> {
    /// Settings of a device, which accept its handles.
    pub fn of(_device: D) -> Self {
        Settings { writes: Vec::new(), refused: None, marker: PhantomData }
    }

    /// Sets an object; a later value replaces an earlier one.
    pub fn set<T: Value, A: Writable, M, E: Fits<D>>(mut self, object: Object<T, A, M, E>, value: T) -> Self {
        self.refused = self.refused.or(object.check(value).err());
        self.put(Write::of(object.address(), value))
    }

    /// Sets the bytes of an entry that has no handle.
    pub fn set_bytes(self, address: Address, data: &[u8]) -> Self {
        self.put(Write { address, data: data.to_vec() })
    }

    fn put(mut self, write: Write) -> Self {
        match self.writes.iter_mut().find(|known| known.address == write.address) {
            Some(known) => *known = write,
            None => self.writes.push(write),
        }
        self
    }

    /// The entries to read before the device is configured. An error is a value that the data sheet does not allow.
    pub(super) fn questions(&self) -> Result<Vec<Address>, OutOfRange> {
        if let Some(refused) = self.refused {
            return Err(refused);
        }
        let mut questions = Vec::new();
        let counter = Address::new(cia301::SYNCHRONOUS_COUNTER_OVERFLOW, 0);
        questions.extend(self.get(SYNC).map(|_| SYNC));
        questions.extend(self.get(counter).map(|_| PERIOD));
        for parameter in self.pdos() {
            questions.push(Address::new(parameter, 1));
            let map = parameter + cia301::TO_MAPPING;
            if self.of_index(map).next().is_some() && self.get(Address::new(map, 0)).is_none() {
                questions.push(Address::new(map, 0));
            }
        }
        Ok(questions)
    }

    /// All writes in their order, for a device whose entries of [`Settings::questions`] hold `found`.
    pub(super) fn in_order(&self, found: &Found) -> Vec<Write> {
        let is_plain = |write: &&Write| {
            let index = write.address.index();
            parameter_of(index).is_none() && !SYNC_OBJECTS.contains(&index) && index != cia301::STORE_PARAMETERS
        };
        let mut writes: Vec<Write> = self.writes.iter().filter(is_plain).cloned().collect();
        self.sync_in_order(found, &mut writes);
        self.pdos().into_iter().for_each(|parameter| self.pdo_in_order(parameter, found, &mut writes));
        writes.extend(self.of_index(cia301::STORE_PARAMETERS).cloned());
        writes
    }

    fn sync_in_order(&self, found: &Found, writes: &mut Vec<Write>) {
        let off = found.get(SYNC).filter(|cob_id| cob_id & PRODUCES != 0);
        writes.extend(off.map(|cob_id| Write::of(SYNC, cob_id & !PRODUCES)));
        let counter = self.of_index(cia301::SYNCHRONOUS_COUNTER_OVERFLOW).next();
        let period = found.get(PERIOD).filter(|period| *period != 0);
        writes.extend(period.map(|_| Write::of(PERIOD, 0_u32)));
        writes.extend(counter.cloned());
        writes.extend(self.get(PERIOD).cloned().or_else(|| period.map(|period| Write::of(PERIOD, period))));
        writes.extend(self.get(SYNC).cloned());
    }

    fn pdo_in_order(&self, parameter: u16, found: &Found, writes: &mut Vec<Write>) {
        let (id, map) = (Address::new(parameter, 1), parameter + cia301::TO_MAPPING);
        let on = found.get(id).map(PdoCobId).filter(|id| id.is_valid());
        writes.extend(on.map(|on| Write::of(id, on.switched_off().0)));
        writes.extend(self.of_index(parameter).filter(|write| write.address != id).cloned());
        let mut mapped: Vec<&Write> = self.of_index(map).collect();
        if !mapped.is_empty() {
            mapped.sort_by_key(|write| write.address);
            let count = Address::new(map, 0);
            let highest = mapped.last().map_or(0, |write| write.address.sub());
            let before = found.get(count).map_or(0, |count| count as u8);
            writes.push(Write::of(count, 0_u8));
            writes.extend(mapped.iter().filter(|write| write.address != count).map(|write| (*write).clone()));
            writes.push(self.get(count).cloned().unwrap_or_else(|| Write::of(count, highest.max(before))));
        }
        writes.extend(self.get(id).cloned().or_else(|| on.map(|on| Write::of(id, on.0))));
    }

    fn get(&self, address: Address) -> Option<&Write> {
        self.writes.iter().find(|write| write.address == address)
    }

    fn of_index(&self, index: u16) -> impl Iterator<Item = &Write> {
        self.writes.iter().filter(move |write| write.address.index() == index)
    }

    /// The communication parameters of all PDOs that change, ascending.
    fn pdos(&self) -> BTreeSet<u16> {
        self.writes.iter().filter_map(|write| parameter_of(write.address.index())).collect()
    }
}

const SYNC: Address = Address::new(cia301::COB_ID_SYNC, 0);
const PERIOD: Address = Address::new(cia301::COMMUNICATION_CYCLE_PERIOD, 0);
const SYNC_OBJECTS: [u16; 3] =
    [cia301::COB_ID_SYNC, cia301::COMMUNICATION_CYCLE_PERIOD, cia301::SYNCHRONOUS_COUNTER_OVERFLOW];

/// The communication parameter of the PDO to which an object belongs.
fn parameter_of(index: u16) -> Option<u16> {
    match index {
        cia301::RPDO_1..=cia301::RPDO_512 | cia301::TPDO_1..=cia301::TPDO_512 => Some(index),
        cia301::RPDO_MAPPING_1..=cia301::RPDO_MAPPING_512 | cia301::TPDO_MAPPING_1..=cia301::TPDO_MAPPING_512 => {
            Some(index - cia301::TO_MAPPING)
        }
        _ => None,
    }
}

/// A PDO of a node, with its new options.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pdo {
    node: NodeId,
    direction: Direction,
    number: u16,
    options: PdoOptions,
}

impl PdoOptions {
    pub(super) fn pdo(self, node: NodeId, direction: Direction, number: u16) -> Result<Pdo, AccessError> {
        let exists = (1..=512).contains(&number);
        exists.then_some(Pdo { node, direction, number, options: self }).ok_or(AccessError::NoSuchPdo { number })
    }
}

impl Pdo {
    pub(super) const fn cob_id(self) -> Object<u32, Rw> {
        Object::new(self.parameter(), 1)
    }

    /// The index of its communication parameter.
    const fn parameter(self) -> u16 {
        match self.direction {
            Direction::Receive => cia301::rpdo(self.number),
            Direction::Transmit => cia301::tpdo(self.number),
        }
    }

    /// The new COB-ID: the one that was given, or else the present one, or else that of the predefined connection set.
    /// Whether remote requests are allowed is kept.
    pub(super) fn choose(self, found: u32) -> Result<PdoCobId, AccessError> {
        let found = PdoCobId(found);
        let first = match self.direction {
            Direction::Receive => cia301::connection::RPDO_1,
            Direction::Transmit => cia301::connection::TPDO_1,
        };
        let predefined = || (self.number <= 4).then(|| CobId::of_node(first + 0x100 * (self.number - 1), self.node));
        let present = Some(found.id()).filter(|id| id.raw() != 0);
        let id = self.options.cob_id.or(present).or_else(predefined);
        let id = PdoCobId::valid(id.ok_or(AccessError::NoCobId { number: self.number })?);
        Ok(if found.allows_remote() { id } else { id.without_remote() })
    }

    /// The writes that give it the COB-ID, the options and the mapping.
    pub(super) fn settings(self, id: PdoCobId, mapping: &[Mapped]) -> Settings {
        let PdoOptions { transmission, inhibit_100us, event_timer_ms, .. } = self.options;
        let settings = PdoSettings {
            direction: self.direction,
            number: self.number,
            cob_id: id,
            transmission,
            inhibit_100us,
            event_timer_ms,
            mapping: Some(mapping),
        };
        configure_pdo(settings).fold(Settings::new(), |settings, step| match step {
            Step::Write { address, data: Data::Value(value) } => settings.set_bytes(address, value.bytes()),
            _ => settings,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::format;
    use std::string::String;

    /// The questions and the writes for these settings, on a device that holds the values `found`.
    fn in_order(settings: &[(u16, u8, &[u8])], found: &[(u16, u8, u32)]) -> (Vec<Address>, Vec<String>) {
        let settings = settings
            .iter()
            .fold(Settings::new(), |settings, (index, sub, data)| settings.set_bytes(Address::new(*index, *sub), data));
        let mut device = Found::default();
        found.iter().for_each(|(index, sub, raw)| device.answer(Address::new(*index, *sub), &raw.to_le_bytes()));
        let hex = |data: &[u8]| data.iter().rev().map(|byte| format!("{byte:02X}")).collect::<String>();
        let writes = settings.in_order(&device);
        let writes = writes.iter().map(|write| format!("{} {}", write.address, hex(&write.data))).collect();
        (settings.questions().unwrap(), writes)
    }

    #[test]
    fn a_pdo_is_switched_off_and_gets_its_cob_id_back() {
        let settings: &[(u16, u8, &[u8])] = &[
            (0x1A00, 2, &[0x20, 0, 0x64, 0x60]),
            (0x1A00, 1, &[0x10, 0, 0x41, 0x60]),
            (0x1800, 5, &[10, 0]),
            (0x6081, 0, &[1]),
            (0x1010, 1, b"save"),
        ];
        let (questions, writes) = in_order(settings, &[(0x1800, 1, 0x4000_0185), (0x1A00, 0, 1)]);
        assert_eq!(questions, [Address::new(0x1800, 1), Address::new(0x1A00, 0)]);
        let expected = [
            "6081:00 01",
            "1800:01 C0000185",
            "1800:05 000A",
            "1A00:00 00",
            "1A00:01 60410010",
            "1A00:02 60640020",
            "1A00:00 02",
            "1800:01 40000185",
            "1010:01 65766173",
        ];
        assert_eq!(writes, expected);
        // A disabled PDO stays disabled, and a given number of objects is written.
        let (_, writes) = in_order(&[settings[2], (0x1A00, 0, &[1])], &[(0x1800, 1, 0x8000_0185)]);
        assert_eq!(writes, ["1800:05 000A", "1A00:00 00", "1A00:00 01"]);
        // A given COB-ID is written last, and the number of objects does not shrink by itself.
        let settings: &[(u16, u8, &[u8])] = &[(0x1600, 1, &[0; 4]), (0x1400, 1, &[5, 3, 0, 0]), (0x1400, 2, &[1])];
        let (_, writes) = in_order(settings, &[(0x1400, 1, 0x205), (0x1600, 0, 3)]);
        let expected =
            ["1400:01 80000205", "1400:02 01", "1600:00 00", "1600:01 00000000", "1600:00 03", "1400:01 00000305"];
        assert_eq!(writes, expected);
    }

    #[test]
    fn sync_is_off_while_it_changes() {
        let settings: &[(u16, u8, &[u8])] =
            &[(0x1005, 0, &[0x81, 0, 0, 0x40]), (0x1019, 0, &[10]), (0x1006, 0, &[0xE8, 3, 0, 0])];
        let (questions, writes) = in_order(settings, &[(0x1005, 0, 0x4000_0080), (0x1006, 0, 5)]);
        assert_eq!(questions, [SYNC, PERIOD]);
        let expected = ["1005:00 00000080", "1006:00 00000000", "1019:00 0A", "1006:00 000003E8", "1005:00 40000081"];
        assert_eq!(writes, expected);
        let (_, writes) = in_order(&settings[1..2], &[(0x1006, 0, 5)]);
        assert_eq!(writes, ["1006:00 00000000", "1019:00 0A", "1006:00 00000005"]);
    }

    #[test]
    fn a_value_outside_the_limits_is_reported_before_anything_is_sent() {
        let object = Object::<u8, Rw>::new(0x2000, 0).with_limits(1, 2);
        assert!(Settings::new().set(object, 3).set(object, 2).questions().is_err());
        let settings = Settings::new().set(object, 1).set(object, 2);
        let writes = settings.in_order(&Found::default());
        assert_eq!(writes.iter().map(|write| write.data.as_slice()).collect::<Vec<_>>(), [[2]]);
    }
}
