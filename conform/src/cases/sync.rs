//! What cases make the device do with SYNC.

use crate::tester::Tester;
use crate::verdict::{Outcome, not_applicable};

pub(crate) fn consumes(t: &Tester<'_>) -> Outcome {
    t.has(&[0x1005, 0x1006])
}

/// The id of the case about the period of SYNC.
pub(crate) const PRODUCED: &str = "301/7.2.5/1";

/// Makes the device produce SYNC, every 10 ms.
pub(crate) fn produce(t: &mut Tester<'_>) -> Outcome {
    consumes(t)?;
    produce_nothing(t)?;
    t.write(0x1006, 0, 10_000)?;
    t.write(0x1005, 0, 0x4000_0080)
}

/// The bit of 1005h by which the device produces SYNC.
const PRODUCES: u32 = 1 << 30;

/// Stops the device's SYNC, and clears its period if 0 is allowed.
pub(crate) fn produce_nothing(t: &mut Tester<'_>) -> Outcome {
    if t.entry(0x1005, 0).is_ok() {
        let cob_id = t.read(0x1005, 0)? as u32;
        if cob_id & PRODUCES != 0 {
            t.write(0x1005, 0, cob_id & !PRODUCES)?;
        }
    }
    // A device may have no value for "no period".
    if t.entry(0x1006, 0).is_ok() && t.has_value(0x1006, 0, 0) && t.read(0x1006, 0)? != 0 {
        t.write(0x1006, 0, 0)?;
    }
    Ok(())
}

/// Clears the period of SYNC, so that 1019h may be written.
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
