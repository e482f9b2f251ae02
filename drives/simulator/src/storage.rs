//! Storage of the values of a simulated drive's objects.

use std::cell::RefCell;
use std::fmt;

use lexican_runtime::object::{Address, DataType, Dictionary, Entry, Object, ObjectDictionary, Table, Value};

/// The values of a drive's objects: a generated dictionary of any size, or another one.
pub trait Storage: ObjectDictionary + fmt::Debug + Send {
    /// The number at `address` in wire form; `None` if there is no number.
    fn raw(&self, address: Address) -> Option<u64>;

    /// Sets a number in wire form, ignoring access and limits; does nothing if there is no number.
    fn set_raw(&mut self, address: Address, raw: u64);

    /// The addresses of all entries, ascending.
    fn addresses(&self) -> Vec<Address>;

    /// A copy.
    fn duplicate(&self) -> Box<dyn Storage>;

    /// The number at `address`; `None` if there is no number.
    fn number(&self, address: Address) -> Option<i64> {
        signed(self.entry(address).ok()?.data_type, self.raw(address)?)
    }
}

impl<const N: usize> Storage for Dictionary<N> {
    fn raw(&self, address: Address) -> Option<u64> {
        self.raw_at(&found(self.table(), address)?)
    }

    fn set_raw(&mut self, address: Address, raw: u64) {
        if let Some(entry) = found(self.table(), address) {
            self.set_raw_at(&entry, raw);
        }
    }

    fn number(&self, address: Address) -> Option<i64> {
        let entry = found(self.table(), address)?;
        signed(entry.data_type, self.raw_at(&entry)?)
    }

    fn addresses(&self) -> Vec<Address> {
        self.table().entries().map(|entry| entry.address).collect()
    }

    fn duplicate(&self) -> Box<dyn Storage> {
        Box::new(self.clone())
    }
}

/// How many entries are cached.
const PLACES: usize = 512;

/// The entry of a generated table. A servo looks up the same hundreds of entries at each frame, so they are cached, for
/// all drives of a thread, in the place given by Knuth's multiplicative hash of the address.
fn found(table: &'static Table, address: Address) -> Option<Entry> {
    type Known = Option<(&'static Table, Address, Option<Entry>)>;
    thread_local! {
        static KNOWN: RefCell<[Known; PLACES]> = const { RefCell::new([None; PLACES]) };
    }
    let key = u32::from(address.index()) << 8 | u32::from(address.sub());
    let place = (key.wrapping_mul(0x9E37_79B1) >> 16) as usize % PLACES;
    KNOWN.with_borrow_mut(|known| match known[place] {
        Some((of, at, entry)) if std::ptr::eq(of, table) && at == address => entry,
        _ => {
            let entry = table.entry(address).ok();
            known[place] = Some((table, address, entry));
            entry
        }
    })
}

impl Clone for Box<dyn Storage> {
    fn clone(&self) -> Self {
        self.duplicate()
    }
}

impl dyn Storage + '_ {
    /// The value of an object; 0 if it is missing.
    #[must_use]
    pub fn get<T: Value, A, M, D>(&self, object: Object<T, A, M, D>) -> T {
        T::from_raw(self.raw(object.address()).unwrap_or_default())
    }
}

/// The little-endian number of the first eight bytes.
#[must_use]
pub fn raw_of(data: &[u8]) -> u64 {
    let mut bytes = [0; 8];
    bytes.iter_mut().zip(data).for_each(|(to, from)| *to = *from);
    u64::from_le_bytes(bytes)
}

/// The number of a wire form; `None` if the type has no fixed size.
#[must_use]
pub fn signed(data_type: DataType, raw: u64) -> Option<i64> {
    let unused_bits = 64 - u32::from(data_type.bits()?);
    let high = raw << unused_bits;
    Some(if data_type.is_signed() { (high as i64) >> unused_bits } else { (high >> unused_bits) as i64 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use lexican_runtime::NodeId;
    use lexican_runtime::object::{Access, PdoMapping, Row};

    const fn table(rows: &'static [Row]) -> Table {
        Table { rows, limits: &[], image: &[7, 0, 0, 0] }
    }

    const fn row(index: u16, data_type: DataType, size: u16) -> Row {
        Row::new(index, 0, data_type, Access::Rw, PdoMapping::None).at(0, size)
    }

    static WIDE: Table = table(&[row(0x6040, DataType::Unsigned32, 4)]);
    static NARROW: Table = table(&[row(0x6040, DataType::Integer8, 1), row(0x6060, DataType::Integer8, 1)]);

    #[test]
    fn what_is_remembered_of_one_drive_is_not_taken_for_another_one() {
        let (control, mode) = (Address::new(0x6040, 0), Address::new(0x6060, 0));
        let [mut wide, mut narrow] = [&WIDE, &NARROW].map(|table| Dictionary::<4>::new(table, NodeId::literal(1)));
        for _ in 0..2 {
            wide.set_raw(control, 0x1FF);
            narrow.set_raw(control, 0x1FF);
            assert_eq!([wide.number(control), wide.number(mode)], [Some(0x1FF), None]);
            assert_eq!([narrow.number(control), narrow.number(mode)], [Some(-1), Some(-1)]);
        }
    }
}
