//! Values that survive a loss of power, in the flash of a microcontroller: what stands behind 1010h and 1011h.
//!
//! Two slots take turns. A new snapshot is written to the slot that does not hold the newest one, and counts only when its
//! checksum is there, which is written last: so a loss of power at any time leaves the old values or the new ones.
//!
//! ```text
//! "LXS1"  sequence number, 4 bytes
//! index, 2 bytes  sub-index  length  value      for each value
//! FFFFh, 2 bytes  0          0       CRC-32, 4 bytes, of everything before it
//! ```
//!
//! A device lends its [`Snapshot`] to [`Storing`](super::storage::Storing), and [loads](Snapshot::load) it at each reset.

use core::ops::RangeInclusive;

use super::storage::{Storage, is_of_group};
use crate::abort::AbortCode;
use crate::cia301;
use crate::id::NodeId;
use crate::object::{Access, Address, DataType, Entry, ObjectDictionary, Table};
use crate::wire::crc::Crc32;

/// The flash, or the part of it, that snapshots have: two slots of the same size, one behind the other.
pub trait Flash {
    /// How many bytes are programmed at once: 1, 2, 4, 8, 16 or 32.
    const WRITE_SIZE: usize;

    /// The size of a slot in bytes. A slot is erased as a whole.
    fn slot_size(&self) -> u32;

    /// Reads from `offset`.
    fn read(&mut self, offset: u32, buffer: &mut [u8]) -> Result<(), FlashError>;

    /// Erases the slot that begins at `offset`.
    fn erase(&mut self, offset: u32) -> Result<(), FlashError>;

    /// Programs bytes that are erased. Both `offset` and the number of bytes are multiples of [`Flash::WRITE_SIZE`].
    fn program(&mut self, offset: u32, data: &[u8]) -> Result<(), FlashError>;
}

/// The flash failed, or a slot is too small.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[error("the flash failed, or a slot is too small")]
pub struct FlashError;

impl From<FlashError> for AbortCode {
    fn from(_: FlashError) -> Self {
        AbortCode::HARDWARE_ERROR
    }
}

/// The longest value that is stored, in bytes: longer ones may come in pieces, and are left out.
pub const LONGEST: usize = 64;

const MAGIC: [u8; 4] = *b"LXS1";
const HEADER: u32 = 8;
const END: [u8; 4] = [0xFF, 0xFF, 0, 0];

/// The stored values of a device, as the [`Storage`] behind 1010h and 1011h.
///
/// What can be stored is what a manager can read and write, has up to [`LONGEST`] bytes, and passes `is_stored`.
/// A COB-ID that is the default for this node-ID is not stored, so that it follows a node-ID that LSS changes. The application
/// [keeps](Snapshot::keep) what is not in the dictionary, such as the node-ID, at indices below 1000h.
#[derive(Clone, Debug)]
pub struct Snapshot<F> {
    flash: F,
    table: &'static Table,
    is_stored: fn(Address) -> bool,
    node: Option<NodeId>,
    newest: Option<Newest>,
}

/// The slot with the newest snapshot.
#[derive(Clone, Copy, Debug)]
struct Newest {
    slot: Slot,
    sequence: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Slot {
    First,
    Second,
}

impl Slot {
    const fn other(self) -> Self {
        match self {
            Slot::First => Slot::Second,
            Slot::Second => Slot::First,
        }
    }
}

impl<F: Flash> Snapshot<F> {
    /// What `flash` holds. A slot that is empty or damaged holds nothing.
    pub fn new(flash: F, table: &'static Table, is_stored: fn(Address) -> bool) -> Self {
        const { assert!(F::WRITE_SIZE > 0 && CHUNK.is_multiple_of(F::WRITE_SIZE), "a part of a chunk") };
        let mut snapshot = Snapshot { flash, table, is_stored, node: None, newest: None };
        let [first, second] =
            [Slot::First, Slot::Second].map(|slot| Some(Newest { slot, sequence: snapshot.sequence(slot)? }));
        snapshot.newest = match (first, second) {
            // They differ by one, also where the number has wrapped around.
            (Some(one), Some(other)) if other.sequence == one.sequence.wrapping_add(1) => Some(other),
            (one, other) => one.or(other),
        };
        snapshot
    }

    /// Whether anything is stored.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.newest.is_none()
    }

    /// The flash.
    pub const fn flash(&mut self) -> &mut F {
        &mut self.flash
    }

