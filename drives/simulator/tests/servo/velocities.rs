//! Profile velocity and profile torque mode.

use lexican_runtime::object::DataType::{Integer16, Unsigned32};
use lexican_runtime::profile::cia402::State;
use simulator::servo::{Inputs, Scales, ServoModel};

use crate::support::{Rig, SERVO, dictionary};

const VELOCITY: i64 = 3;
const TORQUE: i64 = 4;
const REACHED: u16 = 1 << 10;
const LIMITED: u16 = 1 << 11;
const SLOW: u16 = 1 << 12;

#[test]
fn the_velocity_follows_its_target_by_ramps() {
    let mut rig = Rig::enabled(VELOCITY);
    assert_eq!(rig.mode_bits(), [true, true, false], "it stands, as it is to");
    rig.set(0x6084, 0, 5000).set(0x60FF, 0, 1000).pass(50);
    assert_eq!((rig.velocity(), rig.mode_bits()), (500, [false, false, false]));
    rig.pass(50);
    assert_eq!((rig.velocity(), rig.mode_bits()), (1000, [true, false, false]));
    // Through 0: 200 ms with 6084h, 50 ms with 6083h.
    rig.set(0x60FF, 0, -500).pass(200);
    assert_eq!((rig.velocity(), rig.status(SLOW)), (0, true));
    rig.pass(50);
    assert_eq!((rig.velocity(), rig.status(REACHED)), (-500, true));
}

#[test]
fn windows_have_their_times() {
    let mut rig = Rig::enabled(VELOCITY);
    rig.set(0x606D, 0, 100).set(0x606E, 0, 30).set(0x6070, 0, 20).set(0x60FF, 0, 1000).pass(119);
    assert!(!rig.status(REACHED), "900 units/s since 90 ms");
    rig.pass(1);
    assert!(rig.status(REACHED));
    rig.set(0x60FF, 0, 0).pass(119);
    assert!(!rig.status(SLOW), "5 units/s since 99.5 ms");
    rig.pass(1);
    assert!(rig.status(SLOW));
}

#[test]
fn halt_stops_and_the_target_counts_again_after_it() {
    let mut rig = Rig::enabled(VELOCITY);
    rig.set(0x60FF, 0, 1000).pass(200).control(0x10F).pass(100);
    assert_eq!((rig.velocity(), rig.status(REACHED)), (0, true));
    rig.control(0x0F).pass(100);
    assert_eq!(rig.velocity(), 1000);
}

#[test]
fn polarity_turns_velocities_round() {
    let mut rig = Rig::enabled(VELOCITY);
    rig.set(0x607E, 0, 0x40).set(0x60FF, 0, 1000).pass(200);
    assert_eq!(rig.velocity(), 1000);
    assert_eq!(rig.servo.shaft(rig.now).velocity, -1000.0);
}

#[test]
fn the_axis_stops_at_a_software_limit() {
    let mut rig = Rig::enabled(VELOCITY);
    rig.set(0x607D, 1, -100).set(0x607D, 2, 500).set(0x60FF, 0, 1000).pass(2000);
    assert_eq!((rig.position(), rig.velocity(), rig.status(LIMITED)), (500, 0, true));
    rig.set(0x60FF, 0, -1000).pass(50);
    assert!(rig.velocity() < 0 && !rig.status(LIMITED));
    rig.pass(2000);
    assert_eq!((rig.position(), rig.status(LIMITED)), (-100, true));
}

#[test]
fn a_limit_switch_stops_the_axis() {
    let mut rig = Rig::enabled(VELOCITY);
    rig.inputs(|inputs| inputs.machine.negative_limit = Some(-500.0)).set(0x60FF, 0, -1000).pass(2000);
    assert_eq!((rig.position(), rig.status(LIMITED)), (-505, true));
    rig.set(0x60FF, 0, 1000).pass(1000);
    assert!(rig.position() > 0);
}

