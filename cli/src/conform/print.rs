//! The output of the conformance test.

use std::io::Write as _;

use anstyle::{AnsiColor, Style};
use indicatif::ProgressBar;
use lexican_conform::{
    Case, CaseReport, Differences, Ended, Hazard, Level, Motion, Observer, Report, Settings, Sheet, Verdict,
};
use lexican_eds::model::Device;
use lexican_runtime::NodeId;
use serde_json::json;

use crate::output::{Failure, plural, progress, stdout, styled};
use lexican_toolbox::decode::Decoder;

pub(super) fn list(cases: &[&Case]) -> Result<(), Failure> {
    let mut stdout = stdout();
    for case in cases {
        let needs: Vec<_> = case.needs.iter().map(|hazard| hazard.name()).collect();
        let needs = if needs.is_empty() { String::new() } else { format!(" (--allow {})", needs.join(",")) };
        let should = if case.level == Level::Should { " (recommended)" } else { "" };
        writeln!(stdout, "{:<20} {:<6} {}{should}{needs}", case.id, case.plan, case.title)?;
    }
    Ok(())
}

/// The name of a device.
pub(super) fn name(device: &Device) -> &str {
    device.info.product_name.as_deref().unwrap_or("a device without name")
}

/// Prints what is about to happen to the device.
pub(super) fn plan(cases: &[&Case], sheet: &Sheet, settings: &Settings) -> Result<(), Failure> {
    let mut stdout = stdout();
    let device = name(&sheet.device);
    let node = settings.node;
    writeln!(
        stdout,
        "{} for {device} at node {node}: it is reset before each, and what is written is put back",
        plural(cases.len(), "case")
    )?;
    if !sheet.is_unfit && !sheet.findings.lines.is_empty() {
        let warnings = plural(sheet.findings.lines.len(), "warning");
        writeln!(stdout, "  the data sheet has {warnings}: {}", sheet.findings.command())?;
    }
    for hazard in Hazard::ALL {
        let allowed = settings.allow.contains(&hazard);
        let asked = cases.iter().filter(|case| case.needs.contains(&hazard)).count();
        let objects = sheet.device.objects.iter().filter(|object| {
            Hazard::of_write(&sheet.device, object.index) == Some(hazard)
                && object.entries.iter().any(|entry| entry.access.writable())
        });
        let objects = objects.count();
        if asked == 0 && objects == 0 {
            continue;
        }
        let answer = if allowed { styled(AnsiColor::Yellow.on_default(), "allowed") } else { "not allowed".to_owned() };
        let extent: Vec<_> = [(objects, "object"), (asked, "case")]
            .into_iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, what)| plural(count, what))
            .collect();
        let extent = extent.join(", ");
        writeln!(stdout, "  {:<14} {answer}: {} ({extent})", hazard.name(), hazard.what())?;
    }
    let moving =
        cases.iter().filter(|case| case.profile() == Some(402) && case.needs.contains(&Hazard::Motion)).count();
    if moving > 0 && sheet.device.profile == Some(402) {
        motion(moving, settings.motion(sheet))?;
    }
    Ok(())
}

/// Prints how a drive is about to move.
fn motion(cases: usize, Motion { travel, velocity }: Motion) -> Result<(), Failure> {
    let mut stdout = stdout();
    let title = styled(AnsiColor::Yellow.on_default().bold(), "With --allow motion THE DRIVE MOVES");
    writeln!(stdout, "{title} in {cases} cases, again and again, in both directions:")?;
    writeln!(stdout, "  travels of up to {travel} from where it stands (6064h; --travel)")?;
    writeln!(
        stdout,
        "  at a velocity of {velocity} (6081h, 60FFh; --velocity); in profile velocity mode it turns, for some seconds"
    )?;
    writeln!(stdout, "  with ramps of its own, and between {velocity} and {} (6083h, 6084h, 6085h)", 20 * velocity)?;
    writeln!(stdout, "  it is stopped in every way that it has, also by faults, and enabled again")?;
    writeln!(stdout, "  after each case, and with Ctrl-C, it is disabled, and has to stand before the test goes on")?;
    Ok(())
}

/// The screen during the test: a progress bar, and failures as they occur.
pub(super) struct Screen<'a> {
    bar: ProgressBar,
    node: NodeId,
    device: &'a Device,
    json: bool,
}

