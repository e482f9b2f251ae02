//! The typed driver with the simulated drive: every operation, every refusal, and faults in between.

use std::sync::{Arc, Mutex};

use lexican_runtime::host::{Fate, VirtualBus, VirtualLink};
use lexican_runtime::object::{Address, Object, Rw, Unmapped};
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::{AbortCode, CobId, Duration, Frame};
use siko_ag03_1::Direction;
use siko_ag03_1::driver::sequence::Setting;
use siko_ag03_1::driver::{Drive, Error, Missing, Mode, Outcome, VelocityOutcome};
use siko_ag03_1::fault::{self, Cause};
use siko_ag03_1::od;
use siko_ag03_1::parameter::ParameterSet;
use siko_ag03_1::sim::MODEL;
use siko_ag03_1::sim::inputs::{Inputs, Shaft};
use siko_ag03_1::sim::{Setup, SimulatedDrive};
use siko_ag03_1::state::State;

mod cancel;
mod floods;
mod foreign_orders;
mod inching;
mod nothing_starts_unasked;
mod protection;
mod recovery;
pub(crate) mod rig;
mod silence;

use self::rig::{NODE, Rig, refused};

#[test]
fn a_travel_reaches_its_target() {
    let mut rig = Rig::enabled();
    assert_eq!(rig.drive.move_to(5000).unwrap(), Outcome::Reached { position: 5000 });
    assert_eq!(rig.drive.move_to(-20).unwrap(), Outcome::Reached { position: -20 });
    assert_eq!(rig.drive.move_to(-20).unwrap(), Outcome::Reached { position: -20 }, "no way to go");
}

/// Bits that another manager has left in the control word do not matter.
#[test]
fn every_edge_is_made_from_below() {
    let mut rig = Rig::enabled();
    rig.drive.move_to(100).unwrap();
    assert_eq!(rig.simulated.lock().unwrap().stored(od::CONTROLWORD).0, 0x010F, "New Setpoint is cleared");
    rig.control(0x001F);
    rig.pass_ms(1000);
    assert_eq!(rig.drive.move_to(200).unwrap(), Outcome::Reached { position: 200 });
    rig.world(|inputs| inputs.internal_error = true);
    rig.control(0x0080);
    rig.pass_ms(1000);
    rig.world(|inputs| inputs.internal_error = false);
    assert_eq!(rig.drive.reset_fault().unwrap(), Some(Cause::from(fault::INTERNAL)));
    rig.drive.set_mode(Mode::Velocity).unwrap();
    for word in [0x0000, 0x0006, 0x0007, 0x000F] {
        rig.control(word);
    }
    assert_eq!(rig.drive.state().unwrap(), State::OperationEnabled);
    assert!(matches!(rig.drive.run_at(20).unwrap(), VelocityOutcome::Reached { .. }));
    rig.pass_ms(1000);
    assert_eq!(rig.velocity(), 20);
}

#[test]
fn a_travel_can_be_interrupted_and_resumed() {
    let mut rig = Rig::enabled();
    rig.drive.start_moving_to(5000).unwrap();
    rig.pass_ms(1000);
    rig.drive.interrupt().unwrap();
    let stop = rig.position();
    rig.pass_ms(1000);
    assert_eq!(rig.position(), stop);
    assert!((600..1000).contains(&stop), "{stop}");
    rig.drive.resume().unwrap();
    assert_eq!(rig.drive.finish().unwrap(), Outcome::Reached { position: 5000 });
    refused(rig.drive.interrupt(), &[Missing::Travel]);
}

#[test]
fn progress_is_told_on_the_way() {
    let mut rig = Rig::enabled();
    let mut seen = Vec::new();
    rig.drive.move_to_watched(1600, |progress| seen.push(progress.position)).unwrap();
    assert!(seen.len() > 10 && seen.is_sorted(), "{seen:?}");
}

#[test]
fn a_travel_that_takes_too_long_is_still_under_way() {
    let mut rig = Rig::enabled();
    rig.drive.set_patience(Duration::from_secs(2));
    let Outcome::TimedOut { position } = rig.drive.move_to(5000).unwrap() else { panic!("it takes 6.5 s") };
    assert!((1000..2000).contains(&position));
    refused(rig.drive.move_to(0), &[Missing::NoTravel]);
    rig.drive.set_patience(Duration::from_secs(60));
    assert_eq!(rig.drive.finish().unwrap(), Outcome::Reached { position: 5000 });
}

