//! The simulated controller against chapters 2, 5 and 7 of the manual, without any bus, beyond what `tests/verify` asks it.

use super::controller_rig::Bench;
use lexican_runtime::Duration;
use siko_ag03_1::fault::{self, Fault};
use siko_ag03_1::sim::controller::{Motor, Network};
use siko_ag03_1::sim::inputs::{BusState, Inputs, Key, Shaft};
use siko_ag03_1::sim::parameters::{Mode, Parameters};
use siko_ag03_1::sim::{Braking, Order};
use siko_ag03_1::state::State;
use siko_ag03_1::words::{control, status, system};

#[test]
fn the_status_word_follows_the_flow_chart_of_positioning() {
    let mut bench = Bench::new(Parameters::default());
    bench.shows("xxxx xxxx x1x1 0000");
    bench.controller.set_network(bench.now, Network::Operational);
    bench.control(0x0106);
    bench.shows("xxxx xxxx x01x 0001");
    bench.control(0x0107);
    bench.shows("xxxx xxxx x01x 0011");
    bench.control(0x010F);
    bench.shows("0000 0x11 0011 0111");
    bench.travel_to(5000);
    bench.pass_ms(100);
    bench.shows("1101 0010 0011 0111");
    bench.system_shows("0100 1000 0001 0000");
    bench.control(0x011F);
    bench.pass_ms(1000);
    bench.shows("0101 0010 0011 0111");
    bench.control(0x001F);
    bench.pass_ms(60_000);
    bench.shows("0001 0111 0011 0111");
    bench.system_shows("0000 0000 0000 1000");
    assert_eq!(bench.controller.position(bench.now), 5000);
    bench.control(0x010F);
    bench.shows("0000 0111 0011 0111");
    bench.control(0x0002);
    bench.shows("xxxx xxxx x00x 0111");
    bench.control(0x0000);
    bench.shows("xxxx xxxx x1x1 0000");
}

#[test]
fn the_status_word_follows_the_flow_chart_of_velocity_mode() {
    let mut bench = Bench::enabled(Parameters { mode: Mode::Velocity, ..Parameters::default() });
    bench.shows("0001 0x11 0011 0111");
    bench.set(|parameters| parameters.target_velocity = 68);
    bench.pass_ms(1000);
    assert_eq!(bench.controller.velocity(bench.now), 0, "a target alone does not start the drive");
    bench.control(0x000F);
    bench.pass_ms(200);
    bench.shows("0000 0010 0011 0111");
    bench.pass_ms(5000);
    bench.shows("0000 0110 0011 0111");
    bench.system_shows("00xx 1000 0001 1000");
    assert_eq!(bench.controller.velocity(bench.now), 68);
    bench.set(|parameters| parameters.target_velocity = 30);
    bench.pass_ms(5000);
    assert_eq!(bench.controller.velocity(bench.now), 30);
    bench.control(0x010F);
    bench.pass_ms(5000);
    bench.shows("0001 0011 0011 0111");
    assert_eq!(bench.controller.velocity(bench.now), 0);
}

#[test]
fn a_stop_given_with_the_setpoint_forbids_the_start() {
    let mut bench = Bench::enabled(Parameters { target_position: 5000, ..Parameters::default() });
    bench.control(0x011F);
    assert!(!bench.has(status::POSITIONING));
}

