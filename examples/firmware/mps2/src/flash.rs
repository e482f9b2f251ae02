//! Flash memory that outlives QEMU: a file on the host, through semihosting. It must be erased and programmed as flash
//! is.

use cortex_m_semihosting::syscall;
use lexican_runtime::service::snapshot::{Flash, FlashError};

/// Holds both slots.
const NAME: &[u8] = b"flash.bin\0";
const SLOT: u32 = 2048;

const ERASED: [u8; 64] = [0xFF; 64];

/// The modes of semihosting's SYS_OPEN: `r+b` and `w+b`.
const UPDATE: usize = 3;
const CREATE: usize = 7;

/// The file `flash.bin` in the folder in which QEMU runs.
pub struct HostFile(usize);

impl HostFile {
    /// Opens the file, or creates an erased one.
    pub fn open() -> Self {
        let open = |mode: usize| {
            // SAFETY: the host reads the name, whose length without the end is given.
            let handle = unsafe { syscall!(OPEN, NAME.as_ptr(), mode, NAME.len() - 1) };
            (handle != usize::MAX).then_some(HostFile(handle))
        };
        open(UPDATE).unwrap_or_else(|| {
            let mut file = open(CREATE).expect("the host creates flash.bin");
            let erased = [0, SLOT].map(|slot| file.erase(slot));
            assert_eq!(erased, [Ok(()); 2], "the host writes flash.bin");
            file
        })
    }

    fn seek(&mut self, offset: u32) -> Result<(), FlashError> {
        // SAFETY: the host reads the two words.
        let failed = unsafe { syscall!(SEEK, self.0, offset) };
        if failed == 0 { Ok(()) } else { Err(FlashError) }
    }

    fn write(&mut self, offset: u32, data: &[u8]) -> Result<(), FlashError> {
        self.seek(offset)?;
        // SAFETY: the host reads these bytes.
        let missing = unsafe { syscall!(WRITE, self.0, data.as_ptr(), data.len()) };
        if missing == 0 { Ok(()) } else { Err(FlashError) }
    }
}

impl Flash for HostFile {
    /// As in the STM32 families G4 and L4.
    const WRITE_SIZE: usize = 8;

    fn slot_size(&self) -> u32 {
        SLOT
    }

    fn read(&mut self, offset: u32, buffer: &mut [u8]) -> Result<(), FlashError> {
        self.seek(offset)?;
        // SAFETY: the host writes as many bytes as the buffer has.
        let missing = unsafe { syscall!(READ, self.0, buffer.as_mut_ptr(), buffer.len()) };
        if missing == 0 { Ok(()) } else { Err(FlashError) }
    }

    fn erase(&mut self, offset: u32) -> Result<(), FlashError> {
        (offset..offset + SLOT).step_by(ERASED.len()).try_for_each(|offset| self.write(offset, &ERASED))
    }

    fn program(&mut self, offset: u32, data: &[u8]) -> Result<(), FlashError> {
        let mut before = [0; 32];
        let before = before.get_mut(..data.len()).ok_or(FlashError)?;
        self.read(offset, before)?;
        // Programming clears bits, and a double word can be programmed only once.
        let is_erased = before.iter().all(|byte| *byte == 0xFF);
        if is_erased { self.write(offset, data) } else { Err(FlashError) }
    }
}