#[test]
fn a_blocked_shaft_slips() {
    let mut rig = Rig::enabled(VELOCITY);
    rig.set(0x6065, 0, 0).set(0x60FF, 0, 1000).pass(200).inputs(|inputs| inputs.blocked = true).pass(10);
    assert_eq!((rig.velocity(), rig.mode_bits()), (0, [false, true, true]));
    assert_eq!(rig.get(0x6077, 0), 1000);
}

/// The load turns with 10 units/s for each 0.1 %.
#[test]
fn the_torque_rises_with_its_slope_and_turns_the_axis() {
    let mut rig = Rig::enabled(TORQUE);
    rig.set(0x6071, 0, 500).pass(250);
    assert_eq!((rig.get(0x6077, 0), rig.velocity(), rig.status(REACHED)), (250, 2500, false));
    rig.pass(250);
    assert_eq!((rig.get(0x6077, 0), rig.velocity(), rig.status(REACHED)), (500, 5000, true));
    rig.set(0x6072, 0, 300).set(0x6071, 0, 501).pass(500);
    assert_eq!((rig.get(0x6077, 0), rig.status(LIMITED)), (300, true));
    rig.control(0x10F).pass(300);
    assert_eq!((rig.get(0x6077, 0), rig.status(REACHED)), (0, true));
    rig.control(0x0F).set(0x6071, 0, -100).pass(400);
    assert_eq!((rig.get(0x6077, 0), rig.velocity()), (-100, -1000));
}

#[test]
fn another_mode_takes_the_axis_over() {
    let mut rig = Rig::enabled(VELOCITY);
    rig.set(0x60FF, 0, 1000).pass(200).set(0x6060, 0, 1);
    rig.pass(100);
    assert_eq!((rig.velocity(), rig.status(REACHED)), (0, true), "it brakes with 6084h");
    rig.travel(0, 0).pass(50);
    assert!(rig.velocity() < 0);
    rig.set(0x6060, 0, 3).pass(200);
    assert_eq!(rig.velocity(), 1000);
}

/// 60A9h in rev/min, 60AAh in rev/min per second, with 4000 units in a revolution.
#[test]
fn velocities_have_the_unit_that_the_data_sheet_names() {
    let units = [(0x608F, 1), (0x608F, 2), (0x60A9, 0), (0x60AA, 0)];
    let values = [4000, 1, 0x00B4_4700, 0x00C0_0300];
    let units: Vec<_> = units.into_iter().zip(values).map(|(at, value)| (at.0, at.1, Unsigned32, value)).collect();
    let mut rig = Rig::of(&ServoModel::CIA_402, &[SERVO, &units].concat());
    rig.set(0x6060, 0, VELOCITY).enable().set(0x6083, 0, 600).set(0x60FF, 0, 60).pass(100);
    assert_eq!((rig.velocity(), rig.servo.shaft(rig.now).velocity.round()), (60, 4000.0));
}

#[test]
fn inputs_are_set_by_name() {
    let mut inputs = Inputs::default();
    for (key, value, wrong) in [
        ("supply", "false", "no"),
        ("enable", "false", "0"),
        ("blocked", "true", "yes"),
        ("ignores_sync", "true", ""),
        ("fault", "0x4310", "0x14310"),
        ("warning", "17168", "none of them"),
        ("digital", "0x10000", "-1"),
        ("probe_1", "true", "high"),
        ("probe_2", "true", "low"),
        ("negative_limit", "-2000", "left"),
        ("positive_limit", "2000", "right"),
        ("home_low", "100", "low"),
        ("home_high", "200", "high"),
        ("index", "5", "five"),
        ("index_distance", "50", "fifty"),
    ] {
        let before = inputs;
        assert!(inputs.set(key, wrong).is_err() && inputs == before, "{key} = {wrong}");
        inputs.set(key, value).unwrap();
        assert_ne!(inputs, before, "{key}");
    }
    assert_eq!((inputs.faults, inputs.warnings, inputs.digital), (0x4310.into(), 0x4310.into(), 0x10000));
    assert_eq!((inputs.machine.home_switch, inputs.machine.index), (Some((100.0, 200.0)), Some((5.0, 50.0))));
    for key in ["fault", "warning", "negative_limit", "positive_limit", "home_low", "index"] {
        inputs.set(key, "none").unwrap();
    }
    assert_eq!((inputs.faults.is_empty(), inputs.machine.home_switch, inputs.machine.index), (true, None, None));
    assert!(inputs.set("brake", "true").unwrap_err().contains("there are supply"));
}

