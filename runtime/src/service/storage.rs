//! Storing parameters and restoring defaults (CiA 301, 7.5.2.13 and 7.5.2.14; 1010h and 1011h).
//!
//! [`Storing`] stands between the services and the application's dictionary: it is a dictionary whose
//! entries of 1010h and 1011h do what they say. The value of such an entry says what the device can do: bit 0, to
//! store or restore on command.

use crate::abort::AbortCode;
use crate::cia301;
use crate::object::{Address, Entry, Layer, ObjectDictionary};

/// What the application does with the values of its dictionary.
pub trait Storage {
    /// Stores the values of a group: 1 is everything, 2 the communication parameters (1000h to 1FFFh), 3 those
    /// of the profile (6000h to 9FFFh), and from 4 on as the manufacturer says.
    ///
    /// Errors: [`AbortCode::HARDWARE_ERROR`] when the storage fails, or another reason.
    fn store(&mut self, group: u8, od: &mut dyn ObjectDictionary) -> Result<(), AbortCode>;

    /// Makes the defaults of a group those that the next reset loads. The values do not change until then.
    ///
    /// Errors: [`AbortCode::HARDWARE_ERROR`] when the storage fails, or another reason.
    fn restore(&mut self, group: u8) -> Result<(), AbortCode>;
}

/// A dictionary that stores and restores at 1010h and 1011h. Lend it to a device in the place of `od`.
pub struct Storing<'a> {
    od: &'a mut dyn ObjectDictionary,
    storage: &'a mut dyn Storage,
}

const SAVE: [u8; 4] = *b"save";
const LOAD: [u8; 4] = *b"load";

impl<'a> Storing<'a> {
    /// `od`, with `storage` behind 1010h and 1011h.
    pub fn new(od: &'a mut dyn ObjectDictionary, storage: &'a mut dyn Storage) -> Self {
        Storing { od, storage }
    }
}

/// Whether an entry is of a group of parameters (CiA 301, 7.5.2.13): all, communication, profile, and from 4 on those
/// of the manufacturer.
#[must_use]
pub const fn is_of_group(group: u8, address: Address) -> bool {
    match (group, address.index()) {
        (1, _) => true,
        (2, index) => matches!(index, 0x1000..=0x1FFF),
        (3, index) => matches!(index, 0x6000..=0x9FFF),
        (_, index) => matches!(index, 0x2000..=0x5FFF),
    }
}

/// Whether the entry is one of 1010h or 1011h that stands for a group.
fn is_group(address: Address) -> bool {
    matches!(address.index(), cia301::STORE_PARAMETERS | cia301::RESTORE_DEFAULT_PARAMETERS) && address.sub() > 0
}

impl<'a> Layer for Storing<'a> {
    type Under = dyn ObjectDictionary + 'a;

    fn under(&self) -> &Self::Under {
        self.od
    }

    fn under_mut(&mut self) -> &mut Self::Under {
        self.od
    }

    fn write_entry(&mut self, entry: &Entry, offset: u32, data: &[u8], last: bool) -> Result<(), AbortCode> {
        if !is_group(entry.address) {
            return self.od.write(entry, offset, data, last);
        }
        let (index, group) = (entry.address.index(), entry.address.sub());
        match (index, <[u8; 4]>::try_from(data)) {
            (_, Err(_)) if data.len() < 4 => Err(AbortCode::LENGTH_TOO_LOW),
            (_, Err(_)) => Err(AbortCode::LENGTH_TOO_HIGH),
            (cia301::STORE_PARAMETERS, Ok(SAVE)) => self.storage.store(group, self.od),
            (cia301::RESTORE_DEFAULT_PARAMETERS, Ok(LOAD)) => self.storage.restore(group),
            // Any other signature is refused, and nothing happens (CiA 301, 7.5.2.13).
            _ => Err(AbortCode::CANNOT_TRANSFER),
        }
    }
}

impl core::fmt::Debug for Storing<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Storing").finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::TestOd;
    use std::vec::Vec;

    #[derive(Default)]
    struct Log(Vec<(&'static str, u8)>);

    impl Storage for Log {
        fn store(&mut self, group: u8, od: &mut dyn ObjectDictionary) -> Result<(), AbortCode> {
            assert!(od.entry(Address::new(0x1017, 0)).is_ok());
            self.0.push(("store", group));
            if group == 4 { Err(AbortCode::HARDWARE_ERROR) } else { Ok(()) }
        }
        fn restore(&mut self, group: u8) -> Result<(), AbortCode> {
            self.0.push(("restore", group));
            Ok(())
        }
    }

    #[track_caller]
    fn check(at: (u16, u8), data: &[u8], result: Result<(), AbortCode>, log: &[(&'static str, u8)]) {
        let mut od = TestOd::new(
            "1010:00 u8 const - 4
             1010:01 u32 rw - 1
             1010:04 u32 rw - 3
             1011:00 u8 const - 1
             1011:01 u32 rw - 1684107116
             1017:00 u16 rw - 0",
        );
        let mut storage = Log::default();
        let mut storing = Storing::new(&mut od, &mut storage);
        let entry = storing.entry(Address::new(at.0, at.1)).unwrap();
        assert_eq!(storing.write(&entry, 0, data, true), result);
        assert_eq!(storage.0, log);
    }

    #[test]
    fn only_the_signature_does_something() {
        check((0x1010, 1), b"save", Ok(()), &[("store", 1)]);
        check((0x1011, 1), b"load", Ok(()), &[("restore", 1)]);
        check((0x1010, 4), b"save", Err(AbortCode::HARDWARE_ERROR), &[("store", 4)]);
        for data in [b"evas", b"load", b"SAVE"] {
            check((0x1010, 1), data, Err(AbortCode::CANNOT_TRANSFER), &[]);
        }
        check((0x1011, 1), b"save", Err(AbortCode::CANNOT_TRANSFER), &[]);
        check((0x1010, 1), b"sav", Err(AbortCode::LENGTH_TOO_LOW), &[]);
        check((0x1010, 1), b"saves", Err(AbortCode::LENGTH_TOO_HIGH), &[]);
        check((0x1017, 0), &[1, 0], Ok(()), &[]);
    }

    #[test]
    fn reading_gives_the_ability() {
        let mut od = TestOd::new("1010:01 u32 rw - 1\n1010:02 u32 rw - 3\n1011:01 u32 rw - 1");
        let mut storage = Log::default();
        let mut storing = Storing::new(&mut od, &mut storage);
        for (index, sub, ability) in [(0x1010, 1, 1), (0x1010, 2, 3), (0x1011, 1, 1)] {
            let entry = storing.entry(Address::new(index, sub)).unwrap();
            let mut buffer = [0xAA; 8];
            assert_eq!(storing.read(&entry, 0, &mut buffer), Ok(4));
            assert_eq!(buffer[..4], [ability, 0, 0, 0]);
        }
    }
}
