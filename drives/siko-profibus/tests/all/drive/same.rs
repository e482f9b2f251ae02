//! A program has the same results over PROFIBUS and over CANopen.

use std::fmt::Debug;

use lexican_driver::description::Approach;
use lexican_driver::{Direction, Mode, Outcome, ParameterSet, VelocityOutcome};
use lexican_runtime::Duration;
use lexican_runtime::object::Address;
use siko::fault::FaultKind;
use siko::sim::inputs::{Inputs, Shaft};

use super::rig::{Rig, Sold, both};

/// The results of a program, one line for each operation.
#[derive(Debug, Default, PartialEq)]
struct Log(Vec<String>);

impl Log {
    fn got(&mut self, got: impl Debug) {
        self.0.push(format!("{got:?}"));
    }
}

#[track_caller]
fn same<K: Sold>(program: impl Fn(&mut Rig<K>, &mut Log)) {
    let [mut over_profibus, mut over_can] = [Log::default(), Log::default()];
    program(&mut Rig::over_can(), &mut over_can);
    program(&mut Rig::over_profibus().0, &mut over_profibus);
    assert!(!over_can.0.is_empty());
    for (number, (here, there)) in over_profibus.0.iter().zip(&over_can.0).enumerate() {
        assert_eq!(here, there, "{}: number {number} over PROFIBUS and over CAN", K::MODEL.name);
    }
}

both! {
    states travels interruptions inching velocities faults conditions limits parameters starts_by_sync what_it_does_not_have
}

fn states<K: Sold>() {
    same(|rig: &mut Rig<K>, log| {
        log.got(rig.drive.state());
        log.got(rig.drive.move_to(100));
        log.got(rig.drive.quick_stop());
        for _ in 0..2 {
            log.got((rig.drive.enable(), rig.drive.state()));
            log.got((rig.drive.disable(), rig.drive.state()));
        }
        log.got((rig.drive.enable(), rig.drive.quick_stop(), rig.drive.state()));
        log.got(rig.drive.move_to(100));
        log.got((rig.drive.enable(), rig.drive.state(), rig.drive.move_to(100)));
        log.got((rig.drive.start_moving_to(5000), rig.pass_ms(1000), rig.drive.disable()));
        log.got((rig.drive.state(), rig.shaft().1));
    });
}

fn travels<K: Sold>() {
    same(|rig: &mut Rig<K>, log| {
        log.got(rig.drive.enable());
        for target in [5000, -20, -20, -19, 1_000_001, 10_000_000] {
            log.got((rig.drive.move_to(target), rig.drive.position()));
        }
        rig.drive.set_patience(Duration::from_secs(1));
        log.got(matches!(rig.drive.move_to(10_000), Ok(Outcome::TimedOut { .. })));
        log.got((rig.drive.move_to(0), rig.drive.set_mode(Mode::Velocity), rig.drive.calibrate(0)));
        log.got((rig.drive.step(), rig.drive.restore(None)));
        rig.drive.set_patience(Duration::from_secs(60));
        log.got((rig.drive.finish(), rig.shaft()));
    });
}

fn interruptions<K: Sold>() {
    same(|rig: &mut Rig<K>, log| {
        log.got((rig.drive.enable(), rig.drive.interrupt(), rig.drive.resume()));
        log.got((rig.drive.start_moving_to(5000), rig.pass_ms(1000), rig.drive.interrupt()));
        log.got((rig.shaft().1, rig.drive.move_to(0), rig.pass_ms(1000)));
        log.got((rig.drive.resume(), rig.pass_ms(500), rig.drive.stop(), rig.shaft().1));
        log.got((rig.drive.resume(), rig.drive.finish(), rig.shaft()));
        log.got((rig.drive.start_moving_to(0), rig.pass_ms(1000), rig.drive.quick_stop(), rig.shaft().1));
        log.got((rig.drive.state(), rig.drive.enable(), rig.pass_ms(1000), rig.shaft().1));
        log.got(rig.drive.move_to(0));
    });
}