/// Bit 11 is set only while 607Fh limits the axis.
#[test]
fn a_top_speed_limits_the_velocity() {
    let rows = [SERVO, &[(0x607F, 0, Unsigned32, 500), (0x6080, 0, Unsigned32, 0)]].concat();
    let mut rig = Rig::of(&ServoModel::CIA_402, &rows);
    rig.set(0x6060, 0, VELOCITY).enable();
    for (target, velocity, limited) in [(1000, 500, true), (500, 500, false), (-1000, -500, true), (0, 0, false)] {
        rig.set(0x60FF, 0, target).pass(500);
        assert_eq!((rig.velocity(), rig.status(LIMITED)), (velocity, limited), "{target}");
    }
    rig.set(0x6080, 0, 300).set(0x60FF, 0, 1000).pass(500);
    assert_eq!((rig.velocity(), rig.status(LIMITED)), (300, true), "the lower one of both");
    rig.set(0x6060, 0, 1).set(0x6081, 0, 1000).travel(5000, 0).pass(1000);
    assert_eq!(rig.velocity(), 300);
}

/// 60C5h and 60C6h limit all ramps; a ramp or a limit of 0 has no effect.
#[test]
fn ramps_have_their_limits() {
    for (limits, ramps, up_ms, down_ms) in [
        ([0, 0], [10_000, 5000], 100, 200),
        ([2000, 0], [10_000, 5000], 500, 200),
        ([0, 2000], [10_000, 5000], 100, 500),
        ([0, 0], [0, 0], 1, 1),
    ] {
        let rows = [SERVO, &[(0x60C5, 0, Unsigned32, limits[0]), (0x60C6, 0, Unsigned32, limits[1])]].concat();
        let mut rig = Rig::of(&ServoModel::CIA_402, &rows);
        rig.set(0x6060, 0, VELOCITY).enable().set(0x6083, 0, ramps[0]).set(0x6084, 0, ramps[1]);
        for (target, ms) in [(1000, up_ms), (0, down_ms)] {
            rig.set(0x60FF, 0, target).pass(ms - 1);
            assert_ne!(rig.velocity(), target, "{limits:?} {ramps:?}");
            assert_eq!(rig.pass(1).velocity(), target, "{limits:?} {ramps:?}");
        }
    }
}

/// At a software limit, an axis does not move beyond it, but can leave it.
#[test]
fn an_axis_at_a_software_limit_moves_away_only() {
    for sign in [1, -1] {
        let mut rig = Rig::enabled(VELOCITY);
        rig.set(0x607D, 1, -100).set(0x607D, 2, 100).set(0x60FF, 0, sign * 1000).pass(1000);
        assert_eq!((rig.position(), rig.velocity(), rig.status(LIMITED)), (sign * 100, 0, true));
        rig.set(0x60FF, 0, sign * 500).pass(1000);
        assert_eq!((rig.position(), rig.velocity(), rig.status(LIMITED)), (sign * 100, 0, true));
        rig.set(0x60FF, 0, 0).pass(100);
        assert_eq!((rig.position(), rig.status(LIMITED)), (sign * 100, false));
        rig.set(0x60FF, 0, sign * -500).pass(100);
        assert!(rig.velocity() == sign * -500 && !rig.status(LIMITED));
    }
}

