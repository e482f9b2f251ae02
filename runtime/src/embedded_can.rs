//! Frames and identifiers as [`embedded_can`] has them, whose traits the drivers of CAN controllers implement.

use embedded_can::{ExtendedId, Id, StandardId};

use crate::{CobId, Frame};

impl embedded_can::Frame for Frame {
    fn new(id: impl Into<Id>, data: &[u8]) -> Option<Self> {
        Frame::new(id.into().into(), data)
    }

    fn new_remote(id: impl Into<Id>, dlc: usize) -> Option<Self> {
        Frame::remote(id.into().into(), u8::try_from(dlc).ok()?)
    }

    fn is_extended(&self) -> bool {
        self.id().is_extended()
    }

    fn is_remote_frame(&self) -> bool {
        self.is_remote()
    }

    fn id(&self) -> Id {
        self.id().into()
    }

    fn dlc(&self) -> usize {
        self.dlc().into()
    }

    fn data(&self) -> &[u8] {
        self.data()
    }
}

impl Frame {
    /// The same frame as a driver receives it; `None` if it is longer than eight bytes.
    pub fn from_embedded(frame: &impl embedded_can::Frame) -> Option<Self> {
        convert(frame)
    }

    /// The same frame as a driver sends it; `None` if the driver's type does not hold it.
    #[must_use]
    pub fn to_embedded<F: embedded_can::Frame>(&self) -> Option<F> {
        convert(self)
    }
}

fn convert<F: embedded_can::Frame>(frame: &impl embedded_can::Frame) -> Option<F> {
    if frame.is_remote_frame() { F::new_remote(frame.id(), frame.dlc()) } else { F::new(frame.id(), frame.data()) }
}

impl From<Id> for CobId {
    fn from(id: Id) -> Self {
        let id = match id {
            Id::Standard(id) => CobId::standard(id.as_raw()),
            Id::Extended(id) => CobId::extended(id.as_raw()),
        };
        id.expect("both types have the same ranges")
    }
}

impl From<CobId> for Id {
    fn from(id: CobId) -> Self {
        let raw = id.raw();
        let id = if id.is_extended() {
            ExtendedId::new(raw).map(Id::Extended)
        } else {
            u16::try_from(raw).ok().and_then(StandardId::new).map(Id::Standard)
        };
        id.expect("both types have the same ranges")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame of a driver that has a type of its own.
    #[derive(Debug, PartialEq)]
    struct Theirs(Id, bool, std::vec::Vec<u8>);

    impl embedded_can::Frame for Theirs {
        fn new(id: impl Into<Id>, data: &[u8]) -> Option<Self> {
            Some(Theirs(id.into(), false, data.to_vec()))
        }
        fn new_remote(id: impl Into<Id>, dlc: usize) -> Option<Self> {
            Some(Theirs(id.into(), true, std::vec![0; dlc]))
        }
        fn is_extended(&self) -> bool {
            matches!(self.0, Id::Extended(_))
        }
        fn is_remote_frame(&self) -> bool {
            self.1
        }
        fn id(&self) -> Id {
            self.0
        }
        fn dlc(&self) -> usize {
            self.2.len()
        }
        fn data(&self) -> &[u8] {
            if self.1 { &[] } else { &self.2 }
        }
    }

    #[test]
    fn frames_convert_both_ways() {
        for frame in [
            Frame::new(CobId::standard(0x7FF).unwrap(), &[1, 2, 3]).unwrap(),
            Frame::new(CobId::extended(0x5).unwrap(), &[0; 8]).unwrap(),
            Frame::remote(CobId::standard(0x705).unwrap(), 1).unwrap(),
            Frame::remote(CobId::extended(0x1FFF_FFFF).unwrap(), 0).unwrap(),
        ] {
            let theirs: Theirs = frame.to_embedded().unwrap();
            assert_eq!(embedded_can::Frame::is_extended(&theirs), frame.id().is_extended());
            assert_eq!(Frame::from_embedded(&theirs), Some(frame));
        }
        let long = Theirs(Id::Standard(StandardId::ZERO), false, std::vec![0; 9]);
        assert_eq!(Frame::from_embedded(&long), None);
    }
}
