//! SYNC: an empty message, or one with a counter (CiA 301, 7.2.5).

use crate::frame::Frame;
use crate::id::CobId;

/// A SYNC message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sync {
    /// 1 to 240 if the producer has a counter (1019h).
    pub counter: Option<u8>,
}

impl Sync {
    /// `None` if there is more than one byte.
    #[must_use]
    pub const fn parse(data: &[u8]) -> Option<Self> {
        match data {
            [] => Some(Sync { counter: None }),
            &[counter] => Some(Sync { counter: Some(counter) }),
            _ => None,
        }
    }

    /// The whole frame.
    #[must_use]
    pub const fn frame(self, id: CobId) -> Frame {
        match self.counter {
            None => Frame::from_array(id, []),
            Some(counter) => Frame::from_array(id, [counter]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_emitted_is_parsed() {
        for counter in [None, Some(1), Some(240)] {
            let sync = Sync { counter };
            assert_eq!(Sync::parse(sync.frame(CobId::SYNC).data()), Some(sync));
        }
        assert_eq!(Sync::parse(&[1, 2]), None);
    }
}
