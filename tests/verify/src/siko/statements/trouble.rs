//! Torque deactivation, factory settings, power failure, calibration, warnings, faults (2.3 to 5), parameters (6).

use siko::fault::FaultKind;
use siko::sim::inputs::{Inputs, Key};
use siko::sim::{DipSwitches, Restore, Setup, SimulatedDrive};

use super::super::bench::{
    Bench, LOAD, NODE, Siko, V_INCH, Write, enabled_with, faulty, in_velocity_mode, moving_to, one, running_at,
};
use crate::kinds::prose::Statement;

/// Chapter and subject of a statement, and what it says.
pub(super) fn statements<D: Siko>() -> Vec<Statement> {
    vec![
        ("2.3:threshold", || {
            let stops = |threshold, load_ma| {
                let mut bench = overloaded::<D>(threshold, load_ma);
                bench.hear(2000);
                bench.speed() == 0.0
            };
            vec![
                (
                    "stops above the threshold",
                    stops(50, 1100) && !stops(50, 900) && stops(100, 2100) && !stops(100, 1900),
                ),
                ("125 %: never", !stops(125, 2400)),
            ]
        }),
        ("2.3:deactivation", || {
            let mut bench = overloaded::<D>(50, 1500);
            // 800 increments/s, and 6400/s2.
            let way = bench.way_to_rest();
            vec![
                ("maximum delay", way == 50),
                ("motor stays in control", !bench.is_released()),
                ("no fault", !bench.is_fault() && bench.read(0x1003, 0) == Ok(0)),
            ]
        }),
        ("2.3:state", || {
            let mut bench = Bench::<D>::enabled();
            let bits = |bench: &mut Bench<D>| (bench.read(0x2422, 0), bench.read(0x2420, 0).map(|word| word >> 7 & 1));
            let before = bits(&mut bench);
            let mut bench = overloaded::<D>(50, 1500);
            bench.hear(1000);
            let active = bits(&mut bench);
            bench.world(|inputs| inputs.load_ma = 600);
            bench.hear(1000);
            let stays = bits(&mut bench);
            bench.control(0x011F);
            let held = bits(&mut bench);
            bench.control(0x001F);
            bench.hear(1000);
            let resumed = bits(&mut bench);
            vec![
                ("2422h bit 0", before.0 == Ok(0) && active.0 == Ok(1) && (stays.0, held.0) == (Ok(1), Ok(1))),
                ("2420h bit 7", before.1 == Ok(0) && active.1 == Ok(1) && stays.1 == Ok(1)),
                ("reset when the travel is resumed", resumed == (Ok(0), Ok(0)) && bench.velocity() == 30),
            ]
        }),
        ("2.3:mode", || {
            let mut bench = in_velocity_mode::<D>();
            let set = bench.write(0x2421, 0, 50, 1).is_ok();
            bench.run(30);
            bench.world(|inputs| inputs.load_ma = 1500);
            bench.hear(2000);
            vec![("in positioning mode only", set && bench.velocity() == 30 && bench.read(0x2422, 0) == Ok(0))]
        }),
        ("2.4:restore", || {
            vec![
                ("all parameters", restored_by::<D>(Restore::All) == (true, true, true)),
                ("standard parameters", restored_by::<D>(Restore::Standard) == (true, false, true)),
                ("controller parameters", restored_by::<D>(Restore::Controller) == (false, true, true)),
            ]
        }),
        ("2.4:acknowledgement", || {
            let switches = DipSwitches::for_node(NODE).with_restore(Some(Restore::All));
            let mut bench = Bench::<D>::set_up(Setup { switches, ..Setup::new(D::MODEL, NODE) });
            let mut seen = std::collections::BTreeSet::new();
            for _ in 0..40 {
                seen.insert(bench.see(|drive, now| (drive.lights(now).status, drive.lights(now).bus)));
                bench.hear(50);
            }
            vec![("status LED and bus LED blink alternately", seen.into_iter().eq([(false, true), (true, false)]))]
        }),
        ("2.5:power failure", || {
            let fail = |off: fn(&mut Bench<D>)| {
                let mut bench = moving_to::<D>(5000, 1000);
                bench.world(|inputs| inputs.load_ma = 100);
                off(&mut bench);
                bench.hear(50);
                let running = bench.speed();
                let turned = bench.is_released() || !bench.see(|drive, _| drive.is_on());
                // Not braked as a quick stop is: 320 increments/s less after 50 ms.
                (turned, running > 480.0 && running < 800.0)
            };
            let control: fn(&mut Bench<D>) = |bench| bench.see(SimulatedDrive::switch_off);
            let stage: fn(&mut Bench<D>) = |bench| bench.world(D::hinder);
            let found = [fail(control), fail(stage)];
            vec![
                ("torque is lost", found.iter().all(|found| found.0)),
                ("the drive runs out", found.iter().all(|found| found.1)),
            ]
        }),
        ("3:calibration", || {
            let mut bench = moving_to::<D>(1000, 10_000);
            let set = bench.write(0x607C, 0, 250, 4).is_ok() && bench.position() == 250;
            bench.control(0x000F);
            bench.travel(700);
            let busy = [bench.write(0x1011, 4, LOAD, 4), bench.write(0x607C, 0, 5, 4)];
            bench.hear(10_000);
            let done = bench.write(0x1011, 4, LOAD, 4).is_ok() && bench.position() == 250;
            bench.see(SimulatedDrive::power_cycle);
            bench.hear(0);
            let kept = bench.position() == 250;
            vec![
                ("the position becomes the calibration value", set && done),
                ("when no travel job is active", busy == [Err(0x0800_0022); 2]),
                ("once is enough", kept),
            ]
        }),
        ("3:calibration switch", || {
            let mut bench = moving_to::<D>(1000, 10_000);
            let set = bench.write(0x607C, 0, 250, 4).is_ok();
            bench.control(0x000F);
            bench.travel(700);
            bench.hear(100);
            bench.world(|inputs| inputs.calibration_switch = true);
            bench.hear(10_000);
            let busy = bench.position() == 700;
            bench.world(|inputs| inputs.calibration_switch = false);
            bench.world(|inputs| inputs.calibration_switch = true);
            vec![("calibrates when no travel job is active", set && busy && bench.position() == 250)]
        }),
        // Every warning: what brings it, and whether the drive goes on and is as before when it is over.
        ("5.1:warnings", || {
            let warned = |bench: &Bench<D>| bench.status() >> 7 & 1 == 1;
            let all: [fn(&mut Inputs); 3] = [
                |inputs| inputs.battery_10mv = 250,
                |inputs| inputs.load_ma = 2401,
                |inputs| inputs.attainable_rpm = Some(20),
            ];
            let follow = |change: fn(&mut Inputs)| {
                let mut bench = moving_to::<D>(20_000, 1000);
                let before = warned(&bench);
                bench.world(change);
                bench.hear(2000);
                let (there, moves) = (warned(&bench), bench.velocity() >= 20 && !bench.is_fault());
                bench.world(|inputs| *inputs = Inputs::default());
                bench.hear(2000);
                (!before && there, moves, !warned(&bench) && bench.velocity() == 30)
            };
            let found = all.map(follow);
            vec![
                ("warned of battery, current, lag error", found.iter().all(|found| found.0)),
                ("the drive goes on", found.iter().all(|found| found.1)),
                ("they end with their causes", found.iter().all(|found| found.2)),
            ]
        }),
        ("5.2:stop", || {
            // A fault that is over at once, in any kind of movement: 50 increments from 800 increments/s.
            let mut starts: Vec<fn() -> Bench<D>> =
                vec![|| moving_to::<D>(100_000, 1000), || running_at::<D>(30, 1000), || {
                    let mut bench = enabled_with::<D>(&[]);
                    bench.control(0x400F);
                    bench.hear(1000);
                    bench
                }];
            if D::MODEL.keys {
                starts.push(|| {
                    let mut bench = Bench::<D>::new();
                    bench.hear(0);
                    bench.world(|inputs| inputs.key = Some(Key::CounterClockwise));
                    bench.hear(1000);
                    bench
                });
            }
            let stops = |start: &fn() -> Bench<D>| {
                let mut bench = start();
                bench.world(|inputs| inputs.sensor_fails = true);
                (bench.way_to_rest(), bench.is_fault()) == (50, true)
            };
            vec![("immediate stop", starts.iter().all(stops))]
        }),
        ("5.2:buffer", || {
            let mut bench = Bench::<D>::operational();
            for at in 0..11_u8 {
                if at % 2 == 0 {
                    bench.world(|inputs| inputs.sensor_fails = true);
                } else {
                    bench.world(|inputs| inputs.temperature_100mdegc = 901);
                }
                bench.world(|inputs| *inputs = Inputs::default());
                bench.control(0x0000);
                bench.control(0x0080);
            }
            let entries: Vec<_> = (0..=10).map(|sub| bench.read(0x1003, sub)).collect();
            let expected: Vec<_> =
                [10].into_iter().chain([D::code(FaultKind::Sensor), 0x4310].repeat(5)).map(Ok).collect();
            bench.see(SimulatedDrive::power_cycle);
            bench.hear(0);
            let kept: Vec<_> = (0..=10).map(|sub| bench.read(0x1003, sub)).collect();
            let cleared = bench.write(0x1003, 0, 0, 1).is_ok() && bench.read(0x1003, 0) == Ok(0);
            vec![
                ("the last 10", entries == expected),
                ("kept in the EEPROM", kept == expected),
                ("deleted by 1003h", cleared && bench.read(0x1003, 1) == Ok(0)),
            ]
        }),
        ("5.2:reset", || {
            let mut bench = faulty::<D>();
            bench.world(|inputs| inputs.temperature_100mdegc = 901);
            bench.world(|inputs| inputs.sensor_fails = false);
            bench.control(0x0000);
            bench.control(0x0080);
            let stays = bench.is_fault();
            bench.world(|inputs| *inputs = Inputs::default());
            bench.control(0x0000);
            let waits = bench.is_fault();
            bench.control(0x0080);
            let gone = bench.is_disabled() && bench.read(0x1001, 0) == Ok(0);
            vec![("every cause is cleared and acknowledged", stays && waits && gone)]
        }),
        ("6:window", || {
            let bit = |bench: &Bench<D>| bench.system() >> 3 & 1 == 1;
            let inside = |window: i64, by_hand: i32| {
                let mut bench = enabled_with::<D>(&[(0x6067, 0, window, 2)]);
                bench.travel(1000);
                bench.hear(10_000);
                // So that the shaft can be turned.
                bench.control(0x0000);
                bench.turn(by_hand) && bit(&bench)
            };
            let both = |window: i64| {
                let edge = window as i32;
                inside(window, edge) && inside(window, -edge) && !inside(window, edge + 1) && !inside(window, -edge - 1)
            };
            let running = |window: i64, slower: u8| {
                let mut bench = enabled_with::<D>(&[(0x6060, 0, 2, 1), (0x6067, 0, window, 2)]);
                bench.control(0x010F);
                bench.world(|inputs| inputs.attainable_rpm = Some(60 - slower));
                [60, -60].into_iter().all(|target| {
                    bench.run(target);
                    bench.hear(5000);
                    bit(&bench)
                })
            };
            vec![
                ("target position plus or minus the window", both(10) && both(25)),
                ("target velocity plus or minus the window", running(10, 10) && !running(10, 11) && running(5, 5)),
            ]
        }),
        ("6:spindle pitch", || {
            let mut bench = enabled_with::<D>(&[(0x2412, 0, 200, 2)]);
            bench.travel(500);
            bench.hear(20_000);
            let shaft = bench.shaft();
            let moved = bench.read(0x6064, 0) == Ok(500);
            vec![("positions and targets in 1/100 mm", moved && shaft == 4000.0)]
        }),
        ("6:limits", || {
            let bits = |low: i64, high: i64| {
                let mut bench = Bench::<D>::enabled();
                let first = if low > 0 { [(2, high), (1, low)] } else { [(1, low), (2, high)] };
                bench.set(&first.map(|(sub, limit)| (0x607D, sub, limit, 4)));
                bench.control(0x000F);
                bench.travel(10);
                (bench.system() >> 5 & 3, bench.status() >> 11 & 1, bench.status() >> 14 & 1)
            };
            vec![
                ("within and at both limits", bits(-100, 100) == (0, 0, 1) && bits(0, 100) == (0, 0, 1)),
                ("beyond them no travel", bits(1, 100) == (2, 1, 0) && bits(-100, -1) == (1, 1, 0)),
                ("equal: no monitoring", bits(100, 100) == (0, 0, 1) && bits(-100, -100) == (0, 0, 1)),
            ]
        }),
        ("6:calibration value", || {
            let mut bench = Bench::<D>::new();
            let set = [(1, -100), (2, 100)].map(|(sub, limit)| bench.write(0x607D, sub, limit, 4));
            let found = [101, -101, 100, -100].map(|value| bench.write(0x607C, 0, value, 4));
            let refused = Err(0x0609_0030);
            vec![("within the limits", set == [Ok(()); 2] && found == [refused, refused, Ok(()), Ok(())])]
        }),
        ("6:setpoint", || {
            let starts = |target: i32| {
                let mut bench = enabled_with::<D>(&[(0x607D, 1, -100, 4), (0x607D, 2, 100, 4)]);
                bench.travel(target);
                (bench.status() >> 14 & 1, bench.status() >> 12 & 1)
            };
            let within = [starts(100), starts(-100)];
            let beyond = [starts(101), starts(-101)];
            vec![("position within limits 1 and 2", within == [(1, 1); 2] && beyond == [(0, 0); 2])]
        }),
        ("6:offset inching 2", || {
            let inch = |word: u16| {
                let mut bench = enabled_with::<D>(&[(0x2450, 0, 50, 1), one(V_INCH, 60)]);
                bench.control(word);
                bench.hear(2000);
                bench.velocity()
            };
            vec![
                ("a share of v-Inch in inching 2", (inch(0x400F), inch(0x800F)) == (30, -30)),
                ("not in inching 1", {
                    let mut bench = enabled_with::<D>(&[(0x2450, 0, 50, 1), (0x2415, 0, 9000, 4)]);
                    bench.control(0x200F);
                    bench.hear(2000);
                    bench.velocity() == 30
                }),
            ]
        }),
        // Parameters 19, 26 and 27 in velocity mode.
        ("6:velocity mode", || {
            let run = |set: &[Write]| {
                let mut bench = enabled_with::<D>(&[&[(0x6060, 0, 2, 1)], set].concat());
                bench.control(0x010F);
                bench.run(-30);
                bench.hear(3000);
                let before = (bench.velocity(), bench.system());
                bench.control(0x010F);
                bench.hear(3000);
                (before, bench.position(), bench.system())
            };
            let plain = run(&[]);
            let others = [(0x2413, 0, 1, 1), (0x2417, 0, 2, 1), (0x2417, 0, 1, 1), (0x2418, 0, 100, 2)];
            let own = others.iter().filter(|other| D::has((other.0, other.1)));
            let same = own.clone().all(|other| run(&[*other]) == plain);
            let clause = match own.count() {
                1 => "pos type has no meaning",
                _ => "pos type, inpos mode, loop length have no meaning",
            };
            vec![(clause, same)]
        }),
    ]
}

