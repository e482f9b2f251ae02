//! The dictionary that a device serves.
//!
//! [`ObjectDictionary`] is what the services ask. [`Dictionary`] answers from the [`Table`] that the generated code
//! brings.

use core::ops::{Range, RangeInclusive};

use super::pdo::number;
use super::table::{Entry, PdoMapping, Table};
use super::{Address, DataType, Object, Value};
use crate::abort::AbortCode;
use crate::id::NodeId;

/// What the services need of a device's objects. The application implements it, mostly by lending a
/// [`Dictionary`], or by a type of its own that wraps one and looks at some addresses first.
pub trait ObjectDictionary {
    /// The facts of an entry.
    ///
    /// Errors: [`AbortCode::NO_SUCH_OBJECT`] or [`AbortCode::NO_SUCH_SUB_INDEX`].
    fn entry(&self, address: Address) -> Result<Entry, AbortCode>;

    /// The bytes in which [`Entry::offset`] counts, of a dictionary that reads and writes a number without limits by copying
    /// it there and does nothing else with it: a PDO then copies, too. A dictionary that looks at what is read or written
    /// has none, which is the default, and every mapped object is asked for by [`read`](Self::read) and [`write`](Self::write).
    fn image(&mut self) -> &mut [u8] {
        &mut []
    }

    /// The number of bytes that the entry holds now, or `None` if it is known only after reading to the end.
    fn len(&self, entry: &Entry) -> Option<u32>;

    /// Reads from `offset` into `buffer`; less than the whole buffer only at the end. Access rights are
    /// checked by the caller: a device may read what its manager may not.
    ///
    /// Errors: any reason why the device does not give the data now.
    fn read(&mut self, entry: &Entry, offset: u32, buffer: &mut [u8]) -> Result<usize, AbortCode>;

    /// Writes `data` at `offset`; `last` if the entry ends with it. Values of a fixed size come
    /// whole, in one call, and so do text and bytes with a capacity of 1 to 64. Anything else may come in pieces,
    /// ascending and without gaps; the last one never comes when the transfer is given up.
    ///
    /// Errors: any reason why the device does not take the data; the value is unchanged then.
    fn write(&mut self, entry: &Entry, offset: u32, data: &[u8], last: bool) -> Result<(), AbortCode>;

    /// The first and the last of the addresses whose values the application has set since the last call, for TPDOs that map
    /// them; `None` if there are none, or the application reports them by [`Device::changed`](crate::device::Device::changed).
    /// What wraps a dictionary is a [`Layer`](super::Layer), which hands on what that one has.
    fn take_changes(&mut self) -> Option<(Address, Address)> {
        None
    }
}

/// A dictionary that holds its values in an image of `N` bytes.
// Aligned as devices are: on a Cortex-M the compiler brings a function to copy for each alignment.
#[repr(align(8))]
#[derive(Clone, Debug)]
pub struct Dictionary<const N: usize> {
    table: &'static Table,
    image: [u8; N],
    changes: Option<(Address, Address)>,
}

impl<const N: usize> Dictionary<N> {
    /// A dictionary with the defaults of the data sheet for this node-ID.
    ///
    /// # Panics
    ///
    /// When the table's image does not have `N` bytes: the generated code sees to that.
    #[must_use]
    pub fn new(table: &'static Table, node: NodeId) -> Self {
        assert_eq!(table.image.len(), N, "the generated image has the generated size");
        let mut dictionary = Dictionary { table, image: [0; N], changes: None };
        dictionary.reset(node, 0..=0xFFFF);
        dictionary
    }

    /// Adds the node-ID to a number.
    fn add_node(&mut self, entry: &Entry, node: NodeId) {
        let sum = self.raw_at(entry).unwrap_or(0).wrapping_add(u64::from(node.get()));
        self.set_raw_at(entry, sum);
    }

