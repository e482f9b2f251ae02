//! `lexican watch`: a table of values that is renewed while they change.

use std::io::Write;

use lexican_runtime::Instant;
use lexican_toolbox::trace::series::{Recording, Series};
use lexican_toolbox::values::report::ValueReport;
use ratatui::style::Stylize;
use ratatui::text::Line;
use serde_json::{Value as Json, json};

use super::{Follower, SignalArgs};
use crate::output::{Failure, Outcome, stdout};
use crate::screen::{self, Screen};

/// Watch values of a node change
///
/// On a terminal: a table of the values, their bounds and their changes, until q is pressed. Elsewhere, and with --lines: a
/// line for each change. The objects are read by SDO; what PDOs carry is taken as it comes.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct WatchArgs {
    #[command(flatten)]
    signals: SignalArgs,

    /// Print a line for each change, on a terminal as well
    #[arg(long)]
    lines: bool,

    /// Print a JSON object for each change
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican watch --bus can0 --node 5 statusword \"position actual value\" 241B:01
    lexican watch --bus can0 --node 5 --passive tpdo1
    lexican watch --bus sim:siko/ag03-1?node=5 --for 2s --json 6064";

pub(crate) fn watch(args: &WatchArgs) -> Result<Outcome, Failure> {
    let is_screen = !args.lines && !args.json;
    let mut table = Table { recording: Recording::default(), began: None, json: args.json, is_screen, trouble: None };
    table.is_screen &= Screen::is_possible();
    args.signals.follow(table.is_screen, &mut table)?;
    if table.is_screen {
        let mut stdout = stdout();
        write!(stdout, "{}", screen::plain(&table.lines()))?;
        stdout.flush()?;
    }
    Ok(Outcome::Clean)
}

struct Table {
    recording: Recording,
    began: Option<Instant>,
    json: bool,
    is_screen: bool,
    trouble: Option<String>,
}

impl Table {
    fn lines(&self) -> Vec<Line<'static>> {
        let series = self.recording.series();
        let width = |text: fn(&Series) -> usize, least| series.iter().map(text).max().unwrap_or(0).max(least);
        let name = width(|series| series.name.chars().count(), 6);
        let value = width(|series| series.text.chars().count(), 12).min(60);
        let head = format!(
            "{:<7}  {:<name$}  {:<value$}  {:>12}  {:>12}  {:>7}  {:>10}",
            "entry", "name", "value", "lowest", "highest", "changes", "last [s]"
        );
        let mut lines = vec![Line::from(head).bold()];
        lines.extend(series.iter().map(|series| {
            let (low, high) = series.bounds;
            let bound = |bound: f64| if bound.is_finite() { compact(bound) } else { String::new() };
            let text = format!(
                "{:<7}  {:<name$}  {:<value$}  {:>12}  {:>12}  {:>7}  {:>10.3}",
                series.address.to_string(),
                series.name,
                series.text,
                bound(low),
                bound(high),
                series.changes,
                series.changed
            );
            Line::from(text)
        }));
        lines.extend(self.trouble.clone().map(|trouble| Line::from(trouble).red()));
        lines
    }
}

/// A number with at most four decimals.
fn compact(number: f64) -> String {
    let text = format!("{number:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

impl Follower for Table {
    fn value(&mut self, at: Instant, report: &ValueReport) -> Result<(), Failure> {
        let is_new = self.recording.take(at, report);
        if !is_new || self.is_screen {
            return Ok(());
        }
        let seconds = at.since(*self.began.get_or_insert(at)).as_secs_f64();
        let mut stdout = stdout();
        if self.json {
            let mut fields = report.json();
            fields.insert("time".to_owned(), json!(seconds));
            writeln!(stdout, "{}", Json::Object(fields))?;
        } else {
            writeln!(stdout, "{seconds:>10.3}  {}", report.equation())?;
        }
        stdout.flush()?;
        Ok(())
    }

    fn draw(&mut self, screen: &mut Screen) -> Result<(), Failure> {
        screen.draw(|frame| screen::render(self.lines(), frame))
    }

    fn trouble(&mut self, trouble: Option<&str>) {
        self.trouble = trouble.map(str::to_owned);
    }
}
