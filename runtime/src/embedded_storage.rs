//! The flash of a controller as [`embedded_storage`] has it, whose traits its drivers implement.

use embedded_storage::nor_flash::NorFlash;

use crate::service::snapshot::{Flash, FlashError};

/// Two slots for [snapshots](crate::service::snapshot) in a flash whose driver implements [`NorFlash`].
#[derive(Clone, Debug)]
pub struct FlashSlots<F> {
    flash: F,
    start: u32,
    slot_size: u32,
}

impl<F: NorFlash> FlashSlots<F> {
    /// The slots from `start` on; `None` if a slot is not made of whole pages, or the second ends beyond the flash.
    pub fn new(flash: F, start: u32, slot_size: u32) -> Option<Self> {
        // Values lie wherever the one before ends.
        const { assert!(F::READ_SIZE == 1, "flash that is read by single bytes") };
        let of_pages = |number: u32| u32::try_from(F::ERASE_SIZE).is_ok_and(|page| number.is_multiple_of(page));
        let end = start.checked_add(slot_size.checked_mul(2)?)?;
        let fits = slot_size > 0 && usize::try_from(end).is_ok_and(|end| end <= flash.capacity());
        (fits && of_pages(start) && of_pages(slot_size)).then_some(FlashSlots { flash, start, slot_size })
    }
}

impl<F: NorFlash> Flash for FlashSlots<F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;

    fn slot_size(&self) -> u32 {
        self.slot_size
    }

    fn read(&mut self, offset: u32, buffer: &mut [u8]) -> Result<(), FlashError> {
        self.flash.read(self.start + offset, buffer).map_err(|_| FlashError)
    }

    fn erase(&mut self, offset: u32) -> Result<(), FlashError> {
        let from = self.start + offset;
        self.flash.erase(from, from + self.slot_size).map_err(|_| FlashError)
    }

    fn program(&mut self, offset: u32, data: &[u8]) -> Result<(), FlashError> {
        self.flash.write(self.start + offset, data).map_err(|_| FlashError)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::object::Address;
    use crate::service::snapshot::Snapshot;
    use embedded_storage::nor_flash::{
        ErrorType, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
    };
    use std::vec::Vec;

    /// Four pages of 64 bytes.
    struct Theirs(Vec<u8>);

    impl ErrorType for Theirs {
        type Error = NorFlashErrorKind;
    }

    impl ReadNorFlash for Theirs {
        const READ_SIZE: usize = 1;
        fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
            check_read(self, offset, bytes.len())?;
            bytes.copy_from_slice(&self.0[offset as usize..][..bytes.len()]);
            Ok(())
        }
        fn capacity(&self) -> usize {
            self.0.len()
        }
    }

    impl NorFlash for Theirs {
        const WRITE_SIZE: usize = 8;
        const ERASE_SIZE: usize = 64;
        fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
            check_erase(self, from, to)?;
            self.0[from as usize..to as usize].fill(0xFF);
            Ok(())
        }
        fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
            check_write(self, offset, bytes.len())?;
            self.0[offset as usize..][..bytes.len()].copy_from_slice(bytes);
            Ok(())
        }
    }

    static TABLE: crate::object::Table = crate::object::Table { rows: &[], limits: &[], image: &[] };

    #[test]
    fn snapshots_are_kept_in_such_a_flash_and_nowhere_else_in_it() {
        let slots = FlashSlots::new(Theirs(std::vec![0; 256]), 64, 64).unwrap();
        let mut snapshot = Snapshot::new(slots, &TABLE, |_| true);
        let own = Address::new(1, 0);
        for value in [3, 4, 5] {
            snapshot.keep(own, Some(&[value])).unwrap();
            assert_eq!(snapshot.kept(own, &mut [0; 1]), Some(&[value][..]));
        }
        let Theirs(bytes) = &snapshot.flash().flash;
        assert!(bytes[..64].iter().chain(&bytes[192..]).all(|byte| *byte == 0));
        assert!(bytes[64..].starts_with(b"LXS1") && bytes[128..].starts_with(b"LXS1"));
    }

    #[test]
    fn slots_are_whole_pages_of_the_flash() {
        let is_refused = |start, size| FlashSlots::new(Theirs(std::vec![0; 256]), start, size).is_none();
        assert!(!is_refused(0, 128));
        for (start, size) in [(0, 0), (32, 64), (0, 96), (64, 128), (0, u32::MAX), (u32::MAX - 63, 64)] {
            assert!(is_refused(start, size), "{start} {size}");
        }
    }
}