    /// What the generated code says of the device.
    #[must_use]
    pub fn table(&self) -> &'static Table {
        self.table
    }

    /// Gives all entries of these indices the defaults of the data sheet for this node-ID: `0x1000..=0x1FFF`
    /// for a reset of the communication (CiA 301, 7.3.2.2), `0..=0xFFFF` for a reset of the node.
    pub fn reset(&mut self, node: NodeId, indices: RangeInclusive<u16>) {
        let (first, last) = (*indices.start(), *indices.end());
        for row in self.table.rows.iter().filter(|row| (first..=last).contains(&row.first().index())) {
            for entry in row.entries() {
                let range = slot_range(&entry);
                if let (Some(to), Some(from)) = (self.image.get_mut(range.clone()), self.table.image.get(range)) {
                    to.copy_from_slice(from);
                }
                if entry.plus_node {
                    self.add_node(&entry, node);
                }
            }
        }
    }

    /// The value of an object. The device itself reads everything, also what its manager may not.
    ///
    /// # Panics
    ///
    /// When the handle belongs to another device: handle and dictionary come from one data sheet.
    #[must_use]
    pub fn get<T: Value, A, M, D>(&self, object: Object<T, A, M, D>) -> T {
        let entry = self.own(object.address());
        T::from_bytes(self.bytes(&entry)).expect("the handle has the type of the entry")
    }

    /// Sets an object. The device itself writes everything, also what its manager may only read, and
    /// is not held to the limits. Another value than before is an event for the TPDOs that map the object: they are due with
    /// the next `poll_transmit` of the device, if [`Triggers`](crate::service::tpdo::Triggers) counts changes.
    ///
    /// # Panics
    ///
    /// When the handle belongs to another device: handle and dictionary come from one data sheet.
    pub fn set<T: Value, A, M, D>(&mut self, object: Object<T, A, M, D>, value: T) {
        let address = object.address();
        let mapping = self.own(address).mapping;
        if self.replace(object, value) && matches!(mapping, PdoMapping::Tpdo | PdoMapping::Both) {
            let (first, last) = self.changes.unwrap_or((address, address));
            self.changes = Some((first.min(address), last.max(address)));
        }
    }

    /// Sets an object without an event, for values that are worth a PDO only from a certain change on: the application
    /// reports it by [`Device::changed`](crate::device::Device::changed).
    ///
    /// # Panics
    ///
    /// As [`Dictionary::set`].
    pub fn set_quietly<T: Value, A, M, D>(&mut self, object: Object<T, A, M, D>, value: T) {
        self.replace(object, value);
    }

    /// Sets an object, and returns whether it had another value.
    fn replace<T: Value, A, M, D>(&mut self, object: Object<T, A, M, D>, value: T) -> bool {
        let entry = self.own(object.address());
        let (_, bytes) = self.slot(&entry);
        assert_eq!(bytes.len(), T::SIZE, "the handle has the type of the entry");
        let pairs = bytes.iter_mut().zip(value.to_bytes());
        pairs.fold(false, |differs, (to, from)| core::mem::replace(to, from) != from || differs)
    }

    /// The number in an entry of this dictionary's table, in wire form, for those who go by addresses and not by handles;
    /// `None` if the entry has no fixed size. Access is not checked.
    #[must_use]
    pub fn raw_at(&self, entry: &Entry) -> Option<u64> {
        entry.data_type.size()?;
        Some(number(self.bytes(entry)))
    }

    /// Sets such a number, without an event; neither access nor limits are checked. Does nothing if the entry has no fixed size.
    pub fn set_raw_at(&mut self, entry: &Entry, raw: u64) {
        if entry.data_type.size().is_some() {
            let (_, bytes) = self.slot(entry);
            bytes.iter_mut().zip(raw.to_le_bytes()).for_each(|(to, from)| *to = from);
        }
    }

    fn own(&self, address: Address) -> Entry {
        self.table.entry(address).expect("the handle belongs to this dictionary")
    }

    /// The bytes that the entry holds now.
    fn bytes(&self, entry: &Entry) -> &[u8] {
        let start = entry.offset as usize;
        let held = self.image.get(start..start + usize::from(entry.capacity)).unwrap_or(&[]);
        match self.length_prefix(entry) {
            Some(len) => held.get(..len).unwrap_or(held),
            None => held,
        }
    }

    fn length_prefix(&self, entry: &Entry) -> Option<usize> {
        if entry.data_type.size().is_some() {
            return None;
        }
        let prefix = (entry.offset as usize).checked_sub(2)?;
        let bytes = self.image.get(prefix..prefix + 2)?;
        Some(usize::from(u16::from_le_bytes([*bytes.first()?, *bytes.last()?])))
    }

    /// Length prefix (empty for a fixed size) and value, to be written.
    fn slot(&mut self, entry: &Entry) -> (&mut [u8], &mut [u8]) {
        let range = slot_range(entry);
        let prefix = entry.offset as usize - range.start;
        match self.image.get_mut(range) {
            Some(slot) => slot.split_at_mut(prefix),
            None => (&mut [], &mut []),
        }
    }

    fn check_limits(&self, entry: &Entry, bytes: &[u8]) -> Result<(), AbortCode> {
        let limit = usize::from(entry.limit).checked_sub(1).and_then(|row| self.table.limits.get(row));
        let (Some(limit), Some(bits)) = (limit, entry.data_type.bits()) else { return Ok(()) };
        let order = |raw: u64| order_key(entry.data_type, bits, raw);
        let value = order(number(bytes));
        if value < order(limit.low) {
            Err(AbortCode::VALUE_TOO_LOW)
        } else if value > order(limit.high) {
            Err(AbortCode::VALUE_TOO_HIGH)
        } else {
            Ok(())
        }
    }
}

