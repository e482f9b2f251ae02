//! The simulated controller against chapters 2, 5 and 7 of the manual, without any bus, beyond what `tests/verify` asks it.

use super::controller_rig::Rig;
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
    let mut rig = Rig::new(Parameters::default());
    rig.shows("xxxx xxxx x1x1 0000");
    rig.controller.set_network(rig.now, Network::Operational);
    rig.control(0x0106);
    rig.shows("xxxx xxxx x01x 0001");
    rig.control(0x0107);
    rig.shows("xxxx xxxx x01x 0011");
    rig.control(0x010F);
    rig.shows("0000 0x11 0011 0111");
    rig.travel_to(5000);
    rig.pass_ms(100);
    rig.shows("1101 0010 0011 0111");
    rig.system_shows("0100 1000 0001 0000");
    rig.control(0x011F);
    rig.pass_ms(1000);
    rig.shows("0101 0010 0011 0111");
    rig.control(0x001F);
    rig.pass_ms(60_000);
    rig.shows("0001 0111 0011 0111");
    rig.system_shows("0000 0000 0000 1000");
    assert_eq!(rig.controller.position(rig.now), 5000);
    rig.control(0x010F);
    rig.shows("0000 0111 0011 0111");
    rig.control(0x0002);
    rig.shows("xxxx xxxx x00x 0111");
    rig.control(0x0000);
    rig.shows("xxxx xxxx x1x1 0000");
}

#[test]
fn the_status_word_follows_the_flow_chart_of_velocity_mode() {
    let mut rig = Rig::enabled(Parameters { mode: Mode::Velocity, ..Parameters::default() });
    rig.shows("0001 0x11 0011 0111");
    rig.set(|parameters| parameters.target_velocity = 68);
    rig.pass_ms(1000);
    assert_eq!(rig.controller.velocity(rig.now), 0, "a target alone does not start the drive");
    rig.control(0x000F);
    rig.pass_ms(200);
    rig.shows("0000 0010 0011 0111");
    rig.pass_ms(5000);
    rig.shows("0000 0110 0011 0111");
    rig.system_shows("00xx 1000 0001 1000");
    assert_eq!(rig.controller.velocity(rig.now), 68);
    rig.set(|parameters| parameters.target_velocity = 30);
    rig.pass_ms(5000);
    assert_eq!(rig.controller.velocity(rig.now), 30);
    rig.control(0x010F);
    rig.pass_ms(5000);
    rig.shows("0001 0011 0011 0111");
    assert_eq!(rig.controller.velocity(rig.now), 0);
}

#[test]
fn a_stop_given_with_the_setpoint_forbids_the_start() {
    let mut rig = Rig::enabled(Parameters { target_position: 5000, ..Parameters::default() });
    rig.control(0x011F);
    assert!(!rig.has(status::POSITIONING));
}

/// From where the drive stands at a limit, by whichever order, and whether or not the other way was tried first.
#[test]
fn at_a_limit_the_way_back_is_free() {
    type Order = fn(&mut Rig, bool);
    let orders: [(&str, Order); 4] = [
        ("inching 1", |rig, _| rig.control(0x200F)),
        ("inching 2", |rig, up| rig.control(if up { 0x400F } else { 0x800F })),
        ("a key", |rig, up| {
            rig.controller.set_network(rig.now, Network::PreOperational);
            rig.world(|inputs| inputs.key = Some(if up { Key::CounterClockwise } else { Key::Clockwise }));
        }),
        ("a travel", |rig, _| rig.travel_to(0)),
    ];
    for (name, order) in orders {
        for (limits, limit, delta_inch) in [([-1000, 333], 333, -100), ([-333, 1000], -333, 100)] {
            for ((numerator, denominator), tried) in [((1, 1), false), ((378, 100), false), ((7, 9), true)] {
                let parameters = Parameters { limits, delta_inch, numerator, denominator, ..Parameters::default() };
                let mut rig = Rig::enabled(parameters);
                rig.travel_to(limit);
                rig.pass_ms(60_000);
                assert!(rig.controller.position(rig.now) == limit && !rig.has(status::INTERNAL_LIMIT));
                if tried {
                    rig.control(if limit > 0 { 0x400F } else { 0x800F });
                    rig.pass_ms(1000);
                    assert_eq!(rig.controller.position(rig.now), limit);
                }
                rig.control(0x000F);
                order(&mut rig, limit < 0);
                rig.pass_ms(1000);
                let back = (limit - rig.controller.position(rig.now)) * limit.signum();
                assert!(back > 0, "{name} from {limit}: {back}");
            }
        }
    }
}

