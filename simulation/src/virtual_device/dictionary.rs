//! A dictionary made of a data sheet.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use lexican_eds::model::{self, AccessType, Condition};
use lexican_runtime::object::{Access, Address, DataType, Entry, ObjectDictionary, PdoMapping};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{AbortCode, NodeId, cia301};
use lexican_toolbox::values::wire::parse;
use lexican_toolbox::values::{Limits, address};
use simulator::Storage;

/// Stands for `$NODEID` in a device without a node-ID, whose dictionary cannot be read.
pub(super) const NO_NODE: NodeId = NodeId::literal(127);

/// The largest size of an entry, in bytes.
const MAX_BYTES: usize = 1024 * 1024;

#[derive(Clone, Debug)]
pub(super) struct SheetDictionary {
    slots: BTreeMap<Address, Slot>,
    node: NodeId,
    /// The NMT state of the device, on which write access depends.
    pub(super) state: NmtState,
}

#[derive(Clone, Debug)]
struct Slot {
    entry: Entry,
    /// The entry in the data sheet.
    sheet: model::Entry,
    default: Vec<u8>,
    /// Whether the default is from the data sheet.
    is_given: bool,
    value: Vec<u8>,
    /// The bytes received so far of a value whose transfer is in progress.
    partial: Vec<u8>,
}

impl SheetDictionary {
    pub(super) fn new(node: NodeId, sheet: &model::Device) -> Self {
        let slots = sheet.entries().map(|entry| (address(entry), Slot::new(node, sheet, entry)));
        SheetDictionary { slots: slots.collect(), node, state: NmtState::Initialising }
    }

    pub(super) fn value(&self, address: Address) -> Result<&[u8], AbortCode> {
        Ok(&self.slots.get(&address).ok_or_else(|| self.missing(address))?.value)
    }

    /// Changes a value from inside the device: regardless of its access, but within its size and limits.
    pub(super) fn set(&mut self, address: Address, data: &[u8]) -> Result<(), AbortCode> {
        self.value(address)?;
        self.check(address, data)?;
        if let Some(slot) = self.slots.get_mut(&address) {
            slot.value = data.to_vec();
        }
        Ok(())
    }

    /// The entries that 1010h stores.
    pub(super) fn writable(&self) -> Vec<Address> {
        let writable = self.slots.values().filter(|slot| slot.is_stored());
        writable.map(|slot| slot.entry.address).collect()
    }

    /// Whether the device could have stored this value of an entry.
    pub(super) fn can_keep(&self, address: Address, data: &[u8]) -> bool {
        let fits = |slot: &Slot| slot.entry.data_type.size().is_none_or(|size| size == data.len());
        self.slots.get(&address).is_some_and(|slot| (slot.sheet.persistent || slot.is_stored()) && fits(slot))
    }

    /// Whether an entry is stored without a store command.
    pub(super) fn is_persistent(&self, address: Address) -> bool {
        self.slots.get(&address).is_some_and(|slot| slot.sheet.persistent)
    }

    /// Whether the data sheet gives an entry its value.
    pub(super) fn is_given(&self, address: Address) -> bool {
        self.slots.get(&address).is_some_and(|slot| slot.is_given)
    }

    fn missing(&self, address: Address) -> AbortCode {
        let all = Address::new(address.index(), 0)..=Address::new(address.index(), u8::MAX);
        match self.slots.range(all).next() {
            Some(_) => AbortCode::NO_SUCH_SUB_INDEX,
            None => AbortCode::NO_SUCH_OBJECT,
        }
    }

    /// Checks a value against the size of an entry and its limits, which may depend on another entry.
    fn check(&self, address: Address, data: &[u8]) -> Result<(), AbortCode> {
        let slot = self.slots.get(&address).ok_or(AbortCode::NO_SUCH_OBJECT)?;
        if let Some(size) = slot.entry.data_type.size() {
            match data.len().cmp(&size) {
                Ordering::Less => return Err(AbortCode::LENGTH_TOO_LOW),
                Ordering::Greater => return Err(AbortCode::LENGTH_TOO_HIGH),
                Ordering::Equal => {}
            }
        }
        let Some(value) = parse(slot.sheet.data_type, data) else { return Ok(()) };
        let holds = |when: &Condition| {
            let other = self.slots.get(&Address::new(when.index, when.sub)).and_then(Slot::number);
            other.is_some_and(|other| (other == when.value) == when.equal)
        };
        match Limits::violated(&slot.sheet, self.node, holds, &value).map(|(side, _)| side) {
            Some(Ordering::Less) => Err(AbortCode::VALUE_TOO_LOW),
            Some(_) => Err(AbortCode::VALUE_TOO_HIGH),
            None => Ok(()),
        }
    }

    /// Makes numbers the defaults of entries for which the data sheet has none. Numbers beyond the limits are ignored.
    pub(super) fn supply_defaults(&mut self, defaults: &[(Address, i64)]) {
        for &(address, value) in defaults {
            let Some(slot) = self.slots.get(&address).filter(|slot| !slot.is_given) else { continue };
            let bytes = value.to_le_bytes();
            let Some(data) = slot.entry.data_type.size().and_then(|size| bytes.get(..size)) else { continue };
            self.supply_default(address, data);
        }
    }

    /// Makes bytes the default of an entry, if it exists and accepts them.
    pub(super) fn supply_default(&mut self, address: Address, data: &[u8]) {
        if self.set(address, data).is_ok()
            && let Some(slot) = self.slots.get_mut(&address)
        {
            slot.default = data.to_vec();
        }
    }