#[test]
fn every_missing_condition_is_named_before_anything_moves() {
    let mut rig = Rig::new();
    refused(rig.drive.move_to(5000), &[Missing::Enabled(State::SwitchOnDisabled)]);
    rig.drive.enable().unwrap();
    let outside = Missing::TargetWithinLimits { target: 1_000_001, low: -1_000_000, high: 1_000_000 };
    refused(rig.drive.move_to(1_000_001), &[outside]);
    rig.world(|inputs| inputs.output_stage_supply_100mv = 0);
    refused(rig.drive.move_to(1_000_001), &[Missing::Supply, outside]);
    rig.world(|inputs| *inputs = Inputs::default());
    refused(rig.drive.run_at(10), &[Missing::Mode(Mode::Positioning)]);
    rig.drive.start_moving_to(5000).unwrap();
    refused(rig.drive.move_to(0), &[Missing::NoTravel]);
    refused(rig.drive.step(), &[Missing::NoTravel]);
    refused(rig.drive.set_mode(Mode::Velocity), &[Missing::NoTravel]);
    refused(rig.drive.calibrate(0), &[Missing::NoTravel]);
    refused(rig.drive.restore(None), &[Missing::NoTravel]);
    rig.world(|inputs| inputs.sensor_fails = true);
    let fault = Cause::from(fault::SENSOR);
    assert!(matches!(rig.drive.pass(Duration::from_secs(2)), Err(Error::Fault(cause)) if cause == fault));
    refused(rig.drive.move_to(0), &[Missing::NoFault(fault)]);
    assert_eq!(rig.position(), rig.drive.read(od::POSITION_ACTUAL_VALUE).unwrap().0);
    assert!(matches!(rig.drive.move_to(10_000_000), Err(Error::OutOfRange(_))));
}

#[test]
fn outside_the_limits_only_inching_back_is_offered() {
    let limits = od::SOFTWARE_POSITION_LIMIT;
    for (limit, limit_of, missing, on, back) in [
        (1000, limits.limit_1(), Missing::BelowUpperLimit, Direction::Positive, Direction::Negative),
        (-1000, limits.limit_2(), Missing::AboveLowerLimit, Direction::Negative, Direction::Positive),
    ] {
        let mut rig = Rig::enabled();
        rig.drive.move_to(2 * limit).unwrap();
        rig.drive.write(limit_of, od::Position(limit)).unwrap();
        refused(rig.drive.move_to(0), &[missing]);
        refused(rig.drive.inch(on), &[missing]);
        rig.drive.inch(back).unwrap();
        rig.pass_ms(2000);
        let position = rig.drive.stop_inching().unwrap();
        assert!(position.abs() < 1000, "{position}");
        assert_eq!(rig.drive.move_to(0).unwrap(), Outcome::Reached { position: 0 });
    }
}

#[test]
fn enabling_without_supply_is_refused() {
    let mut rig = Rig::new();
    rig.world(|inputs| inputs.output_stage_supply_100mv = 0);
    refused(rig.drive.enable(), &[Missing::Supply]);
}

#[test]
fn a_fault_ends_a_travel_and_is_reset_once_its_cause_is_gone() {
    let mut rig = Rig::enabled();
    rig.drive.start_moving_to(100_000).unwrap();
    rig.world(|inputs| inputs.temperature_100mdegc = 950);
    let fault = Cause::from(fault::OVERTEMPERATURE);
    assert_eq!(rig.drive.finish().unwrap(), Outcome::Fault(fault));
    assert!(matches!(rig.drive.enable(), Err(Error::Fault(cause)) if cause == fault));
    assert!(matches!(rig.drive.reset_fault(), Err(Error::Fault(cause)) if cause == fault));
    rig.world(|inputs| inputs.temperature_100mdegc = 400);
    assert_eq!(rig.drive.reset_fault().unwrap(), Some(fault));
    assert_eq!(rig.drive.reset_fault().unwrap(), None);
    rig.drive.enable().unwrap();
    assert_eq!(rig.drive.move_to(0).unwrap(), Outcome::Reached { position: 0 });
}

