//! Where the values of a simulated drive's objects are.

use std::fmt;

use lexican_runtime::object::{Address, DataType, Dictionary, Object, ObjectDictionary, Value};

/// The values behind a drive's objects: a generated dictionary of any size, or another one.
pub trait Storage: ObjectDictionary + fmt::Debug + Send {
    /// The number at `address` in wire form; none where there is no number.
    fn raw(&self, address: Address) -> Option<u64>;

    /// Sets a number in wire form, regardless of access and limits; does nothing where there is none.
    fn set_raw(&mut self, address: Address, raw: u64);

    /// The addresses of all entries, ascending.
    fn addresses(&self) -> Vec<Address>;

    /// The same values once more.
    fn duplicate(&self) -> Box<dyn Storage>;

    /// The number at `address`; none where there is none.
    fn number(&self, address: Address) -> Option<i64> {
        signed(self.entry(address).ok()?.data_type, self.raw(address)?)
    }
}

impl<const N: usize> Storage for Dictionary<N> {
    fn raw(&self, address: Address) -> Option<u64> {
        self.raw_at(&self.table().entry(address).ok()?)
    }

    fn set_raw(&mut self, address: Address, raw: u64) {
        if let Ok(entry) = self.table().entry(address) {
            self.set_raw_at(&entry, raw);
        }
    }

    // A servo asks for dozens of numbers at each frame: one search for each, and not one for its type besides.
    fn number(&self, address: Address) -> Option<i64> {
        let entry = self.table().entry(address).ok()?;
        signed(entry.data_type, self.raw_at(&entry)?)
    }

    fn addresses(&self) -> Vec<Address> {
        self.table().entries().map(|entry| entry.address).collect()
    }

    fn duplicate(&self) -> Box<dyn Storage> {
        Box::new(self.clone())
    }
}

impl Clone for Box<dyn Storage> {
    fn clone(&self) -> Self {
        self.duplicate()
    }
}

impl dyn Storage + '_ {
    /// The value of an object; zero where there is none.
    #[must_use]
    pub fn get<T: Value, A, M, D>(&self, object: Object<T, A, M, D>) -> T {
        T::from_raw(self.raw(object.address()).unwrap_or_default())
    }
}

/// The number in wire form that these bytes are, as far as it has 64 bits.
#[must_use]
pub fn raw_of(data: &[u8]) -> u64 {
    let mut bytes = [0; 8];
    bytes.iter_mut().zip(data).for_each(|(to, from)| *to = *from);
    u64::from_le_bytes(bytes)
}

/// What a number in wire form means; none where the type has no fixed size.
#[must_use]
pub fn signed(data_type: DataType, raw: u64) -> Option<i64> {
    let unused_bits = 64 - u32::from(data_type.bits()?);
    let high = raw << unused_bits;
    Some(if data_type.is_signed() { (high as i64) >> unused_bits } else { (high >> unused_bits) as i64 })
}
