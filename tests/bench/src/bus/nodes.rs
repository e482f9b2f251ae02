//! Eight nodes on one tokio shell: what becomes of the others when one of them falls silent.

use std::time::{Duration, Instant};

use lexican_runtime::NodeId;
use lexican_runtime::host::{BusUrl, tokio};

use super::client::{DEVICE_TYPE, Turn, runtime};
use super::player::{Outcome, Player, ourselves};
use super::wire::Wire;

pub(super) const NODES: u8 = 8;

/// How often both cases are measured, in turn.
const ROUNDS: usize = 5;

/// How long a turn takes: the silent node is waited for more than once.
const TURN: &str = "2";

/// How the nodes are read, and how often in milliseconds.
const PACES: [(&str, &str); 2] = [("as fast as it goes", "0"), ("each every 20 ms", "20")];

/// Round trips per second of each node.
pub(super) struct Rates {
    pub(super) pace: &'static str,
    pub(super) all: Vec<f64>,
    pub(super) one_silent: Vec<f64>,
}

pub(super) fn measure(wire: &Wire) -> Outcome<Vec<Rates>> {
    PACES.into_iter().map(|(pace, every_ms)| measure_at(wire, pace, every_ms)).collect()
}

fn measure_at(wire: &Wire, pace: &'static str, every_ms: &str) -> Outcome<Rates> {
    let mut all = vec![Vec::new(); usize::from(NODES)];
    let mut one_silent = all.clone();
    for _ in 0..ROUNDS {
        for (alive, rates) in [(NODES, &mut all), (NODES - 1, &mut one_silent)] {
            let mut devices = Player::start(ourselves(&["device", &wire.near, "1", &alive.to_string()])?)?;
            devices.line()?;
            let mut client = Player::start(ourselves(&["nodes", &wire.far, TURN, every_ms])?)?;
            client.line()?;
            for (rates, rate) in rates.iter_mut().zip(client.line()?.split(' ')) {
                rates.push(rate.parse::<f64>()?);
            }
            eprint!(".");
        }
    }
    let middle = |mut rates: Vec<f64>| {
        rates.sort_by(f64::total_cmp);
        rates[rates.len() / 2]
    };
    Ok(Rates {
        pace,
        all: all.into_iter().map(middle).collect(),
        one_silent: one_silent.into_iter().map(middle).collect(),
    })
}

/// Reads from all nodes at once, and prints the rate of each.
pub(super) fn run(url: &str, seconds: &str, every_ms: &str) -> Outcome<()> {
    let link = url.parse::<BusUrl>()?.open()?;
    let (seconds, every) = (seconds.parse::<f64>()?, Duration::from_millis(every_ms.parse()?));
    let (runtime, tasks) = (runtime()?, ::tokio::task::LocalSet::new());
    tasks.block_on(&runtime, async {
        let network = tokio::Network::spawn(link)?;
        let _turn = Turn::begin();
        let end = now() + Duration::from_secs_f64(seconds);
        let read = |node| ::tokio::task::spawn_local(read_until(network.clone(), node, end, every));
        let nodes: Vec<_> = (1..=NODES).map(read).collect();
        let mut rates = Vec::new();
        for node in nodes {
            rates.push(format!("{:.1}", f64::from(node.await?) / seconds));
        }
        println!("{}", rates.join(" "));
        Ok(())
    })
}

/// Reads one node's 1000h until `end`, every so often; a node that is silent is asked again and again.
async fn read_until(network: tokio::Network, node: u8, end: Instant, every: Duration) -> u32 {
    let Ok(node) = NodeId::try_from(node) else { return 0 };
    // A client that reads as fast as it goes never waits for this.
    let mut ticks = ::tokio::time::interval(every.max(Duration::from_nanos(1)));
    ticks.set_missed_tick_behavior(::tokio::time::MissedTickBehavior::Skip);
    let mut answers = 0;
    while now() < end {
        if !every.is_zero() {
            ticks.tick().await;
        }
        if network.read(node, DEVICE_TYPE).await.is_ok() {
            answers += 1;
        }
    }
    answers
}

#[expect(clippy::disallowed_methods, reason = "taking the time is what a benchmark is for")]
fn now() -> Instant {
    Instant::now()
}
