//! An entry as the transfers see it: a stream of bytes, read or written from its beginning to its end.

use core::cmp::Ordering;

use crate::abort::AbortCode;
use crate::object::{Address, Entry, ObjectDictionary};
use crate::wire::sdo::Expedited;

/// An entry being read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    entry: Entry,
    /// The value, when all of it was read at the beginning: it must not change between two segments.
    value: Option<Value>,
}

/// A value of at most eight bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Value {
    pub(super) len: usize,
    pub(super) bytes: [u8; 8],
}

impl Source {
    #[inline]
    pub(super) fn open(address: Address, od: &mut (impl ObjectDictionary + ?Sized)) -> Result<Self, AbortCode> {
        let entry = readable(address, od)?;
        let mut bytes = [0; 8];
        let len = od.read(&entry, 0, &mut bytes)?;
        let is_whole = len < bytes.len() || entry.data_type.size().is_some();
        Ok(Source { entry, value: is_whole.then_some(Value { len, bytes }) })
    }

    pub(super) fn address(&self) -> Address {
        self.entry.address
    }

    /// The value, when it fits into one frame.
    pub(super) fn expedited(&self) -> Option<Expedited> {
        let Value { len, bytes: [a, b, c, d, ..] } = self.value?;
        Expedited::of_buffer([a, b, c, d], len)
    }

    /// The number of bytes, if the dictionary knows it beforehand.
    pub(super) fn size(&self, od: &mut (impl ObjectDictionary + ?Sized)) -> Option<u32> {
        match self.value {
            Some(value) => Some(value.len as u32),
            None => od.len(&self.entry),
        }
    }

    /// Reads one segment, and whether it is the last one: that is known since one byte more is asked for
    /// than a segment has.
    #[inline]
    pub(super) fn read(
        &self,
        offset: u32,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Result<(Value, bool), AbortCode> {
        let mut bytes = [0; 8];
        let len = match &self.value {
            Some(value) => {
                let rest = value.bytes.get(offset as usize..value.len).unwrap_or(&[]);
                bytes.iter_mut().zip(rest).for_each(|(to, from)| *to = *from);
                rest.len()
            }
            None => od.read(&self.entry, offset, &mut bytes)?,
        };
        Ok((Value { len: len.min(7), bytes }, len <= 7))
    }
}

/// Entries of up to so many bytes are written to the dictionary in one call, when the last byte has come; until then the
/// old value stays. Longer ones are written segment by segment.
const STAGED: usize = 64;

/// The bytes of a transfer that have come.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stage([u8; STAGED]);

impl Stage {
    pub(super) const EMPTY: Stage = Stage([0; STAGED]);
}

/// An entry being written.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sink {
    entry: Entry,
    /// Bytes taken so far.
    offset: u32,
    /// How many they must be in the end: as announced, or as the entry has it.
    least: u32,
    most: u32,
    /// Whether the dictionary gets them when all have come.
    is_staged: bool,
}

impl Sink {
    pub(super) fn open(
        address: Address,
        announced: Option<u32>,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Result<Self, AbortCode> {
        let entry = writable(address, od)?;
        let size = entry.data_type.size().map(|size| size as u32);
        let capacity = Some(u32::from(entry.capacity)).filter(|&capacity| capacity > 0);
        let room = size.or(capacity);
        match announced {
            Some(len) if room.is_some_and(|room| len > room) => return Err(AbortCode::LENGTH_TOO_HIGH),
            Some(len) if size.is_some_and(|size| len < size) => return Err(AbortCode::LENGTH_TOO_LOW),
            _ => {}
        }
        Ok(Sink {
            entry,
            offset: 0,
            least: announced.or(size).unwrap_or(0),
            most: announced.or(room).unwrap_or(u32::MAX),
            is_staged: room.is_some_and(|room| room <= STAGED as u32),
        })
    }

    pub(super) fn address(&self) -> Address {
        self.entry.address
    }

    /// Takes the next bytes.
    #[inline]
    pub(super) fn write(
        &mut self,
        data: &[u8],
        last: bool,
        stage: &mut Stage,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Result<(), AbortCode> {
        let start = self.offset;
        let end = start.checked_add(data.len() as u32).filter(|end| *end <= self.most);
        let end = end.ok_or(AbortCode::LENGTH_TOO_HIGH)?;
        if last && end < self.least {
            return Err(AbortCode::LENGTH_TOO_LOW);
        }
        self.offset = end;
        if !self.is_staged {
            return od.write(&self.entry, start, data, last);
        }
        // There always is room: `most` is at most STAGED here.
        if let Some(room) = stage.0.get_mut(start as usize..end as usize) {
            room.copy_from_slice(data);
        }
        if last { od.write(&self.entry, 0, stage.0.get(..end as usize).unwrap_or(&stage.0), true) } else { Ok(()) }
    }
}

/// Writes an entry whose data came in one frame. If the request does not say how many of the four bytes
/// count, or some of them may be padding, the size of the entry decides.
pub(super) fn write_expedited(
    address: Address,
    data: Expedited,
    may_be_padded: bool,
    od: &mut (impl ObjectDictionary + ?Sized),
) -> Result<(), AbortCode> {
    let entry = writable(address, od)?;
    let may_be_padded = may_be_padded && data.data().len() == 4 || data.len().is_none();
    let data = match entry.data_type.size() {
        Some(size) if may_be_padded => data.data().get(..size).unwrap_or(data.data()),
        _ => data.data(),
    };
    match entry.data_type.size().map(|size| data.len().cmp(&size)) {
        Some(Ordering::Less) => Err(AbortCode::LENGTH_TOO_LOW),
        Some(Ordering::Greater) => Err(AbortCode::LENGTH_TOO_HIGH),
        Some(Ordering::Equal) | None => od.write(&entry, 0, data, true),
    }
}

/// The facts of an entry that may be read.
pub(super) fn readable(address: Address, od: &mut (impl ObjectDictionary + ?Sized)) -> Result<Entry, AbortCode> {
    let mut entry = od.entry(address);
    if entry.is_ok_and(|entry| !entry.access.is_readable()) {
        entry = Err(AbortCode::WRITE_ONLY);
    }
    entry
}

fn writable(address: Address, od: &mut (impl ObjectDictionary + ?Sized)) -> Result<Entry, AbortCode> {
    let mut entry = od.entry(address);
    if entry.is_ok_and(|entry| !entry.access.is_writable()) {
        entry = Err(AbortCode::READ_ONLY);
    }
    entry
}