    /// Writes the stored values of these indices to the dictionary: after it was reset to the defaults for this node-ID, and
    /// before the device restarts. Values that the data sheet of another version of the device had, and this one has
    /// not, are left out.
    ///
    /// If the flash fails, values after that point have their defaults.
    pub fn load(
        &mut self,
        node: NodeId,
        indices: RangeInclusive<u16>,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Result<(), FlashError> {
        self.node = Some(node);
        let mut records = self.records();
        while let Some(record) = records.next(&mut self.flash)? {
            let entry = od.entry(record.address).ok().filter(|_| indices.contains(&record.address.index()));
            if let Some(entry) = entry.filter(|entry| self.can_store(entry)) {
                // Of another size or outside of the limits in this version: the default stays.
                let _ = od.write(&entry, 0, record.value(), true);
            }
        }
        Ok(())
    }

    /// Stores one value without a command, up to [`LONGEST`] bytes, or removes it.
    ///
    /// Errors: the flash failed, or has no room. What was stored before is unchanged.
    pub fn keep(&mut self, address: Address, value: Option<&[u8]>) -> Result<(), FlashError> {
        let mut writer = self.begin(|stored| stored == address)?;
        if let Some(value) = value {
            writer.record(&mut self.flash, address, value)?;
        }
        self.commit(writer)
    }

    /// The value that is stored for `address`, in `buffer`.
    pub fn kept<'b>(&mut self, address: Address, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
        let mut records = self.records();
        while let Ok(Some(record)) = records.next(&mut self.flash) {
            if record.address == address {
                let buffer = buffer.get_mut(..record.value().len())?;
                buffer.copy_from_slice(record.value());
                return Some(buffer);
            }
        }
        None
    }

    fn can_store(&self, entry: &Entry) -> bool {
        let index = entry.address.index();
        let is_value = entry.data_type != DataType::Domain && (1..=LONGEST).contains(&usize::from(entry.capacity));
        let is_command = matches!(
            index,
            cia301::PREDEFINED_ERROR_FIELD | cia301::STORE_PARAMETERS | cia301::RESTORE_DEFAULT_PARAMETERS
        );
        entry.access == Access::Rw && is_value && !is_command && (self.is_stored)(entry.address)
    }

    /// Whether an entry has the default that depends on the node-ID.
    fn follows_node(&self, entry: &Entry, value: &[u8]) -> bool {
        let start = entry.offset as usize;
        let default = self.table.image.get(start..start + usize::from(entry.capacity)).unwrap_or(&[]);
        let number = |bytes: &[u8]| bytes.iter().rev().fold(0_u64, |number, byte| number << 8 | u64::from(*byte));
        entry.plus_node
            && self.node.is_some_and(|node| number(default).wrapping_add(u64::from(node.get())) == number(value))
    }

    fn base(&self, slot: Slot) -> u32 {
        if slot == Slot::First { 0 } else { self.flash.slot_size() }
    }

    fn records(&self) -> Records {
        match self.newest {
            Some(newest) => Records::of(self.base(newest.slot), self.flash.slot_size()),
            None => Records { at: 0, end: 0, checksum: None },
        }
    }

    /// The sequence number of a slot whose checksum is right.
    fn sequence(&mut self, slot: Slot) -> Option<u32> {
        let base = self.base(slot);
        let mut header = [0; HEADER as usize];
        self.flash.read(base, &mut header).ok()?;
        let [a, b, c, d, sequence @ ..] = header;
        if [a, b, c, d] != MAGIC {
            return None;
        }
        let mut crc = Crc32::new();
        crc.update(&header);
        let mut records = Records::of(base, self.flash.slot_size());
        while let Some(record) = records.next(&mut self.flash).ok()? {
            crc.update(&record.head());
            crc.update(record.value());
        }
        crc.update(&END);
        let mut stored = [0; 4];
        self.flash.read(records.checksum?, &mut stored).ok()?;
        (stored == crc.get().to_le_bytes()).then_some(u32::from_le_bytes(sequence))
    }

    /// Begins a snapshot with what is stored, but for what is `replaced`.
    fn begin(&mut self, replaced: impl Fn(Address) -> bool) -> Result<Writer, FlashError> {
        let (slot, sequence) = match self.newest {
            Some(newest) => (newest.slot.other(), newest.sequence.wrapping_add(1)),
            None => (Slot::First, 0),
        };
        let base = self.base(slot);
        self.flash.erase(base)?;
        let end = base.saturating_add(self.flash.slot_size());
        let mut writer = Writer { slot, sequence, at: base, end, chunk: [0xFF; CHUNK], filled: 0, crc: Crc32::new() };
        writer.push(&mut self.flash, &MAGIC)?;
        writer.push(&mut self.flash, &sequence.to_le_bytes())?;
        let mut records = self.records();
        while let Some(record) = records.next(&mut self.flash)? {
            if !replaced(record.address) {
                writer.record(&mut self.flash, record.address, record.value())?;
            }
        }
        Ok(writer)
    }

    /// Ends a snapshot, and reads it back.
    fn commit(&mut self, mut writer: Writer) -> Result<(), FlashError> {
        let newest = Newest { slot: writer.slot, sequence: writer.sequence };
        writer.finish(&mut self.flash)?;
        if self.sequence(newest.slot) != Some(newest.sequence) {
            return Err(FlashError);
        }
        self.newest = Some(newest);
        Ok(())
    }
}

