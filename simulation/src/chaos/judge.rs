//! Judges what a program has left behind, and what it claims.

use lexican_runtime::object::Address;
use lexican_runtime::{Duration, NodeId};

use super::plan::{Disturbance, Plan};
use super::rig::{Rig, WINDOW};
use super::seen::{End, Finding, Level, Reference, Scene};

/// What is known of a trial once it is over, to be judged.
pub(super) struct Left<'a> {
    pub(super) plan: Plan,
    pub(super) reference: &'a Reference,
    pub(super) before: &'a Scene,
    pub(super) after: &'a Scene,
    pub(super) end: &'a End,
    pub(super) by_itself: bool,
    pub(super) was_cut_off: bool,
    /// The nodes whose SDO transfers were open when the program ended.
    pub(super) open: &'a [NodeId],
    pub(super) was_disturbed: bool,
    /// By how much this computer polled too late, at most.
    pub(super) late: Duration,
}

impl Left<'_> {
    /// Whether the program ended by itself with the exit code of the undisturbed run, and so claims success.
    pub(super) fn claims_success(&self) -> bool {
        self.by_itself && self.reference.by_itself && self.end.code == self.reference.end.code
    }

    /// Whether the program could clean up: it ended by itself or because the plan told it to, and it had bus and
    /// supply.
    fn could_tidy_up(&self) -> bool {
        self.by_itself && !self.was_cut_off && !matches!(self.plan.disturbance, Disturbance::CutPower(_))
    }

    /// The effects of an undisturbed run that this run does not have: positions reached and entries changed.
    fn undone(&self, rig: &Rig<'_>) -> Vec<String> {
        let mut undone = Vec::new();
        for at in &self.reference.positioning {
            let [Some(from), Some(to)] =
                [&self.reference.before, &self.reference.after].map(|scene| scene.positions.get(at))
            else {
                continue;
            };
            let (Some(is), Some(axis)) = (self.after.positions.get(at), rig.axes.get(at)) else { continue };
            // Tolerance: a hundredth of the travel, and 2 for rounding.
            if (is - to).abs() > ((to - from) / 100.0).abs() + 2.0 {
                undone.push(format!("{} stands at {is:.0} and not at {to:.0}", axis.who));
            }
        }
        let changed = self.reference.after.objects.iter().filter(|(key, value)| {
            self.reference.before.objects.get(*key) != Some(*value) && self.after.objects.get(*key) != Some(*value)
        });
        let changed: Vec<String> = changed.map(|((_, address), _)| address.to_string()).collect();
        if !changed.is_empty() {
            undone.push(format!("not as after an undisturbed run: {}", listed(&changed)));
        }
        undone
    }

    /// Communication entries whose values are neither those before this run nor those after an undisturbed one.
    fn strange(&self) -> Vec<String> {
        let communication = Address::new(0x1000, 0)..=Address::new(0x1FFF, 0xFF);
        let neither = |key: &(usize, Address), value: &Vec<u8>| {
            let of = |scene: &Scene| scene.objects.get(key) == Some(value);
            !of(self.before) && !of(&self.reference.after)
        };
        let entries = self.after.objects.iter().filter(|(key, _)| communication.contains(&key.1));
        entries
            .filter(|(key, value)| neither(key, value))
            .map(|((_, address), value)| in_words(*address, value))
            .collect()
    }
}

/// An entry with its value in hexadecimal digits, or that its PDO is off or maps nothing.
fn in_words(address: Address, value: &[u8]) -> String {
    match (address.index(), address.sub(), value) {
        (0x1400..=0x15FF | 0x1800..=0x19FF, 1, [.., top]) if top & 0x80 != 0 => {
            format!("the PDO of {:04X}h is off", address.index())
        }
        (0x1600..=0x17FF | 0x1A00..=0x1BFF, 0, [0]) => format!("{:04X}h maps nothing", address.index()),
        _ => {
            let digits: String = value.iter().rev().take(8).map(|byte| format!("{byte:02X}")).collect();
            format!("{address} = {digits}h")
        }
    }
}

/// The first six of `all`, and how many more there are.
fn listed(all: &[String]) -> String {
    const MOST: usize = 6;
    let more = all.len().saturating_sub(MOST);
    let first = all.iter().take(MOST).cloned().collect::<Vec<_>>().join(", ");
    if more > 0 { format!("{first} and {more} more") } else { first }
}

