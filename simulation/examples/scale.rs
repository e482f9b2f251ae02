//! How fast plants of 127 simulated devices with a SYNC every millisecond run, in multiples of real time: one of them, and two
//! side by side on one core and on two. That all have the same frames each time.
//!
//! `cargo run --release -p lexican-simulation --example scale [SECONDS]`, or `cargo xtask bench scale`, which keeps the figures.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::num::NonZero;
use std::sync::Arc;
use std::time::Instant;

use lexican_runtime::host::{Link, LinkError, MainError, VirtualBus};
use lexican_runtime::wire::nmt::{NmtCommand, NmtMessage};
use lexican_runtime::wire::sync::Sync;
use lexican_runtime::{CobId, Duration, NodeId};
use lexican_simulation::{Plant, PlantDevice, side_by_side};
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::log::Record;

const SENSOR: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../cli/tests/sensor.eds");

/// How many plants, on how many threads.
const RUNS: [(usize, usize); 3] = [(1, 1), (2, 1), (2, 2)];

/// How often each is run, all in turn; the best counts, since other work of the machine only makes it longer.
const ROUNDS: usize = 3;

fn main() -> Result<(), MainError> {
    let seconds = std::env::args().nth(1).map_or(Ok(10), |text| text.parse())?;
    println!(
        "| 127 devices, SYNC 1 ms | plants | threads | times real time | processor time for a second of a plant |"
    );
    println!("| --- | --- | --- | --- | --- |");
    for (what, sheet) in [("AG03/1", "siko/ag03-1"), ("sensors of a data sheet", SENSOR)] {
        let sheet = Arc::new(DataSheet::load(sheet, &[])?);
        let device = |node| PlantDevice::new(NodeId::new(node), what, Arc::clone(&sheet));
        let plant = Plant { bit_rate_kbit: 1000, devices: (1..=127).map(device).collect(), faults: Vec::new() };
        let mut best = [(0.0, f64::INFINITY); RUNS.len()];
        let mut logs = [const { None }; 3];
        for _ in 0..ROUNDS {
            for ((plants, threads), (factor, processor)) in RUNS.into_iter().zip(&mut best) {
                let (again, spent, log) = run(&vec![&plant; plants], threads, seconds)?;
                (*factor, *processor) = (again.max(*factor), spent.min(*processor));
                if *logs[plants].get_or_insert(log) != log {
                    return Err(format!("127 {what} did not send the same frames again").into());
                }
            }
        }
        for ((plants, threads), (factor, processor)) in RUNS.into_iter().zip(best) {
            println!("| {what} | {plants} | {threads} | {factor:.1} | {:.1} ms |", processor * 1e3);
        }
    }
    Ok(())
}

/// How many seconds of all plants together go into one, how many seconds of a processor a second of one plant takes, and a digest
/// of all frames and their times.
fn run(plants: &[&Plant], threads: usize, seconds: u32) -> Result<(f64, f64, u64), MainError> {
    let program = |_, bus: &VirtualBus| -> Result<_, LinkError> {
        let mut manager = bus.link();
        manager.listen_to(&[CobId::NMT])?;
        bus.advance(Duration::from_secs(1));
        manager.send(&NmtMessage { command: NmtCommand::Start, node: None }.frame())?;
        bus.advance(Duration::from_secs(1));
        let (began, before) = (clock(), processor_time());
        for _ in 0..seconds * 1000 {
            manager.send(&Sync { counter: None }.frame(CobId::SYNC))?;
            bus.advance(Duration::from_millis(1));
        }
        Ok((began, clock(), processor_time() - before))
    };
    let done = side_by_side(plants.iter().copied(), NonZero::new(threads).ok_or("no thread")?, program)?;
    let mut spans = done.results.into_iter().collect::<Result<Vec<_>, _>>()?;
    spans.sort_by_key(|(began, ..)| *began);
    // The time in which at least one plant ran: the devices of another one may boot between.
    let (mut took, mut spent, mut until) = (0.0, 0.0, spans[0].0);
    for (began, ended, processor) in spans {
        took += ended.saturating_duration_since(began.max(until)).as_secs_f64();
        spent += processor;
        until = until.max(ended);
    }
    let mut digest = DefaultHasher::new();
    for Record { at, interface, frame, .. } in &done.log {
        (at.as_micros(), interface, frame.id().raw(), frame.data()).hash(&mut digest);
    }
    let all = plants.len() as f64 * f64::from(seconds);
    Ok((all / took, spent / all, digest.finish()))
}

fn clock() -> Instant {
    #[expect(clippy::disallowed_methods, reason = "this measures")]
    Instant::now()
}

/// What this thread has used of a processor, in seconds; 0 where the system (not Linux) does not say.
fn processor_time() -> f64 {
    let schedstat = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    schedstat.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()).unwrap_or_default() / 1e9
}