impl<F: Flash> Storage for Snapshot<F> {
    fn store(&mut self, group: u8, od: &mut dyn ObjectDictionary) -> Result<(), AbortCode> {
        let is_replaced = |address: Address| is_parameter(address) && is_of_group(group, address);
        let mut writer = self.begin(is_replaced)?;
        let table = self.table;
        for entry in table.entries() {
            if !is_replaced(entry.address) || !self.can_store(&entry) {
                continue;
            }
            let mut buffer = [0; LONGEST];
            let len = od.read(&entry, 0, &mut buffer)?;
            let value = buffer.get(..len).unwrap_or(&buffer);
            if !self.follows_node(&entry, value) {
                writer.record(&mut self.flash, entry.address, value)?;
            }
        }
        Ok(self.commit(writer)?)
    }

    fn restore(&mut self, group: u8) -> Result<(), AbortCode> {
        let writer = self.begin(|address| is_parameter(address) && is_of_group(group, address))?;
        Ok(self.commit(writer)?)
    }
}

/// Whether a value is of the dictionary, and not the application's own.
fn is_parameter(address: Address) -> bool {
    address.index() >= cia301::COMMUNICATION.start
}

/// A value in a slot.
struct Record {
    address: Address,
    len: u8,
    value: [u8; LONGEST],
}

impl Record {
    fn value(&self) -> &[u8] {
        self.value.get(..usize::from(self.len)).unwrap_or(&self.value)
    }

    fn head(&self) -> [u8; 4] {
        head(self.address, self.len)
    }
}

/// What precedes a value.
fn head(address: Address, len: u8) -> [u8; 4] {
    let [low, high] = address.index().to_le_bytes();
    [low, high, address.sub(), len]
}

/// The values in a slot, one after the other.
struct Records {
    at: u32,
    end: u32,
    /// Where the checksum is, when the end has been reached.
    checksum: Option<u32>,
}

impl Records {
    fn of(base: u32, size: u32) -> Self {
        Records { at: base.saturating_add(HEADER), end: base.saturating_add(size), checksum: None }
    }

    /// The next value; `None` at the end, and where there is no value.
    fn next<F: Flash>(&mut self, flash: &mut F) -> Result<Option<Record>, FlashError> {
        let mut bytes = [0; 4];
        let value_at = self.at.saturating_add(4);
        // Four bytes follow also at the end: the checksum.
        if value_at.saturating_add(4) > self.end {
            return Ok(None);
        }
        flash.read(self.at, &mut bytes)?;
        if bytes == END {
            self.checksum = Some(value_at);
            return Ok(None);
        }
        let [low, high, sub, len] = bytes;
        let next = value_at.saturating_add(u32::from(len));
        let mut record =
            Record { address: Address::new(u16::from_le_bytes([low, high]), sub), len, value: [0; LONGEST] };
        let Some(value) = record.value.get_mut(..usize::from(len)).filter(|_| next <= self.end) else {
            return Ok(None);
        };
        flash.read(value_at, value)?;
        self.at = next;
        Ok(Some(record))
    }
}

/// What is programmed at once, at most: a multiple of every [`Flash::WRITE_SIZE`].
const CHUNK: usize = 32;

/// A snapshot that is being written.
struct Writer {
    slot: Slot,
    sequence: u32,
    at: u32,
    end: u32,
    chunk: [u8; CHUNK],
    filled: usize,
    crc: Crc32,
}

impl Writer {
    fn record<F: Flash>(&mut self, flash: &mut F, address: Address, value: &[u8]) -> Result<(), FlashError> {
        let len = u8::try_from(value.len()).ok().filter(|len| usize::from(*len) <= LONGEST).ok_or(FlashError)?;
        self.push(flash, &head(address, len))?;
        self.push(flash, value)
    }

    /// Writes the checksum, last of all: a slot without it counts as empty.
    fn finish<F: Flash>(&mut self, flash: &mut F) -> Result<(), FlashError> {
        self.push(flash, &END)?;
        self.push(flash, &self.crc.get().to_le_bytes())?;
        self.program(flash)
    }

    fn push<F: Flash>(&mut self, flash: &mut F, bytes: &[u8]) -> Result<(), FlashError> {
        self.crc.update(bytes);
        for byte in bytes {
            if self.filled == CHUNK {
                self.program(flash)?;
            }
            if let Some(place) = self.chunk.get_mut(self.filled) {
                *place = *byte;
                self.filled += 1;
            }
        }
        Ok(())
    }

    /// Programs what has been pushed, filled up with what erased bytes are.
    fn program<F: Flash>(&mut self, flash: &mut F) -> Result<(), FlashError> {
        let len = self.filled.next_multiple_of(F::WRITE_SIZE);
        let chunk = self.chunk.get(..len).ok_or(FlashError)?;
        let next = self.at.saturating_add(len as u32);
        if next > self.end {
            return Err(FlashError);
        }
        flash.program(self.at, chunk)?;
        (self.at, self.chunk, self.filled) = (next, [0xFF; CHUNK], 0);
        Ok(())
    }
}
