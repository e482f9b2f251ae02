//! Program download, the device's side (CiA 302-3): what stands behind 1F50h to 1F57h of a boot loader, for one program.
//!
//! A program counts only when its length and its checksum stand behind it, which are written last: so a loss of power at any time
//! leaves the program that was there, or none, and never a part of one. A device lends its [`Program`] to [`Programming`].

use super::snapshot::{Flash, FlashError};
use crate::abort::AbortCode;
use crate::cia301::{PROGRAM_CONTROL, PROGRAM_DATA, PROGRAM_FLASH_STATUS, PROGRAM_SOFTWARE_IDENTIFICATION};
use crate::object::{Address, Entry, Layer, ObjectDictionary};
use crate::wire::crc::Crc32;

/// The sub-index of the program.
const FIRST: u8 = 1;

/// What is written at once, at most.
const LARGEST_WRITE: usize = 32;

/// The end of the flash: magic, length, checksum.
const SEAL: u32 = LARGEST_WRITE as u32;
const MAGIC: [u8; 4] = *b"LXP1";

/// An order to the program control (1F51h).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Order {
    /// The program is to be left: the boot loader takes over.
    Stop,
    /// The program is to run. It is whole.
    Start,
    /// The program is to begin anew.
    Reset,
}

/// What the flash status (1F57h) has: 0, or an error of the last download in its upper seven bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FlashStatus {
    /// No error.
    #[default]
    Good,
    /// There is no valid program.
    NoProgram,
    /// A download without clearing first.
    NotCleared,
    /// The flash failed.
    WriteError,
    /// The program is longer than the flash.
    AddressError,
}

impl FlashStatus {
    /// The error code that stands in bits 1 to 7.
    const fn code(self) -> u32 {
        match self {
            FlashStatus::Good => 0,
            FlashStatus::NoProgram => 1,
            FlashStatus::NotCleared => 4,
            FlashStatus::WriteError => 5,
            FlashStatus::AddressError => 6,
        }
    }
}

/// The program in a flash of one slot, as a boot loader keeps it.
#[derive(Clone, Debug)]
pub struct Program<F> {
    flash: F,
    held: Option<Held>,
    is_cleared: bool,
    is_started: bool,
    status: FlashStatus,
    download: Download,
    order: Option<Order>,
}

/// A whole program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Held {
    len: u32,
    checksum: u32,
}

/// The download under way: bytes that do not fill a write of the flash wait.
#[derive(Clone, Copy, Debug)]
struct Download {
    written: u32,
    waiting: [u8; LARGEST_WRITE],
    count: usize,
    checksum: Crc32,
}

impl Download {
    const NEW: Self = Download { written: 0, waiting: [0xFF; LARGEST_WRITE], count: 0, checksum: Crc32::new() };
}

impl<F: Flash> Program<F> {
    /// What `flash` holds, in its only slot. The program is stopped.
    pub fn new(flash: F) -> Self {
        let mut program = Program {
            flash,
            held: None,
            is_cleared: false,
            is_started: false,
            status: FlashStatus::Good,
            download: Download::NEW,
            order: None,
        };
        program.held = program.find().unwrap_or(None);
        if program.held.is_none() {
            program.status = FlashStatus::NoProgram;
        }
        program
    }

    /// The length and the CRC-32 of the program, if it is whole.
    #[must_use]
    pub fn held(&self) -> Option<(u32, u32)> {
        self.held.map(|held| (held.len, held.checksum))
    }

    /// The order that has come since the last call. The application carries it out when the answer has been sent.
    pub fn take_order(&mut self) -> Option<Order> {
        self.order.take()
    }

    /// Whether the program runs, as the application says after [`Order::Start`] or [`Order::Stop`].
    pub fn set_started(&mut self, is_started: bool) {
        self.is_started = is_started && self.held.is_some();
    }

    /// The flash.
    pub fn flash(&mut self) -> &mut F {
        &mut self.flash
    }

    /// The place of the seal; the program has the bytes before it.
    fn capacity(&self) -> u32 {
        self.flash.slot_size().saturating_sub(SEAL)
    }

    /// A program whose seal and checksum are right.
    fn find(&mut self) -> Result<Option<Held>, FlashError> {
        let capacity = self.capacity();
        let mut seal = [0; 12];
        self.flash.read(capacity, &mut seal)?;
        let [magic, len, checksum] = *seal.as_chunks::<4>().0 else { return Ok(None) };
        let held = Held { len: u32::from_le_bytes(len), checksum: u32::from_le_bytes(checksum) };
        if magic != MAGIC || held.len > capacity {
            return Ok(None);
        }
        let (mut found, mut at) = (Crc32::new(), 0);
        let mut buffer = [0; LARGEST_WRITE];
        while at < held.len {
            let part = &mut buffer[..(held.len - at).min(SEAL) as usize];
            self.flash.read(at, part)?;
            found.update(part);
            at += SEAL;
        }
        Ok(Some(held).filter(|held| held.checksum == found.get()))
    }

    fn clear(&mut self) -> Result<(), AbortCode> {
        if self.is_started {
            return Err(AbortCode::DEVICE_STATE);
        }
        (self.held, self.is_cleared) = (None, false);
        self.download = Download::NEW;
        self.note(FlashStatus::WriteError);
        self.flash.erase(0)?;
        self.is_cleared = true;
        self.note(FlashStatus::NoProgram);
        Ok(())
    }

    fn note(&mut self, status: FlashStatus) {
        self.status = status;
    }

