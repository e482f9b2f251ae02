//! The flash of a simulated boot loader.

use lexican_runtime::service::snapshot::{Flash, FlashError};

/// How many bytes it has, the seal of the program included.
const SIZE: usize = 1 << 20;

/// A flash that outlives a loss of power, as long as the command lasts.
#[derive(Clone, Debug)]
pub(super) struct Ram(Box<[u8]>);

impl Default for Ram {
    fn default() -> Self {
        Ram(vec![0xFF; SIZE].into_boxed_slice())
    }
}

impl Ram {
    fn place(&mut self, offset: u32, len: usize) -> Result<&mut [u8], FlashError> {
        self.0.get_mut(offset as usize..).and_then(|rest| rest.get_mut(..len)).ok_or(FlashError)
    }
}

impl Flash for Ram {
    const WRITE_SIZE: usize = 8;

    fn slot_size(&self) -> u32 {
        SIZE as u32
    }

    fn read(&mut self, offset: u32, buffer: &mut [u8]) -> Result<(), FlashError> {
        buffer.copy_from_slice(self.place(offset, buffer.len())?);
        Ok(())
    }

    fn erase(&mut self, _: u32) -> Result<(), FlashError> {
        self.0.fill(0xFF);
        Ok(())
    }

    fn program(&mut self, offset: u32, data: &[u8]) -> Result<(), FlashError> {
        self.place(offset, data.len())?.copy_from_slice(data);
        Ok(())
    }
}
