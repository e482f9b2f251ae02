//! Inching of the simulated drive where velocities and bits show little: slowly, in short steps, and with a shaft
//! turned by hand.

use std::sync::Arc;

use lexican_runtime::host::{Fate, VirtualLink};
use lexican_runtime::{CobId, Duration};
use siko_ag03_1::Direction;
use siko_ag03_1::driver::{Drive, Error, Missing, Outcome};
use siko_ag03_1::od;
use siko_ag03_1::state::State;

use super::rig::{NODE, Rig};

impl Rig {
    /// An enabled drive that inches with this velocity in rev/min and this acceleration in percent.
    fn inching(speed: u8, acceleration: u8) -> Self {
        let mut rig = Rig::new();
        rig.drive.write(od::MOTOR_PARAMETER_SET.v_inch(), od::Speed(speed)).unwrap();
        rig.drive.write(od::MOTOR_PARAMETER_SET.a_inch(), od::Acceleration(acceleration)).unwrap();
        rig.drive.enable().unwrap();
        rig
    }

    fn width(&mut self, increments: i32) {
        self.drive.write(od::DELTA_JOG, od::Position(increments)).unwrap();
    }

    /// The velocity in increments/s, without rounding.
    fn shaft_velocity(&self) -> f64 {
        self.simulated.lock().unwrap().shaft(self.bus.now()).velocity
    }
}

/// Below 2 rev/min the drive reports that it stands, and below 0.5 rev/min its velocity is 0.
#[test]
fn a_slow_step_is_followed_to_its_end() {
    for (speed, acceleration, width) in [(1, 50, 100), (30, 1, 1600), (1, 1, -100), (2, 100, 40)] {
        let mut rig = Rig::inching(speed, acceleration);
        rig.width(width);
        let outcome = rig.drive.step().unwrap();
        assert_eq!(outcome, Outcome::Reached { position: width }, "{speed} rev/min, {acceleration} %");
        assert_eq!(rig.shaft_velocity(), 0.0);
    }
}

#[test]
fn slow_inching_is_seen_to_begin_and_is_under_way_until_it_is_stopped() {
    for (speed, acceleration, offset, pitch) in [(1, 50, 100, 0), (1, 1, 10, 0), (1, 1, 10, 1), (30, 1, 100, 1)] {
        let mut rig = Rig::inching(speed, acceleration);
        rig.drive.write(od::INCHING_2_OFFSET, od::SpeedShare(offset)).unwrap();
        rig.drive.write(od::SPINDLE_PITCH, od::SpindlePitch(pitch)).unwrap();
        rig.drive.inch(Direction::Positive).unwrap();
        assert!(rig.shaft_velocity() > 0.0);
        for result in [rig.drive.start_moving_to(-100), rig.drive.calibrate(0), rig.drive.inch(Direction::Negative)] {
            let Err(Error::Refused(refusal)) = result else { panic!("{result:?}") };
            assert_eq!(refusal.0, [Missing::NoTravel]);
        }
        rig.drive.stop_inching().unwrap();
        assert_eq!(rig.shaft_velocity(), 0.0);
        rig.drive.move_to(-100).unwrap();
    }
}

/// The drive can inch back without withdrawing the order that led there.
#[test]
fn from_beyond_a_limit_it_inches_back_at_once() {
    let mut rig = Rig::inching(30, 50);
    rig.drive.write(od::SOFTWARE_POSITION_LIMIT.limit_1(), od::Position(500)).unwrap();
    rig.drive.inch(Direction::Positive).unwrap();
    rig.drive.pass(Duration::from_secs(3)).unwrap();
    assert!(rig.drive.position().unwrap() > 500 && rig.shaft_velocity() == 0.0);
    rig.drive.inch(Direction::Negative).unwrap();
    rig.drive.pass(Duration::from_secs(2)).unwrap();
    assert!(rig.drive.stop_inching().unwrap() < 500);
}