/// 6072h = 0 means no limit; bit 11 shows the limit of 6072h.
#[test]
fn torque_has_its_limit_its_offset_and_its_slope() {
    let rows = [SERVO, &[(0x60B2, 0, Integer16, 50)]].concat();
    let mut rig = Rig::of(&ServoModel::CIA_402, &rows);
    rig.set(0x6060, 0, TORQUE).enable();
    for (most, target, torque, limited) in [
        (1000, 100, 150, false),
        (120, 100, 120, true),
        (120, 70, 120, false),
        (0, 2000, 2050, false),
        (100, -300, -100, true),
    ] {
        rig.set(0x6072, 0, most).set(0x6071, 0, target).pass(3000);
        assert_eq!((rig.get(0x6077, 0), rig.status(LIMITED)), (torque, limited), "{target} with {most}");
    }
    rig.set(0x6087, 0, 0).set(0x6071, 0, 0).pass(10);
    assert_eq!((rig.get(0x6077, 0), rig.status(REACHED)), (50, true), "a slope of 0 is none");
    // Without a deceleration, the slope applies: 500 units/s with 10 000 units/s².
    rig.set(0x6087, 0, 1000).set(0x6084, 0, 100_000).set(0x605A, 0, 5).control(0x02).pass(49);
    assert_ne!(rig.velocity(), 0);
    assert_eq!((rig.pass(1).velocity(), rig.state()), (0, State::QuickStopActive));
}

/// A motor with torque holds its shaft, and a coasting one cannot be turned.
#[test]
fn a_shaft_is_turned_by_hand_only_when_nothing_holds_it() {
    let mut rig = Rig::enabled(VELOCITY);
    assert!(!rig.servo.turn(rig.now, &mut rig.od, 5.0));
    rig.set(0x60FF, 0, 1000).pass(200).control(0x00).pass(50);
    let before = rig.servo.shaft(rig.now);
    assert!(!rig.servo.turn(rig.now, &mut rig.od, 5.0));
    assert_eq!(rig.servo.shaft(rig.now), before);
    let stands = rig.pass(50).position();
    assert!(rig.servo.turn(rig.now, &mut rig.od, 5.0));
    assert_eq!(rig.position(), stands + 5);
}

/// If the model says so, a mode is accepted only at rest. With supported modes of 0, all are supported.
#[test]
fn a_model_says_when_and_which_modes_are_taken() {
    static AT_REST: ServoModel = ServoModel { changes_mode_while_moving: false, ..ServoModel::CIA_402 };
    static ALL: ServoModel = ServoModel { obeys_supported_modes: false, ..ServoModel::CIA_402 };
    let mut rig = Rig::of(&AT_REST, SERVO);
    rig.set(0x6060, 0, VELOCITY).enable().set(0x60FF, 0, 1000).pass(200).set(0x6060, 0, 1);
    assert_eq!((rig.get(0x6061, 0), rig.velocity()), (VELOCITY, 1000));
    rig.set(0x60FF, 0, 0).pass(200);
    assert_eq!(rig.get(0x6061, 0), 1);
    for (model, modes, shown) in
        [(&ServoModel::CIA_402, 0x3ED, 1), (&ServoModel::CIA_402, 0, 7), (&ServoModel::CIA_402, 0x41, 7), (&ALL, 1, 7)]
    {
        let mut rig = Rig::of(model, SERVO);
        rig.set(0x6502, 0, modes & !if shown == 1 { 0x40 } else { 0 }).set(0x6060, 0, 7);
        assert_eq!(rig.get(0x6061, 0), shown, "{modes:#X}");
    }
}

