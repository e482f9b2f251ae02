//! Travels, inching and velocity mode (2.2).

use siko::sim::inputs::{Inputs, Key};

use super::super::bench::{
    A_INCH, A_POS, A_ROT, Bench, D_POS, Siko, V_INCH, V_POS, Write, enabled_with, in_velocity_mode, moving_to, one,
    running_at,
};
use crate::kinds::prose::{Clauses, Statement};

/// Chapter and subject of a statement, and what it says.
pub(super) fn statements<D: Siko>() -> Vec<Statement> {
    vec![
        ("2.2.1:ramp", || {
            // 25 % are 1 rev/s2: 60 rev/min after one second, and so for all of them.
            let mut bench = enabled_with::<D>(&[one(A_POS, 25), one(V_POS, 90)]);
            bench.travel(100_000);
            let up = bench.velocities(&[500, 1000, 1499, 1501, 5000]);
            vec![("a-Pos accelerates", up[..2] == [30, 60]), ("to v-Pos", up[2..] == [90, 90, 90])]
        }),
        ("2.2.1:deceleration", || {
            // From 60 rev/min, 1600 increments/s, with 25 % and with 50 %.
            let profile = |d_pos| {
                let mut bench = enabled_with::<D>(&[one(A_POS, 25), one(V_POS, 60), one(D_POS, d_pos)]);
                bench.travel(8000);
                let way = bench.way(20_000);
                // The last moment at which it does not brake yet.
                way.windows(2).rev().find(|pair| pair[1] - pair[0] >= 31).map_or(0, |pair| 8000 - pair[1])
            };
            let near = |found: i32, expected: i32| (found - expected).abs() <= 64;
            let mut clauses = vec![("a-Pos decelerates", near(profile(101), 800))];
            if D::has(D_POS) {
                clauses.push(("or d-Pos", near(profile(50), 400)));
            }
            clauses
        }),
        ("2.2.1:changed parameters", || {
            let arrives = |change: &[Write]| {
                let mut bench = moving_to::<D>(5000, 1000);
                bench.set(change);
                let way = bench.way(8000);
                (way.iter().position(|at| *at == 5000), way.last().copied())
            };
            let undisturbed = arrives(&[]);
            let changes = [(0x2410, 4, 100, 1), (0x2410, 5, 60, 1), (0x2410, 1, 10, 2), (0x607A, 0, 9000, 4)];
            let same = changes.into_iter().all(|change| arrives(&[change]) == undisturbed);
            vec![("changes do not influence the travel under way", same && undisturbed.1 == Some(5000))]
        }),
        ("2.2.1:target", || {
            let mut bench = moving_to::<D>(1000, 10_000);
            bench.control(0x000F);
            bench.travel(1500);
            bench.hear(10_000);
            vec![("ends at the target value", bench.position() == 1500 && bench.speed() == 0.0)]
        }),
        ("2.2.1:control", || {
            let mut bench = moving_to::<D>(1000, 20_000);
            let holds = !bench.is_released() && !bench.turn(10);
            bench.control(0x0000);
            vec![("position control until the motor is released", holds && bench.is_released() && bench.turn(10))]
        }),
        ("2.2.1.1:loop+", || loops::<D>(1)),
        ("2.2.1.1:loop-", || loops::<D>(2)),
        ("2.2.1.1:loop length", || {
            let beyond = |set: &[Write], target: i32| {
                let mut bench = enabled_with::<D>(&[&[(0x2413, 0, 1, 1), one(V_POS, 200)], set].concat());
                bench.travel(target);
                bench.way(20_000).into_iter().min().map(|least| target - least)
            };
            vec![
                (
                    "in increments",
                    beyond(&[], -1000) == Some(800) && beyond(&[(0x2418, 0, 100, 2)], -1000) == Some(100),
                ),
                ("0: no loop", beyond(&[(0x2418, 0, 0, 2)], -1000) == Some(0)),
            ]
        }),
        ("2.2.1.2:mode", || {
            let moves = |mut bench: Bench<D>| {
                WORDS.into_iter().any(|word| {
                    bench.control(0x000F);
                    bench.control(word);
                    bench.hear(500);
                    bench.position() != 0
                })
            };
            let mut keyed = Bench::<D>::new();
            let set = keyed.write(0x6060, 0, 2, 1).is_ok();
            keyed.world(|inputs| inputs.key = Some(Key::Clockwise));
            keyed.hear(500);
            vec![(
                "in positioning mode only",
                moves(Bench::<D>::enabled()) && !moves(in_velocity_mode::<D>()) && set && keyed.position() == 0,
            )]
        }),
        ("2.2.1.2:ramp", || {
            let set = [one(A_INCH, 25), one(V_INCH, 90), (0x2415, 0, 100_000, 4)];
            let up = |word| {
                let mut bench = enabled_with::<D>(&set);
                bench.control(word);
                bench.velocities(&[500, 1000, 1501, 5000])
            };
            let mut all = vec![up(0x200F), up(0x400F), up(0x800F)];
            if D::MODEL.keys {
                let mut bench = Bench::<D>::new();
                bench.set(&set);
                bench.world(|inputs| inputs.key = Some(Key::CounterClockwise));
                all.push(bench.velocities(&[500, 1000, 1501, 5000]));
            }
            let are = |at: std::ops::Range<usize>, speeds: [i32; 2]| {
                all.iter().all(|one| one[at.clone()].iter().map(|speed| speed.abs()).eq(speeds))
            };
            vec![("a-Inch accelerates", are(0..2, [30, 60])), ("to v-Inch", are(2..4, [90, 90]))]
        }),
        ("2.2.1.2:loop", || {
            let mut bench = enabled_with::<D>(&[(0x2413, 0, 1, 1), (0x2415, 0, -1000, 4)]);
            bench.control(0x200F);
            let way = bench.way(10_000);
            vec![("no loop positioning", way.iter().min() == Some(&-1000) && way.last() == Some(&-1000))]
        }),
        ("2.2.1.2:inching 1", || {
            let step = |set: &[Write]| {
                let mut bench = enabled_with::<D>(set);
                bench.control(0x200F);
                bench.hear(30_000);
                bench.control(0x200F);
                bench.hear(30_000);
                (bench.position(), bench.shaft(), bench.system() >> 3 & 1)
            };
            let (up, down) = (step(&[]), step(&[(0x2415, 0, -700, 4)]));
            let spindle = step(&[(0x2412, 0, 200, 2), (0x2415, 0, 300, 4)]);
            vec![
                ("once by Delta Inch", up.0 == 1600 && up.1 == 1600.0),
                ("Delta Inch < 0: negative direction", down.0 == -700),
                ("with a spindle pitch: in 1/100 mm", spindle.0 == 300 && spindle.1 == 2400.0),
                ("1002h bit 3 signals the end", (up.2, down.2, spindle.2) == (1, 1, 1)),
            ]
        }),
        ("2.2.1.2:inching 2", || {
            let inch = |word: u16, stop_mode: i64| {
                let mut bench = enabled_with::<D>(&[(0x2416, 0, stop_mode, 1)]);
                bench.control(word);
                let moving = bench.velocities(&[1000, 5000]);
                bench.control(0x000F);
                (moving, bench.way_to_rest())
            };
            let (up, down) = (inch(0x400F, 0), inch(0x800F, 1));
            vec![
                ("CW.14 positive, CW.15 negative", up.0[0] == 30 && down.0[0] == -30),
                ("as long as the bit is 1", up.0[1] == 30 && down.0[1] == -30 && up.1 == 50 && down.1 == -100),
            ]
        }),
        ("2.2.1.2:inching 2 stop", || {
            let mut bench = enabled_with::<D>(&[]);
            bench.control(0x400F);
            bench.hear(1000);
            bench.control(0x000F);
            // 800 increments/s, and 6400/s2.
            vec![("maximum deceleration by default", bench.way_to_rest() == 50)]
        }),
        ("2.2.1.2:outside switches", || {
            let moved = |switch: usize, word: u16| {
                let mut bench = Bench::<D>::enabled();
                bench.world(|inputs| inputs.limit_switches[switch] = true);
                bench.controls(&[0x000F, word]);
                bench.hear(500);
                bench.position().signum()
            };
            let inching =
                [(0, 0x400F), (0, 0x800F), (1, 0x400F), (1, 0x800F)].map(|(switch, word)| moved(switch, word));
            let step = [moved(0, 0x200F), moved(1, 0x200F)];
            vec![("inching 1 back only", step == [0, 1]), ("inching 2 back only", inching == [0, -1, 1, 0])]
        }),
        ("2.2.1.2:keys", || {
            let (plain, other) = (&[][..], &[(0x607E, 0, 1, 1)][..]);
            let in_state = |command| keyed::<D>(Key::Clockwise, plain, |bench| bench.nmt(command));
            vec![
                (
                    "key 1 clockwise",
                    keyed::<D>(Key::Clockwise, plain, |_| ()) == -750
                        && keyed::<D>(Key::Clockwise, other, |_| ()) == 750,
                ),
                (
                    "key 2 counter-clockwise",
                    keyed::<D>(Key::CounterClockwise, plain, |_| ()) == 750
                        && keyed::<D>(Key::CounterClockwise, other, |_| ()) == -750,
                ),
                (
                    "as inching 2",
                    keyed::<D>(Key::CounterClockwise, &[(0x2416, 0, 1, 1), (0x2450, 0, 50, 1)], |_| ()) == 400,
                ),
                ("not in OPERATIONAL and STOPPED", in_state(0x01) == 0 && in_state(0x02) == 0),
            ]
        }),
        ("2.2.1.2:keys and conditions", || {
            let with = |change: fn(&mut Inputs)| keyed::<D>(Key::Clockwise, &[], |bench| bench.world(change));
            let fault_gone = keyed::<D>(Key::Clockwise, &[], |bench| {
                bench.world(|inputs| inputs.sensor_fails = true);
                bench.world(|inputs| inputs.sensor_fails = false);
            });
            // Another key while the shaft still turns.
            let mut bench = Bench::<D>::new();
            bench.hear(0);
            bench.world(|inputs| inputs.key = Some(Key::CounterClockwise));
            bench.hear(1000);
            bench.world(|inputs| inputs.key = Some(Key::Clockwise));
            bench.hear(3000);
            let released = with(|_| ()) != 0;
            vec![
                ("no fault", with(|inputs| inputs.sensor_fails = true) == 0 && fault_gone == 0 && released),
                ("no active job", bench.position() == 750),
                ("output stage supplied", with(D::hinder) == 0),
            ]
        }),
        ("2.2.1.2:outside limits", || {
            // The position is 0.
            let above = &[(0x607D, 1, -3000, 4), (0x607D, 2, -2000, 4)][..];
            let below = &[(0x607D, 2, 3000, 4), (0x607D, 1, 2000, 4)][..];
            let moved = |limits: &[Write], word: u16, delta: i64| {
                let mut bench = enabled_with::<D>(&[limits, &[(0x2415, 0, delta, 4)]].concat());
                bench.control(word);
                bench.hear(500);
                bench.position().signum()
            };
            let by_key = |limits: &[Write], key| keyed::<D>(key, limits, |_| ()).signum();
            let (up, down) = (Key::CounterClockwise, Key::Clockwise);
            let mut clauses = vec![
                ("inching 1 back only", {
                    moved(above, 0x200F, 100) == 0
                        && moved(above, 0x200F, -100) < 0
                        && moved(below, 0x200F, 100) > 0
                        && moved(below, 0x200F, -100) == 0
                }),
                ("inching 2 back only", {
                    moved(above, 0x400F, 1) == 0
                        && moved(above, 0x800F, 1) < 0
                        && moved(below, 0x400F, 1) > 0
                        && moved(below, 0x800F, 1) == 0
                }),
                ("no travel", moved(above, 0x001F, 1) == 0 && moved(below, 0x001F, 1) == 0),
            ];
            if D::MODEL.keys {
                let back = [by_key(above, up), by_key(above, down), by_key(below, up), by_key(below, down)];
                clauses.insert(2, ("keys back only", back == [0, -1, 1, 0]));
            }
            clauses
        }),
        ("2.2.2:ramp", || {
            let run = |target: i32| {
                let mut bench = enabled_with::<D>(&[(0x6060, 0, 2, 1), one(A_ROT, 25)]);
                bench.control(0x010F);
                bench.run(target);
                bench.velocities(&[500, 1000, 1501, 60_000])
            };
            let (up, down) = (run(90), run(-90));
            let mut stopping = running_at::<D>(60, 5000);
            stopping.control(0x010F);
            // 50 %, as it is at the factory: 2 rev/s2 from 1 rev/s.
            let way = stopping.way_to_rest();
            vec![
                ("a-Rot accelerates", up[..2] == [30, 60]),
                ("to the target velocity and keeps it", up[2..] == [90, 90]),
                ("its sign is the direction", down == [-30, -60, -90, -90]),
                ("until it is stopped", (way - 400).abs() <= 1),
            ]
        }),
        ("2.2.2:new target", || {
            let mut bench = running_at::<D>(60, 5000);
            bench.run(30);
            let slower = bench.velocities(&[100, 1000]);
            bench.run(-30);
            bench.hear(2000);
            let turned = bench.read(0x606C, 0).unwrap_or(0) as i32;
            vec![("a new target velocity is taken at once", slower == [48, 30] && turned == -30)]
        }),
        ("2.2.2:limits", || {
            let mut bench = enabled_with::<D>(&[(0x607D, 1, -100, 4), (0x607D, 2, 100, 4), (0x6060, 0, 2, 1)]);
            bench.control(0x010F);
            bench.run(30);
            bench.hear(5000);
            let none = bench.status() >> 11 & 1 == 0 && bench.system() >> 5 & 3 == 0;
            let mut clauses =
                vec![("limits are deactivated", bench.velocity() == 30 && bench.position() > 1000 && none)];
            if D::MODEL.switches {
                bench.world(|inputs| inputs.limit_switches = [true; 2]);
                bench.hear(1000);
                clauses.push(("limit switches are deactivated", bench.velocity() == 30 && bench.system() & 3 == 0));
            }
            clauses
        }),
    ]
}