/// Where length prefix and value of an entry lie in the image.
fn slot_range(entry: &Entry) -> Range<usize> {
    let start = entry.offset as usize;
    let prefix = if entry.data_type.size().is_some() || entry.capacity == 0 { 0 } else { 2 };
    start.saturating_sub(prefix)..start + usize::from(entry.capacity)
}

/// A number that orders the wire forms of a type as their values order.
fn order_key(data_type: DataType, bits: u8, raw: u64) -> u64 {
    let sign = 1 << (bits - 1);
    match data_type {
        // IEEE 754 numbers order by magnitude when their bits do, and in reverse when negative; there are two zeros.
        DataType::Real32 | DataType::Real64 if raw & sign == 0 => sign + raw,
        DataType::Real32 | DataType::Real64 => sign - (raw ^ sign),
        signed if signed.is_signed() => raw ^ sign,
        _ => raw,
    }
}

impl<const N: usize> ObjectDictionary for Dictionary<N> {
    fn entry(&self, address: Address) -> Result<Entry, AbortCode> {
        self.table.entry(address)
    }

    fn image(&mut self) -> &mut [u8] {
        &mut self.image
    }

    fn len(&self, entry: &Entry) -> Option<u32> {
        u32::try_from(self.bytes(entry).len()).ok()
    }

    fn read(&mut self, entry: &Entry, offset: u32, buffer: &mut [u8]) -> Result<usize, AbortCode> {
        if entry.data_type == DataType::Domain {
            return Err(AbortCode::NO_DATA);
        }
        let rest = self.bytes(entry).get(offset as usize..).unwrap_or(&[]);
        // An SDO server asks for eight bytes: a copy of a known length needs no call (README: SDO block read).
        if let (Some(rest), Ok(buffer)) = (rest.first_chunk::<8>(), <&mut [u8; 8]>::try_from(&mut *buffer)) {
            *buffer = *rest;
            return Ok(8);
        }
        let n = rest.len().min(buffer.len());
        if let (Some(buffer), Some(rest)) = (buffer.get_mut(..n), rest.get(..n)) {
            buffer.copy_from_slice(rest);
        }
        Ok(n)
    }

    fn write(&mut self, entry: &Entry, offset: u32, data: &[u8], last: bool) -> Result<(), AbortCode> {
        if entry.data_type == DataType::Domain {
            return Err(AbortCode::CANNOT_TRANSFER);
        }
        entry.check_len(data.len())?;
        self.check_limits(entry, data)?;
        let (prefix, value) = self.slot(entry);
        let start = offset as usize;
        let Some(to) = start.checked_add(data.len()).and_then(|end| value.get_mut(start..end)) else {
            return Err(AbortCode::LENGTH_TOO_HIGH);
        };
        to.copy_from_slice(data);
        // What comes in pieces is empty until the last one, so that a mixture of two values is never read.
        if last || start == 0 {
            let len = if last { start + data.len() } else { 0 };
            let len = u16::try_from(len).unwrap_or(u16::MAX).to_le_bytes();
            prefix.iter_mut().zip(len).for_each(|(to, from)| *to = from);
        }
        Ok(())
    }