/// A travel with a threshold, and a load that comes when it is under way.
fn overloaded<D: Siko>(threshold: i64, load_ma: u16) -> Bench<D> {
    let mut bench = enabled_with::<D>(&[(0x2421, 0, threshold, 1)]);
    bench.travel(100_000);
    bench.hear(1000);
    bench.world(|inputs| inputs.load_ma = load_ma);
    bench.hear(0);
    bench
}

/// Whether the window (standard) and a-Pos (controller) are restored by the switches, and the address after it.
fn restored_by<D: Siko>(restore: Restore) -> (bool, bool, bool) {
    let mut bench = Bench::<D>::new();
    let set = [bench.write(0x6067, 0, 11, 2), bench.write(0x2410, 4, 51, 1), bench.write(0x2100, 0, 7, 1)];
    let own = DipSwitches::for_node(NODE);
    bench.see(|drive, now| {
        drive.switch_off(now);
        drive.set_switches(own.with_restore(Some(restore)));
        drive.switch_on(now);
    });
    bench.hear(1000);
    bench.see(|drive, now| {
        drive.switch_off(now);
        drive.set_switches(own);
        drive.switch_on(now);
    });
    bench.hear(0);
    let kept = set == [Ok(()); 3] && bench.read(0x2100, 0) == Ok(7) && bench.read(0x2101, 0) == Ok(5);
    (bench.read(0x6067, 0) == Ok(10), bench.read(0x2410, 4) == Ok(50), kept)
}
