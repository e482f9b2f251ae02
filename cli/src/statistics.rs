//! `lexican statistics`: load, rates, jitter and errors of a bus.

use std::io::Write;
use std::sync::atomic::Ordering;

use lexican_runtime::host::{LinkError, Listener, Pace, Pump, Turn};
use lexican_runtime::{Duration, Instant};
use lexican_toolbox::bus::statistics::{NodeReport, Report, Spans, Statistics};
use lexican_toolbox::decode::Decoder;
use ratatui::style::{Modifier, Stylize};
use ratatui::text::Line;
use serde_json::json;

use crate::bus::{Bus, BusArgs, kinds};
use crate::output::{Failure, Outcome, ctrl_c, stdout};
use crate::screen::{self, Screen};
use lexican_toolbox::text::duration;

/// Count the frames of a bus: load, rates and jitter by COB-ID, silent nodes, errors, SDO response times
///
/// On a terminal the numbers are renewed while the command runs; the last ones stay. Nothing is sent.
/// Exit code 1 if a node has fallen silent, an EMCY was heard, or frames are missing.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    bus: BusArgs,

    /// The bit rate in kbit/s, from which the load is computed; of an slcan bus it is known
    #[arg(long, value_name = "KBIT", value_parser = clap::value_parser!(u32).range(1..=1000))]
    bit_rate: Option<u32>,

    /// Stop after this time
    #[arg(long = "for", value_name = "TIME", value_parser = duration::time)]
    span: Option<Duration>,

    /// Print JSON objects: one at the end, or one again and again with --every
    #[arg(long)]
    json: bool,

    /// Print the numbers again and again, this far apart, instead of at the end
    #[arg(long, value_name = "TIME", value_parser = duration::period)]
    every: Option<Duration>,
}

const EXAMPLES: &str = "\
Examples:
    lexican statistics --bus can0 --bit-rate 500
    lexican statistics --bus log:bus.log --bit-rate 125 --json | jq '.nodes[] | select(.silent_seconds)'";

/// The interval of drawing.
const DRAWN: Duration = Duration::from_millis(250);

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let pace = if args.span.is_some() { Pace::Virtual } else { Pace::RealTime };
    let Bus { mut link, nodes, .. } = args.bus.open(pace)?;
    let mut decoder = Decoder::new();
    for (node, sheet) in &nodes {
        decoder.introduce(*node, &sheet.device);
    }
    let rate = args.bit_rate.map(|kbit| kbit * 1000).or_else(|| kinds::bit_rate(args.bus.url()));
    let mut statistics = Statistics::new(rate);
    let mut screen = if args.json || args.every.is_some() || !link.is_real_time() { None } else { Screen::take()? };
    let left = if screen.is_some() { None } else { Some(ctrl_c()?) };
    let (mut pump, end) = (Pump::new(), args.span.map(|span| link.now() + span));
    let period = if screen.is_some() { Some(DRAWN) } else { args.every };
    let mut shown = period.map(|period| link.now() + period);
    // Leaving must work even if frames never end, and some links cannot wait without a limit.
    const LOOK: Duration = Duration::from_millis(100);
    loop {
        let until = [end, shown].into_iter().flatten().fold(link.now() + LOOK, Instant::min);
        match pump.turn(&mut *link, &mut Listener, until) {
            Ok(Turn::Event(frame)) => {
                let decoded = decoder.decode(&frame);
                statistics.observe(link.now(), &frame, &decoded);
            }
            Ok(Turn::Bus(state)) => statistics.change_state(link.now(), state),
            Ok(Turn::Gap(frames)) => statistics.miss(frames),
            Ok(Turn::Idle | Turn::Over) => {}
            Err(LinkError::Ended) => break,
            Err(error) => return Err(error.into()),
        }
        let now = link.now();
        if end.is_some_and(|end| now >= end) || left.as_ref().is_some_and(|left| left.load(Ordering::Relaxed)) {
            break;
        }
        if let (Some(period), Some(due)) = (period, shown.filter(|due| now >= *due)) {
            shown = Some((due + period).max(now));
            let report = statistics.report(now);
            let Some(screen) = &mut screen else {
                print(args.json, &report)?;
                continue;
            };
            if screen.is_left()? {
                break;
            }
            screen.draw(|frame| screen::render(lines(&report), frame))?;
        }
    }
    drop(screen);
    let report = statistics.report(link.now());
    if args.every.is_none() || args.json {
        print(args.json, &report)?;
    }
    Ok(outcome(&report))
}