    fn take_changes(&mut self) -> Option<(Address, Address)> {
        self.changes.take()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::object::table::{Access, Limit, Row};
    use crate::object::{Rw, U24};

    const fn row(index: u16, sub: u8, data_type: DataType, offset: u32, capacity: u16) -> Row {
        Row::new(index, sub, data_type, Access::Rw, PdoMapping::None).at(offset, capacity)
    }

    static TABLE: Table = Table {
        rows: &[
            row(0x1014, 0, DataType::Unsigned32, 0, 4).plus_node(),
            row(0x2000, 1, DataType::Integer16, 4, 2).limited(0),
            row(0x2000, 3, DataType::VisibleString, 8, 5),
            row(0x2001, 0, DataType::Real32, 13, 4).limited(1),
            row(0x2002, 0, DataType::Unsigned24, 17, 3),
        ],
        limits: &[
            Limit { low: (-5_i16 as u16) as u64, high: 5 },
            Limit { low: (-1.5_f32).to_bits() as u64, high: (2.0_f32).to_bits() as u64 },
        ],
        image: &[0x80, 0, 0, 0, 7, 0, 2, 0, b'o', b'k', 0, 0, 0, 0, 0, 0, 0, 1, 2, 3],
    };

    fn dictionary() -> Dictionary<20> {
        Dictionary::new(&TABLE, NodeId::literal(5))
    }

    #[track_caller]
    fn write(at: (u16, u8), data: &[u8]) -> Result<(), AbortCode> {
        let mut od = dictionary();
        let entry = od.entry(Address::new(at.0, at.1))?;
        od.write(&entry, 0, data, true)
    }

    #[test]
    fn a_missing_sub_index_differs_from_a_missing_object() {
        let entry = |index, sub| dictionary().entry(Address::new(index, sub)).map(|entry| entry.address);
        assert_eq!(entry(0x2000, 1), Ok(Address::new(0x2000, 1)));
        for sub in [0, 2, 4] {
            assert_eq!(entry(0x2000, sub), Err(AbortCode::NO_SUCH_SUB_INDEX));
        }
        for index in [0, 0x1015, 0x2003, 0xFFFF] {
            assert_eq!(entry(index, 0), Err(AbortCode::NO_SUCH_OBJECT));
        }
    }

    #[test]
    fn the_node_id_is_added_to_defaults_that_depend_on_it() {
        assert_eq!(dictionary().get(Object::<u32, Rw>::new(0x1014, 0)), 0x85);
        assert_eq!(dictionary().get(Object::<U24, Rw>::new(0x2002, 0)), U24::literal(0x03_0201));
    }

    #[test]
    fn limits_are_those_of_the_type() {
        assert_eq!(write((0x2000, 1), &(-5_i16).to_le_bytes()), Ok(()));
        assert_eq!(write((0x2000, 1), &(-6_i16).to_le_bytes()), Err(AbortCode::VALUE_TOO_LOW));
        assert_eq!(write((0x2000, 1), &6_i16.to_le_bytes()), Err(AbortCode::VALUE_TOO_HIGH));
        assert_eq!(write((0x2001, 0), &(-1.5_f32).to_le_bytes()), Ok(()));
        assert_eq!(write((0x2001, 0), &(-1.6_f32).to_le_bytes()), Err(AbortCode::VALUE_TOO_LOW));
        assert_eq!(write((0x2001, 0), &2.1_f32.to_le_bytes()), Err(AbortCode::VALUE_TOO_HIGH));
    }

    #[test]
    fn a_value_of_another_length_is_refused() {
        assert_eq!(write((0x2000, 1), &[1]), Err(AbortCode::LENGTH_TOO_LOW));
        assert_eq!(write((0x2000, 1), &[1, 0, 0]), Err(AbortCode::LENGTH_TOO_HIGH));
    }

    #[test]
    fn a_reset_concerns_the_indices_that_it_names() {
        let mut od = dictionary();
        let mut write = |index, sub, data: &[u8]| {
            let entry = od.entry(Address::new(index, sub)).unwrap();
            od.write(&entry, 0, data, true).unwrap();
        };
        write(0x1014, 0, &[0x99, 0, 0, 0]);
        write(0x2000, 1, &[1, 0]);
        write(0x2000, 3, b"other");
        od.reset(NodeId::literal(6), 0x1000..=0x1FFF);
        assert_eq!(od.get(Object::<u32, Rw>::new(0x1014, 0)), 0x86);
        assert_eq!(od.get(Object::<i16, Rw>::new(0x2000, 1)), 1);
        od.reset(NodeId::literal(5), 0..=0xFFFF);
        assert_eq!(od.image, dictionary().image);
    }

    #[test]
    fn numbers_are_got_and_set_by_their_entries_whatever_their_size_and_limits() {
        let mut od = dictionary();
        let entry = |index, sub| dictionary().entry(Address::new(index, sub)).unwrap();
        for (at, before, set, after) in [
            (entry(0x2000, 1), Some(7), 0x1_FFFF, Some(0xFFFF)),
            (entry(0x2002, 0), Some(0x03_0201), 0x0A_0B0C, Some(0x0A_0B0C)),
            (entry(0x2000, 3), None, 1, None),
        ] {
            assert_eq!(od.raw_at(&at), before, "{}", at.address);
            od.set_raw_at(&at, set);
            assert_eq!(od.raw_at(&at), after, "{}", at.address);
        }
        assert_eq!(od.len(&entry(0x2000, 3)), Some(2), "a text is left alone");
    }

    #[test]
    fn text_is_written_in_pieces_and_has_a_length_of_its_own() {
        let mut od = dictionary();
        let entry = od.entry(Address::new(0x2000, 3)).unwrap();
        assert_eq!(od.len(&entry), Some(2));
        od.write(&entry, 0, b"abc", false).unwrap();
        assert_eq!(od.len(&entry), Some(0), "it is neither what it was nor what it will be");
        od.write(&entry, 3, b"d", true).unwrap();
        let mut buffer = [0; 8];
        assert_eq!(od.read(&entry, 0, &mut buffer), Ok(4));
        assert_eq!(&buffer[..4], b"abcd");
        assert_eq!(od.read(&entry, 3, &mut buffer), Ok(1));
        assert_eq!(od.write(&entry, 4, b"xy", true), Err(AbortCode::LENGTH_TOO_HIGH));
    }
}