fn inching<K: Sold>() {
    same(|rig: &mut Rig<K>, log| {
        log.got(rig.drive.enable());
        for _ in 0..2 {
            log.got(rig.drive.step());
        }
        log.got((rig.drive.inch(Direction::Negative), rig.pass_ms(1000), rig.drive.move_to(0)));
        log.got((rig.shaft().1 < 0, rig.drive.stop_inching().is_ok(), rig.shaft().1));
        log.got((rig.drive.state(), rig.drive.move_to(0)));
        rig.drive.set_patience(Duration::from_millis(500));
        log.got(rig.drive.step().is_ok());
        log.got((rig.drive.stop(), rig.shaft().1, rig.drive.state()));
    });
}

fn velocities<K: Sold>() {
    same(|rig: &mut Rig<K>, log| {
        log.got((rig.drive.mode(), rig.drive.enable(), rig.drive.run_at(20)));
        log.got((rig.drive.set_mode(Mode::Velocity), rig.drive.mode(), rig.drive.move_to(0)));
        log.got(rig.drive.inch(Direction::Positive));
        log.got(rig.drive.run_at(1000));
        for velocity in [20, -10, 0, 30] {
            // The velocity when it enters the window depends on milliseconds.
            log.got(matches!(rig.drive.run_at(velocity), Ok(VelocityOutcome::Reached { .. })));
            log.got((rig.pass_ms(1000), rig.drive.velocity(), rig.shaft().1));
        }
        log.got((rig.drive.set_mode(Mode::Positioning), rig.drive.stop(), rig.shaft().1));
        log.got((rig.drive.run_at(20).is_ok(), rig.drive.quick_stop(), rig.drive.state(), rig.shaft().1));
        log.got((rig.drive.set_mode(Mode::Positioning), rig.drive.enable(), rig.pass_ms(500), rig.shaft().1));
        log.got(rig.drive.move_to(0));
    });
}

fn faults<K: Sold>() {
    same(|rig: &mut Rig<K>, log| {
        log.got((rig.drive.enable(), rig.drive.reset_fault(), rig.drive.start_moving_to(100_000)));
        rig.pass_ms(500);
        rig.world(|inputs| inputs.sensor_fails = true);
        log.got((rig.drive.finish(), rig.drive.state(), rig.drive.cause(), rig.drive.move_to(0)));
        log.got((rig.drive.enable(), rig.drive.reset_fault(), rig.drive.state()));
        rig.world(|inputs| inputs.sensor_fails = false);
        log.got((rig.drive.reset_fault(), rig.drive.reset_fault(), rig.drive.state()));
        log.got((rig.drive.enable(), rig.drive.start_moving_to(100_000), rig.pass_ms(1000)));
        rig.world(|inputs| inputs.shaft = Shaft::Blocked);
        log.got((rig.drive.finish(), rig.drive.cause()));
        rig.world(|inputs| *inputs = Inputs::default());
        log.got((rig.drive.reset_fault(), rig.drive.fault_history()));
        log.got((rig.drive.clear_fault_history(), rig.drive.fault_history()));
        log.got((rig.drive.set_emergencies(false).is_ok(), rig.drive.enable(), rig.drive.start_moving_to(0)));
        rig.world(|inputs| inputs.force(FaultKind::Overcurrent));
        log.got(rig.drive.finish());
        rig.world(|inputs| inputs.clear(FaultKind::Overcurrent));
        log.got((rig.drive.reset_fault(), rig.pass_ms(3000)));
        log.got((rig.drive.enable(), rig.drive.move_to(0)));
    });
}