/// From where the drive stands at a limit, by whichever order, and whether or not the other way was tried first.
#[test]
fn at_a_limit_the_way_back_is_free() {
    type Order = fn(&mut Bench, bool);
    let orders: [(&str, Order); 4] = [
        ("inching 1", |bench, _| bench.control(0x200F)),
        ("inching 2", |bench, up| bench.control(if up { 0x400F } else { 0x800F })),
        ("a key", |bench, up| {
            bench.controller.set_network(bench.now, Network::PreOperational);
            bench.world(|inputs| inputs.key = Some(if up { Key::CounterClockwise } else { Key::Clockwise }));
        }),
        ("a travel", |bench, _| bench.travel_to(0)),
    ];
    for (name, order) in orders {
        for (limits, limit, delta_inch) in [([-1000, 333], 333, -100), ([-333, 1000], -333, 100)] {
            for ((numerator, denominator), tried) in [((1, 1), false), ((378, 100), false), ((7, 9), true)] {
                let parameters = Parameters { limits, delta_inch, numerator, denominator, ..Parameters::default() };
                let mut bench = Bench::enabled(parameters);
                bench.travel_to(limit);
                bench.pass_ms(60_000);
                assert!(bench.controller.position(bench.now) == limit && !bench.has(status::INTERNAL_LIMIT));
                if tried {
                    bench.control(if limit > 0 { 0x400F } else { 0x800F });
                    bench.pass_ms(1000);
                    assert_eq!(bench.controller.position(bench.now), limit);
                }
                bench.control(0x000F);
                order(&mut bench, limit < 0);
                bench.pass_ms(1000);
                let back = (limit - bench.controller.position(bench.now)) * limit.signum();
                assert!(back > 0, "{name} from {limit}: {back}");
            }
        }
    }
}

/// What brakes needs its motor for it: without torque or supply, it runs out (2.5).
#[test]
fn a_quick_stop_that_loses_its_torque_runs_out() {
    type Loss = fn(&mut Bench);
    let losses: [(&str, Loss); 3] = [
        ("disable voltage", |bench| bench.control(0x0100)),
        ("PRE-OPERATIONAL", |bench| bench.controller.set_network(bench.now, Network::PreOperational)),
        ("no supply", |bench| bench.world(|inputs| inputs.output_stage_supply_100mv = 0)),
    ];
    for (name, loss) in losses {
        let mut bench = Bench::enabled(Parameters { v_pos: 120, ..Parameters::default() });
        bench.travel_to(100_000);
        bench.pass_ms(2000);
        bench.control(0x010B);
        bench.pass_ms(100);
        loss(&mut bench);
        bench.pass_ms(500);
        // 2 rev/s: 0.4 rev/s less by braking, and 1 rev/s less by running out.
        assert_eq!(bench.controller.velocity(bench.now), 36, "{name}");
    }
}

#[test]
fn leaving_operational_releases_the_motor() {
    for network in [Network::PreOperational, Network::Stopped] {
        let mut bench = Bench::enabled(Parameters::default());
        bench.travel_to(5000);
        bench.pass_ms(1000);
        bench.controller.set_network(bench.now, network);
        assert_eq!(bench.controller.state(), State::SwitchOnDisabled);
        bench.system_shows("0xxx xxx0 1xx1 xxxx");
        bench.pass_ms(250);
        assert_eq!(bench.controller.position(bench.now), 800, "it runs out");
        assert_eq!(bench.has(status::REMOTE), network == Network::Stopped);
        bench.control(0x0106);
        assert_eq!(bench.controller.state(), State::SwitchOnDisabled);
    }
}

#[test]
fn a_key_that_is_held_down_is_locked_when_the_drive_becomes_operational() {
    let mut bench = Bench::new(Parameters::default());
    bench.world(|inputs| inputs.key = Some(Key::CounterClockwise));
    bench.pass_ms(1000);
    bench.controller.set_network(bench.now, Network::Operational);
    bench.pass_ms(1000);
    assert_eq!(bench.controller.position(bench.now), 750);
}

