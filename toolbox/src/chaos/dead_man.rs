//! How soon a drive stands when nothing commands it any more.

use lexican_runtime::Duration;

/// The drives of the library, and within which time each of them stands whose program is gone: protected as
/// `Drive::connect` has it, in the middle of a travel. `drives/README.md` shows it; `toolbox/tests/all/dead_man.rs` measures it.
pub const STANDS_WITHIN: &[(&str, Duration)] = &[
    ("kollmorgen/akd", Duration::from_millis(1300)),
    ("siko/ag02", Duration::from_millis(1500)),
    ("siko/ag03-1", Duration::from_millis(1300)),
];

/// The same for other drives: a second to notice, and a second to brake.
pub const OTHERS_STAND_WITHIN: Duration = Duration::from_millis(2000);

/// Within which time a drive stands: one of the library, or another one.
#[must_use]
pub fn stands_within(library: Option<&str>) -> Duration {
    let known = STANDS_WITHIN.iter().find(|(id, _)| library == Some(id));
    known.map_or(OTHERS_STAND_WITHIN, |(_, within)| *within)
}