#[test]
fn a_blocked_shaft_is_a_fault_after_a_while() {
    let mut rig = Rig::enabled();
    rig.drive.start_moving_to(100_000).unwrap();
    rig.pass_ms(1000);
    rig.world(|inputs| inputs.shaft = Shaft::Blocked);
    let emergency = Arc::new(Mutex::new(None));
    let seen = Arc::clone(&emergency);
    rig.bus.observe(move |at, frame| {
        if frame.id() == CobId::of_node(0x080, NODE) {
            *seen.lock().unwrap() = Some(at);
        }
    });
    assert_eq!(rig.drive.finish().unwrap(), Outcome::Fault(Cause::from(fault::SHAFT_BLOCKED)));
    let emergency = emergency.lock().unwrap().expect("it sends an emergency");
    let later = rig.bus.now().since(emergency);
    assert!(later < Duration::from_millis(10), "the next status word is not waited for: {later}");
}

#[test]
fn torque_deactivation_can_be_resumed() {
    let mut rig = Rig::enabled();
    rig.drive.write(od::TORQUE_DEACTIVATION, od::TorqueThreshold(50)).unwrap();
    rig.drive.start_moving_to(5000).unwrap();
    rig.pass_ms(1000);
    rig.world(|inputs| inputs.load_ma = 1500);
    let Outcome::TorqueDeactivated { position } = rig.drive.finish().unwrap() else { panic!("it is overloaded") };
    assert!((600..1000).contains(&position));
    rig.world(|inputs| inputs.load_ma = 500);
    rig.drive.resume().unwrap();
    assert_eq!(rig.drive.finish().unwrap(), Outcome::Reached { position: 5000 });
}

/// An edge without effect does not prevent the next one.
#[test]
fn a_travel_that_its_load_still_forbids_is_resumed_once_that_is_gone() {
    let mut rig = Rig::enabled();
    rig.drive.set_torque_threshold(Some(40)).unwrap();
    rig.drive.start_moving_to(5000).unwrap();
    rig.pass_ms(1000);
    rig.world(|inputs| inputs.load_ma = 1500);
    for _ in 0..2 {
        assert!(matches!(rig.drive.finish().unwrap(), Outcome::TorqueDeactivated { .. }));
        assert!(matches!(rig.drive.resume().map_err(Error::into_cause), Err(Error::NotTaken { .. })));
    }
    rig.world(|inputs| inputs.load_ma = 500);
    rig.drive.resume().unwrap();
    assert_eq!(rig.drive.finish().unwrap(), Outcome::Reached { position: 5000 });
}

#[test]
fn a_quick_stop_ends_a_travel() {
    let mut rig = Rig::enabled();
    rig.drive.start_moving_to(5000).unwrap();
    rig.pass_ms(1000);
    rig.drive.quick_stop().unwrap();
    assert_eq!((rig.velocity(), rig.drive.state().unwrap()), (0, State::QuickStopActive));
    refused(rig.drive.move_to(0), &[Missing::Enabled(State::QuickStopActive)]);
    rig.drive.enable().unwrap();
    assert_eq!(rig.drive.move_to(0).unwrap(), Outcome::Reached { position: 0 });
}

#[test]
fn a_quick_stop_does_not_enable_a_drive_that_is_not() {
    let mut rig = Rig::new();
    refused(rig.drive.quick_stop(), &[Missing::Enabled(State::SwitchOnDisabled)]);
    rig.drive.enable().unwrap();
    rig.drive.disable().unwrap();
    refused(rig.drive.quick_stop(), &[Missing::Enabled(State::SwitchOnDisabled)]);
    assert_eq!(rig.drive.state().unwrap(), State::SwitchOnDisabled);
}

/// The way to OPERATION ENABLED leads through states without torque, in which a drive that still brakes would coast.
#[test]
fn a_drive_that_brakes_by_quick_stop_stands_before_it_is_enabled() {
    let mut rig = Rig::new();
    rig.drive.write(od::MOTOR_PARAMETER_SET.v_pos(), od::Speed(200)).unwrap();
    rig.drive.enable().unwrap();
    rig.drive.start_moving_to(100_000).unwrap();
    rig.pass_ms(3000);
    let stopped_at = rig.position();
    rig.control(0x010B);
    rig.drive.enable().unwrap();
    assert_eq!((rig.velocity(), rig.drive.state().unwrap()), (0, State::OperationEnabled));
    // 200 rev/min with 4 rev/s² take 2222 increments.
    assert!(rig.position() - stopped_at < 2300, "{stopped_at} to {}", rig.position());
}