/// What brakes needs its motor for it: without torque or supply, it runs out (2.5).
#[test]
fn a_quick_stop_that_loses_its_torque_runs_out() {
    type Loss = fn(&mut Rig);
    let losses: [(&str, Loss); 3] = [
        ("disable voltage", |rig| rig.control(0x0100)),
        ("PRE-OPERATIONAL", |rig| rig.controller.set_network(rig.now, Network::PreOperational)),
        ("no supply", |rig| rig.world(|inputs| inputs.output_stage_supply_100mv = 0)),
    ];
    for (name, loss) in losses {
        let mut rig = Rig::enabled(Parameters { v_pos: 120, ..Parameters::default() });
        rig.travel_to(100_000);
        rig.pass_ms(2000);
        rig.control(0x010B);
        rig.pass_ms(100);
        loss(&mut rig);
        rig.pass_ms(500);
        // 2 rev/s: 0.4 rev/s less by braking, and 1 rev/s less by running out.
        assert_eq!(rig.controller.velocity(rig.now), 36, "{name}");
    }
}

#[test]
fn leaving_operational_releases_the_motor() {
    for network in [Network::PreOperational, Network::Stopped] {
        let mut rig = Rig::enabled(Parameters::default());
        rig.travel_to(5000);
        rig.pass_ms(1000);
        rig.controller.set_network(rig.now, network);
        assert_eq!(rig.controller.state(), State::SwitchOnDisabled);
        rig.system_shows("0xxx xxx0 1xx1 xxxx");
        rig.pass_ms(250);
        assert_eq!(rig.controller.position(rig.now), 800, "it runs out");
        assert_eq!(rig.has(status::REMOTE), network == Network::Stopped);
        rig.control(0x0106);
        assert_eq!(rig.controller.state(), State::SwitchOnDisabled);
    }
}

#[test]
fn a_key_that_is_held_down_is_locked_when_the_drive_becomes_operational() {
    let mut rig = Rig::new(Parameters::default());
    rig.world(|inputs| inputs.key = Some(Key::CounterClockwise));
    rig.pass_ms(1000);
    rig.controller.set_network(rig.now, Network::Operational);
    rig.pass_ms(1000);
    assert_eq!(rig.controller.position(rig.now), 750);
}

#[test]
fn at_the_target_the_motor_holds_brakes_or_lets_go() {
    for (in_position_mode, motor, current_ma, turned) in
        [(0, Motor::InControl, Inputs::HOLDING_CURRENT_MA, 0), (1, Motor::Shorted, 0, 0), (2, Motor::Released, 0, 25)]
    {
        let mut rig = Rig::enabled(Parameters { in_position_mode, ..Parameters::default() });
        rig.travel_to(100);
        assert_eq!(rig.controller.motor(rig.now), Motor::InControl);
        rig.pass_ms(10_000);
        let controller = &mut rig.controller;
        assert_eq!(controller.motor(rig.now), motor, "mode {in_position_mode}");
        assert_eq!(controller.current_ma(rig.now), current_ma, "mode {in_position_mode}");
        let shown = controller.system_status(rig.now) & system::MOTOR_RELEASED != 0;
        assert_eq!(shown, motor == Motor::Released, "mode {in_position_mode}");
        assert_eq!(controller.turn_shaft(rig.now, 25), turned != 0);
        assert_eq!(controller.position(rig.now), 100 + turned, "mode {in_position_mode}");
        assert_eq!(rig.has(status::TARGET_REACHED), turned == 0, "25 is beyond the window of 10");
        // The next travel takes the motor into control again.
        rig.control(0x000F);
        rig.travel_to(300);
        assert_eq!(rig.controller.motor(rig.now), Motor::InControl);
        rig.pass_ms(10_000);
        assert_eq!(rig.controller.position(rig.now), 300);
    }
}

#[test]
fn in_position_modes_are_for_positioning_only() {
    let mut rig = Rig::enabled(Parameters { in_position_mode: 2, ..Parameters::default() });
    rig.control(0x000F);
    rig.control(0x200F);
    rig.pass_ms(10_000);
    assert_eq!(rig.controller.motor(rig.now), Motor::InControl, "after inching 1");
    rig.control(0x000F);
    rig.travel_to(5000);
    rig.pass_ms(500);
    rig.control(0x011F);
    rig.pass_ms(10_000);
    assert_eq!(rig.controller.motor(rig.now), Motor::InControl, "while a positioning is interrupted");
}

