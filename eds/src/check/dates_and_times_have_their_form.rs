//! Dates are mm-dd-yyyy and times hh:mmAM or hh:mmPM.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::section::SectionKind;

pub(crate) const RULE: Rule = Rule {
    code: "eds::bad-date",
    severity: Severity::Note,
    holds: "Dates are mm-dd-yyyy and times hh:mmAM or hh:mmPM.",
    explain: "CiA 306-1 (6.3) has one form for dates and one for times. Others are kept as they are.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let Some(section) = context.facts.section(SectionKind::FileInfo) else { return };
    let keys =
        [("CreationDate", true), ("ModificationDate", true), ("CreationTime", false), ("ModificationTime", false)];
    for (key, date) in keys {
        let Some(pair) = section.get(key).filter(|pair| !pair.value.is_empty()) else { continue };
        let (good, form) =
            if date { (is_date(pair.value), "mm-dd-yyyy") } else { (is_time(pair.value), "hh:mmAM or hh:mmPM") };
        if !good {
            let span = context.facts.syntax.value_span(pair);
            out.push(
                RULE.finding(format!("`{key}` is not in the form of CiA 306")).at(span, format!("expected {form}")),
            );
        }
    }
}

fn is_date(text: &str) -> bool {
    let parts: Vec<&str> = text.split('-').collect();
    let number = |at: usize, digits: usize, max: u16| {
        parts
            .get(at)
            .is_some_and(|part| part.len() == digits && part.parse().is_ok_and(|n: u16| (1..=max).contains(&n)))
    };
    parts.len() == 3 && number(0, 2, 12) && number(1, 2, 31) && number(2, 4, 9999)
}

fn is_time(text: &str) -> bool {
    let upper = text.to_ascii_uppercase();
    let Some(clock) = upper.strip_suffix("AM").or_else(|| upper.strip_suffix("PM")) else { return false };
    let Some((hours, minutes)) = clock.split_once(':') else { return false };
    let number = |text: &str, max: u8| text.len() == 2 && text.parse().is_ok_and(|n: u8| n <= max);
    number(hours, 12) && number(minutes, 59)
}
