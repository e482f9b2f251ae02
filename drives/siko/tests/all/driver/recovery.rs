//! A drive that loses its power, its bus or its state at any point of an operation is recovered, and does nothing
//! without a new order.

use std::sync::{Arc, Mutex};

use lexican_runtime::host::{BusState, Link, Node, VirtualBus, VirtualLink};
use lexican_runtime::{CobId, Duration, Frame, Instant};
use siko_ag03_1::driver::sequence::{Recovered, Recovery, Setting};
use siko_ag03_1::driver::{Drive, Error, Mode, Outcome, Protection, Supervision};
use siko_ag03_1::fault::{self, Cause};
use siko_ag03_1::od;
use siko_ag03_1::sim::{MODEL, SimulatedDrive};
use siko_ag03_1::state::State;

use super::rig::{NODE, Rig};

const WITHIN: Recovery = Recovery::within(Duration::from_secs(5));

/// How long the power is off.
const OFF: Duration = Duration::from_millis(400);

/// A drive whose power fails after a number of frames on the bus, and comes back later.
struct Supplied {
    drive: SimulatedDrive,
    left: Option<u64>,
    back: Option<Instant>,
}

impl Supplied {
    fn count(&mut self, now: Instant) {
        self.left = match self.left {
            Some(0) => {
                self.drive.switch_off(now);
                self.back = Some(now + OFF);
                None
            }
            left => left.map(|left| left - 1),
        };
    }
}

impl Node for Supplied {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        self.count(now);
        Node::handle_frame(&mut self.drive, now, frame);
    }
    fn handle_timeout(&mut self, now: Instant) {
        if self.back.take_if(|back| *back <= now).is_some() {
            self.drive.switch_on(now);
        }
        if Node::poll_timeout(&self.drive).is_some_and(|due| due <= now) {
            Node::handle_timeout(&mut self.drive, now);
        }
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        let frame = Node::poll_transmit(&mut self.drive, now)?;
        self.count(now);
        Some(frame)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        [self.back, Node::poll_timeout(&self.drive)].into_iter().flatten().min()
    }
}

/// The operation during which the power fails.
type Operate = fn(&mut Drive<VirtualLink>) -> Result<(), Error>;

/// Cuts the power at each frame of an operation. Afterwards the drive stands, is back, stays at rest when it is
/// enabled, and travels when it is ordered to.
/// travels when it is ordered to.
#[track_caller]
fn check_power_cuts(operate: Operate) -> u64 {
    for frames in 0.. {
        let bus = VirtualBus::with_bit_rate(500);
        let drive = SimulatedDrive::new(&MODEL, NODE);
        let supplied = Arc::new(Mutex::new(Supplied { drive, left: None, back: None }));
        bus.attach(Arc::clone(&supplied));
        let position = || supplied.lock().unwrap().drive.position(bus.now());
        let mut drive = Drive::connect_unprotected(bus.link(), NODE).unwrap();
        supplied.lock().unwrap().left = Some(frames);
        let result = operate(&mut drive);
        if supplied.lock().unwrap().left.is_some() {
            return frames;
        }
        let what = format!("after frame {frames}: {result:?}");
        // The shaft coasts to a standstill.
        bus.advance(Duration::from_secs(1));
        let stands_at = position();
        let Recovered { now, .. } = drive.recover(&WITHIN).unwrap_or_else(|error| panic!("{what}: {error}"));
        assert_eq!(
            (now.state.map(|it| it.value), now.position.map(|it| it.value)),
            (Some(State::SwitchOnDisabled), Some(stands_at)),
            "{what}"
        );
        drive.enable().unwrap();
        bus.advance(Duration::from_secs(1));
        assert_eq!(position(), stands_at, "{what}");
        let target = stands_at + 200;
        assert_eq!(drive.move_to(target).unwrap(), Outcome::Reached { position: target }, "{what}");
    }
    unreachable!("the operation ends")
}

#[test]
fn a_power_cut_while_it_is_enabled() {
    assert!(check_power_cuts(Drive::enable) > 10);
}

#[test]
fn a_power_cut_while_it_moves() {
    let move_to: Operate = |drive| {
        drive.enable()?;
        drive.move_to(800).map(drop)
    };
    assert!(check_power_cuts(move_to) > 60);
}

#[test]
fn a_power_cut_while_it_is_calibrated() {
    assert!(check_power_cuts(|drive| drive.calibrate(500)) > 5);
}