impl<'a> Screen<'a> {
    pub(super) fn new(node: NodeId, device: &'a Device, json: bool) -> Self {
        Screen { bar: progress("{msg} {wide_bar} {pos}/{len}", 0), node, device, json }
    }

    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }

    fn show(&self, report: &CaseReport) -> std::io::Result<()> {
        let mut stdout = stdout();
        if self.json {
            return writeln!(stdout, "{}", report.json());
        }
        let verdict = styled(style(report), report.verdict());
        let reason = report.outcome.as_ref().err().map(Verdict::reason).unwrap_or_default();
        writeln!(stdout, "{verdict} {} {}: {reason}", report.case.id, report.case.title)?;
        let mut decoder = Decoder::new();
        decoder.introduce(self.node, self.device);
        let lines = report.lines(|frame| decoder.decode(frame).words());
        lines.iter().try_for_each(|line| writeln!(stdout, "    {line}"))
    }
}

impl Observer for Screen<'_> {
    fn begins(&mut self, number: usize, total: usize, case: &Case) {
        self.bar.set_length(total as u64);
        self.bar.set_position(number as u64 - 1);
        self.bar.set_message(format!("{} {}", case.id, case.title));
    }

    fn ended(&mut self, report: &CaseReport) {
        let is_seen =
            matches!(report.outcome, Err(Verdict::Failed(_) | Verdict::Blocked(..) | Verdict::NotDecidable(_)));
        if self.json || is_seen || !report.notes.is_empty() {
            // Ignore an error: the test goes on even if nobody reads the output.
            self.bar.suspend(|| drop(self.show(report)));
        }
    }
}

pub(crate) fn style(report: &CaseReport) -> Style {
    match report.verdict() {
        "passed" => AnsiColor::Green.on_default(),
        "failed" | "unfinished" => AnsiColor::Red.on_default().bold(),
        "advised" | "blocked" | "not decidable" => AnsiColor::Yellow.on_default(),
        _ => Style::new(),
    }
}

/// Prints the result of the test; the last line sums it up.
pub(crate) fn sum(report: &Report, as_json: bool) -> Result<(), Failure> {
    if as_json {
        writeln!(stdout(), "{}", report.json())?;
        return Ok(());
    }
    let says_all = report.cases.is_empty() || matches!(report.ended_early, Some(Ended::Unfit(_)));
    if says_all && report.ended_early.is_some() {
        return Ok(());
    }
    let mut stdout = stdout();
    report.root_causes().iter().try_for_each(|text| writeln!(stdout, "root cause: {text}"))?;
    report.not_put_back.iter().chain(&report.findings).try_for_each(|text| writeln!(stdout, "{text}"))?;
    if let Some(why) = &report.ended_early {
        writeln!(stdout, "the test ended early: {why}")?;
    }
    writeln!(stdout, "{}", last_line(report))?;
    Ok(())
}

/// Prints the differences from an earlier test.
pub(super) fn differences(differences: &Differences, as_json: bool) -> Result<(), Failure> {
    let mut stdout = stdout();
    if as_json {
        writeln!(stdout, "{}", json!({ "event": "against", "differences": differences }))?;
    } else {
        writeln!(stdout, "{differences}")?;
    }
    Ok(())
}

fn last_line(report: &Report) -> String {
    let tally = report.tally();
    let counts = [
        (tally.passed, "passed"),
        (tally.failed, "failed"),
        (tally.blocked, "blocked"),
        (tally.advised, "failed of what is recommended"),
        (tally.known, "failed as known"),
        (tally.not_applicable, "do not apply"),
        (tally.not_allowed, "not allowed"),
        (tally.not_decidable, "not decidable"),
        (tally.unfinished, "not finished"),
    ];
    let counts = counts.into_iter().filter(|(count, _)| *count > 0);
    let counts: Vec<_> = counts.map(|(count, what)| format!("{count} {what}")).collect();
    let left = match report.not_put_back.len() {
        0 => String::new(),
        1 => "; 1 entry NOT PUT BACK".to_owned(),
        left => format!("; {left} entries NOT PUT BACK"),
    };
    format!("{}: {}{left}", plural(report.cases.len(), "case"), counts.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_line_says_that_something_was_not_put_back() {
        let report = Report { not_put_back: vec![String::new(); 2], ..Report::default() };
        assert_eq!(last_line(&report), "0 cases: ; 2 entries NOT PUT BACK");
    }
}