/// The direct way, the one beyond the target, and which way bit 9 of 1002h is set.
fn loops<D: Siko>(kind: i64) -> Clauses {
    let (sign, is_fixed) = (if kind == 1 { 1 } else { -1 }, !D::has((0x2418, 0)));
    let travel = |target: i32| {
        let mut bench = enabled_with::<D>(&[(0x2413, 0, kind, 1)]);
        if !is_fixed {
            bench.set(&[(0x2418, 0, 400, 2)]);
        }
        bench.travel(target);
        let (mut far, mut bits) = (0, Vec::new());
        for _ in 0..500 {
            bench.hear(20);
            let (at, speed) = (bench.position() * sign, bench.velocity() * sign);
            far = far.min(at);
            bits.push((bench.system() >> 9 & 1 == 1) == (speed < 0) || speed == 0);
        }
        (far, bench.position() == target, bits.into_iter().all(|right| right))
    };
    let direct = travel(1000 * sign);
    let turned = travel(-1000 * sign);
    let names = match (kind, is_fixed) {
        (1, false) => ["target greater: direct", "target smaller: beyond by the loop length"],
        (1, true) => ["target greater: direct", "target smaller: beyond by half a revolution"],
        _ => ["target smaller: direct", "target greater: beyond by the loop length"],
    };
    vec![
        (names[0], direct == (0, true, true)),
        (names[1], turned.0 == if is_fixed { -1800 } else { -1400 }),
        ("bit 9 of 1002h while it travels there", turned.2),
        ("then back to the target", turned.1),
    ]
}

/// The three ways to inch: control words that start and end it.
const WORDS: [u16; 3] = [0x200F, 0x400F, 0x800F];

/// Where a key has led, held for a second; what `set` has written before, and what is done to the drive.
fn keyed<D: Siko>(key: Key, set: &[Write], prepare: impl FnOnce(&mut Bench<D>)) -> i32 {
    let mut bench = Bench::<D>::new();
    bench.set(set);
    let before = bench.position();
    prepare(&mut bench);
    bench.hear(0);
    bench.world(|inputs| inputs.key = Some(key));
    bench.hear(1000);
    bench.world(|inputs| inputs.key = None);
    bench.hear(5000);
    bench.position() - before
}