fn conditions<K: Sold>() {
    same(|rig: &mut Rig<K>, log| {
        let without_power = |inputs: &mut Inputs| {
            if K::MODEL.drive.enable_input {
                inputs.enable = false;
            } else {
                inputs.output_stage_supply_100mv = 0;
            }
        };
        rig.world(without_power);
        log.got(rig.drive.enable().map(|()| rig.drive.move_to(100)));
        rig.world(|inputs| *inputs = Inputs::default());
        log.got((rig.drive.enable(), rig.drive.start_moving_to(5000), rig.pass_ms(1000)));
        rig.world(without_power);
        rig.drive.set_patience(Duration::from_secs(2));
        log.got(matches!(rig.drive.finish(), Ok(Outcome::Reached { .. })));
        log.got(rig.drive.move_to(100).is_err());
        rig.pass_ms(1000);
        rig.world(|inputs| *inputs = Inputs::default());
        rig.pass_ms(1000);
        log.got(rig.shaft().1);
        rig.drive.set_patience(Duration::from_secs(60));
        log.got((rig.drive.enable(), rig.drive.move_to(0)));
        rig.world(|inputs| inputs.limit_switches = [true, false]);
        log.got((rig.drive.move_to(100), rig.drive.warning()));
        rig.world(|inputs| *inputs = Inputs::default());
        log.got((rig.drive.start_moving_to(20_000), rig.pass_ms(2000)));
        rig.world(|inputs| inputs.limit_switches = [true, false]);
        rig.pass_ms(2000);
        log.got((rig.drive.finish().is_ok_and(|outcome| matches!(outcome, Outcome::Reached { .. })), rig.shaft().1));
    });
}

fn limits<K: Sold>() {
    same(|rig: &mut Rig<K>, log| {
        log.got((rig.drive.limits(), rig.drive.enable(), rig.drive.move_to(2000)));
        let set = |rig: &mut Rig<K>, sub, value| {
            let mut settings = rig.drive.read_parameters().unwrap();
            settings.retain(|setting| setting.address == Address::new(0x607D, sub));
            settings.iter_mut().for_each(|setting| setting.value = value);
            rig.drive.write_parameters(&settings)
        };
        log.got((set(rig, 2, 1000), rig.drive.limits(), rig.drive.move_to(0)));
        log.got((rig.drive.inch(Direction::Positive), rig.drive.inch(Direction::Negative)));
        log.got((rig.pass_ms(2500), rig.drive.stop_inching().is_ok(), rig.drive.move_to(1001)));
        log.got(rig.drive.move_to(0));
        // One error number of PROFIBUS stands for several abort codes.
        log.got((set(rig, 2, -2_000_000).is_err(), set(rig, 2, 99_999_999).is_err(), rig.drive.limits()));
    });
}

fn parameters<K: Sold>() {
    same(|rig: &mut Rig<K>, log| {
        let settings = rig.drive.read_parameters().unwrap();
        log.got(&settings);
        log.got((rig.drive.units(), rig.drive.approach(), rig.drive.limits()));
        log.got((rig.drive.set_approach(Approach::Positive), rig.drive.approach()));
        log.got((rig.drive.calibrate(1234), rig.drive.position(), rig.drive.calibrate(1_000_000)));
        let mut others = settings.clone();
        for setting in &mut others {
            setting.value = if (0x2410..=0x2412).contains(&setting.address.index()) { 7 } else { setting.value };
        }
        log.got((rig.drive.compare_parameters(&others), rig.drive.write_parameters(&others)));
        log.got(rig.drive.read_parameters());
        log.got(rig.drive.restore(Some(ParameterSet::Controller)));
        log.got(rig.drive.read_parameters());
        log.got((rig.drive.restore(None), rig.drive.read_parameters()));
    });
}

/// Nobody sends a SYNC here.
fn starts_by_sync<K: Sold>() {
    same(|rig: &mut Rig<K>, log| {
        log.got((rig.drive.set_start_by_sync(true), rig.drive.enable(), rig.drive.prepare_moving_to(1000)));
        log.got((rig.pass_ms(1000), rig.shaft(), rig.drive.confirm_start().is_err()));
        log.got((rig.drive.disable(), rig.drive.set_start_by_sync(false), rig.drive.enable()));
        log.got((rig.drive.move_to(1000), rig.shaft()));
    });
}

fn what_it_does_not_have<K: Sold>() {
    same(|rig: &mut Rig<K>, log| {
        log.got((rig.drive.home(1), rig.drive.store(), rig.drive.apply_torque(1), rig.drive.torque()));
        log.got((rig.drive.temperature(), rig.drive.battery_voltage(), rig.drive.torque_deactivated()));
        log.got((rig.drive.set_torque_threshold(Some(50)), rig.drive.torque_threshold()));
        log.got(rig.drive.set_mode(Mode::Torque));
    });
}
