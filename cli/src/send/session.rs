//! Runs a sending and listening state machine until it is done, its time is up, or Ctrl-C.

use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::ProgressBar;
use lexican_runtime::host::{Link, LinkError, Pump, StateMachine, Turn};
use lexican_runtime::{Duration, Frame, Instant, NodeId};
use serde_json::{Value as Json, json};

use super::schedule::Schedule;
use super::ticker::Ticker;
use crate::bus::{BoxedLink, Bus};
use crate::output::{Failure, Outcome, ctrl_c, missing_frames, plural, progress, stdout, warn};
use lexican_toolbox::data_sheet::DataSheet;

/// The interval of checking for Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

/// How long a frame may take to leave the transmit buffers.
const LEAVING: Duration = Duration::from_millis(20);

pub(super) struct Session {
    pub(super) link: BoxedLink,
    /// The nodes that the URL of the bus describes.
    pub(super) nodes: Vec<(NodeId, DataSheet)>,
    pub(super) began: Instant,
    pump: Pump,
    interrupted: std::sync::Arc<AtomicBool>,
    bar: ProgressBar,
    json: bool,
    /// The number of frames that the bus did not accept.
    lost: u64,
}

impl Session {
    /// Opens the bus of a schedule.
    pub(super) fn of(schedule: &Schedule) -> Result<Self, Failure> {
        Session::new(schedule.open()?, schedule.json)
    }

    pub(super) fn new(bus: Bus, json: bool) -> Result<Self, Failure> {
        let Bus { link, nodes, .. } = bus;
        let (began, interrupted) = (link.now(), ctrl_c()?);
        let bar = progress("{spinner} {msg}", 0);
        Ok(Session { link, nodes, began, pump: Pump::new(), interrupted, bar, json, lost: 0 })
    }

    /// Runs a state machine. After each turn, `look` returns the time until which to run, and the progress.
    pub(super) fn run<M: StateMachine>(
        &mut self,
        machine: &mut M,
        mut look: impl FnMut(&M, Instant) -> (Option<Instant>, String),
        mut event: impl FnMut(&mut Self, &mut M, M::Event) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        while !self.interrupted.load(Ordering::Relaxed) {
            let now = self.link.now();
            let (end, message) = look(machine, now);
            if end.is_some_and(|end| now >= end) {
                break;
            }
            self.show(now, message);
            let until = end.map_or(now + LOOK, |end| end.min(now + LOOK));
            match self.pump.turn(&mut self.link, machine, until) {
                Ok(Turn::Event(it)) => event(self, machine, it)?,
                Ok(Turn::Bus(state)) => warn(format_args!("the bus is {state}")),
                Ok(Turn::Gap(frames)) => warn(missing_frames(frames)),
                Ok(Turn::Idle | Turn::Over) => {}
                Err(LinkError::Ended) => break,
                Err(error) if error.is_final() => return Err(error.into()),
                Err(error) => self.refused(error)?,
            }
        }
        self.bar.finish_and_clear();
        Ok(())
    }

    /// Counts a frame that the bus did not accept; reports the first one.
    fn refused(&mut self, error: LinkError) -> Result<(), Failure> {
        self.lost += 1;
        if matches!(error, LinkError::ReadOnly) {
            return Err(error.into());
        }
        if self.lost == 1 {
            warn(format_args!("a frame was not sent: {error}"));
        }
        Ok(())
    }

    fn show(&self, now: Instant, message: String) {
        if now.since(self.began) >= Duration::from_secs(1) {
            self.bar.set_message(message);
            self.bar.tick();
        }
    }

    /// Seconds since the beginning.
    pub(super) fn elapsed(&self) -> f64 {
        self.link.now().since(self.began).as_secs_f64()
    }

    /// Prints an event as JSON fields, or as a line with its time.
    pub(super) fn print(&self, event: &str, mut fields: Json, text: &str) -> Result<(), Failure> {
        let mut stdout = stdout();
        if self.json {
            fields["event"] = json!(event);
            fields["time"] = json!(self.elapsed());
            fields["text"] = json!(text);
            writeln!(stdout, "{fields}")?;
        } else {
            writeln!(stdout, "{:>12.6}  {text}", self.elapsed())?;
        }
        Ok(stdout.flush()?)
    }

    /// `Found` if the bus did not accept some frames.
    pub(super) fn outcome(&self) -> Outcome {
        if self.lost == 0 { Outcome::Clean } else { Outcome::Found }
    }

    /// Sends frames by a schedule, and listens for `listen` after the last one.
    pub(super) fn tick<F: FnMut(u64, Duration) -> Vec<Frame>>(
        &mut self,
        schedule: &Schedule,
        listen: Duration,
        make: F,
        mut heard: impl FnMut(&mut Self, Frame) -> Result<(), Failure>,
    ) -> Result<Outcome, Failure> {
        let mut ticker = Ticker::new(self.began, schedule.every, schedule.count, make);
        let end = schedule.span.map(|span| self.began + span);
        let mut over = None;
        self.run(
            &mut ticker,
            |ticker, now| {
                let over = ticker.is_over().then(|| *over.get_or_insert(now + listen.max(LEAVING)));
                (over.into_iter().chain(end).min(), format!("{} sent", plural(ticker.sent as usize, "frame")))
            },
            |session, _, frame| heard(session, frame),
        )?;
        self.sum_up(&ticker, schedule.every.is_some())?;
        Ok(self.outcome())
    }

    fn sum_up<F>(&self, ticker: &Ticker<F>, is_periodic: bool) -> Result<(), Failure> {
        let sent = ticker.sent.saturating_sub(self.lost);
        let frames = plural(sent as usize, "frame");
        let text = match is_periodic {
            true => {
                let (elapsed, late) = (self.elapsed(), ticker.latest.as_secs_f64() * 1000.0);
                format!("{frames} sent in {elapsed:.3} s, at most {late:.3} ms late")
            }
            false => format!("{frames} sent"),
        };
        let skipped = if ticker.skipped > 0 { format!(", {} left out", ticker.skipped) } else { String::new() };
        let lost = if self.lost > 0 { format!(", {} not taken by the bus", self.lost) } else { String::new() };
        let fields = json!({
            "sent": sent,
            "lost": self.lost,
            "skipped": ticker.skipped,
            "latest_ms": ticker.latest.as_secs_f64() * 1000.0,
        });
        self.print("summary", fields, &format!("{text}{skipped}{lost}"))
    }
}
