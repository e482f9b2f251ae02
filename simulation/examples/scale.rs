//! How fast a bus of 127 simulated devices with a SYNC every millisecond runs, in multiples of real time, and that the same
//! bus gives the same frames again.
//!
//! `cargo run --release -p lexican-simulation --example scale [SECONDS]`

use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::{Arc, Mutex, PoisonError};

use lexican_runtime::host::{Link, MainError, VirtualBus};
use lexican_runtime::wire::nmt::{NmtCommand, NmtMessage};
use lexican_runtime::wire::sync::Sync;
use lexican_runtime::{CobId, Duration, Instant, NodeId};
use lexican_simulation::SimulatedDevice;
use lexican_toolbox::data_sheet::DataSheet;

const SENSOR: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../cli/tests/sensor.eds");

fn main() -> Result<(), MainError> {
    let seconds = std::env::args().nth(1).map_or(Ok(10), |text| text.parse())?;
    for (what, sheet) in [("AG03/1", "siko/ag03-1"), ("sensors of a data sheet", SENSOR)] {
        let [(first, log), (_, again)] = [run(sheet, seconds)?, run(sheet, seconds)?];
        if log != again {
            return Err(format!("127 {what} did not send the same frames twice").into());
        }
        println!("127 {what}, SYNC 1 ms: {first:.1} times real time on one core");
    }
    Ok(())
}

/// How often `seconds` of the bus go into a second, and a digest of all frames and their times.
fn run(sheet: &str, seconds: u32) -> Result<(f64, u64), MainError> {
    let sheet = DataSheet::load(sheet, &[])?;
    let bus = VirtualBus::with_bit_rate(1000);
    for node in 1..=127 {
        bus.attach(SimulatedDevice::new(Instant::ZERO, &sheet, NodeId::new(node), None)?);
    }
    let log = Arc::new(Mutex::new(DefaultHasher::new()));
    let heard = Arc::clone(&log);
    bus.observe(move |at, frame| {
        let mut log = heard.lock().unwrap_or_else(PoisonError::into_inner);
        (at.as_micros(), frame.id().raw(), frame.data()).hash(&mut *log);
    });
    let mut manager = bus.link();
    manager.listen_to(&[CobId::NMT])?;
    bus.advance(Duration::from_secs(1));
    manager.send(&NmtMessage { command: NmtCommand::Start, node: None }.frame())?;
    bus.advance(Duration::from_secs(1));
    #[expect(clippy::disallowed_methods, reason = "real time is what is measured")]
    let began = std::time::Instant::now();
    for _ in 0..seconds * 1000 {
        manager.send(&Sync { counter: None }.frame(CobId::SYNC))?;
        bus.advance(Duration::from_millis(1));
    }
    let took = began.elapsed().as_secs_f64();
    let digest = log.lock().unwrap_or_else(PoisonError::into_inner).finish();
    Ok((f64::from(seconds) / took, digest))
}