#[test]
fn at_the_target_the_motor_holds_brakes_or_lets_go() {
    for (in_position_mode, motor, current_ma, turned) in
        [(0, Motor::InControl, Inputs::HOLDING_CURRENT_MA, 0), (1, Motor::Shorted, 0, 0), (2, Motor::Released, 0, 25)]
    {
        let mut bench = Bench::enabled(Parameters { in_position_mode, ..Parameters::default() });
        bench.travel_to(100);
        assert_eq!(bench.controller.motor(bench.now), Motor::InControl);
        bench.pass_ms(10_000);
        let controller = &mut bench.controller;
        assert_eq!(controller.motor(bench.now), motor, "mode {in_position_mode}");
        assert_eq!(controller.current_ma(bench.now), current_ma, "mode {in_position_mode}");
        let shown = controller.system_status(bench.now) & system::MOTOR_RELEASED != 0;
        assert_eq!(shown, motor == Motor::Released, "mode {in_position_mode}");
        assert_eq!(controller.turn_shaft(bench.now, 25), turned != 0);
        assert_eq!(controller.position(bench.now), 100 + turned, "mode {in_position_mode}");
        assert_eq!(bench.has(status::TARGET_REACHED), turned == 0, "25 is beyond the window of 10");
        // The next travel takes the motor into control again.
        bench.control(0x000F);
        bench.travel_to(300);
        assert_eq!(bench.controller.motor(bench.now), Motor::InControl);
        bench.pass_ms(10_000);
        assert_eq!(bench.controller.position(bench.now), 300);
    }
}

#[test]
fn in_position_modes_are_for_positioning_only() {
    let mut bench = Bench::enabled(Parameters { in_position_mode: 2, ..Parameters::default() });
    bench.control(0x000F);
    bench.control(0x200F);
    bench.pass_ms(10_000);
    assert_eq!(bench.controller.motor(bench.now), Motor::InControl, "after inching 1");
    bench.control(0x000F);
    bench.travel_to(5000);
    bench.pass_ms(500);
    bench.control(0x011F);
    bench.pass_ms(10_000);
    assert_eq!(bench.controller.motor(bench.now), Motor::InControl, "while a positioning is interrupted");
}

/// Provokes a fault while travelling, checks it, removes its cause and resets it.
#[track_caller]
fn check_fault(fault: Fault, after_ms: u64, cause: impl FnOnce(&mut Inputs)) {
    let mut bench = Bench::enabled(Parameters::default());
    bench.travel_to(100_000);
    bench.pass_ms(1000);
    bench.world(cause);
    if after_ms > 0 {
        bench.pass_ms(after_ms - 1);
        assert_eq!(bench.codes(), [0; 0], "{fault}: too early");
        bench.pass_ms(1);
    }
    assert_eq!(bench.codes(), [fault.code.number], "{fault}");
    assert_eq!(bench.controller.faults(), [fault]);
    assert_eq!(bench.controller.error_register(), fault.register);
    assert_eq!(bench.controller.state(), State::Fault);
    bench.shows("xxxx xxx0 x0xx 1000");
    bench.system_shows("x0xx 1xx1 1xxx xxxx");
    bench.pass_ms(5000);
    assert_eq!(bench.controller.velocity(bench.now), 0, "{fault}");
    let persists = !matches!(fault, fault::SHAFT_BLOCKED | fault::OVERCURRENT | fault::UNDERVOLTAGE);
    if persists {
        bench.control(control::FAULT_RESET);
        assert_eq!(bench.controller.state(), State::Fault, "{fault}: its cause is still there");
        bench.control(0);
    }
    bench.world(|inputs| *inputs = Inputs::default());
    bench.codes();
    bench.control(control::FAULT_RESET);
    assert_eq!(bench.controller.state(), State::SwitchOnDisabled, "{fault}");
    assert_eq!((bench.codes(), bench.controller.error_register()), (vec![0], 0), "{fault}");
}

