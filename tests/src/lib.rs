//! Everything that crosses crates. The tests themselves are in `tests/tests`, their data beside it.

/// The README, so that what it promises compiles and runs.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
pub struct Readme;

/// The runtime's, which shows objects of a drive that the runtime does not know.
#[cfg(doctest)]
#[doc = include_str!("../../runtime/README.md")]
pub struct RuntimeReadme;