#[test]
fn a_drive_that_does_not_stop_is_told_of() {
    let mut rig = Rig::running();
    rig.drive.run_at(50).unwrap();
    rig.bus.set_fate(|_, frame| if frame.id().raw() == 0x205 { Fate::Lose } else { Fate::Deliver });
    let error = rig.drive.stop().unwrap_err();
    assert_eq!(
        error.to_string(),
        "the drive does not stop: it runs at 50 rev/min; the drive at node 5 may still be moving"
    );
    assert!(matches!(error.into_cause(), Error::NotStopped { velocity: 50, unit: "rev/min" }));
}

#[test]
fn somebody_else_interrupts_a_travel() {
    let mut rig = Rig::enabled();
    rig.drive.start_moving_to(5000).unwrap();
    rig.pass_ms(500);
    let mut other = Drive::connect_unprotected(rig.bus.link(), NODE).unwrap();
    other.quick_stop().unwrap();
    let outcome = rig.drive.finish().unwrap();
    assert!(matches!(outcome, Outcome::Interrupted { state: State::QuickStopActive, .. }), "{outcome:?}");
}

#[test]
fn inching_is_a_step_or_lasts_until_it_is_stopped() {
    let mut rig = Rig::enabled();
    rig.drive.write(od::DELTA_JOG, od::Position(-400)).unwrap();
    assert_eq!(rig.drive.step().unwrap(), Outcome::Reached { position: -400 });
    assert_eq!(rig.drive.step().unwrap(), Outcome::Reached { position: -800 });
    rig.drive.inch(Direction::Positive).unwrap();
    rig.pass_ms(1000);
    let position = rig.drive.stop_inching().unwrap();
    assert!(position > -400 && rig.position() == position);
    rig.drive.write(od::SOFTWARE_POSITION_LIMIT.limit_2(), od::Position(position - 100)).unwrap();
    let outcome = rig.drive.step().unwrap();
    assert!(matches!(outcome, Outcome::Limit { .. }), "{outcome:?}");
}

#[test]
fn velocities_are_reached_and_changed() {
    let mut rig = Rig::running();
    for velocity in [68, 30, -72] {
        let outcome = rig.drive.run_at(velocity).unwrap();
        let VelocityOutcome::Reached { velocity: reached } = outcome else { panic!("{outcome:?}") };
        assert!((reached - velocity).abs() <= 10, "within the window");
        rig.pass_ms(1000);
        assert_eq!(rig.velocity(), velocity);
    }
    rig.drive.stop().unwrap();
    assert_eq!(rig.velocity(), 0);
    for velocity in [201, -201, i32::MAX, i32::MIN] {
        refused(rig.drive.run_at(velocity), &[Missing::VelocityWithinGear { velocity, most: 200 }]);
    }
    refused(rig.drive.move_to(0), &[Missing::Mode(Mode::Velocity)]);
}

#[test]
fn a_drive_that_has_lost_its_supply_in_velocity_mode_runs_again_when_it_is_told_to() {
    let mut rig = Rig::running();
    rig.drive.run_at(60).unwrap();
    rig.world(|inputs| inputs.output_stage_supply_100mv = 0);
    rig.pass_ms(2000);
    refused(rig.drive.run_at(60), &[Missing::Supply]);
    rig.world(|inputs| inputs.output_stage_supply_100mv = 240);
    rig.pass_ms(2000);
    assert_eq!(rig.velocity(), 0, "not by itself");
    assert!(matches!(rig.drive.run_at(60).unwrap(), VelocityOutcome::Reached { .. }));
}

#[test]
fn the_slow_gear_allows_half_the_velocity() {
    let mut rig = Rig::with(Setup { gear: od::GearReduction::GEAR_48_1.0, ..Setup::new(&MODEL, NODE) });
    let too_fast = rig.drive.write(od::MOTOR_PARAMETER_SET.v_pos(), od::Speed(101));
    let Err(Error::Sdo(SdoError::Aborted { code, .. })) = too_fast else { panic!("{too_fast:?}") };
    assert_eq!(code, AbortCode::INVALID_VALUE);
    rig.drive.write(od::MOTOR_PARAMETER_SET.v_pos(), od::Speed(100)).unwrap();
    rig.drive.set_mode(Mode::Velocity).unwrap();
    rig.drive.enable().unwrap();
    refused(rig.drive.run_at(-101), &[Missing::VelocityWithinGear { velocity: -101, most: 100 }]);
}