#[test]
fn every_fault_of_table_2_comes_from_its_cause() {
    check_fault(fault::UNDERVOLTAGE, 0, |inputs| inputs.output_stage_supply_100mv = 179);
    check_fault(fault::SHAFT_BLOCKED, 500, |inputs| inputs.shaft = Shaft::Blocked);
    check_fault(fault::OVERCURRENT, 4000, |inputs| inputs.load_ma = 2401);
    check_fault(fault::OVERTEMPERATURE, 0, |inputs| inputs.temperature_100mdegc = 901);
    check_fault(fault::SENSOR, 0, |inputs| inputs.sensor_fails = true);
    check_fault(fault::INTERNAL, 0, |inputs| inputs.internal_error = true);
    check_fault(fault::OVERVOLTAGE, 0, |inputs| inputs.output_stage_supply_100mv = 351);
    check_fault(fault::BUS_PASSIVE, 0, |inputs| inputs.bus = BusState::Passive);
    check_fault(fault::BUS_OFF, 0, |inputs| inputs.bus = BusState::Off);
    check_fault(fault::BATTERY, 0, |inputs| inputs.battery_10mv = 219);
}

#[test]
fn a_motor_that_is_overloaded_by_a_blocked_shaft_is_a_blocked_shaft() {
    let mut bench = Bench::enabled(Parameters::default());
    bench.travel_to(100_000);
    bench.pass_ms(1000);
    bench.world(|inputs| (inputs.shaft, inputs.load_ma) = (Shaft::Blocked, 4000));
    bench.system_shows("1x1x xxx0 xxx0 xxxx");
    bench.pass_ms(10_000);
    assert_eq!(bench.controller.faults(), [fault::SHAFT_BLOCKED], "it comes first, and ends the current");
}

#[test]
fn a_lost_supply_takes_the_torque_and_is_no_fault() {
    let mut bench = Bench::enabled(Parameters::default());
    bench.travel_to(100_000);
    bench.pass_ms(1000);
    bench.world(|inputs| inputs.output_stage_supply_100mv = 0);
    bench.pass_ms(1000);
    assert_eq!((bench.codes(), bench.controller.velocity(bench.now)), (vec![], 0));
    bench.system_shows("0000 1100 1000 0000");
    assert_eq!(bench.controller.generic_status(), 0);
    assert!(!bench.has(status::VOLTAGE_ENABLED | status::READY | status::POSITIONING));
    bench.control(0x000F);
    bench.control(0x001F);
    assert!(!bench.has(status::POSITIONING));
}

/// Table 1 excepts no mode from bit 15.
#[test]
fn a_load_that_is_too_high_is_a_lag_error_in_inching_too() {
    type Start = fn(&mut Bench);
    let starts: [(&str, Start); 3] = [
        ("inching 1", |bench| bench.control(0x200F)),
        ("inching 2", |bench| bench.control(0x800F)),
        ("key", |bench| {
            bench.controller.set_network(bench.now, Network::PreOperational);
            bench.world(|inputs| inputs.key = Some(Key::Clockwise));
        }),
    ];
    for (name, start) in starts {
        let mut bench = Bench::enabled(Parameters { delta_inch: -5000, ..Parameters::default() });
        bench.control(0x000F);
        start(&mut bench);
        bench.pass_ms(1000);
        assert!(!bench.has(status::WARNING), "{name}");
        bench.world(|inputs| inputs.attainable_rpm = Some(15));
        bench.pass_ms(1000);
        assert_eq!(bench.controller.velocity(bench.now), -15, "{name}: it follows at once");
        bench.system_shows("1xxx xxx0 xxx1 xxxx");
        assert!(bench.has(status::WARNING), "{name}");
        bench.world(|inputs| inputs.attainable_rpm = None);
        bench.pass_ms(1000);
        assert_eq!(bench.controller.velocity(bench.now), -30, "{name}");
        bench.system_shows("0xxx xxx0 xxx1 xxxx");
        assert!(!bench.has(status::WARNING), "{name}");
    }
}