/// Provokes a fault while travelling, checks it, removes its cause and resets it.
#[track_caller]
fn check_fault(fault: Fault, after_ms: u64, cause: impl FnOnce(&mut Inputs)) {
    let mut rig = Rig::enabled(Parameters::default());
    rig.travel_to(100_000);
    rig.pass_ms(1000);
    rig.world(cause);
    if after_ms > 0 {
        rig.pass_ms(after_ms - 1);
        assert_eq!(rig.codes(), [0; 0], "{fault}: too early");
        rig.pass_ms(1);
    }
    assert_eq!(rig.codes(), [fault.code.number], "{fault}");
    assert_eq!(rig.controller.faults(), [fault]);
    assert_eq!(rig.controller.error_register(), fault.register);
    assert_eq!(rig.controller.state(), State::Fault);
    rig.shows("xxxx xxx0 x0xx 1000");
    rig.system_shows("x0xx 1xx1 1xxx xxxx");
    rig.pass_ms(5000);
    assert_eq!(rig.controller.velocity(rig.now), 0, "{fault}");
    let persists = !matches!(fault, fault::SHAFT_BLOCKED | fault::OVERCURRENT | fault::UNDERVOLTAGE);
    if persists {
        rig.control(control::FAULT_RESET);
        assert_eq!(rig.controller.state(), State::Fault, "{fault}: its cause is still there");
        rig.control(0);
    }
    rig.world(|inputs| *inputs = Inputs::default());
    rig.codes();
    rig.control(control::FAULT_RESET);
    assert_eq!(rig.controller.state(), State::SwitchOnDisabled, "{fault}");
    assert_eq!((rig.codes(), rig.controller.error_register()), (vec![0], 0), "{fault}");
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
    let mut rig = Rig::enabled(Parameters::default());
    rig.travel_to(100_000);
    rig.pass_ms(1000);
    rig.world(|inputs| (inputs.shaft, inputs.load_ma) = (Shaft::Blocked, 4000));
    rig.system_shows("1x1x xxx0 xxx0 xxxx");
    rig.pass_ms(10_000);
    assert_eq!(rig.controller.faults(), [fault::SHAFT_BLOCKED], "it comes first, and ends the current");
}

#[test]
fn a_lost_supply_takes_the_torque_and_is_no_fault() {
    let mut rig = Rig::enabled(Parameters::default());
    rig.travel_to(100_000);
    rig.pass_ms(1000);
    rig.world(|inputs| inputs.output_stage_supply_100mv = 0);
    rig.pass_ms(1000);
    assert_eq!((rig.codes(), rig.controller.velocity(rig.now)), (vec![], 0));
    rig.system_shows("0000 1100 1000 0000");
    assert_eq!(rig.controller.generic_status(), 0);
    assert!(!rig.has(status::VOLTAGE_ENABLED | status::READY | status::POSITIONING));
    rig.control(0x000F);
    rig.control(0x001F);
    assert!(!rig.has(status::POSITIONING));
}

/// Table 1 excepts no mode from bit 15.
#[test]
fn a_load_that_is_too_high_is_a_lag_error_in_inching_too() {
    type Start = fn(&mut Rig);
    let starts: [(&str, Start); 3] = [
        ("inching 1", |rig| rig.control(0x200F)),
        ("inching 2", |rig| rig.control(0x800F)),
        ("key", |rig| {
            rig.controller.set_network(rig.now, Network::PreOperational);
            rig.world(|inputs| inputs.key = Some(Key::Clockwise));
        }),
    ];
    for (name, start) in starts {
        let mut rig = Rig::enabled(Parameters { delta_inch: -5000, ..Parameters::default() });
        rig.control(0x000F);
        start(&mut rig);
        rig.pass_ms(1000);
        assert!(!rig.has(status::WARNING), "{name}");
        rig.world(|inputs| inputs.attainable_rpm = Some(15));
        rig.pass_ms(1000);
        assert_eq!(rig.controller.velocity(rig.now), -15, "{name}: it follows at once");
        rig.system_shows("1xxx xxx0 xxx1 xxxx");
        assert!(rig.has(status::WARNING), "{name}");
        rig.world(|inputs| inputs.attainable_rpm = None);
        rig.pass_ms(1000);
        assert_eq!(rig.controller.velocity(rig.now), -30, "{name}");
        rig.system_shows("0xxx xxx0 xxx1 xxxx");
        assert!(!rig.has(status::WARNING), "{name}");
    }
}