#[test]
fn disabling_stops_first() {
    let mut rig = Rig::enabled();
    rig.drive.start_moving_to(5000).unwrap();
    rig.pass_ms(1000);
    rig.drive.disable().unwrap();
    let position = rig.position();
    rig.pass_ms(1000);
    assert_eq!((rig.position(), rig.drive.state().unwrap()), (position, State::SwitchOnDisabled));
}

#[test]
fn a_driver_that_is_dropped_stops_the_drive() {
    let Rig { bus, simulated, mut drive } = Rig::enabled();
    drive.start_moving_to(5000).unwrap();
    drive.pass(Duration::from_secs(1)).unwrap();
    drop(drive);
    bus.advance(Duration::from_secs(2));
    assert_eq!(simulated.lock().unwrap().velocity(bus.now()), 0);
}

/// TPDO1 has an inhibit time, so its last report may be out of date.
#[test]
fn a_driver_that_is_dropped_at_once_stops_the_drive() {
    type Order = fn(&mut Drive<VirtualLink>) -> Result<(), Error>;
    let orders: [(Mode, Order); 3] = [
        (Mode::Positioning, |drive| drive.inch(Direction::Negative)),
        (Mode::Positioning, |drive| drive.start_moving_to(5000)),
        (Mode::Velocity, |drive| drive.run_at(200).map(drop)),
    ];
    for (mode, order) in orders {
        let mut rig = Rig::enabled();
        rig.drive.disable().unwrap();
        rig.drive.set_mode(mode).unwrap();
        rig.pass_ms(300);
        rig.drive.set_patience(Duration::from_millis(20));
        rig.drive.enable().unwrap();
        order(&mut rig.drive).unwrap();
        let Rig { bus, simulated, drive } = rig;
        drop(drive);
        bus.advance(Duration::from_secs(2));
        assert_eq!(simulated.lock().unwrap().velocity(bus.now()), 0, "{mode}");
    }
}

#[test]
fn a_driver_that_is_released_leaves_the_drive_moving() {
    let Rig { bus, simulated, mut drive } = Rig::enabled();
    drive.start_moving_to(5000).unwrap();
    drop(drive.release());
    bus.advance(Duration::from_secs(60));
    assert_eq!(simulated.lock().unwrap().position(bus.now()), 5000);
}

#[test]
fn parameters_are_read_compared_written_and_restored() {
    let mut rig = Rig::new();
    let factory = rig.drive.read_parameters().unwrap();
    rig.drive.write(od::MOTOR_PARAMETER_SET.a_pos(), od::Acceleration(75)).unwrap();
    rig.drive.write(od::LOOP_LENGTH, od::LoopLength(5)).unwrap();
    // Both limits move beyond the former value of the other.
    rig.drive.write(od::SOFTWARE_POSITION_LIMIT.limit_1(), od::Position(5_000_000)).unwrap();
    rig.drive.write(od::SOFTWARE_POSITION_LIMIT.limit_2(), od::Position(4_000_000)).unwrap();
    assert_eq!(rig.drive.compare_parameters(&factory).unwrap().len(), 4);
    rig.drive.write_parameters(&factory).unwrap();
    assert_eq!(rig.drive.compare_parameters(&factory).unwrap(), []);
    rig.drive.write(od::MOTOR_PARAMETER_SET.a_pos(), od::Acceleration(75)).unwrap();
    rig.drive.write(od::LOOP_LENGTH, od::LoopLength(5)).unwrap();
    rig.drive.restore(Some(ParameterSet::Controller)).unwrap();
    let left = rig.drive.compare_parameters(&factory).unwrap();
    assert_eq!(left.iter().map(|difference| difference.address).collect::<Vec<_>>(), [od::LOOP_LENGTH.address()]);
    rig.drive.restore(Some(ParameterSet::Standard)).unwrap();
    assert_eq!(rig.drive.compare_parameters(&factory).unwrap(), []);
}

