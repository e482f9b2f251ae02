//! What a case is.

use lexican_runtime::wire::nmt::NmtCommand;

use crate::hazard::Hazard;
use crate::tester::Tester;
use crate::verdict::{Ended, Level, Outcome, Verdict, not_applicable};

/// What a case needs.
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
    /// What has to hold, in a few words.
    pub title: &'static str,
    /// The requirement of the clause, in one sentence of ours.
    pub requirement: &'static str,
    /// Whether it has to hold, or only should.
    pub level: Level,
    /// The hazards that have to be allowed for the case.
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
    Case { id, plan, title, requirement: "", level: Level::Must, needs: &[], scope: Scope::Device, run }
}

/// A case of a drive, which may move.
pub(crate) const fn drive(id: &'static str, title: &'static str, run: fn(&mut Tester<'_>) -> Outcome) -> Case {
    case(id, "", title, run).needs(&[Hazard::Motion])
}

impl Case {
    /// A case that something other than the tester judges, to be reported in the same way. It is kept until the program
    /// ends.
    #[must_use]
    pub fn judged_elsewhere(id: String, title: String, requirement: &'static str, level: Level) -> &'static Self {
        let case = case(id.leak(), "", title.leak(), |_| Ok(()));
        Box::leak(Box::new(Case { requirement, level, scope: Scope::DataSheet, ..case }))
    }

    pub(crate) const fn requires(self, requirement: &'static str) -> Self {
        Case { requirement, ..self }
    }

    pub(crate) const fn recommended(self) -> Self {
        Case { level: Level::Should, ..self }
    }

    pub(crate) const fn about(self, scope: Scope) -> Self {
        Case { scope, ..self }
    }

    pub(crate) const fn needs(self, needs: &'static [Hazard]) -> Self {
        Case { needs, ..self }
    }

    /// The device profile of the case, such as 402, from the standard in its id. A case of a profile does not apply to
    /// devices of another one; cases without a profile are for every device.
    #[must_use]
    pub fn profile(&self) -> Option<u16> {
        let standard = self.id.split('/').next()?.parse().ok();
        standard.filter(|standard| (400..500).contains(standard))
    }

    /// The standard and the clause or object of the case: `CiA 301, 7.2.4.3.7`; empty for a case without a standard.
    #[must_use]
    pub fn clause(&self) -> String {
        let clause = self.id.rsplit_once('/').map_or(self.id, |(clause, _)| clause);
        if !clause.starts_with(|first: char| first.is_ascii_digit()) {
            return String::new();
        }
        format!("CiA {}", clause.replacen('/', ", ", 1))
    }

    /// The standard with up to three numbers of the clause: `301/7.2.4`.
    pub(crate) fn chapter(&self) -> &'static str {
        let clause = self.id.rsplit_once('/').map_or(self.id, |(clause, _)| clause);
        clause.match_indices('.').nth(2).map_or(clause, |(end, _)| &clause[..end])
    }

    /// Whether a name means the case: its id, its number in the plan, or a beginning of either that ends before a dot
    /// or a slash.
    #[must_use]
    pub fn is_meant_by(&self, name: &str) -> bool {
        let begins =
            |whole: &str| whole.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '/']));
        !name.is_empty() && (begins(self.id) || begins(self.plan))
    }
}

impl Tester<'_> {
    /// Runs one case on a device with default values.
    pub fn run(&mut self, case: &Case) -> Outcome {
        self.begin();
        let profile = self.sheet.device.profile;
        if let Some(wanted) = case.profile().filter(|&wanted| Some(wanted) != profile) {
            return Err(not_applicable(format!("1000h does not say that the device is one of CiA {wanted}")));
        }
        match case.scope {
            Scope::DataSheet => return (case.run)(self),
            _ if self.sheet.is_unfit => {
                return Err(Verdict::Unfinished(Ended::Unfit(self.sheet.findings.clone())));
            }
            Scope::Lss if !self.sheet.device.info.lss => {
                return Err(not_applicable("LSS_Supported is not 1 in the data sheet"));
            }
            Scope::Lss | Scope::Device => {}
        }
        if let Some(hazard) = case.needs.iter().find(|hazard| !self.settings.allow.contains(hazard)) {
            return Err(Verdict::NotAllowed(*hazard));
        }
        let outcome = self.reset(NmtCommand::ResetNode).and_then(|()| (case.run)(self));
        self.decided(outcome)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::{cases, profile_cases};

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
    fn each_case_names_its_clause_and_what_that_asks_for_in_one_sentence() {
        for case in cases().chain(profile_cases()) {
            let one = case.requirement.trim_end_matches('.');
            assert!(one.len() + 1 == case.requirement.len() && !one.contains(". "), "{}: {one}", case.id);
        }
        assert_eq!(case("301/7.2.4.3.7/2", "", "", |_| Ok(())).clause(), "CiA 301, 7.2.4.3.7");
        assert_eq!(case("chaos/7", "", "", |_| Ok(())).clause(), "");
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
