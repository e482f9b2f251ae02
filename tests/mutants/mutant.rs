//! The mutant that this process is.

use std::cell::Cell;
use std::sync::OnceLock;

/// The descriptions of the mutants, by number, and the unit tests of the sources, by path.
pub use crate::mutated::{MUTANTS, TESTS};

/// The name of this crate.
pub const PACKAGE: &str = env!("CARGO_PKG_NAME");

/// The environment variable that names a mutant: the crate and its number there, `lexican-mutated-siko:7`.
pub const VARIABLE: &str = "LEXICAN_MUTANT";

/// A mutant that takes this many steps is taken for endless: the verification of a drive takes six million.
const STEPS: u64 = 60_000_000;

/// Whether this process is the mutant with this number.
#[must_use]
pub fn is(number: usize) -> bool {
    static CHOSEN: OnceLock<Option<usize>> = OnceLock::new();
    *CHOSEN.get_or_init(|| {
        let chosen = std::env::var(VARIABLE).ok()?.strip_prefix(PACKAGE)?.strip_prefix(':')?.parse().ok()?;
        // A panic means that the mutant is found: end without running other tests.
        std::panic::set_hook(Box::new(|_| std::process::exit(101)));
        Some(chosen)
    }) == Some(number)
}

thread_local! {
    static TAKEN: Cell<u64> = const { Cell::new(0) };
}

/// Counts functions and turns of loops, so that nothing runs for ever.
///
/// # Panics
///
/// After too many steps.
pub fn step() {
    let taken = TAKEN.get() + 1;
    TAKEN.set(taken);
    assert!(taken < STEPS, "it does not end");
}

/// The rows of data, without the one that a mutant removes.
#[must_use]
pub fn rows<T>(rows: Vec<(bool, T)>) -> &'static [T] {
    Box::leak(rows.into_iter().filter_map(|(lacks, row)| (!lacks).then_some(row)).collect())
}

/// A number that a mutant replaces by another one.
pub trait Altered {
    /// A slightly greater number; for a single bit, the next bit.
    #[must_use]
    fn altered(self) -> Self;
}

macro_rules! numbers {
    ($($number:ty: $more:expr;)*) => {
        $(impl Altered for $number {
            fn altered(self) -> Self {
                let more: fn(Self) -> Self = $more;
                more(self)
            }
        })*
    };
}

numbers! {
    u8: |number| if number.is_power_of_two() { number.rotate_left(1) } else { number.wrapping_add(1) };
    u16: |number| if number.is_power_of_two() { number.rotate_left(1) } else { number + 1 };
    i16: |number| number + 1;
    u32: |number| number + 1;
    i32: |number| number + 1;
    i64: |number| number + 1;
    f64: |number| number * 1.5;
    lexican_runtime::Duration: |span| span + lexican_runtime::Duration::from_micros(span.as_micros() / 2);
}