/// A limit waits for the other one, and the calibration value for both, whatever values the drive had before.
#[test]
fn a_set_of_parameters_is_written_in_whatever_order_the_drive_takes_it() {
    let limits = od::SOFTWARE_POSITION_LIMIT;
    let set = |low, high, calibration| {
        [
            (od::CALIBRATION_VALUE.address(), calibration),
            (limits.limit_1().address(), high),
            (limits.limit_2().address(), low),
        ]
        .map(|(address, value)| Setting { address, value })
    };
    let mut rig = Rig::new();
    for (low, high, calibration) in
        [(800_000, 2_000_000, 900_000), (-2_000_000, -800_000, -900_000), (0, 10, 5), (-1_000_000, 1_000_000, 0)]
    {
        let settings = set(low, high, calibration);
        rig.drive.write_parameters(&settings).unwrap();
        assert_eq!(rig.drive.compare_parameters(&settings).unwrap(), []);
        assert_eq!(i64::from(rig.position()), calibration);
    }
    let refused = rig.drive.write_parameters(&set(0, 10, 1_000_000));
    let Err(Error::Sdo(SdoError::Aborted { address, .. })) = refused else { panic!("{refused:?}") };
    assert_eq!(address, od::CALIBRATION_VALUE.address());
}

#[test]
fn a_setting_that_is_no_parameter_is_told_of_before_anything_is_sent() {
    let mut rig = Rig::new();
    let foreign = Setting { address: Address::new(0x2410, 0x07), value: 1 };
    let good = Setting { address: od::POS_TYPE.address(), value: 1 };
    let error = rig.drive.write_parameters(&[good, foreign]).unwrap_err();
    assert_eq!(error.to_string(), "2410:07 is no parameter of the SIKO AG03/1");
    assert!(matches!(rig.drive.compare_parameters(&[foreign]), Err(Error::NoParameter { .. })));
    assert_eq!(rig.drive.read(od::POS_TYPE).unwrap(), od::PositioningType::DIRECT);
}

#[test]
fn calibration_sets_the_position() {
    let mut rig = Rig::new();
    rig.drive.calibrate(2500).unwrap();
    assert_eq!(rig.position(), 2500);
    assert!(matches!(rig.drive.calibrate(1_000_000), Err(Error::OutOfRange(_))));
}

#[test]
fn units_follow_pitch_and_gear() {
    let mut rig = Rig::new();
    rig.drive.write(od::SPINDLE_PITCH, od::SpindlePitch(200)).unwrap();
    rig.drive.write(od::GEAR_RATIO.numerator(), 5).unwrap();
    let units = rig.drive.units().unwrap();
    assert_eq!((units.millimetres(1000), units.shaft_revolutions(1000)), (Some(10.0), 25.0));
}

#[test]
fn another_device_is_not_taken_for_the_drive() {
    let bus = VirtualBus::new();
    let silent = Drive::connect_unprotected(bus.link(), NODE);
    assert!(matches!(silent, Err(Error::Sdo(SdoError::TimedOut { .. }))), "no node answers");
    // An AG02 has the same vendor and profile, but no device name.
    let bus = VirtualBus::new();
    bus.attach(SimulatedDrive::new(&MODEL, NODE));
    bus.set_fate(|_, frame| match frame.data() {
        [0x42, 0x08, 0x10, ..] => {
            Fate::Replace(Frame::from_array(frame.id(), [0x80, 0x08, 0x10, 0, 0x00, 0x00, 0x02, 0x06]))
        }
        _ => Fate::Deliver,
    });
    match Drive::connect_unprotected(bus.link(), NODE) {
        Err(Error::NotThisDrive { vendor_id: 0x195, profile: 402, name: None, .. }) => {}
        other => panic!("{:?}", other.err()),
    }
}

#[test]
fn cob_ids_that_the_driver_does_not_go_by_are_told_of() {
    type Identifier = Object<u32, Rw, Unmapped, od::Device>;
    let setups: [(Identifier, u32, bool); 9] = [
        (od::RPDO1_PARAMETER.cob_id(), 0x206, false),
        (od::RPDO3_PARAMETER.cob_id(), 0x8000_0405, false),
        (od::RPDO4_PARAMETER.cob_id(), 0x2000_0505, false),
        (od::TPDO1_PARAMETER.cob_id(), 0x285, false),
        (od::TPDO1_PARAMETER.cob_id(), 0x4000_0185, true),
        (od::TPDO3_PARAMETER.cob_id(), 0x8000_0385, true),
        // The driver adapts to the change.
        (od::COB_ID_EMERGENCY_MESSAGE, 0x86, true),
        (od::COB_ID_EMERGENCY_MESSAGE, 0x8000_0085, true),
        (od::COB_ID_SYNC_MESSAGE, 0x81, true),
    ];
    for (object, cob_id, connects) in setups {
        let mut rig = Rig::new();
        rig.drive.write(object, cob_id).unwrap();
        match Drive::connect_unprotected(rig.bus.link(), NODE) {
            Ok(_) => assert!(connects, "{object:?}"),
            Err(Error::OtherCobId { address, found, .. }) => {
                assert_eq!((address, found, connects), (object.address(), cob_id, false));
            }
            Err(error) => panic!("{object:?}: {error}"),
        }
    }
    let error =
        Error::OtherCobId { address: Address::new(0x1400, 1), expected: CobId::of_node(0x200, NODE), found: 0x206 };
    assert_eq!(error.to_string(), "1400:01: the driver goes by COB-ID 205h, and the node is set up with 00000206h");
}

