//! Words that may be meant.

/// How alike a known word and a typed one are, from 0 to 1; capitals do not count.
#[must_use]
pub fn similarity(known: &str, typed: &str) -> f64 {
    strsim::jaro_winkler(&known.to_lowercase(), &typed.to_lowercase())
}