#[test]
fn it_is_reached_as_soon_as_its_power_is_back_with_mode_and_parameters_as_before() {
    let mut rig = Rig::running();
    rig.drive.run_at(60).unwrap();
    let was = rig.drive.position().unwrap();
    let now = rig.bus.now();
    rig.simulated.lock().unwrap().switch_off(now);
    let error = rig.drive.pass(Duration::from_secs(1)).unwrap_err();
    assert!(matches!(error.into_cause(), Error::Sdo(_)));
    rig.simulated.lock().unwrap().switch_on(rig.bus.now());
    let setting = Setting { address: od::MOTOR_PARAMETER_SET.a_pos().address(), value: 75 };
    let recovery = Recovery { settings: vec![setting], ..WITHIN };
    let recovered = rig.drive.recover(&recovery).unwrap();
    assert!(recovered.restarted);
    assert_eq!(
        (recovered.before.mode.map(|it| it.value), recovered.now.mode.map(|it| it.value)),
        (Some(2), Some(2)),
        "velocity mode is not kept"
    );
    assert_eq!(recovered.before.position.map(|it| it.value), Some(was));
    assert_eq!(rig.drive.mode().unwrap(), Some(Mode::Velocity));
    assert_eq!(rig.drive.compare_parameters(&[setting]).unwrap(), []);
    rig.pass_ms(1000);
    assert_eq!((rig.velocity(), recovered.referenced, recovered.fault), (0, None, None));
    assert!(!rig.drive.recover(&recovery).unwrap().restarted, "once");
}

/// The cable was unplugged, and the drive has gone on.
#[test]
fn a_drive_that_has_gone_on_is_stopped() {
    let mut rig = Rig::enabled();
    rig.drive.start_moving_to(100_000).unwrap();
    rig.bus.set_state(BusState::Off);
    let lost = rig.drive.finish().unwrap_err();
    assert!(matches!(lost, Error::MayBeMoving { .. }), "{lost}");
    let unreached = rig.drive.recover(&Recovery::within(Duration::from_millis(300))).unwrap_err();
    assert!(matches!(unreached.into_cause(), Error::Link(_)));
    rig.bus.advance(Duration::from_secs(1));
    assert!(rig.velocity() > 0);
    rig.bus.set_state(BusState::Active);
    let recovered = rig.drive.recover(&WITHIN).unwrap();
    assert_eq!((rig.velocity(), recovered.now.state.map(|it| it.value)), (0, Some(State::SwitchOnDisabled)));
    let stands_at = rig.position();
    rig.drive.enable().unwrap();
    rig.pass_ms(1000);
    assert_eq!(rig.position(), stands_at, "the travel is forgotten");
}

#[test]
fn a_fault_is_reset_only_when_that_is_asked_for() {
    let mut rig = Rig::enabled();
    let overheated = Cause::from(fault::OVERTEMPERATURE);
    rig.world(|inputs| inputs.temperature_100mdegc = 950);
    let recovered = rig.drive.recover(&WITHIN).unwrap();
    assert_eq!((recovered.now.state.map(|it| it.value), recovered.fault), (Some(State::Fault), Some(overheated)));
    let reset = Recovery { reset_fault: true, ..WITHIN };
    assert!(matches!(rig.drive.recover(&reset), Err(Error::Fault(cause)) if cause == overheated));
    rig.world(|inputs| inputs.temperature_100mdegc = 400);
    let recovered = rig.drive.recover(&reset).unwrap();
    assert_eq!(
        (recovered.now.state.map(|it| it.value), recovered.fault),
        (Some(State::SwitchOnDisabled), Some(overheated))
    );
}

#[test]
fn a_reset_by_another_manager_is_recovered_from_and_the_drive_is_protected_again() {
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(SimulatedDrive::new(&MODEL, NODE));
    let supervision = Supervision::within(Duration::from_secs(1));
    let mut drive = Drive::connect_protected(bus.link(), NODE, supervision).unwrap();
    drive.enable().unwrap();
    bus.link().send(&Frame::from_array(CobId::NMT, [0x81, NODE.get()])).unwrap();
    bus.advance(Duration::from_millis(500));
    let recovered = drive.recover(&WITHIN).unwrap();
    assert!(recovered.restarted);
    assert!(matches!(drive.protection(), Protection::LifeGuarding { .. }));
    assert_eq!(drive.read(od::GUARD_TIME).unwrap(), od::Interval(250));
}

#[test]
fn a_drive_that_has_no_power_yet_is_waited_for() {
    let bus = VirtualBus::with_bit_rate(500);
    let drive = SimulatedDrive::new(&MODEL, NODE);
    let supplied = Arc::new(Mutex::new(Supplied { drive, left: Some(0), back: None }));
    bus.attach(Arc::clone(&supplied));
    let (mut drive, recovered) = Drive::connect_and_recover(bus.link(), NODE, &WITHIN).unwrap();
    assert_eq!((recovered.before.state, recovered.now.state.map(|it| it.value)), (None, Some(State::SwitchOnDisabled)));
    drive.enable().unwrap();
    let absent = Drive::connect_and_recover(VirtualBus::new().link(), NODE, &WITHIN);
    assert!(matches!(absent, Err(Error::Sdo(_))));
}
