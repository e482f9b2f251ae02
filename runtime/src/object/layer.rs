//! A dictionary over another one.

use super::{Address, Entry, ObjectDictionary};
use crate::AbortCode;

/// A dictionary over another one that changes some of what that one does. All else is handed on, in one place: a layer
/// cannot forget a method of [`ObjectDictionary`].
pub trait Layer {
    /// The dictionary under it.
    type Under: ObjectDictionary + ?Sized;

    /// The dictionary under it.
    fn under(&self) -> &Self::Under;

    /// The dictionary under it.
    fn under_mut(&mut self) -> &mut Self::Under;

    /// Whether the layer has an entry of the dictionary under it; else the error of [`ObjectDictionary::entry`].
    fn admits(&self, address: Address) -> Result<(), AbortCode> {
        let _ = address;
        Ok(())
    }

    /// [`ObjectDictionary::read`].
    fn read_entry(&mut self, entry: &Entry, offset: u32, buffer: &mut [u8]) -> Result<usize, AbortCode> {
        self.under_mut().read(entry, offset, buffer)
    }

    /// [`ObjectDictionary::write`].
    fn write_entry(&mut self, entry: &Entry, offset: u32, data: &[u8], last: bool) -> Result<(), AbortCode> {
        self.under_mut().write(entry, offset, data, last)
    }
}

impl<L: Layer> ObjectDictionary for L {
    fn entry(&self, address: Address) -> Result<Entry, AbortCode> {
        let entry = self.under().entry(address)?;
        self.admits(address).map(|()| entry)
    }

    fn len(&self, entry: &Entry) -> Option<u32> {
        self.under().len(entry)
    }

    fn read(&mut self, entry: &Entry, offset: u32, buffer: &mut [u8]) -> Result<usize, AbortCode> {
        self.read_entry(entry, offset, buffer)
    }

    fn write(&mut self, entry: &Entry, offset: u32, data: &[u8], last: bool) -> Result<(), AbortCode> {
        self.write_entry(entry, offset, data, last)
    }

    fn take_changes(&mut self) -> Option<(Address, Address)> {
        self.under_mut().take_changes()
    }
}
