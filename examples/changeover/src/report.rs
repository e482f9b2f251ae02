//! The report of a change-over, as text, Markdown or JSON.

use std::fmt::Write as _;

use clap::ValueEnum;
use lexican_runtime::Instant;
use serde::Serialize;

use crate::axis::Axis;
use crate::recipe::Unit;
use crate::run::Run;
use crate::stop::Reason;

/// How to print a report.
#[derive(Clone, Copy, Default, ValueEnum)]
pub(crate) enum Format {
    #[default]
    Text,
    Json,
    Markdown,
}

/// The result of a change-over, or the plan for one.
#[derive(Serialize)]
pub(crate) struct Report {
    pub(crate) recipe: String,
    /// One sentence.
    pub(crate) summary: String,
    done: bool,
    /// `null` if nothing was stopped.
    pub(crate) stop: Option<Stop>,
    pub(crate) drives: Vec<Row>,
}

/// How all drives were stopped. Times are in seconds since the release.
#[derive(Serialize)]
pub(crate) struct Stop {
    pub(crate) because: String,
    /// When the reason was noticed; `null` before the release.
    pub(crate) at_s: Option<f64>,
    /// The time after which every other drive had been sent its stop.
    ordered_within_s: f64,
    /// The time after which every drive was at a standstill.
    stood_within_s: f64,
}

/// One drive.
#[derive(Serialize)]
pub(crate) struct Row {
    pub(crate) name: String,
    node: u8,
    kind: String,
    pub(crate) unit: Unit,
    from: f64,
    pub(crate) to: f64,
    low: Option<f64>,
    high: Option<f64>,
    /// The last position.
    reached: Option<f64>,
    /// From the release to the end of its motion, in seconds.
    time_s: Option<f64>,
    /// What starts its motion.
    start: &'static str,
    outcome: &'static str,
    /// A fault in the words of the manual, or errors.
    why: Vec<String>,
    /// Seconds since the release, and positions.
    #[serde(skip)]
    pub(crate) course: Vec<(f64, f64)>,
}

impl Report {
    /// The report of a finished run, or of a run that was only checked.
    pub(crate) fn of(run: &Run<'_>) -> Report {
        let axes = &run.axes;
        let is_plan = axes.iter().all(|axis| axis.end.is_none());
        let reached = axes.iter().filter(|axis| axis.end.as_ref().is_some_and(|end| end.outcome == "reached")).count();
        let by_sync = axes.iter().filter(|axis| axis.by_sync).count();
        let released = run.released.unwrap_or(Instant::ZERO);
        let stop = run.reason().map(|reason| Stop::of(axes, &reason, run.released));
        let starts = match by_sync {
            0 => "they start one after the other".to_owned(),
            all if all == axes.len() => "SYNC starts all of them".to_owned(),
            some => format!("SYNC starts {some} of them, the others start one after the other"),
        };
        let summary = match &stop {
            _ if is_plan => format!("the recipe fits the machine; {starts}"),
            Some(Stop { because, .. }) => format!("{reached} of {} drives are in position; {because}", axes.len()),
            None => format!("{reached} of {} drives are in position; {starts}", axes.len()),
        };
        let done = is_plan || reached == axes.len();
        let drives = axes.iter().map(|axis| Row::of(axis, released)).collect();
        Report { recipe: run.recipe.name.clone(), summary, done, stop, drives }
    }

    /// Whether every drive has reached its position, or nothing was to be moved.
    pub(crate) fn is_done(&self) -> bool {
        self.done
    }

    pub(crate) fn print(&self, format: Format) -> String {
        match format {
            Format::Json => serde_json::to_string_pretty(self).expect("all keys are text") + "\n",
            Format::Text => self.table(&format!("{}: {}", self.recipe, self.summary), ["", "  ", ""]),
            Format::Markdown => self.table(&format!("# {}\n\n{}.", self.recipe, self.summary), ["| ", " | ", " |"]),
        }
    }

