//! `lexican plot`: curves of values, on the terminal and as files.

use std::path::{Path, PathBuf};

use lexican_pictures as pictures;
use lexican_runtime::{Duration, Instant};
use lexican_toolbox::trace::series::{Recording, Series, number};
use lexican_toolbox::values::report::ValueReport;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style, Stylize};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType};

use super::{Follower, SignalArgs};
use crate::output::{Failure, ForceArgs, Outcome, note};
use crate::screen::Screen;
use lexican_toolbox::text::duration::period;

/// Plot values of a node over time
///
/// On a terminal the curves are drawn while they come, those with the same unit in one diagram, until q is pressed. --svg and
/// --csv write all of them to files at the end. The objects are read by SDO; what PDOs carry is taken as it comes.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct PlotArgs {
    #[command(flatten)]
    signals: SignalArgs,

    /// Write a picture
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,

    /// Write a table: a row for each value
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,

    #[command(flatten)]
    force: ForceArgs,

    /// How long the span of time is that the terminal shows
    #[arg(long, value_name = "TIME", default_value = "30s", value_parser = period)]
    window: Duration,
}

const EXAMPLES: &str = "\
Examples:
    lexican plot --bus can0 --node 5 \"position actual value\" \"velocity actual value\"
    lexican plot --bus can0 --node 5 --passive tpdo3 --for 10s --svg travel.svg --csv travel.csv
    lexican plot --bus log:travel.log --node 5 --device siko/ag03-1 tpdo3 --svg travel.svg";

pub(crate) fn plot(args: &PlotArgs) -> Result<Outcome, Failure> {
    let is_screen = Screen::is_possible();
    if !is_screen && args.svg.is_none() && args.csv.is_none() {
        return Err(Failure::new("there is no terminal to plot on").help("name a file with --svg FILE or --csv FILE"));
    }
    for path in args.svg.iter().chain(&args.csv) {
        args.force.guard(path, args.signals.network.files())?;
    }
    let rows = args.csv.as_ref().map(|_| csv::Writer::from_writer(Vec::new()));
    let mut plot =
        Plot { recording: Recording::default(), began: None, rows, window: args.window.as_secs_f64(), trouble: None };
    if let Some(rows) = &mut plot.rows {
        rows.write_record(["time_s", "entry", "name", "value", "unit", "text"]).map_err(csv_failure)?;
    }
    args.signals.follow(is_screen, &mut plot)?;
    if plot.recording.units().is_empty() {
        return Err(Failure::new("no value has come that can be plotted")
            .help("does the node answer, and are the objects numbers? `lexican watch` shows values of any type"));
    }
    if let Some(path) = &args.svg {
        write_svg(args.force, path, &plot.recording)?;
    }
    if let (Some(path), Some(rows)) = (&args.csv, plot.rows) {
        let bytes = rows.into_inner().map_err(|error| csv_failure(error.into_error().into()))?;
        args.force.write(path, &bytes)?;
        note(format_args!("{} is written", path.display()));
    }
    Ok(Outcome::Clean)
}

fn write_svg(force: ForceArgs, path: &Path, recording: &Recording) -> Result<(), Failure> {
    let names: Vec<_> = recording.series().iter().map(|series| series.name.as_str()).collect();
    let svg = pictures::svg(&[recording.picture(names.join(", "))]);
    force.write(path, svg.as_bytes())?;
    note(format_args!("{} is written", path.display()));
    Ok(())
}

fn csv_failure(error: csv::Error) -> Failure {
    Failure::new(format_args!("cannot write the table: {error}"))
}

struct Plot {
    recording: Recording,
    began: Option<Instant>,
    rows: Option<csv::Writer<Vec<u8>>>,
    window: f64,
    trouble: Option<String>,
}

const COLORS: [Color; 6] = [Color::Cyan, Color::Yellow, Color::Green, Color::Magenta, Color::Red, Color::Blue];

impl Plot {
    fn render(&self, frame: &mut Frame<'_>) {
        let units = self.recording.units();
        let mut rows = vec![Constraint::Fill(1); units.len()];
        rows.push(Constraint::Length(1));
        let areas = Layout::vertical(rows).split(frame.area());
        for (unit, area) in units.iter().zip(areas.iter()) {
            self.render_unit(*unit, *area, frame);
        }
        let hint = match &self.trouble {
            Some(trouble) => Line::from(trouble.clone()).red(),
            None if units.is_empty() => Line::from("waiting for values; q to leave"),
            None => Line::from("q to leave").add_modifier(Modifier::DIM),
        };
        frame.render_widget(hint, areas[units.len()]);
    }

    fn render_unit(&self, unit: Option<&str>, area: Rect, frame: &mut Frame<'_>) {
        let end = self.recording.seconds().max(1e-3);
        let begin = (end - self.window).max(0.0);
        let curves: Vec<_> = self.recording.of_unit(unit).map(|series| (series, within(series, begin))).collect();
        let values = curves.iter().flat_map(|(_, points)| *points).map(|point| point.1);
        let bounds = pictures::range(values);
        let datasets = curves.iter().zip(COLORS.iter().cycle()).map(|((_, points), color)| {
            Dataset::default().marker(Marker::Braille).graph_type(GraphType::Line).style(*color).data(points)
        });
        let names = curves.iter().zip(COLORS.iter().cycle()).flat_map(|((series, _), color)| {
            let text = format!(" {} = {} ", series.name, series.text);
            [Span::styled(text, Style::from(*color))]
        });
        let axis = |low: f64, high: f64, decimals: usize| {
            let labels = [low, f64::midpoint(low, high), high].map(|number| format!("{number:.decimals$}"));
            Axis::default().bounds([low, high]).labels(labels).style(Modifier::DIM)
        };
        let decimals = (2.5 - (bounds.end - bounds.start).log10()).clamp(0.0, 12.0) as usize;
        let chart = Chart::new(datasets.collect())
            .block(Block::bordered().title_top(Line::from_iter(names)))
            .x_axis(axis(begin, end, 1).title("s"))
            .y_axis(axis(bounds.start, bounds.end, decimals).title(unit.unwrap_or_default().to_owned()))
            .legend_position(None);
        frame.render_widget(chart, area);
    }
}

/// The points from `begin` on.
fn within(series: &Series, begin: f64) -> &[(f64, f64)] {
    let first = series.points.partition_point(|(at, _)| *at < begin);
    &series.points[first..]
}

impl Follower for Plot {
    fn value(&mut self, at: Instant, report: &ValueReport) -> Result<(), Failure> {
        self.recording.take(at, report);
        let seconds = at.since(*self.began.get_or_insert(at)).as_secs_f64();
        let Some(rows) = &mut self.rows else { return Ok(()) };
        let value = number(report).map(|number| number.to_string()).unwrap_or_default();
        let unit = report.unit.as_ref().map(|(symbol, _)| symbol.as_str()).unwrap_or_default();
        let name = report.name.as_deref().unwrap_or_default();
        let (time, entry) = (format!("{seconds:.6}"), report.address.to_string());
        rows.write_record([&time, &entry, name, &value, unit, report.text()]).map_err(csv_failure)
    }

    fn draw(&mut self, screen: &mut Screen) -> Result<(), Failure> {
        screen.draw(|frame| self.render(frame))
    }

    fn trouble(&mut self, trouble: Option<&str>) {
        self.trouble = trouble.map(str::to_owned);
    }
}
