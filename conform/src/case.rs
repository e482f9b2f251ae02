//! Cases, and what they lead to.

use std::fmt::{self, Display};

use lexican_runtime::NodeId;

use crate::hazard::Hazard;
use crate::tester::Tester;

/// Why a case was not passed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The data sheet says that the device lacks what the case is about.
    NotApplicable(String),
    /// The case would do something that has not been [allowed](crate::Settings::allow).
    NotAllowed(Hazard),
    /// The device does something else.
    Failed(String),
    /// The case was not finished: it was [cancelled](Ended::Cancelled), or the [bus is gone](Ended::BusLost).
    Unfinished(Ended),
}

/// Why a test, or a case of it, ended early.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ended {
    /// By this data sheet no device can be tested: what the linter finds in it.
    Unfit(String),
    /// The device does not answer, or not any more.
    Silent(NodeId),
    /// A case failed, and the test was to end [then](crate::Settings::fail_fast).
    AtFailure,
    /// The test was cancelled.
    Cancelled,
    /// The bus was lost, and not back in [time](crate::Settings::bus): what the link says.
    BusLost(String),
    /// A drive may still move, and could not be stopped: what is known of it.
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

/// How much a standard asks for what a case is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// Required.
    Must,
    /// Recommended.
    Should,
}

/// What a case is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scope {
    /// The data sheet alone: nothing is sent.
    DataSheet,
    /// The device, at its node-ID.
    Device,
    /// LSS (CiA 305), if the data sheet says that the device has it.
    Lss,
}

/// One case.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// The standard, its clause, and a number: `301/7.2.4.3.7/2`.
    pub id: &'static str,
    /// The number in CiA's test plan (CCT 3.0.3.10), such as `2.17`; empty for a case that the plan does not have.
    pub plan: &'static str,
    /// What has to hold.
    pub title: &'static str,
    /// Whether it has to hold, or only should.
    pub level: Level,
    /// What the case does in any case that needs to be allowed.
    pub needs: &'static [Hazard],
    pub(crate) scope: Scope,
    pub(crate) run: fn(&mut Tester<'_>) -> Outcome,
}

pub(crate) const fn case(
    id: &'static str,
    plan: &'static str,
    title: &'static str,
    run: fn(&mut Tester<'_>) -> Outcome,
) -> Case {
    Case { id, plan, title, level: Level::Must, needs: &[], scope: Scope::Device, run }
}

impl Case {
    pub(crate) const fn recommended(self) -> Self {
        Case { level: Level::Should, ..self }
    }

    pub(crate) const fn about(self, scope: Scope) -> Self {
        Case { scope, ..self }
    }

    pub(crate) const fn needs(self, needs: &'static [Hazard]) -> Self {
        Case { needs, ..self }
    }

    /// The device profile that the case is about, such as 402, by the standard that its id begins with. A case of a profile
    /// does not apply to devices of another; the other cases are for every device.
    #[must_use]
    pub fn profile(&self) -> Option<u16> {
        let standard = self.id.split('/').next()?.parse().ok();
        standard.filter(|standard| (400..500).contains(standard))
    }

    /// Whether the case is meant by a name: its id or its number in the plan, a chapter or another beginning of either that
    /// ends before a dot or a slash.
    #[must_use]
    pub fn is_meant_by(&self, name: &str) -> bool {
        let begins =
            |whole: &str| whole.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '/']));
        !name.is_empty() && (begins(self.id) || begins(self.plan))
    }
}

impl Verdict {
    /// Why, without the verdict itself.
    #[must_use]
    pub fn reason(&self) -> String {
        match self {
            Verdict::NotApplicable(why) | Verdict::Failed(why) => why.clone(),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_case_is_meant_by_its_number_its_id_and_their_chapters() {
        let toggle = case("301/7.2.4.3.7/2", "2.17", "", |_| Ok(()));
        for name in ["2.17", "2", "301/7.2.4.3.7/2", "301/7.2.4.3.7", "301/7.2", "301"] {
            assert!(toggle.is_meant_by(name), "{name}");
        }
        for name in ["", "2.1", "301/7.2.4.3.7/", "7.2.4.3.7", "301/7.2.4.3.7/21", "3"] {
            assert!(!toggle.is_meant_by(name), "{name}");
        }
    }

    #[test]
    fn the_profile_of_a_case_is_its_standard() {
        for (id, profile) in
            [("301/7.2.5/1", None), ("306-1/6/1", None), ("305/6.2/1", None), ("402/8.4.2/1", Some(402))]
        {
            assert_eq!(case(id, "", "", |_| Ok(())).profile(), profile, "{id}");
        }
    }
}