/// What has been ordered to end does not go on because its load changes.
#[test]
fn inching_that_ends_does_not_begin_again_with_another_load() {
    let mut rig = Rig::enabled(Parameters { inching_stop: 1, a_inch: 10, ..Parameters::default() });
    rig.control(0x000F);
    rig.control(0x400F);
    rig.pass_ms(3000);
    rig.control(0x000F);
    rig.world(|inputs| inputs.attainable_rpm = Some(15));
    rig.pass_ms(100);
    assert!(!rig.has(status::WARNING));
    rig.pass_ms(3000);
    assert_eq!(rig.controller.velocity(rig.now), 0);
}

#[test]
fn the_words_change_only_when_announced() {
    // A span that next_change skips must look the same throughout.
    let mut rig = Rig::enabled(Parameters { positioning_type: 2, limits: [-800, 2500], ..Parameters::default() });
    rig.travel_to(2000);
    for _ in 0..50 {
        let words = |rig: &Rig, at| (rig.controller.status_word(at), rig.controller.system_status(at));
        let next = rig.controller.next_change(rig.now);
        let until = next.unwrap_or(rig.now + Duration::from_secs(10));
        let before = words(&rig, rig.now);
        let span = until.since(rig.now).as_micros();
        for part in 0..1000 {
            let at = rig.now + Duration::from_micros(span.saturating_sub(1) * part / 999);
            assert_eq!(words(&rig, at), before, "at {at}, announced for {until}");
        }
        rig.now = until;
        if next.is_none() {
            assert_eq!(rig.controller.position(rig.now), 2000);
            return;
        }
    }
    panic!("the drive does not come to rest");
}

#[test]
fn the_system_status_follows_the_flow_chart_of_orders_beside_the_bus() {
    let mut rig = Rig::new(Parameters { target_position: 5000, ..Parameters::default() });
    rig.system_shows("000x 0000 1000 0000");
    rig.controller.order(rig.now, Order::Enable).unwrap();
    rig.controller.order(rig.now, Order::Start).unwrap();
    rig.pass_ms(1000);
    rig.system_shows("x1xx 10x0 0001 0000");
    rig.controller.order(rig.now, Order::Interrupt(Braking::Full)).unwrap();
    // It is ready when it stands, and not while it brakes.
    rig.system_shows("x10x 10x0 0001 0000");
    rig.pass_ms(1000);
    rig.system_shows("x10x 00x0 0000 0000");
}

#[test]
fn the_bus_releases_a_motor_that_another_interface_has_in_control() {
    let mut rig = Rig::new(Parameters { target_position: 5000, ..Parameters::default() });
    rig.controller.order(rig.now, Order::Enable).unwrap();
    rig.controller.order(rig.now, Order::Start).unwrap();
    rig.pass_ms(1000);
    rig.controller.set_network(rig.now, Network::Operational);
    assert_eq!(rig.controller.state(), State::SwitchOnDisabled);
    for word in [0x0106, 0x0107, 0x010F] {
        rig.control(word);
    }
    rig.controller.set_network(rig.now, Network::Operational);
    assert_eq!(rig.controller.state(), State::OperationEnabled);
}

#[test]
fn a_word_that_enables_does_not_start_a_travel() {
    let mut rig = Rig::new(Parameters { target_position: 5000, ..Parameters::default() });
    rig.controller.set_network(rig.now, Network::Operational);
    for word in [0x0006, 0x0007, 0x001F] {
        rig.control(word);
    }
    rig.pass_ms(1000);
    assert_eq!(rig.controller.position(rig.now), 0);
}

#[test]
fn a_load_that_is_too_high_is_a_lag_error_and_no_fault() {
    let mut rig = Rig::enabled(Parameters::default());
    rig.world(|inputs| inputs.attainable_rpm = Some(15));
    rig.travel_to(5000);
    rig.pass_ms(2000);
    assert_eq!(rig.controller.velocity(rig.now), 15);
    rig.system_shows("1100 1000 0001 0000");
    assert!(rig.has(status::WARNING));
    rig.pass_ms(60_000);
    rig.system_shows("0000 0000 0000 1000");
    assert_eq!(rig.codes(), [0; 0]);
}
