//! The network and the state machine (7).

use siko::fault::FaultKind;
use siko::sim::inputs::BusState;
use siko::sim::{Addressing, DipSwitches, SimulatedDrive};

use super::super::bench::{Bench, LOAD, Siko, enabled_with, faulty, moving_to};
use crate::bench::Simulator as _;
use crate::kinds::prose::Statement;

/// Chapter and subject of a statement, and what it says.
pub(super) fn statements<D: Siko>() -> Vec<Statement> {
    vec![
        ("7.2.2:NMT", || {
            let state = |data: &[u8]| {
                let mut bench = Bench::<D>::new();
                bench.send(0x000, data);
                bench.hear(0);
                bench.nmt_state().code()
            };
            vec![
                ("identifier 0, two bytes", state(&[1, 5]) == 5 && state(&[1]) == 127 && state(&[1, 5, 0]) == 127),
                ("node 0: all", state(&[1, 0]) == 5 && state(&[1, 6]) == 127),
            ]
        }),
        ("7.2.2.2:boot-up", || {
            let mut bench = Bench::<D>::as_delivered();
            let frames = bench.hear(1000);
            let only = frames.len() == 1 && frames.iter().all(|frame| frame.id().raw() == 0x705 && frame.data() == [0]);
            let state = bench.nmt_state().code();
            vec![("then PRE-OPERATIONAL by itself", only && state == 127)]
        }),
        ("7.2.2.3:PDO parameters", || {
            let write = |bench: &mut Bench<D>| {
                [
                    bench.write(0x1800, 1, 0x4000_0186, 4),
                    bench.write(0x1800, 2, 254, 1),
                    bench.write(0x1402, 1, 0x406, 4),
                    bench.write(0x1005, 0, 0x81, 4),
                    bench.write(0x1014, 0, emcy::<D>(0x86), 4),
                ]
            };
            let before = write(&mut Bench::<D>::new());
            let after = write(&mut Bench::<D>::operational());
            vec![("can be changed in PRE-OPERATIONAL only", before == [Ok(()); 5] && after == [Err(0x0800_0022); 5])]
        }),
        ("7.2.3:SYNC", || {
            let mut bench = Bench::<D>::new();
            let set = [bench.write(0x1800, 2, 1, 1), bench.write(0x1005, 0, 0x81, 4)];
            bench.nmt(0x01);
            bench.hear(0);
            let mut sent = |id| {
                bench.send(id, &[]);
                bench.hear_from(0x185, 0).len()
            };
            vec![("its identifier is that of 1005h", set == [Ok(()); 2] && (sent(0x080), sent(0x081)) == (0, 1))]
        }),
        ("7.2.4:PDOs", || {
            let asked = |command: u8| {
                let mut bench = Bench::<D>::new();
                bench.nmt(command);
                bench.hear(0);
                [0x185, 0x385, 0x485].map(|id| bench.requested(id, 0).len())
            };
            let heard = |command: u8| {
                let mut bench = Bench::<D>::new();
                bench.nmt(command);
                bench.send(0x205, &[0x06, 0x01]);
                bench.hear(0);
                bench.status() & 0x6F == 0x21
            };
            let sent = (asked(0x01)[1..] == [1, 1], asked(0x80) == [0; 3], asked(0x02) == [0; 3]);
            vec![
                ("transmitted in OPERATIONAL only", sent == (true, true, true)),
                ("received in OPERATIONAL only", (heard(0x01), heard(0x80), heard(0x02)) == (true, false, false)),
            ]
        }),
        ("7.2.5:default types", || {
            let mut bench = Bench::<D>::operational();
            let heard: Vec<u32> = bench.hear(950).iter().map(|frame| frame.id().raw()).collect();
            let mut asked = |id| bench.requested(id, 0).len();
            vec![
                ("TPDO1 asynchronously", heard == [0x185; 9]),
                ("TPDO3 and TPDO4 by RTR only", (asked(0x385), asked(0x485)) == (1, 1)),
            ]
        }),
        ("7.2.5.4:type 254", || {
            // At 800 increments/s, and with 2 rev/s2: every one of them.
            let every = |parameter: u16, id: u16, mode: i64, order: fn(&mut Bench<D>)| {
                let mut bench = enabled_with::<D>(&[(parameter, 2, 254, 1), (0x6060, 0, mode, 1)]);
                bench.hear(0);
                order(&mut bench);
                let sent = bench.hear_from(id, 300);
                let readings = sent.iter().filter_map(|data| data.get(2..6)?.try_into().ok().map(i32::from_le_bytes));
                let readings: Vec<i32> = readings.collect();
                let without_gap = readings.windows(2).all(|pair| pair[1] - pair[0] <= 1);
                without_gap && readings.last().is_some_and(|last| *last > 15)
            };
            vec![
                ("TPDO3 on every change of the position", every(0x1802, 0x385, 1, |bench| bench.travel(5000))),
                (
                    "TPDO4 on every change of the velocity",
                    every(0x1803, 0x485, 2, |bench| {
                        bench.control(0x010F);
                        bench.run(30);
                    }),
                ),
            ]
        }),
        ("7.2.6:default types", || {
            let at_once = |id: u16, len: usize| {
                let mut bench = Bench::<D>::operational();
                bench.send(id, &[0x06, 0x01, 0, 0, 0, 0][..len]);
                bench.hear(0);
                bench.status() & 0x6F == 0x21
            };
            vec![("RPDO1, RPDO3, RPDO4 asynchronously", at_once(0x205, 2) && at_once(0x405, 6) && at_once(0x505, 6))]
        }),
        ("7.2.6.2:target", || {
            let mut bench = moving_to::<D>(1000, 10_000);
            bench.control(0x000F);
            bench.travel(600);
            bench.hear(10_000);
            let mut disabled = Bench::<D>::operational();
            for word in [0x0106, 0x0107] {
                disabled.control(word);
            }
            disabled.command(0x405, 0x0017, 600);
            disabled.hear(5000);
            vec![("absolute", bench.position() == 600), ("from OPERATION ENABLED only", disabled.position() == 0)]
        }),
        ("7.2.6.2:synchronous start", || {
            let start = |parameter: u16, id: u16, mode: i64, word: u16, target: i32| {
                let mut bench = enabled_with::<D>(&[(0x6060, 0, mode, 1), (parameter, 2, 0, 1)]);
                bench.control(0x010F);
                bench.command(id, word, target);
                bench.hear(1000);
                let waits = bench.speed() == 0.0;
                bench.send(0x080, &[]);
                bench.hear(500);
                waits && bench.velocity() == 30
            };
            vec![(
                "type 0 starts with the next SYNC",
                start(0x1402, 0x405, 1, 0x001F, 9000) && start(0x1403, 0x505, 2, 0x000F, 30),
            )]
        }),
        ("7.2.7:SDO", || {
            let mut bench = Bench::<D>::new();
            let answers =
                [&[0x40, 0, 0x10, 0, 0, 0, 0, 0], &[0x40, 1, 0x10, 0, 0, 0, 0, 0], &[0x40, 0xFF, 0x5F, 0, 0, 0, 0, 0]];
            let eight = answers.iter().all(|request| {
                bench.send(0x605, *request);
                bench.hear_from(0x585, 0).first().is_some_and(|answer| answer.len() == 8)
            });
            let fixed = [bench.write(0x1200, 1, 0x606, 4), bench.write(0x1200, 2, 0x586, 4)];
            let mut idle = Bench::<D>::new();
            let quiet = idle.hear_from(0x585, 10_000).is_empty();
            vec![
                ("always 8 bytes", eight),
                ("identifiers cannot be changed", fixed == [Err(0x0601_0002); 2]),
                ("initiated by the master", quiet),
            ]
        }),
        ("7.2.7:states", || {
            let answers = |command: u8| {
                let mut bench = Bench::<D>::new();
                bench.nmt(command);
                bench.read(0x1000, 0).is_ok()
            };
            vec![(
                "in PRE-OPERATIONAL and OPERATIONAL",
                (answers(0x80), answers(0x01), answers(0x02)) == (true, true, false),
            )]
        }),
        ("7.2.7.1:error response", || {
            let mut bench = Bench::<D>::new();
            let answer = bench.sdo(&[0x40, 0xFF, 0x5F, 0, 0, 0, 0, 0]);
            vec![("80h and the code in bytes 5 to 8", answer == Some([0x80, 0xFF, 0x5F, 0, 0x00, 0x00, 0x02, 0x06]))]
        }),
        ("7.2.9:emergency", || {
            let mut bench = Bench::<D>::operational();
            bench.hear(0);
            bench.world(|inputs| inputs.temperature_100mdegc = 901);
            let frames = bench.hear_from(0x085, 1000);
            let first = frames.first().cloned().unwrap_or_default();
            vec![
                ("sent once on a fault", frames.len() == 1),
                ("byte 2 is 1001h", first.get(2) == Some(&0x09) && bench.read(0x1001, 0) == Ok(0x09)),
                ("bytes 3 to 7 not used", first.get(3..) == Some(&[0; 5])),
            ]
        }),
        ("7.2.9:no error", || {
            let mut bench = faulty::<D>();
            bench.hear(0);
            bench.world(|inputs| inputs.sensor_fails = false);
            let quiet = bench.hear_from(0x085, 1000).is_empty();
            bench.send(0x205, &[0x00, 0x00]);
            bench.send(0x205, &[0x80, 0x00]);
            let sent = bench.hear_from(0x085, 1000) == [[0; 8]];
            let mut bench = Bench::<D>::operational();
            bench.world(|inputs| inputs.bus = BusState::Passive);
            bench.hear(100);
            bench.world(|inputs| inputs.bus = BusState::Active);
            let well = bench.hear_from(0x085, 1000) == [[0; 8]];
            let clause = match D::MODEL.reports_recovery {
                true => ("0000h when a communication error is over", well),
                false => ("not when a communication error is over", !well && bench.read(0x1001, 0) == Ok(0)),
            };
            vec![("0000h when a fault is reset", quiet && sent), clause]
        }),
        ("7.2.9:enabled", || {
            let sent = |mut bench: Bench<D>| {
                bench.see(D::fail);
                !bench.hear_from(0x085, 1000).is_empty()
            };
            vec![("must be enabled by 1014h", !sent(Bench::as_delivered()) && sent(Bench::new()))]
        }),
        ("7.2.9:identifier", || {
            let mut bench = Bench::<D>::new();
            let set = bench.write(0x1014, 0, emcy::<D>(0x86), 4).is_ok();
            bench.world(|inputs| inputs.sensor_fails = true);
            let frames = bench.hear(0);
            vec![("can be changed by 1014h", set && frames.iter().any(|frame| frame.id().raw() == 0x086))]
        }),
        ("7.2.9:states", || {
            let sent = |command: u8| {
                let mut bench = Bench::<D>::new();
                bench.nmt(command);
                bench.hear(0);
                bench.world(|inputs| inputs.sensor_fails = true);
                bench.hear_from(0x085, 1000).len()
            };
            vec![("in PRE-OPERATIONAL and OPERATIONAL", (sent(0x80), sent(0x01), sent(0x02)) == (1, 1, 0))]
        }),
        ("7.2.10:heartbeat", || {
            let mut bench = Bench::<D>::new();
            bench.hear(0);
            let set = bench.write(0x1017, 0, 100, 2).is_ok();
            let mut beats = |command: u8| {
                bench.nmt(command);
                bench.hear_from(0x705, 1000)
            };
            let all = [beats(0x80), beats(0x01), beats(0x02)];
            let states: Vec<Vec<u8>> = all.iter().filter_map(|beats| beats.last().cloned()).collect();
            vec![
                ("every 1017h milliseconds", set && all.iter().all(|beats| (10..=11).contains(&beats.len()))),
                ("one byte: the state", states == [[127], [5], [4]]),
            ]
        }),
        ("7.2.10:and guarding", || {
            let mut bench = Bench::<D>::new();
            let beats = [bench.write(0x1017, 0, 100, 2), bench.write(0x100C, 0, 100, 2), bench.write(0x100D, 0, 3, 1)];
            let mut bench = Bench::<D>::new();
            let guards = [bench.write(0x100C, 0, 100, 2), bench.write(0x100D, 0, 3, 1), bench.write(0x1017, 0, 100, 2)];
            let one = |found: [Result<(), u32>; 3]| found.iter().filter(|written| written.is_err()).count() == 1;
            vec![("heartbeat and guarding exclude each other", one(beats) && one(guards))]
        }),
        ("7.2.11:guarding", || {
            let mut bench = Bench::<D>::new();
            let set = [bench.write(0x100C, 0, 100, 2), bench.write(0x100D, 0, 3, 1)];
            bench.hear(0);
            let mut ask = |command: u8| {
                bench.nmt(command);
                bench.hear(0);
                bench.requested(0x705, 0).concat()
            };
            let answers = [ask(0x80), ask(0x80), ask(0x01), ask(0x02)];
            vec![
                (
                    "one byte: toggle bit and state",
                    set == [Ok(()); 2] && answers == [[127], [128 + 127], [5], [128 + 4]],
                ),
                ("in all states", answers.iter().all(|answer| answer.len() == 1)),
            ]
        }),
        ("7.2.11:life time", || {
            let disabled_after = |guard_time: i64, factor: i64, asked: bool| {
                let mut bench = Bench::<D>::new();
                bench.set(&[(0x100C, 0, guard_time, 2), (0x100D, 0, factor, 1)]);
                bench.nmt(0x01);
                bench.enable();
                if asked {
                    bench.request(0x705);
                }
                (0..100).find(|_| {
                    let disabled = bench.is_disabled();
                    bench.hear(10);
                    disabled
                })
            };
            let lives = [disabled_after(100, 3, true), disabled_after(200, 2, true)];
            vec![
                ("guard time by life time factor", lives == [Some(30), Some(40)]),
                ("from the first request on", disabled_after(100, 3, false).is_none()),
                (
                    "off when either is 0",
                    disabled_after(0, 3, true).is_none() && disabled_after(100, 0, true).is_none(),
                ),
            ]
        }),
        ("7.3:network", || {
            let mut bench = Bench::<D>::new();
            let by_sdo = bench.write(0x6040, 0, 0x0006, 2);
            let before = bench.status() & 0x6F;
            bench.nmt(0x01);
            bench.hear(0);
            let after = bench.write(0x6040, 0, 0x0006, 2);
            let set = bench.status() & 0x6F == 0x21;
            let ready_before = by_sdo.is_ok() || before & 0x4F != 0x40;
            if D::MODEL.control_by_sdo {
                return vec![("set in OPERATIONAL only", !ready_before && after.is_ok() && set)];
            }
            bench.control(0x0006);
            let by_pdo = bench.status() & 0x6F == 0x21;
            vec![("set by PDO only", !ready_before && !set && by_pdo)]
        }),
        ("7.3:quick stop", || {
            let mut bench = moving_to::<D>(100_000, 1000);
            bench.control(0x0002);
            let way = bench.way_to_rest();
            let torque = !bench.is_released() && !bench.turn(10);
            let cancelled = bench.status() >> 14 & 1 == 0;
            bench.control(0x010F);
            bench.control(0x001F);
            bench.hear(1000);
            vec![
                ("maximum deceleration", way == 50),
                ("stops with torque", torque),
                ("positioning is cancelled", cancelled && bench.speed() == 0.0),
            ]
        }),
        ("7.3:fault", || {
            let mut bench = moving_to::<D>(100_000, 1000);
            bench.world(|inputs| inputs.sensor_fails = true);
            bench.hear(1000);
            let released = bench.is_released() && bench.turn(10);
            let cancelled = bench.status() >> 14 & 1 == 0;
            bench.world(|inputs| inputs.sensor_fails = false);
            for word in [0x0000, 0x0080, 0x0106, 0x0107, 0x010F, 0x000F] {
                bench.control(word);
            }
            bench.hear(1000);
            vec![
                ("motor released", released),
                ("positioning is cancelled", cancelled && bench.speed() == 0.0 && bench.status() >> 14 & 1 == 0),
            ]
        }),
        ("7.10:bit rate", || {
            let mut bench = Bench::<D>::new();
            let set = bench.write(0x2100, 0, 7, 1).is_ok();
            let rate = |bench: &Bench<D>| bench.see(|drive, _| drive.bit_rate());
            let before = rate(&bench);
            bench.nmt(0x82);
            bench.hear(0);
            let after = rate(&bench);
            let locked = Bench::<D>::operational().write(0x2100, 0, 7, 1) == Err(0x0800_0022);
            let mut clauses =
                vec![("taken over at the next initialisation", set && (before, after) == (500_000, 125_000))];
            if D::MODEL.addressing == Addressing::Switches {
                clauses.push(("changed in PRE-OPERATIONAL only", locked));
            }
            clauses
        }),
        ("7.10:node-ID", || {
            let mut bench = Bench::<D>::new();
            let set = bench.write(0x2101, 0, 7, 1).is_ok();
            let before = bench.read(0x2101, 0) == Ok(7);
            bench.nmt(0x82);
            bench.hear(0);
            let node = bench.see(|drive, _| drive.node().get());
            vec![("taken over at the next initialisation", set && before && node == 7)]
        }),
        ("7.12.2:latest", || {
            let mut bench = Bench::<D>::new();
            bench.world(|inputs| inputs.sensor_fails = true);
            bench.world(|inputs| inputs.temperature_100mdegc = 901);
            let found = [0, 1, 2].map(|sub| bench.read(0x1003, sub));
            vec![(
                "the latest under 01, their number under 00",
                found == [Ok(2), Ok(0x4310), Ok(D::code(FaultKind::Sensor))],
            )]
        }),
        ("7.12.2:restore", || {
            let mut bench = Bench::<D>::new();
            let set = [bench.write(0x2100, 0, 7, 1), bench.write(0x6067, 0, 11, 2)];
            let wrong = bench.write(0x1011, 1, 0x6461_6F6D, 4);
            let kept = bench.read(0x6067, 0) == Ok(11);
            let loaded = bench.write(0x1011, 1, LOAD, 4);
            let rest = [bench.read(0x2100, 0), bench.read(0x2101, 0), bench.read(0x6067, 0)];
            vec![
                ("by the signature only", set == [Ok(()); 2] && wrong.is_err() && kept && loaded.is_ok()),
                ("address and bit rate stay", rest == [Ok(7), Ok(5), Ok(10)]),
            ]
        }),
        ("7.13:switches", || {
            let mut bench = Bench::<D>::new();
            bench.see(|drive, _| drive.set_switches(DipSwitches::new(7)));
            bench.nmt(0x81);
            bench.hear(0);
            let same = bench.see(|drive, _| drive.node().get());
            bench.see(SimulatedDrive::power_cycle);
            bench.hear(0);
            let other = bench.see(|drive, _| drive.node().get());
            vec![("read when the supply is switched on", (same, other) == (5, 7))]
        }),
    ]
}

/// 1014h with an identifier, and the bit without which some drives send nothing.
fn emcy<D: Siko>(id: i64) -> i64 {
    D::MODEL.emergencies.filter(|switch| switch.on_when_set).map_or(id, |switch| id | i64::from(switch.bit))
}
