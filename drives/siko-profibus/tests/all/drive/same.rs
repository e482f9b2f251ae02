//! The same program over PROFIBUS and over CANopen: what it gets does not differ.

use std::fmt::Debug;

use lexican_driver::description::Approach;
use lexican_driver::{Direction, Mode, Outcome, ParameterSet, VelocityOutcome};
use lexican_runtime::Duration;
use lexican_runtime::object::Address;
use siko::sim::inputs::{Inputs, Shaft};

use super::bench::{Bench, Sold, both};

/// What a program has got, one line for each operation.
#[derive(Debug, Default, PartialEq)]
struct Log(Vec<String>);

impl Log {
    fn got(&mut self, got: impl Debug) {
        self.0.push(format!("{got:?}"));
    }
}

#[track_caller]
fn same<K: Sold>(program: impl Fn(&mut Bench<K>, &mut Log)) {
    let [mut over_profibus, mut over_can] = [Log::default(), Log::default()];
    program(&mut Bench::over_can(), &mut over_can);
    program(&mut Bench::over_profibus().0, &mut over_profibus);
    assert!(!over_can.0.is_empty());
    for (number, (here, there)) in over_profibus.0.iter().zip(&over_can.0).enumerate() {
        assert_eq!(here, there, "{}: number {number} over PROFIBUS and over CAN", K::MODEL.name);
    }
}

both! {
    states travels interruptions inching velocities faults conditions limits parameters starts_by_sync what_it_does_not_have
}

fn states<K: Sold>() {
    same(|bench: &mut Bench<K>, log| {
        log.got(bench.drive.state());
        log.got(bench.drive.move_to(100));
        log.got(bench.drive.quick_stop());
        for _ in 0..2 {
            log.got((bench.drive.enable(), bench.drive.state()));
            log.got((bench.drive.disable(), bench.drive.state()));
        }
        log.got((bench.drive.enable(), bench.drive.quick_stop(), bench.drive.state()));
        log.got(bench.drive.move_to(100));
        log.got((bench.drive.enable(), bench.drive.state(), bench.drive.move_to(100)));
        log.got((bench.drive.start_moving_to(5000), bench.pass_ms(1000), bench.drive.disable()));
        log.got((bench.drive.state(), bench.shaft().1));
    });
}

fn travels<K: Sold>() {
    same(|bench: &mut Bench<K>, log| {
        log.got(bench.drive.enable());
        for target in [5000, -20, -20, -19, 1_000_001, 10_000_000] {
            log.got((bench.drive.move_to(target), bench.drive.position()));
        }
        bench.drive.set_patience(Duration::from_secs(1));
        log.got(matches!(bench.drive.move_to(10_000), Ok(Outcome::TimedOut { .. })));
        log.got((bench.drive.move_to(0), bench.drive.set_mode(Mode::Velocity), bench.drive.calibrate(0)));
        log.got((bench.drive.step(), bench.drive.restore(None)));
        bench.drive.set_patience(Duration::from_secs(60));
        log.got((bench.drive.finish(), bench.shaft()));
    });
}

fn interruptions<K: Sold>() {
    same(|bench: &mut Bench<K>, log| {
        log.got((bench.drive.enable(), bench.drive.interrupt(), bench.drive.resume()));
        log.got((bench.drive.start_moving_to(5000), bench.pass_ms(1000), bench.drive.interrupt()));
        log.got((bench.shaft().1, bench.drive.move_to(0), bench.pass_ms(1000)));
        log.got((bench.drive.resume(), bench.pass_ms(500), bench.drive.stop(), bench.shaft().1));
        log.got((bench.drive.resume(), bench.drive.finish(), bench.shaft()));
        log.got((bench.drive.start_moving_to(0), bench.pass_ms(1000), bench.drive.quick_stop(), bench.shaft().1));
        log.got((bench.drive.state(), bench.drive.enable(), bench.pass_ms(1000), bench.shaft().1));
        log.got(bench.drive.move_to(0));
    });
}

fn inching<K: Sold>() {
    same(|bench: &mut Bench<K>, log| {
        log.got(bench.drive.enable());
        for _ in 0..2 {
            log.got(bench.drive.step());
        }
        log.got((bench.drive.inch(Direction::Negative), bench.pass_ms(1000), bench.drive.move_to(0)));
        log.got((bench.shaft().1 < 0, bench.drive.stop_inching().is_ok(), bench.shaft().1));
        log.got((bench.drive.state(), bench.drive.move_to(0)));
        bench.drive.set_patience(Duration::from_millis(500));
        log.got(bench.drive.step().is_ok());
        log.got((bench.drive.stop(), bench.shaft().1, bench.drive.state()));
    });
}

fn velocities<K: Sold>() {
    same(|bench: &mut Bench<K>, log| {
        log.got((bench.drive.mode(), bench.drive.enable(), bench.drive.run_at(20)));
        log.got((bench.drive.set_mode(Mode::Velocity), bench.drive.mode(), bench.drive.move_to(0)));
        log.got(bench.drive.inch(Direction::Positive));
        log.got(bench.drive.run_at(1000));
        for velocity in [20, -10, 0, 30] {
            // With which velocity it comes into the window, is a matter of milliseconds.
            log.got(matches!(bench.drive.run_at(velocity), Ok(VelocityOutcome::Reached { .. })));
            log.got((bench.pass_ms(1000), bench.drive.velocity(), bench.shaft().1));
        }
        log.got((bench.drive.set_mode(Mode::Positioning), bench.drive.stop(), bench.shaft().1));
        log.got((bench.drive.run_at(20).is_ok(), bench.drive.quick_stop(), bench.drive.state(), bench.shaft().1));
        log.got((bench.drive.set_mode(Mode::Positioning), bench.drive.enable(), bench.pass_ms(500), bench.shaft().1));
        log.got(bench.drive.move_to(0));
    });
}