    /// Sets the values of power-on: the stored ones, else the defaults.
    pub(super) fn reset(&mut self, kept: &BTreeMap<Address, Vec<u8>>) {
        for (address, slot) in &mut self.slots {
            slot.partial.clear();
            slot.value.clone_from(kept.get(address).unwrap_or(&slot.default));
        }
    }

    /// Takes over from `before` what a reset communication keeps: all but 1000h to 1FFFh (CiA 301, 7.3.2.2.1).
    pub(super) fn keep_application(&mut self, mut before: Self) {
        for (address, slot) in &mut self.slots {
            if let Some(old) =
                before.slots.get_mut(address).filter(|_| !cia301::COMMUNICATION.contains(&address.index()))
            {
                slot.value = std::mem::take(&mut old.value);
            }
        }
    }
}

impl Slot {
    fn new(node: NodeId, sheet: &model::Device, entry: &model::Entry) -> Self {
        // A type that CiA 301 does not define is transferred as bytes.
        let data_type = entry.data_type.known().unwrap_or(DataType::Domain);
        let initial = lexican_eds::start::initial(sheet, entry);
        let default = initial.of_node(node.get());
        Slot {
            entry: Entry {
                address: address(entry),
                data_type,
                access: access(entry.access),
                mapping: mapping(entry),
                offset: 0,
                capacity: u16::try_from(data_type.size().unwrap_or(0)).unwrap_or(u16::MAX),
                limit: 0,
                // The value already includes the node-ID.
                plus_node: false,
            },
            sheet: entry.clone(),
            value: default.clone(),
            default,
            is_given: initial.is_given,
            partial: Vec::new(),
        }
    }

    /// Whether 1010h stores the entry.
    fn is_stored(&self) -> bool {
        use cia301::{PREDEFINED_ERROR_FIELD, RESTORE_DEFAULT_PARAMETERS, STORE_PARAMETERS};
        let commands = [PREDEFINED_ERROR_FIELD, STORE_PARAMETERS, RESTORE_DEFAULT_PARAMETERS];
        self.entry.access == Access::Rw && !commands.contains(&self.entry.address.index())
    }

    fn is_writable_in(&self, state: NmtState) -> bool {
        let state = match state {
            NmtState::Operational => model::NmtState::Operational,
            _ => model::NmtState::PreOperational,
        };
        self.sheet.writable_in.as_ref().is_none_or(|states| states.contains(&state))
    }

    fn number(&self) -> Option<i128> {
        parse(self.sheet.data_type, &self.value)?.as_integer()
    }
}

impl Storage for SheetDictionary {
    fn raw(&self, address: Address) -> Option<u64> {
        let slot = self.slots.get(&address)?;
        slot.entry.data_type.size()?;
        let mut bytes = [0; 8];
        bytes.iter_mut().zip(&slot.value).for_each(|(to, from)| *to = *from);
        Some(u64::from_le_bytes(bytes))
    }

    fn set_raw(&mut self, address: Address, raw: u64) {
        if let Some(slot) = self.slots.get_mut(&address)
            && let Some(bytes) =
                slot.entry.data_type.size().and_then(|size| raw.to_le_bytes().get(..size).map(<[u8]>::to_vec))
        {
            slot.value = bytes;
        }
    }

    fn addresses(&self) -> Vec<Address> {
        self.slots.keys().copied().collect()
    }

    fn duplicate(&self) -> Box<dyn Storage> {
        Box::new(self.clone())
    }
}

impl ObjectDictionary for SheetDictionary {
    fn entry(&self, address: Address) -> Result<Entry, AbortCode> {
        if let Some(slot) = self.slots.get(&address) {
            return Ok(slot.entry);
        }
        Err(self.missing(address))
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
        let state = self.state;
        let slot = self.slots.get_mut(&entry.address).ok_or(AbortCode::NO_SUCH_OBJECT)?;
        if !slot.is_writable_in(state) {
            return Err(AbortCode::DEVICE_STATE);
        }
        slot.partial.truncate(offset as usize);
        if slot.partial.len() + data.len() > MAX_BYTES {
            slot.partial.clear();
            return Err(AbortCode::OUT_OF_MEMORY);
        }
        slot.partial.extend(data);
        if last {
            let whole = std::mem::take(&mut slot.partial);
            // A default may violate the limits of its own data sheet, so the present value can always be written back.
            if whole == slot.value {
                return Ok(());
            }
            self.check(entry.address, &whole)?;
            if let Some(slot) = self.slots.get_mut(&entry.address) {
                slot.value = whole;
            }
        }
        Ok(())
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
    use crate::samples;

    const NODE: NodeId = NodeId::literal(5);

    #[test]
    fn limits_depend_on_another_entry() {
        let sheet = samples::drive();
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
    fn an_entry_is_written_only_in_its_states() {
        let mut sheet = samples::drive();
        let entry = sheet.objects.iter_mut().find(|object| object.index == 0x6060).unwrap().entries.first_mut();
        entry.unwrap().writable_in = Some(Box::new([model::NmtState::PreOperational]));
        let mut dictionary = SheetDictionary::new(NODE, &sheet);
        let entry = dictionary.entry(Address::new(0x6060, 0)).unwrap();
        dictionary.state = NmtState::Operational;
        assert_eq!(dictionary.write(&entry, 0, &[2], true), Err(AbortCode::DEVICE_STATE));
        dictionary.state = NmtState::PreOperational;
        assert_eq!(dictionary.write(&entry, 0, &[2], true), Ok(()));
    }
}