    /// The head, and a table with `edges` before, between and after the cells of a row.
    fn table(&self, head: &str, edges: [&str; 3]) -> String {
        const HEAD: [&str; 10] =
            ["drive", "node", "kind", "from", "to", "limits", "reached", "time", "start", "outcome"];
        let rows = [HEAD.map(str::to_owned)].into_iter().chain(self.drives.iter().map(Row::cells));
        let mut rows: Vec<Vec<String>> = rows.map(Vec::from).collect();
        // Leave out times in a plan, and limits in a report.
        for column in (0..HEAD.len()).rev() {
            if rows.iter().skip(1).all(|row| row[column].is_empty()) {
                rows.iter_mut().for_each(|row| drop(row.remove(column)));
            }
        }
        let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or_default();
        let widths: Vec<usize> = (0..rows[0].len()).map(width).collect();
        if edges[0].starts_with('|') {
            rows.insert(1, widths.iter().map(|width| "-".repeat(*width)).collect());
        }
        let mut text = format!("{head}\n\n");
        for row in &rows {
            let cells: Vec<String> = row.iter().zip(&widths).map(|(cell, &width)| format!("{cell:width$}")).collect();
            let line = format!("{}{}{}", edges[0], cells.join(edges[1]), edges[2]);
            let _ = writeln!(text, "{}", line.trim_end());
        }
        if let Some(stop) = &self.stop {
            let Stop { because, at_s, ordered_within_s, stood_within_s } = stop;
            let [ordered, stood] = [ordered_within_s, stood_within_s].map(|seconds| seconds * 1e3);
            let _ = match at_s {
                Some(at_s) => writeln!(
                    text,
                    "\n{because}, noticed {at_s:.2} s after the release: all drives that moved were ordered to stop \
                     within {ordered:.0} ms, and stood within {stood:.0} ms."
                ),
                None => writeln!(text, "\n{because}, noticed before the release: nothing has moved."),
            };
        }
        text
    }
}

impl Stop {
    fn of(axes: &[Axis], reason: &Reason, released: Option<Instant>) -> Stop {
        let halted = || axes.iter().filter_map(|axis| axis.halted);
        let (because, at) = match reason {
            Reason::Signal => ("the operator has stopped it".to_owned(), halted().min().unwrap_or(Instant::ZERO)),
            Reason::Drive { name, outcome, why, at } => (format!("{name}: {outcome}: {why}"), *at),
        };
        let ended = axes.iter().filter(|axis| axis.halted.is_some()).filter_map(|axis| axis.end.as_ref());
        let stood = ended.map(|end| end.at).max().unwrap_or(at);
        Stop {
            because,
            at_s: released.map(|released| at.since(released).as_secs_f64()),
            ordered_within_s: halted().max().unwrap_or(at).since(at).as_secs_f64(),
            stood_within_s: stood.since(at).as_secs_f64(),
        }
    }
}

impl Row {
    fn of(axis: &Axis, released: Instant) -> Row {
        let entry = &axis.entry;
        Row {
            name: entry.name.clone(),
            node: axis.drive.node().id().get(),
            kind: axis.drive.node().stated().sheet_name.clone().unwrap_or_default(),
            unit: entry.position.unit(),
            from: axis.value(axis.from),
            to: axis.value(axis.to),
            low: axis.limits.map(|(low, _)| axis.value(low)),
            high: axis.limits.map(|(_, high)| axis.value(high)),
            reached: axis.course.last().map(|(_, position)| axis.value(*position)),
            time_s: axis.end.as_ref().map(|end| end.at.since(released).as_secs_f64()),
            start: if axis.by_sync { "SYNC" } else { "by itself" },
            outcome: axis.end.as_ref().map_or("planned", |end| end.outcome),
            why: axis.end.as_ref().map(|end| end.why.clone()).unwrap_or_default(),
            course: axis
                .course
                .iter()
                .map(|(at, place)| (at.since(released).as_secs_f64(), axis.value(*place)))
                .collect(),
        }
    }

    fn cells(&self) -> [String; 10] {
        let show = |value: f64| self.unit.show(value);
        let outcome = [&[self.outcome.to_owned()], &self.why[..]].concat().join(": ");
        let is_planned = self.outcome == "planned";
        let limits = self.low.zip(self.high).filter(|_| is_planned);
        [
            self.name.clone(),
            self.node.to_string(),
            self.kind.clone(),
            show(self.from),
            show(self.to),
            limits.map(|(low, high)| format!("{} to {}", show(low), show(high))).unwrap_or_default(),
            self.reached.map(show).unwrap_or_default(),
            self.time_s.map(|time| format!("{time:.2} s")).unwrap_or_default(),
            self.start.to_owned(),
            if is_planned { String::new() } else { outcome },
        ]
    }
}