/// What has been ordered to end does not go on because its load changes.
#[test]
fn inching_that_ends_does_not_begin_again_with_another_load() {
    let mut bench = Bench::enabled(Parameters { inching_stop: 1, a_inch: 10, ..Parameters::default() });
    bench.control(0x000F);
    bench.control(0x400F);
    bench.pass_ms(3000);
    bench.control(0x000F);
    bench.world(|inputs| inputs.attainable_rpm = Some(15));
    bench.pass_ms(100);
    assert!(!bench.has(status::WARNING));
    bench.pass_ms(3000);
    assert_eq!(bench.controller.velocity(bench.now), 0);
}

#[test]
fn the_words_change_only_when_announced() {
    // A span that next_change skips must look the same throughout.
    let mut bench = Bench::enabled(Parameters { positioning_type: 2, limits: [-800, 2500], ..Parameters::default() });
    bench.travel_to(2000);
    for _ in 0..50 {
        let words = |bench: &Bench, at| (bench.controller.status_word(at), bench.controller.system_status(at));
        let next = bench.controller.next_change(bench.now);
        let until = next.unwrap_or(bench.now + Duration::from_secs(10));
        let before = words(&bench, bench.now);
        let span = until.since(bench.now).as_micros();
        for part in 0..1000 {
            let at = bench.now + Duration::from_micros(span.saturating_sub(1) * part / 999);
            assert_eq!(words(&bench, at), before, "at {at}, announced for {until}");
        }
        bench.now = until;
        if next.is_none() {
            assert_eq!(bench.controller.position(bench.now), 2000);
            return;
        }
    }
    panic!("the drive does not come to rest");
}

#[test]
fn the_system_status_follows_the_flow_chart_of_orders_beside_the_bus() {
    let mut bench = Bench::new(Parameters { target_position: 5000, ..Parameters::default() });
    bench.system_shows("000x 0000 1000 0000");
    bench.controller.order(bench.now, Order::Enable).unwrap();
    bench.controller.order(bench.now, Order::Start).unwrap();
    bench.pass_ms(1000);
    bench.system_shows("x1xx 10x0 0001 0000");
    bench.controller.order(bench.now, Order::Interrupt(Braking::Full)).unwrap();
    // It is ready when it stands, and not while it brakes.
    bench.system_shows("x10x 10x0 0001 0000");
    bench.pass_ms(1000);
    bench.system_shows("x10x 00x0 0000 0000");
}

#[test]
fn the_bus_releases_a_motor_that_another_interface_has_in_control() {
    let mut bench = Bench::new(Parameters { target_position: 5000, ..Parameters::default() });
    bench.controller.order(bench.now, Order::Enable).unwrap();
    bench.controller.order(bench.now, Order::Start).unwrap();
    bench.pass_ms(1000);
    bench.controller.set_network(bench.now, Network::Operational);
    assert_eq!(bench.controller.state(), State::SwitchOnDisabled);
    for word in [0x0106, 0x0107, 0x010F] {
        bench.control(word);
    }
    bench.controller.set_network(bench.now, Network::Operational);
    assert_eq!(bench.controller.state(), State::OperationEnabled);
}

#[test]
fn a_word_that_enables_does_not_start_a_travel() {
    let mut bench = Bench::new(Parameters { target_position: 5000, ..Parameters::default() });
    bench.controller.set_network(bench.now, Network::Operational);
    for word in [0x0006, 0x0007, 0x001F] {
        bench.control(word);
    }
    bench.pass_ms(1000);
    assert_eq!(bench.controller.position(bench.now), 0);
}

#[test]
fn a_load_that_is_too_high_is_a_lag_error_and_no_fault() {
    let mut bench = Bench::enabled(Parameters::default());
    bench.world(|inputs| inputs.attainable_rpm = Some(15));
    bench.travel_to(5000);
    bench.pass_ms(2000);
    assert_eq!(bench.controller.velocity(bench.now), 15);
    bench.system_shows("1100 1000 0001 0000");
    assert!(bench.has(status::WARNING));
    bench.pass_ms(60_000);
    bench.system_shows("0000 0000 0000 1000");
    assert_eq!(bench.codes(), [0; 0]);
}
