//! The drive monitors its manager: the driver arms life guarding, and sends the guarding requests.

use std::sync::{Arc, Mutex};

use lexican_runtime::host::{Link, VirtualBus};
use lexican_runtime::{CobId, Duration, Instant};
use siko_ag03_1::Direction;
use siko_ag03_1::driver::{Drive, Error, Protection, Supervision};
use siko_ag03_1::od;
use siko_ag03_1::sim::MODEL;
use siko_ag03_1::sim::SimulatedDrive;
use siko_ag03_1::state::State;

use super::rig::NODE;

const WITHIN: Supervision = Supervision::within(Duration::from_secs(1));

fn bus() -> (VirtualBus, Arc<Mutex<SimulatedDrive>>) {
    let bus = VirtualBus::with_bit_rate(500);
    let simulated = Arc::new(Mutex::new(SimulatedDrive::new(&MODEL, NODE)));
    bus.attach(Arc::clone(&simulated));
    (bus, simulated)
}

#[test]
fn life_guarding_is_armed_and_kept_going() {
    let (bus, simulated) = bus();
    let mut drive = Drive::connect_protected(bus.link(), NODE, WITHIN).unwrap();
    let guard_time = Duration::from_millis(250);
    assert_eq!(drive.protection(), Protection::LifeGuarding { guard_time, life_time_factor: 4 });
    assert_eq!(
        (drive.read(od::GUARD_TIME).unwrap(), drive.read(od::LIFE_TIME_FACTOR).unwrap()),
        (od::Interval(250), 4)
    );
    let requests: Arc<Mutex<Vec<Instant>>> = Arc::default();
    let seen = Arc::clone(&requests);
    bus.observe(move |now, frame| {
        if frame.id() == CobId::of_node(0x700, NODE) && frame.is_remote() {
            seen.lock().unwrap().push(now);
        }
    });
    drive.enable().unwrap();
    drive.inch(Direction::Positive).unwrap();
    drive.pass(Duration::from_secs(10)).unwrap();
    assert_eq!(drive.state().unwrap(), State::OperationEnabled);
    let requests = requests.lock().unwrap().clone();
    assert!(requests.windows(2).all(|pair| pair[1].since(pair[0]) < Duration::from_millis(300)), "{requests:?}");
    assert!(requests.len() >= 39, "{}", requests.len());
    drop(drive);
    // The drive gets no further guarding requests.
    bus.advance(Duration::from_secs(2));
    assert_eq!(simulated.lock().unwrap().state(), State::SwitchOnDisabled);
}

#[test]
fn a_drive_that_is_released_is_not_protected_any_more() {
    let (bus, simulated) = bus();
    let mut drive = Drive::connect_protected(bus.link(), NODE, WITHIN).unwrap();
    drive.enable().unwrap();
    drive.start_moving_to(5000).unwrap();
    let link = drive.release();
    bus.advance(Duration::from_secs(60));
    assert_eq!(simulated.lock().unwrap().position(link.now()), 5000);
}

/// Settings of another tool are restored; those left by a killed program of this driver are not.
#[test]
fn a_drive_that_is_disarmed_holds_what_it_held_before() {
    for (before, after) in [((500, 3), (500, 3)), ((0, 2), (0, 2)), ((250, 4), (0, 4)), ((0, 0), (0, 0))] {
        let (bus, _) = bus();
        let held =
            |drive: &mut Drive<_>| (drive.read(od::GUARD_TIME).unwrap().0, drive.read(od::LIFE_TIME_FACTOR).unwrap());
        let mut drive = Drive::connect_unprotected(bus.link(), NODE).unwrap();
        drive.write(od::GUARD_TIME, od::Interval(before.0)).unwrap();
        drive.write(od::LIFE_TIME_FACTOR, before.1).unwrap();
        drop(drive);
        let mut drive = Drive::connect_protected(bus.link(), NODE, WITHIN).unwrap();
        assert_eq!(held(&mut drive), (250, 4));
        drop(drive);
        let mut drive = Drive::connect_unprotected(bus.link(), NODE).unwrap();
        assert_eq!(held(&mut drive), after, "{before:?}");
        drive.pass(Duration::from_secs(3)).unwrap();
        assert_eq!(drive.state().unwrap(), State::SwitchOnDisabled);
    }
}

#[test]
fn a_drive_that_has_restarted_is_protected_again() {
    let (bus, simulated) = bus();
    let mut drive = Drive::connect_protected(bus.link(), NODE, WITHIN).unwrap();
    simulated.lock().unwrap().power_cycle(bus.now());
    assert!(matches!(drive.pass(Duration::from_secs(1)), Err(Error::Restarted)));
    assert_eq!(drive.protection(), Protection::None);
    drive.enable().unwrap();
    assert!(matches!(drive.protection(), Protection::LifeGuarding { .. }));
    assert_eq!(drive.read(od::GUARD_TIME).unwrap(), od::Interval(250));
}

#[test]
fn heartbeats_exclude_life_guarding() {
    let (bus, _) = bus();
    let mut drive = Drive::connect_unprotected(bus.link(), NODE).unwrap();
    drive.write(od::PRODUCER_HEARTBEAT_TIME, od::Interval(100)).unwrap();
    let link = drive.release();
    let error = Drive::connect_protected(link, NODE, WITHIN).unwrap_err();
    assert!(matches!(error, Error::HeartbeatExcludesGuarding { heartbeat_ms: 100 }), "{error}");
}

#[test]
fn times_that_cannot_be_set_are_refused() {
    for within in [Duration::ZERO, Duration::from_millis(3), Duration::from_secs(66)] {
        let (bus, _) = bus();
        let connected = Drive::connect_protected(bus.link(), NODE, Supervision::within(within));
        assert!(matches!(connected, Err(Error::OutOfRange(_))), "{within}");
    }
}

#[test]
fn what_an_unprotected_drive_does_is_said() {
    let (bus, _) = bus();
    let drive = Drive::connect_unprotected(bus.link(), NODE).unwrap();
    assert_eq!(drive.protection().to_string(), "none: the drive goes on with its last order if this program dies");
}
