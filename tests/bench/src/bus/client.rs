//! Our clients, and their figures.

use std::str::FromStr;
use std::time::{Duration, Instant};

use lexican_runtime::NodeId;
use lexican_runtime::host::{AccessError, BusUrl, Link, LinkError, blocking, tokio};
use lexican_runtime::object::{Object, Ro};
use nix::sys::resource::{UsageWho, getrusage};

use super::player::{NODE, Outcome};

pub(super) const DEVICE_TYPE: Object<u32, Ro> = Object::new(0x1000, 0);

/// How long a turn takes.
const TURN: Duration = Duration::from_secs(1);

/// Reads before a turn.
const WARM_UP: u32 = 200;

/// How often the clock is read: it costs a system call where the kernel is a guest.
const STRIDE: u32 = 16;

/// The figures of one turn of a client.
#[derive(Clone, Copy, Debug)]
pub(super) struct Figure {
    pub(super) trips: f64,
    pub(super) elapsed_s: f64,
    /// Processor time of the client, for each frame.
    pub(super) client_us: f64,
    /// The same of the device.
    pub(super) device_us: f64,
}

impl Figure {
    pub(super) fn frames(&self) -> f64 {
        2.0 * self.trips
    }

    pub(super) fn trips_per_s(&self) -> f64 {
        self.trips / self.elapsed_s
    }

    /// The middle one of all turns for the rate, and the sum for the processor time: its ticks are coarse.
    pub(super) fn middle(turns: &[Figure]) -> Figure {
        let mut sorted = turns.to_vec();
        sorted.sort_by(|a, b| a.trips_per_s().total_cmp(&b.trips_per_s()));
        let frames: f64 = turns.iter().map(Figure::frames).sum();
        let spent = |of: fn(&Figure) -> f64| turns.iter().map(|turn| of(turn) * turn.frames()).sum::<f64>() / frames;
        Figure {
            client_us: spent(|turn| turn.client_us),
            device_us: spent(|turn| turn.device_us),
            ..sorted[sorted.len() / 2]
        }
    }
}

/// A client's line: round trips, seconds, seconds of the processor.
impl FromStr for Figure {
    type Err = Box<dyn std::error::Error>;

    fn from_str(line: &str) -> Result<Self, Self::Err> {
        let numbers: Result<Vec<f64>, _> = line.split(' ').map(str::parse).collect();
        match numbers?[..] {
            [trips, elapsed_s, processor_s] => {
                Ok(Figure { trips, elapsed_s, client_us: processor_s * 1e6 / (2.0 * trips), device_us: 0.0 })
            }
            _ => Err(format!("a client says {line:?}").into()),
        }
    }
}

/// How many round trips a turn has; without a limit it lasts a second.
#[derive(Clone, Copy)]
struct Limit(Option<u32>);

impl Limit {
    fn new(trips: &[&str]) -> Outcome<Self> {
        Ok(Limit(trips.first().map(|trips| trips.parse()).transpose()?))
    }
}

pub(super) fn blocking(url: &str, trips: &[&str]) -> Outcome<()> {
    let limit = Limit::new(trips)?;
    let mut network = blocking::Network::new(url.parse::<BusUrl>()?.open()?);
    let node = NodeId::try_from(NODE)?;
    for _ in 0..WARM_UP {
        network.read(node, DEVICE_TYPE)?;
    }
    let turn = Turn::begin();
    let mut trips = 0;
    while turn.goes_on(trips, limit) {
        network.read(node, DEVICE_TYPE)?;
        trips += 1;
    }
    turn.end(trips);
    Ok(())
}

/// From the future that the runtime is started with, which it has to be woken for.
pub(super) fn tokio(url: &str, trips: &[&str]) -> Outcome<()> {
    let limit = Limit::new(trips)?;
    let link = url.parse::<BusUrl>()?.open()?;
    Ok(runtime()?.block_on(read(link, limit))?)
}

/// From a task.
pub(super) fn tokio_task(url: &str, trips: &[&str]) -> Outcome<()> {
    let limit = Limit::new(trips)?;
    let link = url.parse::<BusUrl>()?.open()?;
    Ok(runtime()?.block_on(async { ::tokio::spawn(read(link, limit)).await })??)
}

async fn read(link: Box<dyn Link + Send>, limit: Limit) -> Result<(), AccessError> {
    let network = tokio::Network::spawn(link).map_err(LinkError::Io)?;
    let node = NodeId::literal(NODE);
    for _ in 0..WARM_UP {
        network.read(node, DEVICE_TYPE).await?;
    }
    let turn = Turn::begin();
    let mut trips = 0;
    while turn.goes_on(trips, limit) {
        network.read(node, DEVICE_TYPE).await?;
        trips += 1;
    }
    turn.end(trips);
    Ok(())
}

pub(super) fn runtime() -> std::io::Result<::tokio::runtime::Runtime> {
    ::tokio::runtime::Builder::new_current_thread().enable_all().build()
}

/// The time of a turn.
pub(super) struct Turn {
    started: Instant,
    processor: Duration,
}

impl Turn {
    /// Prints a line, so that the times of all others are taken, too.
    #[expect(clippy::disallowed_methods, reason = "taking the time is what a benchmark is for")]
    pub(super) fn begin() -> Self {
        println!("warm");
        Turn { started: Instant::now(), processor: processor() }
    }

    fn goes_on(&self, trips: u32, limit: Limit) -> bool {
        limit.0.map_or_else(|| !trips.is_multiple_of(STRIDE) || self.started.elapsed() < TURN, |limit| trips < limit)
    }

    fn end(self, trips: u32) {
        let (elapsed, processor) = (self.started.elapsed(), processor().saturating_sub(self.processor));
        println!("{trips} {} {}", elapsed.as_secs_f64(), processor.as_secs_f64());
    }
}

/// The processor time of this process.
fn processor() -> Duration {
    let usage = getrusage(UsageWho::RUSAGE_SELF).expect("a process may ask for its own usage");
    let times = [usage.user_time(), usage.system_time()];
    times.iter().map(|time| Duration::from_micros(1_000_000 * time.tv_sec() as u64 + time.tv_usec() as u64)).sum()
}