#[test]
fn a_step_that_loses_its_supply_is_interrupted() {
    let mut rig = Rig::inching(30, 50);
    rig.width(100_000);
    let (simulated, mut ordered) = (Arc::clone(&rig.simulated), None);
    rig.bus.observe(move |now, frame| {
        if frame.data() == [0x0F, 0x20] {
            ordered = Some(now);
        }
        if ordered.is_some_and(|at| now > at + Duration::from_millis(500)) {
            simulated.lock().unwrap().set_inputs(now, |inputs| inputs.output_stage_supply_100mv = 0);
        }
    });
    let outcome = rig.drive.step().unwrap();
    assert!(matches!(outcome, Outcome::Interrupted { state: State::OperationEnabled, .. }), "{outcome:?}");
}

/// Stop interrupts only travels, not steps.
#[test]
fn what_stops_a_drive_stops_a_step() {
    type Stop = fn(&mut Drive<VirtualLink>) -> Result<(), Error>;
    let stops: [(&str, Stop, State); 4] = [
        ("stop_inching", |drive| drive.stop_inching().map(drop), State::QuickStopActive),
        ("stop", Drive::stop, State::QuickStopActive),
        ("quick_stop", Drive::quick_stop, State::QuickStopActive),
        ("disable", Drive::disable, State::SwitchOnDisabled),
    ];
    for (name, stop, state) in stops {
        let mut rig = Rig::inching(30, 50);
        rig.width(100_000);
        rig.drive.set_patience(Duration::from_secs(1));
        assert!(matches!(rig.drive.step(), Ok(Outcome::TimedOut { .. })), "{name}");
        stop(&mut rig.drive).unwrap();
        assert_eq!((rig.shaft_velocity(), rig.drive.state().unwrap()), (0.0, state), "{name}");
        rig.drive.enable().unwrap();
        rig.width(10);
        assert!(matches!(rig.drive.step(), Ok(Outcome::Reached { .. })), "{name}");
        assert_eq!(rig.drive.stop_inching().unwrap(), rig.drive.position().unwrap(), "{name}");
        assert_eq!(rig.drive.state().unwrap(), State::OperationEnabled, "{name}: there was nothing to stop");
    }
}

#[test]
fn a_driver_that_is_dropped_stops_a_step() {
    let mut rig = Rig::inching(30, 50);
    rig.width(100_000);
    rig.drive.set_patience(Duration::from_secs(1));
    assert!(matches!(rig.drive.step(), Ok(Outcome::TimedOut { .. })));
    let Rig { bus, simulated, drive } = rig;
    drop(drive);
    bus.advance(Duration::from_secs(2));
    assert_eq!(simulated.lock().unwrap().shaft(bus.now()).velocity, 0.0);
}

/// The motor releases the shaft at its target, and the order is lost: the drive does not cause the turning.
#[test]
fn a_shaft_that_is_turned_by_hand_has_not_begun_to_inch() {
    for by_hand in [-400, -3, 3] {
        let mut rig = Rig::inching(30, 50);
        rig.drive.write(od::INPOS_MODE, od::InPositionMode(2)).unwrap();
        rig.drive.move_to(100).unwrap();
        let simulated = Arc::clone(&rig.simulated);
        rig.bus.set_fate(move |_, frame| {
            let ordered = frame.id() == CobId::of_node(0x200, NODE) && frame.data() == [0x0F, 0x40];
            if ordered { Fate::Lose } else { Fate::Deliver }
        });
        let mut turned = false;
        rig.bus.observe(move |now, frame| {
            if !turned && frame.data() == [0x0F, 0x00] {
                turned = simulated.lock().unwrap().turn_shaft(now, by_hand);
            }
        });
        let result = rig.drive.inch(Direction::Positive);
        assert!(matches!(result, Err(Error::NotTaken { .. })), "{by_hand}: {result:?}");
        assert_eq!(rig.drive.position().unwrap(), 100 + by_hand);
    }
}