/// Velocity and torque modes take over a moving axis; position modes brake it with 6084h.
#[test]
fn a_change_of_the_mode_brakes_or_does_not() {
    for (mode, velocity) in [(1, 0), (6, 0), (7, 0), (8, 0), (9, 1000), (10, 1000)] {
        let mut rig = Rig::enabled(VELOCITY);
        rig.set(0x60FF, 0, 1000).pass(200).set(0x6060, 0, mode).pass(99);
        assert_ne!(rig.velocity(), 0, "mode {mode}");
        assert_eq!(rig.pass(1).velocity(), velocity, "mode {mode}");
    }
    // A coasting axis, and one in quick stop, continue unchanged.
    for (word, ms) in [(0x00, 100), (0x02, 10)] {
        let mut rig = Rig::enabled(VELOCITY);
        rig.set(0x6084, 0, 1000).set(0x60FF, 0, 1000).pass(200).control(word).set(0x6060, 0, 1).pass(ms - 1);
        assert_ne!(rig.velocity(), 0);
        assert_eq!(rig.pass(1).velocity(), 0);
    }
}

/// Only with an absolute encoder, a servo knows its position after power-on.
#[test]
fn an_absolute_encoder_keeps_the_position() {
    static ABSOLUTE: ServoModel = ServoModel { absolute_encoder: true, ..ServoModel::CIA_402 };
    for (model, position) in [(&ABSOLUTE, 150), (&ServoModel::CIA_402, 0)] {
        let mut rig = Rig::of(model, SERVO);
        assert!(rig.servo.turn(rig.now, &mut rig.od, 100.0));
        rig.servo.set_position(rig.now, &mut rig.od, 150.0);
        rig.servo.restart(rig.now);
        assert_eq!(rig.pass(0).position(), position);
    }
}

/// 60A9h and 60AAh with what counts as a revolution: 6092h by 6091h, else 608Fh, else one position unit.
#[test]
fn a_revolution_is_what_the_factors_say() {
    const RPM: i64 = 0x00B4_4700;
    const RPS: i64 = 0x00B4_0300;
    const RPM_PER_S: i64 = 0x00C0_0300;
    const RPS_PER_S: i64 = 0x00B4_5700;
    for ([encoder, gear, feed], units, velocity, acceleration) in [
        ([[4000, 1], [0, 0], [0, 0]], [RPM, RPM_PER_S], 4000.0 / 60.0, 4000.0 / 60.0),
        ([[4000, 2], [0, 0], [0, 0]], [RPS, RPS_PER_S], 2000.0, 2000.0),
        ([[4000, 2], [3, 1], [0, 0]], [RPS, RPS_PER_S], 2000.0, 2000.0),
        ([[4000, 1], [5, 2], [1000, 4]], [RPS, RPS_PER_S], 100.0, 100.0),
        ([[4000, 1], [5, 0], [1000, 4]], [RPS, RPS_PER_S], 250.0, 250.0),
        ([[4000, 1], [0, 5], [1000, 0]], [RPS, RPS_PER_S], 4000.0, 4000.0),
        ([[0, 1], [1, 1], [0, 1]], [RPS, RPS_PER_S], 1.0, 1.0),
        ([[4000, 0], [1, 1], [0, 0]], [RPS, RPS_PER_S], 1.0, 1.0),
        // The prefix (bits 24 to 31) and bits 0 to 7 of the velocity are ignored; other units are position units.
        ([[4000, 1], [1, 1], [0, 0]], [RPS | 0xFF00_00FF, RPS_PER_S | 0xFF00_0000], 4000.0, 4000.0),
        ([[4000, 1], [1, 1], [0, 0]], [0x0001_0300, 0x0001_5700], 1.0, 1.0),
    ] {
        let ratio = |index, values: [i64; 2]| [(index, 1, Unsigned32, values[0]), (index, 2, Unsigned32, values[1])];
        let own = [(0x60A9, 0, Unsigned32, units[0]), (0x60AA, 0, Unsigned32, units[1])];
        let rows = [&ratio(0x608F, encoder)[..], &ratio(0x6091, gear), &ratio(0x6092, feed), &own].concat();
        let scales = Scales::of_units(&dictionary(&rows));
        assert_eq!(scales, Scales { velocity, acceleration }, "{encoder:?} {gear:?} {feed:?} {units:X?}");
    }
}

