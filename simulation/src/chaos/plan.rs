//! The plan of a trial: what is done to a program, and when. A number, the seed, decides both.

use std::fmt::{self, Display};

use lexican_runtime::Duration;

/// What is done to the program, to the bus or to the supply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Disturbance {
    /// The program is told to end (SIGTERM).
    Terminate,
    /// The program is told to end by Ctrl-C (SIGINT).
    Interrupt,
    /// The program is killed (SIGKILL).
    Kill,
    /// The program is stopped for this long (SIGSTOP, SIGCONT).
    Freeze(Duration),
    /// Nothing passes between the program and the devices, for this long or until the program ends.
    CutBus(Option<Duration>),
    /// All devices lose their supply for this long.
    CutPower(Duration),
}

/// When it is done: counted from events of the bus, which are the same in each run, not by a clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moment {
    /// At this frame of the program; the first one is 1.
    Frame(u32),
    /// At this SDO request of the program; the first one is 1.
    Request(u32),
    /// This long after an axis has set off.
    Moving(Duration),
}

/// What is done, and when.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// The number that decides moment and disturbance.
    pub seed: u64,
    /// When.
    pub moment: Moment,
    /// What.
    pub disturbance: Disturbance,
}

impl Plan {
    /// The plan of a seed. `moves` says whether the program moves an axis.
    #[must_use]
    pub fn draw(seed: u64, moves: bool) -> Self {
        let mut random = Random(seed);
        let moment = match random.below(if moves { 10 } else { 5 }) {
            0..3 => Moment::Frame(random.octaves(1, 9) as u32),
            3..5 => Moment::Request(random.octaves(1, 7) as u32),
            _ => Moment::Moving(Duration::from_millis(random.octaves(16, 7))),
        };
        // Either shorter than a drive needs to notice, or longer.
        let mut span = || match random.below(2) {
            0 => Duration::from_millis(50 + random.below(500)),
            _ => Duration::from_millis(2_000 + random.below(1_500)),
        };
        let span = span();
        let disturbance = match random.below(12) {
            0..2 => Disturbance::Terminate,
            2..4 => Disturbance::Interrupt,
            4..6 => Disturbance::Kill,
            6..8 => Disturbance::Freeze(span),
            8 => Disturbance::CutBus(None),
            9 => Disturbance::CutBus(Some(span)),
            _ => Disturbance::CutPower(span),
        };
        Plan { seed, moment, disturbance }
    }
}

impl Disturbance {
    /// How long it lasts; `None` if it has no end of its own.
    #[must_use]
    pub const fn span(self) -> Option<Duration> {
        match self {
            Disturbance::Freeze(span) | Disturbance::CutPower(span) => Some(span),
            Disturbance::CutBus(span) => span,
            Disturbance::Terminate | Disturbance::Interrupt | Disturbance::Kill => None,
        }
    }

    /// Whether it asks the program to end, so that the program can clean up.
    #[must_use]
    pub const fn is_asked(self) -> bool {
        matches!(self, Disturbance::Terminate | Disturbance::Interrupt)
    }
}

impl Display for Disturbance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Disturbance::Terminate => f.write_str("SIGTERM"),
            Disturbance::Interrupt => f.write_str("SIGINT"),
            Disturbance::Kill => f.write_str("SIGKILL"),
            Disturbance::Freeze(span) => write!(f, "SIGSTOP for {span}"),
            Disturbance::CutBus(None) => f.write_str("bus cut"),
            Disturbance::CutBus(Some(span)) => write!(f, "bus cut for {span}"),
            Disturbance::CutPower(span) => write!(f, "power cut for {span}"),
        }
    }
}

impl Display for Moment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Moment::Frame(number) => write!(f, "at frame {number} of the program"),
            Moment::Request(number) => write!(f, "at SDO request {number}"),
            Moment::Moving(span) => write!(f, "{span} after an axis has set off"),
        }
    }
}

/// `SIGKILL at frame 37 of the program`.
impl Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.disturbance, self.moment)
    }
}

/// The generator SplitMix64, whose numbers are the same on every platform.
struct Random(u64);

impl Random {
    const fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ mixed >> 31
    }

    const fn below(&mut self, end: u64) -> u64 {
        self.next() % end
    }

    /// A number of at least `first`, in one of `doublings` octaves that are equally likely: programs may be short or
    /// long.
    const fn octaves(&mut self, first: u64, doublings: u64) -> u64 {
        let low = first << self.below(doublings);
        low + self.below(low)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_decides_and_all_is_drawn_that_there_is() {
        let drawn = |moves| (0..200).map(|seed| Plan::draw(seed, moves).to_string()).collect::<Vec<_>>();
        assert_eq!(drawn(true), drawn(true));
        for words in ["SIGTERM", "SIGINT", "SIGKILL", "SIGSTOP for", "bus cut", "bus cut for", "power cut for"] {
            for moment in ["at frame", "at SDO request", "after an axis has set off"] {
                assert!(
                    drawn(true).iter().any(|plan| plan.contains(words) && plan.contains(moment)),
                    "{words} {moment}"
                );
            }
        }
        assert!(drawn(false).iter().all(|plan| !plan.contains("set off")), "nothing moves");
        // Plans are named by their seeds in bug reports: a seed keeps its plan.
        assert_eq!(Plan::draw(5, true).to_string(), "SIGKILL 839 ms after an axis has set off");
    }
}