fn outcome(report: &Report) -> Outcome {
    let is_alarming = |node: &NodeReport| node.silent_seconds.is_some() || node.emergencies > 0;
    let found = report.missing_frames > 0 || report.nodes.iter().any(is_alarming);
    if found { Outcome::Found } else { Outcome::Clean }
}

fn print(as_json: bool, report: &Report) -> Result<(), Failure> {
    let mut stdout = stdout();
    if as_json {
        writeln!(stdout, "{}", json!(report))?;
    } else {
        write!(stdout, "{}", screen::plain(&lines(report)))?;
    }
    stdout.flush()?;
    Ok(())
}

/// The statistics as a table of the bus, its nodes and its COB-IDs.
fn lines(report: &Report) -> Vec<Line<'static>> {
    let mut lines = vec![Line::from(summary(report))];
    if let (Some(mean), Some(peak)) = (report.load_percent, report.load_percent_peak) {
        let last = report.load_percent_last_second.unwrap_or(mean);
        lines.push(Line::from(format!("load {mean:.1} %, in the last second {last:.1} %, at most {peak:.1} %")));
    } else if report.load_percent.is_none() {
        lines.push(Line::from("load unknown: name the bit rate with --bit-rate KBIT").add_modifier(Modifier::DIM));
    }
    if report.missing_frames > 0 {
        let text = format!("{} frames are missing: they came faster than they were read", report.missing_frames);
        lines.push(Line::from(text).red());
    }
    let states = report.states.iter();
    lines.extend(states.map(|(at, state)| Line::from(format!("the bus was {state} after {at:.3} s")).red()));
    if !report.nodes.is_empty() {
        let head = format!(
            "{:>4}  {:<15}  {:>21}  {:>21}  {:>7}  {:>6}  {:>5}",
            "node", "state", "heartbeat [ms]", "SDO response [ms]", "aborts", "boots", "EMCYs"
        );
        lines.extend([Line::default(), Line::from(head).bold()]);
        lines.extend(report.nodes.iter().map(node));
    }
    if !report.ids.is_empty() {
        let head = format!(
            "{:>8}  {:<14}  {:>4}  {:>9}  {:>9}  {:>9}  {:>9}  {:>9}  {:>9}",
            "COB-ID", "frame", "node", "frames", "per s", "gap [ms]", "shortest", "longest", "jitter"
        );
        lines.extend([Line::default(), Line::from(head).bold()]);
    }
    for id in &report.ids {
        let gaps = id.gaps.map(|it| [it.mean_ms, it.shortest_ms, it.longest_ms, it.deviation_ms]);
        let gaps = gaps.map(|it| it.map(|ms| format!("  {ms:>9.2}")).concat()).unwrap_or_default();
        let node = id.node.map(|node| node.to_string()).unwrap_or_default();
        let rate = id.frames_per_second;
        lines
            .push(Line::from(format!("{:>8}  {:<14}  {node:>4}  {:>9}  {rate:>9.1}{gaps}", id.id, id.name, id.frames)));
    }
    lines
}

fn summary(report: &Report) -> String {
    let (seconds, frames) = (report.seconds, report.frames);
    let (mean, last) = (report.frames_per_second, report.frames_last_second);
    format!("{frames} frames in {seconds:.1} s: {mean:.1} per second, {last} in the last one")
}

fn node(node: &NodeReport) -> Line<'static> {
    let spread = |spans: Option<Spans>| {
        spans.map(|it| format!("{:.2} ({:.2} to {:.2})", it.mean_ms, it.shortest_ms, it.longest_ms)).unwrap_or_default()
    };
    let text = format!(
        "{:>4}  {:<15}  {:>21}  {:>21}  {:>7}  {:>6}  {:>5}",
        node.node,
        node.state.as_deref().unwrap_or("unknown"),
        spread(node.heartbeat),
        spread(node.sdo_response),
        node.sdo_aborts,
        node.boot_ups,
        node.emergencies,
    );
    let silent = node.silent_seconds.map(|seconds| format!("silent for {seconds:.1} s"));
    let remarks: Vec<_> = silent.into_iter().chain(node.last_emergency.clone()).collect();
    if remarks.is_empty() { Line::from(text) } else { Line::from(format!("{text}  {}", remarks.join("; "))).red() }
}
