//! TIME: milliseconds after midnight and days since 1984 (CiA 301, 7.2.6).

use crate::frame::Frame;
use crate::id::CobId;
use crate::object::{TimeOfDay, Value};

/// `None` if the data are not six bytes. The four bits besides the milliseconds are reserved and ignored.
#[must_use]
pub fn parse(data: &[u8]) -> Option<TimeOfDay> {
    TimeOfDay::from_bytes(data).ok()
}

/// The whole frame.
#[must_use]
pub fn frame(id: CobId, time: TimeOfDay) -> Frame {
    let [a, b, c, d, e, f, _, _] = time.to_bytes();
    Frame::from_array(id, [a, b, c, d, e, f])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_emitted_is_parsed() {
        let time = TimeOfDay { days: 15_300, ms: 86_399_999 };
        assert_eq!(parse(frame(CobId::TIME, time).data()), Some(time));
        assert_eq!(parse(&[0; 5]), None);
        assert_eq!(parse(&[0; 8]), None);
    }
}
