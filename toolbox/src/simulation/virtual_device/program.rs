//! A simulated boot loader and its flash.

use lexican_runtime::AbortCode;
use lexican_runtime::cia301::{PROGRAM_CONTROL, PROGRAM_DATA, PROGRAM_FLASH_STATUS, PROGRAM_SOFTWARE_IDENTIFICATION};
use lexican_runtime::object::{Address, Entry, ObjectDictionary};
use lexican_runtime::service::program::{Order, Program, Programming};
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

/// What makes a device one with a boot loader (CiA 302-3).
pub(super) const BOOT_LOADER: [Address; 2] = [Address::new(PROGRAM_DATA, 1), Address::new(PROGRAM_CONTROL, 1)];

/// A boot loader, whose entries hold what the data sheet declares of the program that the device comes with, until a client
/// gives an order or loads another program.
#[derive(Clone, Debug)]
pub(super) struct Loader {
    program: Program<Ram>,
    /// The entries that the data sheet declares, as long as they count.
    declared: Vec<Address>,
}

impl Loader {
    /// A loader of a device whose data sheet gives values to some entries.
    pub(super) fn new(is_given: impl Fn(Address) -> bool) -> Self {
        let held = [PROGRAM_CONTROL, PROGRAM_SOFTWARE_IDENTIFICATION, PROGRAM_FLASH_STATUS];
        let declared = held.map(|index| Address::new(index, 1)).into_iter().filter(|&address| is_given(address));
        Loader { program: Program::new(Ram::default()), declared: declared.collect() }
    }

    /// Carries out what a client has ordered.
    pub(super) fn obey(&mut self) {
        if let Some(order) = self.program.take_order() {
            self.program.set_started(order != Order::Stop);
        }
    }
}

/// A dictionary with the entries of a [`Loader`].
pub(super) struct Loading<'a, O> {
    pub(super) od: &'a mut O,
    pub(super) loader: &'a mut Loader,
}

impl<O: ObjectDictionary> ObjectDictionary for Loading<'_, O> {
    fn entry(&self, address: Address) -> Result<Entry, AbortCode> {
        self.od.entry(address)
    }

    fn entry_again(&self, address: Address, row: &mut u16) -> Result<Entry, AbortCode> {
        self.od.entry_again(address, row)
    }

    fn len(&self, entry: &Entry) -> Option<u32> {
        self.od.len(entry)
    }

    fn read(&mut self, entry: &Entry, offset: u32, buffer: &mut [u8]) -> Result<usize, AbortCode> {
        match self.loader.declared.contains(&entry.address) {
            true => self.od.read(entry, offset, buffer),
            false => Programming::new(self.od, &mut self.loader.program).read(entry, offset, buffer),
        }
    }

    fn write(&mut self, entry: &Entry, offset: u32, data: &[u8], last: bool) -> Result<(), AbortCode> {
        Programming::new(self.od, &mut self.loader.program).write(entry, offset, data, last)?;
        if BOOT_LOADER.contains(&entry.address) {
            self.loader.declared.clear();
        }
        Ok(())
    }
}
