//! A simulated boot loader and its flash.

use lexican_runtime::cia301::{PROGRAM_CONTROL, PROGRAM_DATA, PROGRAM_FLASH_STATUS, PROGRAM_SOFTWARE_IDENTIFICATION};
use lexican_runtime::device::Event;
use lexican_runtime::object::{Address, ObjectDictionary};
use lexican_runtime::service::program::{Order, Program, Programming};
use lexican_runtime::service::snapshot::{Flash, FlashError};

/// The size of the flash in bytes, including the seal of the program.
const SIZE: usize = 1 << 20;

/// A flash in memory: it keeps its content without power, but only until the command ends.
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

/// A device with these entries has a boot loader (CiA 302-3).
pub(super) const BOOT_LOADER: [Address; 2] = [Address::new(PROGRAM_DATA, 1), Address::new(PROGRAM_CONTROL, 1)];

/// A boot loader. Its entries hold what the data sheet declares about the program that the device comes with, until a
/// client gives an order or loads another program.
#[derive(Clone, Debug)]
pub(super) struct Loader {
    program: Program<Ram>,
    /// The entries that still have the values of the data sheet.
    declared: Vec<Address>,
}

impl Loader {
    /// A loader for a device. `is_given` says whether its data sheet gives an entry a value.
    pub(super) fn new(is_given: impl Fn(Address) -> bool) -> Self {
        let held = [PROGRAM_CONTROL, PROGRAM_SOFTWARE_IDENTIFICATION, PROGRAM_FLASH_STATUS];
        let declared = held.map(|index| Address::new(index, 1)).into_iter().filter(|&address| is_given(address));
        Loader { program: Program::new(Ram::default()), declared: declared.collect() }
    }

    /// `od` with the entries of the program.
    pub(super) fn of<'a, O: ObjectDictionary>(&'a mut self, od: &'a mut O) -> Programming<'a, O, Ram> {
        Programming::new(od, &mut self.program).with_held(&self.declared)
    }

    /// Carries out what a client has ordered.
    pub(super) fn obey(&mut self, event: Option<Event>) {
        if matches!(event, Some(Event::Written(address)) if BOOT_LOADER.contains(&address)) {
            self.declared.clear();
        }
        if let Some(order) = self.program.take_order() {
            self.program.set_started(order != Order::Stop);
        }
    }
}
