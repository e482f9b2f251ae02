//! What cases have the device do with SYNC.

use crate::tester::Tester;
use crate::verdict::{Outcome, not_applicable};

pub(crate) fn consumes(t: &Tester<'_>) -> Outcome {
    t.has(&[0x1005, 0x1006])
}

/// The case that is about SYNC in its period.
pub(crate) const PRODUCED: &str = "301/7.2.5/1";

/// SYNC, every 10 ms.
pub(crate) fn produce(t: &mut Tester<'_>) -> Outcome {
    consumes(t)?;
    produce_nothing(t)?;
    t.write(0x1006, 0, 10_000)?;
    t.write(0x1005, 0, 0x4000_0080)
}

/// In 1005h: the device produces SYNC.
const PRODUCES: u32 = 1 << 30;

/// No SYNC, and no period of it if the device can have none.
pub(crate) fn produce_nothing(t: &mut Tester<'_>) -> Outcome {
    if t.entry(0x1005, 0).is_ok() {
        let cob_id = t.read(0x1005, 0)? as u32;
        if cob_id & PRODUCES != 0 {
            t.write(0x1005, 0, cob_id & !PRODUCES)?;
        }
    }
    // A device may have no period for "never".
    if t.entry(0x1006, 0).is_ok() && t.has_value(0x1006, 0, 0) && t.read(0x1006, 0)? != 0 {
        t.write(0x1006, 0, 0)?;
    }
    Ok(())
}

/// 1019h may be written: there is no period of SYNC.
pub(crate) fn without_period(t: &mut Tester<'_>) -> Outcome {
    t.entry(0x1019, 0)?;
    if t.entry(0x1006, 0).is_ok() && !t.has_value(0x1006, 0, 0) {
        return Err(not_applicable("1006h has no value for no period, with which 1019h could be written"));
    }
    produce_nothing(t)
}

pub(crate) fn counts(t: &mut Tester<'_>, overflow: u32) -> Outcome {
    without_period(t)?;
    t.write(0x1019, 0, overflow)?;
    produce(t)
}