#[test]
fn a_value_of_another_length_is_no_value() {
    let mut rig = Rig::new();
    rig.bus.set_fate(|_, frame| match *frame.data() {
        // Two bytes instead of the four in the data sheet.
        [0x42, 0x64, 0x60, sub, a, b, ..] => {
            Fate::Replace(Frame::from_array(frame.id(), [0x4B, 0x64, 0x60, sub, a, b, 0, 0]))
        }
        _ => Fate::Deliver,
    });
    assert!(matches!(rig.drive.read(od::POSITION_ACTUAL_VALUE), Err(Error::DataSheet { .. })));
}

#[test]
fn a_restart_of_the_drive_is_noticed() {
    let mut rig = Rig::enabled();
    rig.drive.start_moving_to(5000).unwrap();
    rig.simulated.lock().unwrap().power_cycle(rig.bus.now());
    assert!(matches!(rig.drive.finish(), Err(Error::Restarted)));
    assert_eq!(rig.drive.state().unwrap(), State::SwitchOnDisabled);
}

#[test]
fn a_drive_that_never_gets_ready_is_not_waited_for_without_end() {
    let mut rig = Rig::new();
    let answer = CobId::of_node(0x580, NODE);
    rig.bus.set_fate(move |_, frame| match frame.data() {
        // NOT READY TO SWITCH ON whenever the status word is read; TPDOs never show it.
        [_, 0x41, 0x60, 0, ..] if frame.id() == answer => {
            Fate::Replace(Frame::from_array(answer, [0x4B, 0x41, 0x60, 0, 0x00, 0x02, 0, 0]))
        }
        _ if [0x185, 0x385, 0x485].contains(&frame.id().raw()) => Fate::Lose,
        _ => Fate::Deliver,
    });
    let enabled = rig.drive.enable();
    assert!(matches!(enabled, Err(Error::NoWay { from: State::NotReadyToSwitchOn, .. })), "{enabled:?}");
}

#[test]
fn an_interruption_does_not_outlive_a_restart() {
    let mut rig = Rig::enabled();
    rig.drive.write(od::TORQUE_DEACTIVATION, od::TorqueThreshold(50)).unwrap();
    rig.drive.start_moving_to(5000).unwrap();
    rig.drive.interrupt().unwrap();
    rig.simulated.lock().unwrap().power_cycle(rig.bus.now());
    assert!(matches!(rig.drive.pass(Duration::from_secs(1)), Err(Error::Restarted)));
    rig.drive.enable().unwrap();
    rig.drive.start_moving_to(5000).unwrap();
    rig.pass_ms(1000);
    rig.world(|inputs| inputs.load_ma = 1500);
    // The drive stands without an order to stop.
    let outcome = rig.drive.finish().unwrap();
    assert!(matches!(outcome, Outcome::TorqueDeactivated { .. }), "{outcome:?}");
}

#[test]
fn an_unknown_operating_mode_refuses_every_order() {
    let mut rig = Rig::enabled();
    let answer = CobId::of_node(0x580, NODE);
    rig.bus.set_fate(move |_, frame| match *frame.data() {
        [_, 0x60, 0x60, ..] if frame.id() == answer => {
            Fate::Replace(Frame::from_array(answer, [0x4F, 0x60, 0x60, 0, 6, 0, 0, 0]))
        }
        _ => Fate::Deliver,
    });
    let unknown = [Missing::UnknownMode(6)];
    refused(rig.drive.move_to(100), &unknown);
    refused(rig.drive.inch(Direction::Positive), &unknown);
    refused(rig.drive.run_at(10), &unknown);
}
