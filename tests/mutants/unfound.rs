//! Mutants that are not found, because they do the same.

/// What they are called, and why they do the same.
pub(crate) const UNFOUND: &[(&str, &str)] = &[
    ("leds flashes: at < code => at <= code", "where the code ends, a gap begins: it is dark by the other condition"),
    ("motion lags: TINY => another number", ROUNDING),
    (
        "motion lags: state.velocity.abs () >= self.ceiling - TINY => state.velocity.abs () > self.ceiling - TINY",
        ROUNDING,
    ),
    ("objects check_state: NmtState::PreOperational => no arm", "every object that has a rule can be written there"),
    ("objects new: 64 => 64 + 1 #2", "what has no size in bits is read-only"),
    ("status observe: ROUNDING => another number", ROUNDING),
    (
        "status observe: velocity >= target - f64::from (window) - ROUNDING => velocity > target - f64::from (window) - ROUNDING",
        ROUNDING,
    ),
    ("status observe: ROUNDING => another number #2", ROUNDING),
    (
        "status observe: velocity > target + f64::from (window) + ROUNDING => velocity >= target + f64::from (window) + ROUNDING",
        ROUNDING,
    ),
];

/// A velocity passes through that much in far less than a microsecond, which is what time is counted in.
const ROUNDING: &str = "far below what can be read";

/// Why a mutant is not found.
pub(crate) fn why(name: &str) -> Option<&'static str> {
    UNFOUND.iter().find(|(known, _)| *known == name).map(|(_, why)| *why)
}