    /// Takes a part of a program.
    fn take(&mut self, offset: u32, data: &[u8], last: bool) -> Result<(), AbortCode> {
        if offset == 0 {
            if !self.is_cleared || self.is_started {
                self.note(FlashStatus::NotCleared);
                return Err(AbortCode::DEVICE_STATE);
            }
            // A download that was given up leaves bytes behind: the next one needs a clear flash again.
            (self.is_cleared, self.download) = (false, Download::NEW);
        }
        if u64::from(offset) + data.len() as u64 > self.capacity().into() {
            self.note(FlashStatus::AddressError);
            return Err(AbortCode::LENGTH_TOO_HIGH);
        }
        self.download.checksum.update(data);
        self.note(FlashStatus::WriteError);
        for &byte in data {
            let download = &mut self.download;
            download.waiting[download.count] = byte;
            download.count += 1;
            if download.count == F::WRITE_SIZE {
                self.flush()?;
            }
        }
        if last {
            let (len, checksum) = (offset + data.len() as u32, self.download.checksum.get());
            if self.download.count > 0 {
                self.flush()?;
            }
            self.seal(Held { len, checksum })?;
        }
        self.note(if last { FlashStatus::Good } else { FlashStatus::NoProgram });
        Ok(())
    }

    /// Programs what waits, filled up with erased bytes.
    fn flush(&mut self) -> Result<(), FlashError> {
        let download = &mut self.download;
        self.flash.program(download.written, &download.waiting[..F::WRITE_SIZE])?;
        download.written += F::WRITE_SIZE as u32;
        (download.waiting, download.count) = ([0xFF; LARGEST_WRITE], 0);
        Ok(())
    }

    /// Makes a program of what was written.
    fn seal(&mut self, held: Held) -> Result<(), FlashError> {
        let mut seal = [0xFF; LARGEST_WRITE];
        let parts = [MAGIC, held.len.to_le_bytes(), held.checksum.to_le_bytes()];
        seal.iter_mut().zip(parts.as_flattened()).for_each(|(to, from)| *to = *from);
        let len = parts.as_flattened().len().next_multiple_of(F::WRITE_SIZE);
        let at = self.capacity();
        self.flash.program(at, &seal[..len])?;
        self.held = self.find()?;
        if self.held == Some(held) { Ok(()) } else { Err(FlashError) }
    }

    fn control(&mut self, value: u8) -> Result<(), AbortCode> {
        match value {
            0 => self.order = Some(Order::Stop),
            1 | 2 if self.held.is_none() => return Err(AbortCode::DEVICE_STATE),
            1 => self.order = Some(Order::Start),
            2 => self.order = Some(Order::Reset),
            3 => return self.clear(),
            _ => return Err(AbortCode::INVALID_VALUE),
        }
        Ok(())
    }

    /// The value of an entry that is not in the dictionary.
    fn value(&self, index: u16) -> Option<u32> {
        Some(match index {
            PROGRAM_CONTROL if self.held.is_none() => 2,
            PROGRAM_CONTROL => self.is_started.into(),
            PROGRAM_SOFTWARE_IDENTIFICATION => self.held.map_or(0, |held| held.checksum),
            PROGRAM_FLASH_STATUS => self.status.code() << 1,
            _ => return None,
        })
    }
}

/// A dictionary whose entries 1F50h:01, 1F51h:01, 1F56h:01 and 1F57h:01 are those of a [`Program`]. Lend it to a device in the
/// place of `od`, which has to have the entries: the data as DOMAIN, the control with 8 bits, the others with 32.
#[derive(Debug)]
pub struct Programming<'a, O: ?Sized, F> {
    od: &'a mut O,
    program: &'a mut Program<F>,
    /// Read from `od` nevertheless.
    held: &'a [Address],
}

impl<'a, O: ObjectDictionary + ?Sized, F: Flash> Programming<'a, O, F> {
    /// `od`, with `program` behind its entries.
    pub fn new(od: &'a mut O, program: &'a mut Program<F>) -> Self {
        Programming { od, program, held: &[] }
    }

    /// The same, but the given entries are read from `od`: what it says of the program that the device was delivered with.
    #[must_use]
    pub fn with_held(self, held: &'a [Address]) -> Self {
        Programming { held, ..self }
    }

    fn value(&self, address: Address) -> Option<u32> {
        let is_held = self.held.contains(&address);
        self.program.value(address.index()).filter(|_| address.sub() == FIRST && !is_held)
    }
}

impl<O: ObjectDictionary + ?Sized, F: Flash> Layer for Programming<'_, O, F> {
    type Under = O;

    fn under(&self) -> &Self::Under {
        self.od
    }

    fn under_mut(&mut self) -> &mut Self::Under {
        self.od
    }

    fn read_entry(&mut self, entry: &Entry, offset: u32, buffer: &mut [u8]) -> Result<usize, AbortCode> {
        match self.value(entry.address) {
            Some(value) => {
                let size = entry.data_type.size().unwrap_or(4);
                let bytes = value.to_le_bytes();
                let rest = bytes.get(offset as usize..size).unwrap_or_default();
                Ok(buffer.iter_mut().zip(rest).map(|(to, from)| *to = *from).count())
            }
            None => self.od.read(entry, offset, buffer),
        }
    }

    fn write_entry(&mut self, entry: &Entry, offset: u32, data: &[u8], last: bool) -> Result<(), AbortCode> {
        match (entry.address.index(), entry.address.sub()) {
            (PROGRAM_DATA, FIRST) => self.program.take(offset, data, last),
            (PROGRAM_CONTROL, FIRST) => self.program.control(*data.first().ok_or(AbortCode::LENGTH_TOO_LOW)?),
            _ => self.od.write(entry, offset, data, last),
        }
    }
}
