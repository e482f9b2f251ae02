//! The transfer under way: an entry as a stream of bytes, read or written from its beginning to its end.

use crate::abort::AbortCode;
use crate::object::{Access, Address, DataType, Entry, ObjectDictionary, PdoMapping};
use crate::wire::sdo::Expedited;

/// Entries of up to so many bytes are written to the dictionary in one call, when the last byte has come; until then the
/// old value stays. Longer ones are written segment by segment.
const HELD: usize = 64;

/// An entry, and how much of it was transferred. One record serves both directions.
#[derive(Clone, Debug)]
pub(super) struct Transfer {
    entry: Entry,
    /// Bytes transferred so far.
    offset: u32,
    /// How many bytes a download must have in the end, as announced, or as the entry has it.
    least: u32,
    /// The same; of an upload that is held, how many it has.
    most: u32,
    /// The toggle bit of the next segment.
    toggle: bool,
    /// Whether the value is in `held`: it was read at the beginning, or is written when all of it has come. So it does not
    /// change between two segments.
    is_held: bool,
    held: [u8; HELD],
}

/// At most seven bytes, and the first one behind them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub(super) bytes: [u8; 8],
    pub(super) len: usize,
    pub(super) last: bool,
}

impl Transfer {
    // A function: a constant of as many bytes would be copied from flash.
    pub(super) const fn none() -> Self {
        Transfer {
            entry: Entry::new(0, 0, DataType::Boolean, Access::Ro, PdoMapping::None),
            offset: 0,
            least: 0,
            most: 0,
            toggle: false,
            is_held: false,
            held: [0; HELD],
        }
    }

    pub(super) const fn address(&self) -> Address {
        self.entry.address
    }

    /// Begins to read an entry: all of it, if it has at most eight bytes.
    #[inline]
    pub(super) fn open_upload(
        &mut self,
        address: Address,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Result<(), AbortCode> {
        let entry = permitted(Access::is_readable, AbortCode::WRITE_ONLY, address, od)?;
        let mut bytes = [0; 8];
        let len = od.read(&entry, 0, &mut bytes)?;
        if let Some(held) = self.held.first_chunk_mut() {
            *held = bytes;
        }
        self.is_held = len < bytes.len() || entry.data_type.size().is_some();
        self.most = len as u32;
        self.open(entry);
        Ok(())
    }

    /// Begins to write an entry, with as many bytes as the client announces.
    pub(super) fn open_download(
        &mut self,
        address: Address,
        announced: Option<u32>,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Result<(), AbortCode> {
        let entry = permitted(Access::is_writable, AbortCode::READ_ONLY, address, od)?;
        let size = entry.data_type.size().map(|size| size as u32);
        let room = size.unwrap_or(match entry.capacity {
            0 => u32::MAX,
            capacity => capacity.into(),
        });
        if let Some(len) = announced {
            entry.check_len(len as usize)?;
            if len > room {
                return Err(AbortCode::LENGTH_TOO_HIGH);
            }
        }
        self.least = announced.or(size).unwrap_or(0);
        self.most = announced.unwrap_or(room);
        self.is_held = room <= HELD as u32;
        self.open(entry);
        Ok(())
    }

    fn open(&mut self, entry: Entry) {
        self.entry = entry;
        self.offset = 0;
        self.toggle = false;
    }

    /// The value, when it fits into one frame.
    #[inline]
    pub(super) fn expedited(&self) -> Option<Expedited> {
        let bytes = self.held.first_chunk().filter(|_| self.is_held)?;
        Expedited::of_buffer(*bytes, self.most as usize)
    }

    /// The number of bytes to read, if the dictionary knows it beforehand.
    pub(super) fn size(&self, od: &mut (impl ObjectDictionary + ?Sized)) -> Option<u32> {
        if self.is_held { Some(self.most) } else { od.len(&self.entry) }
    }

    /// Goes on with the next segment; those with the same toggle bit are one.
    #[inline]
    pub(super) fn turn(&mut self, toggle: bool) -> Result<(), AbortCode> {
        if toggle != self.toggle {
            return Err(AbortCode::TOGGLE_BIT);
        }
        self.toggle = !toggle;
        Ok(())
    }

    /// The next bytes of an upload in segments.
    #[inline]
    pub(super) fn read_next(&mut self, od: &mut (impl ObjectDictionary + ?Sized)) -> Result<Piece, AbortCode> {
        let piece = self.read(self.offset, od)?;
        // The size field of CiA 301 has no room for an entry longer than 4 GiB either.
        self.offset = self.offset.checked_add(piece.len as u32).ok_or(AbortCode::GENERAL)?;
        Ok(piece)
    }

    /// The bytes from `offset` on. Whether they are the last ones is known since one more is asked for than a segment has.
    #[inline]
    pub(super) fn read(&self, offset: u32, od: &mut (impl ObjectDictionary + ?Sized)) -> Result<Piece, AbortCode> {
        let mut bytes = [0; 8];
        let len = if self.is_held {
            let rest = self.held.get(offset as usize..self.most as usize).unwrap_or(&[]);
            bytes.iter_mut().zip(rest).for_each(|(to, from)| *to = *from);
            rest.len()
        } else {
            od.read(&self.entry, offset, &mut bytes)?
        };
        Ok(Piece { bytes, len: len.min(7), last: len <= 7 })
    }

    /// Takes the next bytes of a download.
    #[inline]
    pub(super) fn write(
        &mut self,
        data: &[u8],
        last: bool,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Result<(), AbortCode> {
        let start = self.offset;
        let end = start.checked_add(data.len() as u32).filter(|end| *end <= self.most);
        let end = end.ok_or(AbortCode::LENGTH_TOO_HIGH)?;
        if last && end < self.least {
            return Err(AbortCode::LENGTH_TOO_LOW);
        }
        self.offset = end;
        if !self.is_held {
            return od.write(&self.entry, start, data, last);
        }
        // There always is room: `most` is at most HELD here.
        if let Some(room) = self.held.get_mut(start as usize..end as usize) {
            room.copy_from_slice(data);
        }
        if last { od.write(&self.entry, 0, self.held.get(..end as usize).unwrap_or(&self.held), true) } else { Ok(()) }
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
    let entry = permitted(Access::is_writable, AbortCode::READ_ONLY, address, od)?;
    let bytes = data.data();
    let may_be_padded = may_be_padded && bytes.len() == 4 || data.len().is_none();
    let bytes = match entry.data_type.size() {
        Some(size) if may_be_padded => bytes.get(..size).unwrap_or(bytes),
        _ => bytes,
    };
    entry.check_len(bytes.len())?;
    od.write(&entry, 0, bytes, true)
}

/// The facts of an entry, if its access is right, and else `refusal`. The result is the dictionary's own, as one that is
/// taken apart is copied field by field.
fn permitted(
    is_right: fn(Access) -> bool,
    refusal: AbortCode,
    address: Address,
    od: &mut (impl ObjectDictionary + ?Sized),
) -> Result<Entry, AbortCode> {
    let mut entry = od.entry(address);
    if entry.is_ok_and(|entry| !is_right(entry.access)) {
        entry = Err(refusal);
    }
    entry
}
