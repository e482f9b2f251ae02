//! How services read and write numbers in the dictionary that they are lent.

use crate::abort::AbortCode;
use crate::object::{Address, Entry, ObjectDictionary};

/// The number at `address`; `None` when there is none or the dictionary does not give it.
pub(crate) fn read_at(od: &mut (impl ObjectDictionary + ?Sized), address: Address) -> Option<u64> {
    let entry = od.entry(address).ok()?;
    read_entry(od, &entry)
}

/// The number that an entry holds; `None` when the dictionary does not give it.
pub(crate) fn read_entry(od: &mut (impl ObjectDictionary + ?Sized), entry: &Entry) -> Option<u64> {
    let mut bytes = [0; 8];
    let len = od.read(entry, 0, &mut bytes).ok()?;
    (len > 0).then_some(u64::from_le_bytes(bytes))
}

/// The number at `index:sub`, 32 bits of it.
pub(crate) fn read_u32(od: &mut (impl ObjectDictionary + ?Sized), index: u16, sub: u8) -> Option<u32> {
    read_at(od, Address::new(index, sub)).map(|value| value as u32)
}

/// The number at `index:sub`, 16 bits of it.
pub(crate) fn read_u16(od: &mut (impl ObjectDictionary + ?Sized), index: u16, sub: u8) -> Option<u16> {
    read_u32(od, index, sub).map(|value| value as u16)
}

/// The number at `index:sub`, 8 bits of it.
pub(crate) fn read_u8(od: &mut (impl ObjectDictionary + ?Sized), index: u16, sub: u8) -> Option<u8> {
    read_u32(od, index, sub).map(|value| value as u8)
}

/// Writes as many bytes as the entry's type has. Does nothing if there is no such entry, or the dictionary refuses the
/// number.
pub(crate) fn write(od: &mut (impl ObjectDictionary + ?Sized), index: u16, sub: u8, value: u32) {
    let _ = write_at(od, Address::new(index, sub), value.into(), 8);
}

/// Writes as many bytes of a number as the entry's type has, or `len` if it has no fixed size.
pub(crate) fn write_at(
    od: &mut (impl ObjectDictionary + ?Sized),
    address: Address,
    value: u64,
    len: usize,
) -> Result<(), AbortCode> {
    let entry = od.entry(address)?;
    let bytes = value.to_le_bytes();
    od.write(&entry, 0, bytes.get(..entry.data_type.size().unwrap_or(len)).unwrap_or(&bytes), true)
}