fn faults<K: Sold>() {
    same(|bench: &mut Bench<K>, log| {
        log.got((bench.drive.enable(), bench.drive.reset_fault(), bench.drive.start_moving_to(100_000)));
        bench.pass_ms(500);
        bench.world(|inputs| inputs.sensor_fails = true);
        log.got((bench.drive.finish(), bench.drive.state(), bench.drive.cause(), bench.drive.move_to(0)));
        log.got((bench.drive.enable(), bench.drive.reset_fault(), bench.drive.state()));
        bench.world(|inputs| inputs.sensor_fails = false);
        log.got((bench.drive.reset_fault(), bench.drive.reset_fault(), bench.drive.state()));
        log.got((bench.drive.enable(), bench.drive.start_moving_to(100_000), bench.pass_ms(1000)));
        bench.world(|inputs| inputs.shaft = Shaft::Blocked);
        log.got((bench.drive.finish(), bench.drive.cause()));
        bench.world(|inputs| *inputs = Inputs::default());
        log.got((bench.drive.reset_fault(), bench.drive.fault_history()));
        log.got((bench.drive.clear_fault_history(), bench.drive.fault_history()));
        log.got((bench.drive.enable(), bench.drive.move_to(0)));
    });
}

fn conditions<K: Sold>() {
    same(|bench: &mut Bench<K>, log| {
        let without_power = |inputs: &mut Inputs| {
            if K::MODEL.drive.enable_input {
                inputs.enable = false;
            } else {
                inputs.output_stage_supply_100mv = 0;
            }
        };
        bench.world(without_power);
        log.got(bench.drive.enable().map(|()| bench.drive.move_to(100)));
        bench.world(|inputs| *inputs = Inputs::default());
        log.got((bench.drive.enable(), bench.drive.start_moving_to(5000), bench.pass_ms(1000)));
        bench.world(without_power);
        bench.drive.set_patience(Duration::from_secs(2));
        log.got(matches!(bench.drive.finish(), Ok(Outcome::Reached { .. })));
        log.got(bench.drive.move_to(100).is_err());
        bench.pass_ms(1000);
        bench.world(|inputs| *inputs = Inputs::default());
        bench.pass_ms(1000);
        log.got(bench.shaft().1);
        bench.drive.set_patience(Duration::from_secs(60));
        log.got((bench.drive.enable(), bench.drive.move_to(0)));
        bench.world(|inputs| inputs.limit_switches = [true, false]);
        log.got((bench.drive.move_to(100), bench.drive.warning()));
    });
}

fn limits<K: Sold>() {
    same(|bench: &mut Bench<K>, log| {
        log.got((bench.drive.limits(), bench.drive.enable(), bench.drive.move_to(2000)));
        let set = |bench: &mut Bench<K>, sub, value| {
            let mut settings = bench.drive.read_parameters().unwrap();
            settings.retain(|setting| setting.address == Address::new(0x607D, sub));
            settings.iter_mut().for_each(|setting| setting.value = value);
            bench.drive.write_parameters(&settings)
        };
        log.got((set(bench, 2, 1000), bench.drive.limits(), bench.drive.move_to(0)));
        log.got((bench.drive.inch(Direction::Positive), bench.drive.inch(Direction::Negative)));
        log.got((bench.pass_ms(2500), bench.drive.stop_inching().is_ok(), bench.drive.move_to(1001)));
        log.got(bench.drive.move_to(0));
        // One error number of PROFIBUS stands for several abort codes.
        log.got((set(bench, 2, -2_000_000).is_err(), set(bench, 2, 99_999_999).is_err(), bench.drive.limits()));
    });
}

fn parameters<K: Sold>() {
    same(|bench: &mut Bench<K>, log| {
        let settings = bench.drive.read_parameters().unwrap();
        log.got(&settings);
        log.got((bench.drive.units(), bench.drive.approach(), bench.drive.limits()));
        log.got((bench.drive.set_approach(Approach::Positive), bench.drive.approach()));
        log.got((bench.drive.calibrate(1234), bench.drive.position(), bench.drive.calibrate(1_000_000)));
        let mut others = settings.clone();
        for setting in &mut others {
            setting.value = if (0x2410..=0x2412).contains(&setting.address.index()) { 7 } else { setting.value };
        }
        log.got((bench.drive.compare_parameters(&others), bench.drive.write_parameters(&others)));
        log.got(bench.drive.read_parameters());
        log.got(bench.drive.restore(Some(ParameterSet::Controller)));
        log.got(bench.drive.read_parameters());
        log.got((bench.drive.restore(None), bench.drive.read_parameters()));
    });
}

/// Nobody sends a SYNC here.
fn starts_by_sync<K: Sold>() {
    same(|bench: &mut Bench<K>, log| {
        log.got((bench.drive.set_start_by_sync(true), bench.drive.enable(), bench.drive.prepare_moving_to(1000)));
        log.got((bench.pass_ms(1000), bench.shaft(), bench.drive.confirm_start().is_err()));
        log.got((bench.drive.disable(), bench.drive.set_start_by_sync(false), bench.drive.enable()));
        log.got((bench.drive.move_to(1000), bench.shaft()));
    });
}

fn what_it_does_not_have<K: Sold>() {
    same(|bench: &mut Bench<K>, log| {
        log.got((bench.drive.home(1), bench.drive.store(), bench.drive.apply_torque(1), bench.drive.torque()));
        log.got((bench.drive.temperature(), bench.drive.battery_voltage(), bench.drive.torque_deactivated()));
        log.got((bench.drive.set_torque_threshold(Some(50)), bench.drive.torque_threshold()));
        log.got(bench.drive.set_mode(Mode::Torque));
    });
}
