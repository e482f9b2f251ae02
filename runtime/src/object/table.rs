//! What generated code says of a device's entries: the facts of each, packed in rows.

use super::{Address, DataType};
use crate::abort::AbortCode;

/// The facts of an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Entry {
    pub address: Address,
    pub data_type: DataType,
    pub access: Access,
    pub mapping: PdoMapping,
    /// Where the value starts in the image. Text and bytes are preceded by their length, two bytes.
    pub offset: u32,
    /// How many bytes the image has for the value; 0 for a DOMAIN, which the image does not hold.
    pub capacity: u16,
    /// 1 + the row of [`Table::limits`]; 0 for none.
    pub limit: u16,
    /// Whether the node-ID is added to the default in [`Table::image`].
    pub plus_node: bool,
}

impl Entry {
    /// An entry without a value and without limits.
    #[must_use]
    pub const fn new(index: u16, sub: u8, data_type: DataType, access: Access, mapping: PdoMapping) -> Self {
        Entry {
            address: Address::new(index, sub),
            data_type,
            access,
            mapping,
            offset: 0,
            capacity: 0,
            limit: 0,
            plus_node: false,
        }
    }

    /// Whether a value may have `len` bytes.
    ///
    /// Errors: [`AbortCode::LENGTH_TOO_LOW`] or [`AbortCode::LENGTH_TOO_HIGH`], of an entry with a fixed size.
    pub(crate) fn check_len(&self, len: usize) -> Result<(), AbortCode> {
        match self.data_type.size() {
            Some(size) if len < size => Err(AbortCode::LENGTH_TOO_LOW),
            Some(size) if len > size => Err(AbortCode::LENGTH_TOO_HIGH),
            _ => Ok(()),
        }
    }
}

/// What a manager may do with an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Access {
    /// Read only.
    Ro,
    /// Write only.
    Wo,
    /// Both.
    Rw,
    /// Read only, and never changing.
    Const,
}

impl Access {
    /// Whether a manager may read.
    #[must_use]
    pub const fn is_readable(self) -> bool {
        !matches!(self, Access::Wo)
    }

    /// Whether a manager may write.
    #[must_use]
    pub const fn is_writable(self) -> bool {
        matches!(self, Access::Wo | Access::Rw)
    }
}

/// Which PDOs may map an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum PdoMapping {
    None,
    Tpdo,
    Rpdo,
    Both,
}

/// The limits of an entry, in wire form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Limit {
    pub low: u64,
    pub high: u64,
}

/// One or more entries of an object, in twelve bytes. Those of one row have sub-indices one after the other, and the same
/// facts but for where their values are: these lie one after the other, too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// Index, first sub-index and last sub-index, from the highest byte down.
    key: u32,
    /// Where the value of the first entry starts.
    offset: u32,
    /// Of a number 1 + its row of limits, or 0; the capacity of everything else.
    room: u16,
    data_type: DataType,
    /// What a manager may do (bits 0 and 1), which PDOs may map it (bits 2 and 3), and [`Row::PLUS_NODE`].
    flags: u8,
}

impl Row {
    const PLUS_NODE: u8 = 1 << 4;

    /// An entry without a value and without limits.
    #[must_use]
    pub const fn new(index: u16, sub: u8, data_type: DataType, access: Access, mapping: PdoMapping) -> Self {
        let key = Address::new(index, sub).0 << 8 | sub as u32;
        Row { key, offset: NOWHERE, room: 0, data_type, flags: access as u8 | (mapping as u8) << 2 }
    }

    /// The entries up to this sub-index.
    ///
    /// # Panics
    ///
    /// Unless they are numbers: at compile time in a constant.
    #[must_use]
    pub const fn up_to(self, last: u8) -> Self {
        assert!(self.data_type.size().is_some() && last >= self.key as u8, "numbers have one size");
        Row { key: self.key & !0xFF | last as u32, ..self }
    }

    /// With a place for the value of the first entry: `capacity` bytes of the image, from `offset` on.
    ///
    /// # Panics
    ///
    /// If a number has another size: at compile time in a constant.
    #[must_use]
    pub const fn at(self, offset: u32, capacity: u16) -> Self {
        match self.data_type.size() {
            Some(size) => {
                assert!(size == capacity as usize, "a number has the size of its type");
                Row { offset, ..self }
            }
            None => Row { offset, room: capacity, ..self },
        }
    }

    /// With the limits in row `row` of [`Table::limits`], counted from 0.
    ///
    /// # Panics
    ///
    /// Unless they are numbers: at compile time in a constant.
    #[must_use]
    pub const fn limited(self, row: u16) -> Self {
        assert!(self.data_type.size().is_some(), "only numbers have limits");
        Row { room: row + 1, ..self }
    }

    /// With defaults to which the node-ID is added.
    #[must_use]
    pub const fn plus_node(self) -> Self {
        Row { flags: self.flags | Row::PLUS_NODE, ..self }
    }

    /// Whether the entry with this address is in the row.
    pub(super) fn holds(&self, address: Address) -> bool {
        address.0.wrapping_sub(self.first().0) < self.len()
    }

