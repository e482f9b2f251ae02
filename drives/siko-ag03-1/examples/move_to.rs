//! Table 25 of the manual through the typed driver, against the simulated drive: +5000, then -5000 with an intermediate
//! stop. It runs in virtual time, so it takes no time; exits non-zero when anything differs.
//!
//! `cargo run -p lexican-siko-ag03-1 --example move_to`

use std::sync::{Arc, Mutex};

use lexican_runtime::host::{MainError, VirtualBus};
use lexican_runtime::{Duration, NodeId};
use siko_ag03_1::driver::{Drive, Mode, Outcome};
use siko_ag03_1::od;
use siko_ag03_1::sim::MODEL;
use siko_ag03_1::sim::SimulatedDrive;
use siko_ag03_1::state::State;

const NODE: NodeId = NodeId::literal(5);

fn main() -> Result<(), MainError> {
    let bus = VirtualBus::with_bit_rate(500);
    let simulated = Arc::new(Mutex::new(SimulatedDrive::new(&MODEL, NODE)));
    bus.attach(Arc::clone(&simulated));

    let mut drive = Drive::connect(bus.link(), NODE)?;
    // SIGINT and SIGTERM stop the drive, and end the program with an error.
    let handle = drive.cancel_handle();
    ctrlc::set_handler(move || handle.cancel())?;
    let say = |what: &str| println!("{:>9} s  {what}", bus.now().to_string());
    say("found an AG03/1 at node 5");

    if let Err(refused) = drive.move_to(5000) {
        say(&refused.to_string());
    }
    drive.set_mode(Mode::Positioning)?;
    drive.enable()?;
    say("enabled");

    let mut next_second = bus.now();
    let outcome = drive.move_to_watched(5000, |progress| {
        if progress.at >= next_second {
            println!("{:>9} s    at {:>5}", progress.at.to_string(), progress.position);
            next_second = progress.at + Duration::from_secs(1);
        }
    })?;
    say(&format!("{outcome:?}"));
    check("the first travel", outcome, Outcome::Reached { position: 5000 })?;

    drive.start_moving_to(-5000)?;
    drive.pass(Duration::from_secs(4))?;
    drive.interrupt()?;
    let stop = drive.read(od::POSITION_ACTUAL_VALUE)?;
    say(&format!("stopped at {}", stop.0));
    drive.pass(Duration::from_secs(1))?;
    check("the position after a second's stop", drive.read(od::POSITION_ACTUAL_VALUE)?, stop)?;
    drive.resume()?;
    let outcome = drive.finish()?;
    say(&format!("{outcome:?}"));
    check("the second travel", outcome, Outcome::Reached { position: -5000 })?;

    drive.disable()?;
    say("disabled");
    check("the final state", drive.state()?, State::SwitchOnDisabled)?;
    let position = simulated.lock().map_err(|_| "the simulated drive has panicked")?.position(bus.now());
    check("the position of the simulated drive", position, -5000)
}

fn check<T: PartialEq + std::fmt::Debug>(what: &str, found: T, expected: T) -> Result<(), MainError> {
    if found == expected { Ok(()) } else { Err(format!("{what} is {found:?}, not {expected:?}").into()) }
}
