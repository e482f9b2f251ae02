//! `lexican conform --trace`: sends the frames of a file to a device.

use std::io::Write as _;
use std::path::Path;

use lexican_conform::{Ended, Settings, Sheet, Trace, TraceReport, run_trace};
use lexican_runtime::host::Link;
use serde_json::json;

use crate::output::{Failure, Outcome, ctrl_c, plural, stdout};

pub(super) fn run(
    path: &Path,
    link: &mut dyn Link,
    sheet: &Sheet,
    settings: &Settings,
    as_json: bool,
) -> Result<TraceReport, Failure> {
    let text = std::fs::read_to_string(path).map_err(|error| Failure::file("read", path, &error))?;
    let trace = Trace::parse(&path.display().to_string(), &text).map_err(Failure::new)?;
    let report = run_trace(link, sheet, settings, &trace, &*ctrl_c()?);
    let mut stdout = stdout();
    for chapter in &report.chapters {
        if as_json {
            writeln!(stdout, "{}", chapter.json())?;
            continue;
        }
        let name = if chapter.chapter.is_empty() { path.display().to_string() } else { chapter.chapter.clone() };
        writeln!(stdout, "{name}: {}", chapter.verdict())?;
        for step in &chapter.steps {
            let way = if step.is_sent { ">" } else { "<" };
            let seen = step.seen.map_or_else(|| "-".to_owned(), |frame| frame.to_string());
            let right = if step.outcome.is_ok() { "ok" } else { "FAILED" };
            let (seconds, line, printed) = (step.at.as_secs_f64(), step.line, &step.printed);
            writeln!(stdout, "    {seconds:9.3} line {line}: {way} {printed:<21} {seen:<21} {right} {}", step.meaning)?;
        }
    }
    let (passed, failed, left_out) = report.tally();
    if as_json {
        let ended = report.ended_early.as_ref().map(ToString::to_string);
        let sum = json!({ "event": "summary", "passed": passed, "failed": failed, "left_out": left_out, "ended_early": ended });
        writeln!(stdout, "{sum}")?;
    } else {
        let chapters = plural(report.chapters.len(), "chapter");
        writeln!(stdout, "{chapters}: {passed} passed, {failed} failed, {left_out} left out")?;
    }
    Ok(report)
}

pub(super) fn outcome(report: &TraceReport, is_worse: bool) -> Result<Outcome, Failure> {
    let (passed, failed, _) = report.tally();
    match &report.ended_early {
        Some(end @ (Ended::BusLost(_) | Ended::Moving(_) | Ended::Unfit(_))) => Err(Failure::new(end)),
        None if failed == 0 && passed > 0 && !is_worse => Ok(Outcome::Clean),
        _ => Ok(Outcome::Found),
    }
}