/// Windows, limits, speeds and ramps all use the units in the data sheet: 4000 position units.
#[test]
fn every_velocity_has_its_unit() {
    let factors = [(0x608F, 1, 4000), (0x608F, 2, 1), (0x60A9, 0, 0x00B4_0300), (0x60AA, 0, 0x00B4_5700)];
    let limits = [(0x607F, 0, 0), (0x60C5, 0, 20), (0x60F8, 0, 2)];
    let extra: Vec<_> = factors.iter().chain(&limits).map(|row| (row.0, row.1, Unsigned32, row.2)).collect();
    let mut rig = Rig::of(&ServoModel::CIA_402, &[SERVO, &extra].concat());
    rig.set(0x6060, 0, VELOCITY).set(0x6084, 0, 10).set(0x606D, 0, 2).set(0x606F, 0, 3).set(0x60FF, 0, 10).enable();
    // 60C5h: 20 revolutions/s², half a second.
    for (ms, velocity, bits) in
        [(149, 3, [false, true, false]), (5, 3, [false; 3]), (240, 8, [false; 3]), (10, 8, [true, false, false])]
    {
        rig.pass(ms);
        assert_eq!((rig.velocity(), rig.mode_bits()), (velocity, bits), "{ms}");
    }
    rig.pass(200).set(0x607F, 0, 5).set(0x60FF, 0, 9).pass(1000);
    assert_eq!(rig.servo.shaft(rig.now).velocity, 20_000.0);
    rig.set(0x6060, 0, 1).pass(1000).set(0x607F, 0, 0).set(0x6081, 0, 4).set(0x6083, 0, 100);
    rig.set(0x6065, 0, 0).travel(1_000_000, 0).pass(1000);
    assert_eq!(rig.servo.shaft(rig.now).velocity, 16_000.0);
}

/// Bits 0 to 2 of 60FDh on both sides of each switch; a switch is active at its position.
#[test]
fn switches_change_where_they_are() {
    let mut rig = Rig::new();
    rig.inputs(|inputs| {
        inputs.machine.negative_limit = Some(-200.0);
        inputs.machine.positive_limit = Some(200.0);
        inputs.machine.home_switch = Some((-50.0, 100.0));
        inputs.digital = 1 << 16;
    });
    for (position, bits) in
        [(-201, 1), (-200, 1), (-199, 0), (-51, 0), (-50, 4), (100, 4), (101, 0), (199, 0), (200, 2), (201, 2)]
    {
        let by = f64::from(position) - rig.servo.shaft(rig.now).position;
        assert!(rig.servo.turn(rig.now, &mut rig.od, by));
        assert_eq!(rig.get(0x60FD, 0), 1 << 16 | bits, "at {position}");
    }
    rig.inputs(|inputs| inputs.machine.home_switch = None).inputs(|inputs| inputs.machine.positive_limit = None);
    assert_eq!(rig.get(0x60FD, 0), 1 << 16);
}

#[test]
fn inputs_that_are_half_set_have_a_default_for_the_other_half() {
    let set = |pairs: &[(&str, &str)]| {
        let mut inputs = Inputs::default();
        pairs.iter().for_each(|(key, value)| inputs.set(key, value).unwrap());
        inputs.machine
    };
    assert_eq!(set(&[("index", "none"), ("index", "7")]).index, Some((7.0, 1000.0)));
    assert_eq!(set(&[("index", "none"), ("index_distance", "50")]).index, Some((0.0, 50.0)));
    for none in ["0", "-50", "none"] {
        assert_eq!(set(&[("index_distance", none)]).index, None);
    }
    assert_eq!(set(&[("home_low", "1")]).home_switch, Some((1.0, f64::INFINITY)));
    assert_eq!(set(&[("home_high", "1")]).home_switch, Some((f64::NEG_INFINITY, 1.0)));
    let before = Inputs::default();
    let mut inputs = before;
    assert!(inputs.set("positive_limit", "NaN").is_err() && inputs == before);
}
