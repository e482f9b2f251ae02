//! Segmented transfers (CiA 301, 7.2.4.3.4 and 7.2.4.3.7).

use super::entry::{Sink, Source, Stage, Value};
use crate::abort::AbortCode;
use crate::object::{Address, ObjectDictionary};
use crate::wire::sdo::Segment;

/// A segmented upload under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Upload {
    source: Source,
    offset: u32,
    toggle: bool,
}

/// A segmented download under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Download {
    sink: Sink,
    toggle: bool,
}

impl Upload {
    pub(super) const fn new(source: Source) -> Self {
        Upload { source, offset: 0, toggle: false }
    }

    pub(super) fn address(&self) -> Address {
        self.source.address()
    }

    /// The next segment.
    #[inline]
    pub(super) fn segment(
        &mut self,
        toggle: bool,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Result<Segment, AbortCode> {
        if toggle != self.toggle {
            return Err(AbortCode::TOGGLE_BIT);
        }
        let (Value { len, bytes }, last) = self.source.read(self.offset, od)?;
        // The size field of CiA 301 has no room for an entry longer than 4 GiB either.
        self.offset = self.offset.checked_add(len as u32).ok_or(AbortCode::GENERAL)?;
        self.toggle = !toggle;
        Ok(Segment::of_buffer(toggle, bytes, len, last))
    }
}

impl Download {
    pub(super) const fn new(sink: Sink) -> Self {
        Download { sink, toggle: false }
    }

    pub(super) fn address(&self) -> Address {
        self.sink.address()
    }

    /// Takes the next segment.
    #[inline]
    pub(super) fn take(
        &mut self,
        segment: &Segment,
        stage: &mut Stage,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Result<(), AbortCode> {
        if segment.toggle != self.toggle {
            return Err(AbortCode::TOGGLE_BIT);
        }
        self.sink.write(segment.data(), segment.last, stage, od)?;
        self.toggle = !segment.toggle;
        Ok(())
    }
}