/// Judges a trial. Observations that are no findings are added to `notes`.
pub(super) fn judge(left: &Left<'_>, rig: &Rig<'_>, notes: &mut Vec<String>) -> Vec<Finding> {
    let mut found = Vec::new();
    let mut find = |level, what: String| found.push(Finding { level, what });
    let asked = left.was_disturbed && left.plan.disturbance.is_asked();
    let undone = left.undone(rig);
    if !undone.is_empty() {
        let level = if asked { Level::Should } else { Level::Must };
        let printed = !left.end.last_line.is_empty() && left.end.last_line == left.reference.end.last_line;
        if left.claims_success() {
            let code = left.end.code.unwrap_or_default();
            find(level, format!("it claims success by exit code {code}: {}", undone.join("; ")));
        } else if printed && left.reference.by_itself {
            find(level, format!("it prints {:?}: {}", left.end.last_line, undone.join("; ")));
        } else {
            notes.extend(undone);
        }
    }
    let transfers = left.open.iter().map(|node| format!("an SDO transfer of node {node} is open"));
    let left_behind: Vec<String> = left.strange().into_iter().chain(transfers).collect();
    if !left_behind.is_empty() {
        let what = format!("left half done: {}", listed(&left_behind));
        if left.could_tidy_up() { find(Level::Should, what) } else { notes.push(what) }
    }
    if left.was_disturbed && matches!(left.plan.disturbance, Disturbance::Freeze(_)) {
        for (at, axis) in &rig.axes {
            let usual = left.reference.peaks.get(at).copied().unwrap_or_default();
            // Tolerate rounding, and frames that bunch because one of the two programs was late.
            let bunched = left.late.as_secs_f64() / WINDOW.as_secs_f64();
            if axis.peak > usual * (1.25 + bunched) + 1.0 {
                let peak = axis.peak;
                find(
                    Level::Must,
                    format!("{} jerks when it is continued: {peak:.0}/s, {usual:.0}/s undisturbed", axis.who),
                );
            }
        }
    }
    found
}

/// Judges a file that the program writes. `before` is its content before the run, `whole` that after an undisturbed
/// run. `None` if `now` is one of these; after a claim of success it must be `whole`.
#[must_use]
pub fn judge_file(
    name: &str,
    before: Option<&[u8]>,
    whole: Option<&[u8]>,
    now: Option<&[u8]>,
    claims_success: bool,
) -> Option<Finding> {
    // All digits count as equal, because times in the file differ from run to run.
    let shape = |content: Option<&[u8]>| {
        content
            .map(|bytes| bytes.iter().map(|byte| if byte.is_ascii_digit() { b'0' } else { *byte }).collect::<Vec<u8>>())
    };
    let (is, whole) = (shape(now), shape(whole));
    let what = if is == whole {
        return None;
    } else if now == before {
        claims_success.then(|| format!("it claims success, and {name} is as before"))?
    } else {
        match (&is, &whole) {
            (None, _) => format!("{name} is gone"),
            (Some(is), Some(whole)) if whole.starts_with(is) => {
                format!("{name} is half written: {} of {} bytes", is.len(), whole.len())
            }
            _ => format!("{name} is neither as before nor as after an undisturbed run"),
        }
    };
    Some(Finding { level: Level::Must, what })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_as_before_or_whole() {
        let check = |before: Option<&str>, now: Option<&str>, claims, words: Option<&str>| {
            let [before, now] = [before, now].map(|text| text.map(str::as_bytes));
            let found = judge_file("a.txt", before, Some(b"at 12:30\nvalue\n"), now, claims);
            assert_eq!(found.map(|finding| finding.what).as_deref(), words);
        };
        check(None, None, false, None);
        check(None, None, true, Some("it claims success, and a.txt is as before"));
        check(None, Some("at 14:01\nvalue\n"), true, None);
        check(None, Some("at 14:01\nva"), false, Some("a.txt is half written: 11 of 15 bytes"));
        check(Some("old"), Some(""), false, Some("a.txt is half written: 0 of 15 bytes"));
        check(Some("old"), None, false, Some("a.txt is gone"));
        check(Some("old"), Some("old"), false, None);
        check(Some("old"), Some("else"), false, Some("a.txt is neither as before nor as after an undisturbed run"));
    }

    #[test]
    fn what_is_off_is_said_so() {
        assert_eq!(in_words(Address::new(0x1801, 1), &[0x85, 2, 0, 0xC0]), "the PDO of 1801h is off");
        assert_eq!(in_words(Address::new(0x1A00, 0), &[0]), "1A00h maps nothing");
        assert_eq!(in_words(Address::new(0x100C, 0), &[0xFA, 0]), "100C:00 = 00FAh");
    }
}
