//! `lexican watch` and `lexican plot`: follow values of a node over time.

mod plot;
mod watch;

use std::sync::atomic::Ordering;

use lexican_eds::model::Device;
use lexican_runtime::host::{LinkError, Pace, Pump, Turn};
use lexican_runtime::{Duration, Instant, NodeId};
use lexican_toolbox::trace::sampler::{Sampled, Sampler, Signal};
use lexican_toolbox::values::report::ValueReport;

use crate::bus::{Connected, NODE, NetworkArgs, node_id};
use crate::output::{Failure, ctrl_c, missing_frames, warn};
use crate::screen::Screen;
use lexican_toolbox::text::duration::{milliseconds, time};

pub(crate) use plot::{PlotArgs, plot};
pub(crate) use watch::{WatchArgs, watch};

/// The arguments that say which values are followed.
#[derive(clap::Args, Debug)]
struct SignalArgs {
    #[command(flatten)]
    network: NetworkArgs,

    #[arg(long, value_name = "NODE", value_parser = node_id, help = NODE)]
    node: Option<NodeId>,

    /// How often the objects are read; a node that is slower is read without a pause
    #[arg(long, value_name = "TIME", default_value = "100ms", value_parser = milliseconds)]
    every: Duration,

    /// Send nothing: take only what PDOs and the transfers of others carry
    #[arg(long)]
    passive: bool,

    /// Stop after this time
    #[arg(long = "for", value_name = "TIME", value_parser = time)]
    span: Option<Duration>,

    /// The objects, by address or name, and PDOs: 6064, 2410:05, "Position Actual Value", tpdo1
    #[arg(required = true, value_name = "OBJECT|PDO")]
    signals: Vec<String>,
}

/// Handles followed values.
trait Follower {
    /// Takes a value.
    fn value(&mut self, at: Instant, report: &ValueReport) -> Result<(), Failure>;
    /// Draws the values on the screen.
    fn draw(&mut self, screen: &mut Screen) -> Result<(), Failure>;
    /// An object cannot be read, or with `None`, all can be read again.
    fn trouble(&mut self, trouble: Option<&str>);
}

/// The interval of drawing.
const DRAWN: Duration = Duration::from_millis(100);

/// The interval of checking the screen and Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

impl SignalArgs {
    /// Follows the values until the end of the span or the log, or until a key is pressed on the screen.
    fn follow(&self, wants_screen: bool, follower: &mut impl Follower) -> Result<(), Failure> {
        let pace = if self.span.is_some() { Pace::Virtual } else { Pace::RealTime };
        let Connected { mut network, id, device } = self.network.connect_at(pace, self.node)?;
        network.listen_to_all()?;
        let mut link = network.into_link();
        let device: Option<&Device> = device.as_ref();
        let signals = self.signals.iter().map(|text| Signal::parse(device, text));
        let signals = signals.collect::<Result<Vec<_>, _>>()?;
        let every = (!self.passive && !self.network.is_log()).then_some(self.every);
        let mut screen = if wants_screen && link.is_real_time() { Screen::take()? } else { None };
        let interrupted = if screen.is_some() { None } else { Some(ctrl_c()?) };
        let mut sampler = Sampler::new(link.now(), id, device, signals, every).with_latency(link.latency());
        let (mut pump, end) = (Pump::new(), self.span.map(|span| link.now() + span));
        let mut drawn = link.now();
        loop {
            let until = end.map_or(link.now() + LOOK, |end| end.min(link.now() + LOOK));
            match pump.turn(&mut *link, &mut sampler, until) {
                Ok(Turn::Event(Sampled::Values(reports))) => {
                    follower.trouble(None);
                    reports.iter().try_for_each(|report| follower.value(link.now(), report))?;
                }
                Ok(Turn::Event(Sampled::Failed(error))) => {
                    let text = error.to_string();
                    follower.trouble(Some(&text));
                    if screen.is_none() {
                        warn(&text);
                    }
                }
                Ok(Turn::Gap(frames)) if screen.is_none() => warn(missing_frames(frames)),
                Ok(Turn::Bus(state)) => follower.trouble(Some(&format!("the bus is {state}"))),
                Ok(Turn::Gap(_) | Turn::Idle | Turn::Over) => {}
                Err(LinkError::Ended) => return Ok(()),
                Err(error) => return Err(error.into()),
            }
            let now = link.now();
            if end.is_some_and(|end| now >= end) || interrupted.as_ref().is_some_and(|it| it.load(Ordering::Relaxed)) {
                return Ok(());
            }
            if let Some(screen) = screen.as_mut().filter(|_| now >= drawn) {
                drawn = now + DRAWN;
                if screen.is_left()? {
                    return Ok(());
                }
                follower.draw(screen)?;
            }
        }
    }
}
