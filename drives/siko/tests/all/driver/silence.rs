//! A drive that falls silent, or into FAULT, while it moves: every call of the driver then reports it.

use lexican_runtime::host::{BusState, Fate};
use lexican_runtime::{CobId, Duration};
use siko_ag03_1::driver::{Error, Mode};
use siko_ag03_1::fault::{self, Cause};
use siko_ag03_1::sim::inputs;
use siko_ag03_1::state::State;

use super::rig::{NODE, Rig};

const SECOND: Duration = Duration::from_secs(1);

/// A drive during a travel.
fn travelling() -> Rig {
    let mut rig = Rig::enabled();
    rig.drive.start_moving_to(100_000).unwrap();
    rig.pass_ms(1000);
    rig
}

#[track_caller]
fn check_may_move<T: std::fmt::Debug>(result: Result<T, Error>) {
    let error = result.expect_err("no node answers");
    assert!(error.to_string().ends_with("; the drive at node 5 may still be moving"), "{error}");
    assert!(matches!(error.into_cause(), Error::Sdo(_) | Error::Link(_) | Error::NotStopped { .. }));
}

#[test]
fn passing_time_notices_a_dead_link() {
    let mut rig = travelling();
    rig.bus.set_state(BusState::Off);
    check_may_move(rig.drive.pass(SECOND));
    check_may_move(rig.drive.stop());
}

#[test]
fn passing_time_notices_a_drive_without_power() {
    let mut rig = travelling();
    rig.world(|inputs| inputs.control_supply_100mv = 0);
    check_may_move(rig.drive.pass(SECOND));
    check_may_move(rig.drive.finish());
    check_may_move(rig.drive.stop());
}

#[test]
fn passing_time_notices_a_fault() {
    let mut rig = travelling();
    rig.world(|inputs| inputs.sensor_fails = true);
    let fault = Cause::from(fault::SENSOR);
    assert!(matches!(rig.drive.pass(SECOND), Err(Error::Fault(cause)) if cause == fault));
    // The travel was ordered, but nothing moves.
    rig.drive.pass(SECOND).unwrap();
}

#[test]
fn passing_time_notices_silence_soon() {
    let mut rig = travelling();
    rig.world(|inputs| inputs.bus = inputs::BusState::Off);
    let before = rig.bus.now();
    check_may_move(rig.drive.pass(Duration::from_secs(3600)));
    assert!(rig.bus.now().since(before) < Duration::from_secs(3));
}

/// A drive at standstill need not send anything.
#[test]
fn a_drive_that_stands_may_be_silent() {
    let mut rig = Rig::enabled();
    rig.world(|inputs| inputs.control_supply_100mv = 0);
    rig.drive.pass(SECOND).unwrap();
}

/// In velocity mode a drive goes on while it is error passive.
#[test]
fn a_drive_that_could_not_be_stopped_is_stopped_once_it_is_back() {
    let mut rig = Rig::running();
    rig.drive.run_at(60).unwrap();
    rig.world(|inputs| inputs.bus = inputs::BusState::Passive);
    check_may_move(rig.drive.stop());
    assert_eq!(rig.velocity(), 60);
    rig.world(|inputs| inputs.bus = inputs::BusState::Active);
    rig.drive.pass(Duration::from_millis(100)).unwrap();
    assert_eq!((rig.velocity(), rig.drive.state().unwrap()), (0, State::OperationEnabled));
    // The drive has stopped, as if it had been reached at once.
    rig.drive.set_mode(Mode::Positioning).unwrap();
}

#[test]
fn a_travel_that_could_not_be_interrupted_is_interrupted_once_the_drive_is_back() {
    let mut rig = travelling();
    let mut lost = false;
    rig.bus.set_fate(move |_, frame| {
        lost |= frame.id() == CobId::of_node(0x200, NODE);
        if lost { Fate::Lose } else { Fate::Deliver }
    });
    check_may_move(rig.drive.interrupt());
    rig.bus.set_fate(|_, _| Fate::Deliver);
    rig.drive.pass(Duration::from_millis(100)).unwrap();
    assert_eq!(rig.velocity(), 0);
    rig.drive.resume().unwrap();
    rig.pass_ms(1000);
    assert_ne!(rig.velocity(), 0);
}

/// A lock poisoned by a panicked shell does not prevent the stop.
#[test]
fn a_panic_in_the_middle_of_an_operation_stops_the_drive() {
    let Rig { bus, simulated, mut drive } = Rig::enabled();
    let moved = std::panic::catch_unwind(std::panic::AssertUnwindSafe(move || {
        drive.move_to_watched(5000, |progress| assert!(progress.position < 500, "far enough"))
    }));
    assert!(moved.is_err());
    bus.advance(SECOND);
    assert_eq!(simulated.lock().unwrap().velocity(bus.now()), 0);
    assert!(simulated.lock().unwrap().position(bus.now()) < 1000);
}
