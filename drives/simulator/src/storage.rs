//! Where the values of a simulated drive's objects are.

use std::fmt;

use lexican_runtime::object::{Address, DataType, Dictionary, Object, ObjectDictionary, Rw, Value};

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
        fn get<T: Value, const N: usize>(from: &Dictionary<N>, address: Address) -> u64 {
            from.get(Object::<T, Rw>::new(address.index(), address.sub())).to_raw()
        }
        match self.table().entry(address).ok()?.data_type.size()? {
            1 => Some(get::<u8, N>(self, address)),
            2 => Some(get::<u16, N>(self, address)),
            4 => Some(get::<u32, N>(self, address)),
            8 => Some(get::<u64, N>(self, address)),
            _ => None,
        }
    }

    fn set_raw(&mut self, address: Address, raw: u64) {
        fn set<T: Value, const N: usize>(to: &mut Dictionary<N>, address: Address, raw: u64) {
            to.set(Object::<T, Rw>::new(address.index(), address.sub()), T::from_raw(raw));
        }
        match self.table().entry(address).ok().and_then(|entry| entry.data_type.size()) {
            Some(1) => set::<u8, N>(self, address, raw),
            Some(2) => set::<u16, N>(self, address, raw),
            Some(4) => set::<u32, N>(self, address, raw),
            Some(8) => set::<u64, N>(self, address, raw),
            _ => {}
        }
    }

    fn addresses(&self) -> Vec<Address> {
        self.table().entries.iter().map(|entry| entry.address).collect()
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
    pub fn get<T: Value, A, M>(&self, object: Object<T, A, M>) -> T {
        T::from_raw(self.raw(object.address()).unwrap_or_default())
    }
}

/// What a number in wire form means; none where the type has no fixed size.
#[must_use]
pub fn signed(data_type: DataType, raw: u64) -> Option<i64> {
    let unused_bits = 64 - u32::from(data_type.bits()?);
    let high = raw << unused_bits;
    Some(if data_type.is_signed() { (high as i64) >> unused_bits } else { (high >> unused_bits) as i64 })
}
