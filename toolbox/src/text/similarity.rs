//! Similarity of names, for suggestions.

/// The similarity of two words, from 0 to 1, ignoring case.
#[must_use]
pub fn similarity(known: &str, typed: &str) -> f64 {
    strsim::jaro_winkler(&known.to_lowercase(), &typed.to_lowercase())
}