    /// The facts of an entry that is in the row.
    pub(super) fn entry(&self, address: Address) -> Entry {
        let (capacity, limit) = match self.data_type.size() {
            Some(size) => (size as u16, self.room),
            None => (self.room, 0),
        };
        Entry {
            address,
            data_type: self.data_type,
            access: match self.flags & 3 {
                0 => Access::Ro,
                1 => Access::Wo,
                2 => Access::Rw,
                _ => Access::Const,
            },
            mapping: match self.flags >> 2 & 3 {
                0 => PdoMapping::None,
                1 => PdoMapping::Tpdo,
                2 => PdoMapping::Rpdo,
                _ => PdoMapping::Both,
            },
            offset: self.offset + address.0.wrapping_sub(self.first().0) * u32::from(capacity),
            capacity,
            limit,
            plus_node: self.flags & Row::PLUS_NODE != 0,
        }
    }

    /// The address of the first entry.
    pub(super) const fn first(&self) -> Address {
        Address(self.key >> 8)
    }

    /// How many entries the row has.
    pub(super) fn len(&self) -> u32 {
        u32::from((self.key as u8).wrapping_sub((self.key >> 8) as u8)) + 1
    }

    /// All entries of the row.
    pub fn entries(&self) -> impl Iterator<Item = Entry> {
        (self.first().0..).map(|address| self.entry(Address(address))).take(self.len() as usize)
    }
}

/// The offset of an entry that has no value: beyond the end of all images.
const NOWHERE: u32 = i32::MAX as u32;

/// What the generated code says of a device: everything but the values. 5,000 objects are data and not code, and an
/// entry is found in O(log n).
#[derive(Debug)]
pub struct Table {
    /// The entries, ascending by address.
    pub rows: &'static [Row],
    /// The limits that entries refer to.
    pub limits: &'static [Limit],
    /// The defaults of all entries.
    pub image: &'static [u8],
}

impl Table {
    /// All entries, ascending by address.
    pub fn entries(&self) -> impl Iterator<Item = Entry> {
        self.rows.iter().flat_map(Row::entries)
    }

    /// The facts of an entry.
    ///
    /// Errors: [`AbortCode::NO_SUCH_OBJECT`] or [`AbortCode::NO_SUCH_SUB_INDEX`].
    pub fn entry(&self, address: Address) -> Result<Entry, AbortCode> {
        // Behind the last row that begins at the address or before.
        let behind = self.rows.partition_point(|row| row.first().0 <= address.0);
        let (before, next) = (self.rows.get(behind.wrapping_sub(1)), self.rows.get(behind));
        let is_near = |row: &Row| row.first().index() == address.index();
        match before {
            Some(row) if row.holds(address) => Ok(row.entry(address)),
            _ if before.is_some_and(is_near) || next.is_some_and(is_near) => Err(AbortCode::NO_SUCH_SUB_INDEX),
            _ => Err(AbortCode::NO_SUCH_OBJECT),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const fn row(index: u16, sub: u8, data_type: DataType) -> Row {
        Row::new(index, sub, data_type, Access::Const, PdoMapping::Both)
    }

    static TABLE: Table = Table {
        rows: &[
            row(0x1000, 0, DataType::Unsigned32).at(0, 4),
            row(0x2000, 2, DataType::Integer16).up_to(4).at(4, 2).limited(0).plus_node(),
            row(0x2000, 6, DataType::VisibleString).at(12, 9),
            row(0x20FF, 0xFE, DataType::Unsigned8).up_to(0xFF).at(21, 1),
            row(0x2100, 0, DataType::Domain),
        ],
        limits: &[Limit { low: 0, high: 1 }],
        image: &[0; 23],
    };

    #[test]
    fn a_row_stands_for_all_its_entries() {
        let places: Vec<_> = TABLE.entries().map(|entry| (entry.address.0, entry.offset, entry.capacity)).collect();
        let expected = [
            (0x10_0000, 0, 4),
            (0x20_0002, 4, 2),
            (0x20_0003, 6, 2),
            (0x20_0004, 8, 2),
            (0x20_0006, 12, 9),
            (0x20_FFFE, 21, 1),
            (0x20_FFFF, 22, 1),
            (0x21_0000, NOWHERE, 0),
        ];
        assert_eq!(places, expected);
        for entry in TABLE.entries() {
            assert_eq!(TABLE.entry(entry.address), Ok(entry));
            assert_eq!((entry.access, entry.mapping), (Access::Const, PdoMapping::Both));
            let is_limited = entry.data_type == DataType::Integer16;
            assert_eq!((entry.limit, entry.plus_node), (is_limited.into(), is_limited), "{}", entry.address);
        }
    }

    #[test]
    fn what_is_between_rows_is_missing() {
        let missing = |index, sub| TABLE.entry(Address::new(index, sub)).map(|entry| entry.address);
        for sub in [0, 1, 5, 7, 0xFF] {
            assert_eq!(missing(0x2000, sub), Err(AbortCode::NO_SUCH_SUB_INDEX), "{sub}");
        }
        assert_eq!(missing(0x20FF, 0xFD), Err(AbortCode::NO_SUCH_SUB_INDEX));
        for index in [0, 0x0FFF, 0x1001, 0x20FE, 0x2101, 0xFFFF] {
            assert_eq!(missing(index, 0), Err(AbortCode::NO_SUCH_OBJECT), "{index:04X}");
        }
    }
}
