//! Verdicts on cases.

use std::fmt::{self, Display};

use lexican_runtime::NodeId;

use crate::hazard::Hazard;
use crate::sheet::Findings;

/// Why a case was not passed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The device lacks the subject of the case, by its data sheet.
    NotApplicable(String),
    /// The case needs a hazard that is not [allowed](crate::Settings::allow).
    NotAllowed(Hazard),
    /// The device does not do what is required: what was seen.
    Failed(String),
    /// A step failed that is also a case, and that case fails too: its id, and what was seen.
    Blocked(&'static str, String),
    /// This computer was too late to judge the device: what was seen, with figures.
    NotDecidable(String),
    /// The case was not finished: it was [cancelled](Ended::Cancelled), or the [bus was lost](Ended::BusLost).
    Unfinished(Ended),
}

/// Why a test, or a case of it, ended early.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ended {
    /// No device can be tested by this data sheet: the findings of the linter.
    Unfit(Findings),
    /// The device does not answer, or has stopped answering.
    Silent(NodeId),
    /// A case failed, and [`fail_fast`](crate::Settings::fail_fast) is set.
    AtFailure,
    /// The test was cancelled.
    Cancelled,
    /// The bus was lost, and not back in [time](crate::Settings::bus): the error of the link.
    BusLost(String),
    /// A drive may still move, and could not be stopped: why.
    Moving(String),
}

impl Display for Ended {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Ended::Unfit(findings) => write!(f, "by this data sheet no device can be tested:\n{findings}"),
            Ended::Silent(node) => {
                write!(f, "node {node} does not answer: is it switched on, and is the bit rate right?")
            }
            Ended::AtFailure => f.write_str("a case failed, and the test was to end then"),
            Ended::Cancelled => f.write_str("it was cancelled"),
            Ended::BusLost(why) => write!(f, "the bus was lost: {why}"),
            Ended::Moving(why) => write!(f, "THE DRIVE MAY STILL MOVE, switch off its power: {why}"),
        }
    }
}

/// The result of a case, or of a step of it.
pub type Outcome<T = ()> = Result<T, Verdict>;

/// How strongly a standard asks for the subject of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// Required.
    Must,
    /// Recommended.
    Should,
}

impl Verdict {
    /// The reason, without the verdict itself.
    #[must_use]
    pub fn reason(&self) -> String {
        match self {
            Verdict::NotApplicable(why) | Verdict::Failed(why) | Verdict::NotDecidable(why) => why.clone(),
            Verdict::Blocked(by, why) => format!("by {by}: {why}"),
            Verdict::Unfinished(ended) => ended.to_string(),
            Verdict::NotAllowed(hazard) => format!("it {}, which needs `--allow {}`", hazard.what(), hazard.name()),
        }
    }
}

impl Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = match self {
            Verdict::NotApplicable(_) => "does not apply",
            Verdict::NotAllowed(_) => "not run",
            Verdict::Failed(_) => "failed",
            Verdict::Blocked(..) => "blocked",
            Verdict::NotDecidable(_) => "not decidable",
            Verdict::Unfinished(_) => "not finished",
        };
        write!(f, "{verdict}: {}", self.reason())
    }
}

pub(crate) fn failed(why: impl Display) -> Verdict {
    Verdict::Failed(why.to_string())
}

pub(crate) fn not_applicable(why: impl Display) -> Verdict {
    Verdict::NotApplicable(why.to_string())
}

pub(crate) fn ensure<S: Display>(holds: bool, why: impl FnOnce() -> S) -> Outcome {
    if holds { Ok(()) } else { Err(failed(why())) }
}
