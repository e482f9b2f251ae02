//! What the AKD's manual says in running text, clause by clause.

use kollmorgen_akd::fault;
use lexican_runtime::profile::cia402::{Mode, State};
use lexican_runtime::wire::nmt::NmtState;

use super::behaviour::{STATUS, SYSTEM, bit, homing, is_powered, limited};
use super::simulated::Simulated;
use crate::bench::Bench as OnBus;
use crate::kinds::cia402::bring_to;
use crate::kinds::prose::Statement;

type Bench = OnBus<Simulated>;

fn code(label: &str) -> u16 {
    fault::find(label).map_or(0, |code| code.number)
}

/// A fault comes, goes, and is reset.
fn pass_fault(bench: &mut Bench, code: u16) {
    bench.world(|inputs| inputs.faults = code.into());
    bench.world(|inputs| inputs.faults = Default::default());
    bench.controls(&[0x00, 0x80]);
}

/// Turns at 1000 units/s in profile velocity mode.
fn running() -> Bench {
    let mut bench = Bench::enabled_in(Mode::ProfileVelocity);
    let _ = bench.put(0x60FF, 0, 1000);
    bench.hear(1000);
    bench
}

/// TPDO1 with this type, in OPERATIONAL; nothing of it is waiting.
fn sending(settings: &[(u8, i64)]) -> Bench {
    let mut bench = Bench::new();
    settings.iter().for_each(|(sub, value)| _ = bench.put(0x1800, *sub, *value));
    bench.nmt(0x01);
    bench.hear(1000);
    bench
}

/// Brings a change of the status word about, and hears TPDO1.
fn changed(bench: &mut Bench, ms: u64) -> usize {
    let supply = bit(bench, STATUS, 4);
    bench.see(|drive, now| drive.set_inputs(now, |inputs| inputs.supply = !supply));
    bench.hear_from(Bench::own(0x180), ms).len()
}

/// After how many SYNC a shutdown takes effect that came by RPDO1 with this type.
fn taken_after(transmission: i64) -> Option<usize> {
    let mut bench = Bench::new();
    bench.put(0x1400, 2, transmission).ok()?;
    bench.nmt(0x01);
    bench.control(0x06);
    (0..10).find(|_| {
        let taken = bench.state() == State::ReadyToSwitchOn;
        bench.send(0x080, &[]);
        bench.hear(0);
        taken
    })
}

/// Homes on the present position with an offset, and where it is then.
fn homed_with(offset: i64) -> i64 {
    let mut bench = Bench::enabled_in(Mode::Homing);
    let _ = [bench.put(0x6098, 0, 35), bench.put(0x607C, 0, offset)];
    bench.control(0x1F);
    bench.rest();
    bench.number(0x6064, 0)
}

/// Chapter and subject of a statement, and what it says.
pub(super) const ALL: &[Statement] = &[
    ("5.4.4:history", || {
        let mut bench = Bench::operational();
        for number in 0..11 {
            pass_fault(&mut bench, 0x8610 + number);
        }
        let ten = (bench.number(0x1003, 0), bench.number(0x1003, 10)) == (10, 0x8611);
        let latest = bench.number(0x1003, 1) == 0x861A;
        let deleted = bench.put(0x1003, 0, 0).is_ok() && bench.number(0x1003, 0) == 0 && bench.number(0x1003, 1) == 0;
        vec![("the last 10", ten), ("the latest under 01", latest), ("writing 0 deletes them", deleted)]
    }),
    ("5.4.4.1:several errors", || {
        let mut bench = Bench::operational();
        bench.see(|drive, now| {
            drive.set_inputs(now, |inputs| {
                ["F234", "F502"].map(code).iter().for_each(|code| _ = inputs.faults.insert(*code));
            });
        });
        let both = bench.hear_from(Bench::own(0x80), 0).len() == 2;
        bench.see(|drive, now| drive.set_inputs(now, |inputs| inputs.faults.remove(code("F234"))));
        let one = bench.hear_from(Bench::own(0x80), 0);
        let over = one.len() == 1 && one[0].starts_with(&[0, 0]);
        let remains = one.first().is_some_and(|data| data[2] == 0x04) && bench.number(0x1001, 0) == 0x04;
        bench.see(|drive, now| drive.set_inputs(now, |inputs| inputs.faults.remove(code("F502"))));
        let stays = bench.hear_from(Bench::own(0x80), 0).is_empty() && bench.state() == State::Fault;
        bench.control(0x00);
        bench.send(Bench::own(0x200), &[0x80, 0]);
        let reset = bench.hear_from(Bench::own(0x80), 0) == [[0; 8]];
        vec![
            ("0000h when one is over", both && over),
            ("1001h has what remains", remains),
            ("the last fault stays until it is reset", stays && reset),
        ]
    }),
    ("5.4.6.2:event", || {
        let sent = changed(&mut sending(&[]), 0);
        let mut slow = sending(&[(3, 1000)]);
        let inhibited = [changed(&mut slow, 0), changed(&mut slow, 90), slow.hear_from(Bench::own(0x180), 20).len()];
        let timed = sending(&[(5, 100)]).hear_from(Bench::own(0x180), 1000).len();
        let idle = sending(&[]).hear_from(Bench::own(0x180), 1000).len();
        vec![
            ("sent when what it maps changes", sent == 1 && idle == 0),
            ("not before the inhibit time", inhibited == [1, 0, 1]),
            ("after the event timer without a change", timed == 10),
        ]
    }),
    ("5.4.7:life time", || {
        let guarded = |time: i64, factor: i64, asks: bool| {
            let mut bench = running();
            let _ = [bench.put(0x100C, 0, time), bench.put(0x100D, 0, factor)];
            if asks {
                bench.requested(Bench::own(0x700), 0);
            }
            bench
        };
        let is_lost = |bench: &Bench| bench.see(|drive, _| drive.servo().faults() == [code("F129")]);
        let mut bench = guarded(100, 3, true);
        let emcy = [bench.hear_from(Bench::own(0x80), 290), bench.hear_from(Bench::own(0x80), 20)];
        let in_time = emcy[0].is_empty() && emcy[1].first().is_some_and(|data| data.starts_with(&[0x30, 0x81]));
        bench.rest();
        bench.controls(&[0x06, 0x07, 0x0F]);
        bench.hear(100);
        let prevents = !bench.is_moving();
        let others = [(100, 3, false), (0, 3, true), (100, 0, true)].map(|(time, factor, asks)| {
            let mut bench = guarded(time, factor, asks);
            bench.hear(1000);
            is_lost(&bench)
        });
        vec![
            ("guard time by life time factor", in_time),
            ("from the first request on", !others[0]),
            ("off when either is 0", others[1..] == [false; 2]),
            ("fault F129", is_lost(&bench)),
            ("braked to a stop", bench.state() == State::Fault && !bench.is_moving()),
            ("any other movement is prevented", prevents),
        ]
    }),
    ("5.4.8:heartbeat", || {
        let lost = |beats: bool| {
            let mut bench = running();
            let _ = bench.put(0x1016, 1, 0x007F_0064);
            if beats {
                bench.send(0x77F, &[5]);
            }
            bench.hear(1000);
            bench.see(|drive, _| drive.servo().faults() == [code("F129")])
        };
        vec![("from the first one on", !lost(false)), ("fault F129", lost(true))]
    }),
    ("6.2.1.5:COB-ID", || {
        let mut bench = Bench::new();
        let taken = bench.put(0x1005, 0, 0x6001_F880).is_ok() && bench.put(0x1006, 0, 1000).is_ok();
        let silent = bench.hear_from(0x80, 1000).is_empty();
        vec![("bits 11 to 30 stay 0", taken && bench.number(0x1005, 0) == 0x80), ("no SYNC is sent", silent)]
    }),
    ("6.2.1.12:store", || {
        let kept = |signature| {
            let mut bench = Bench::new();
            let _ = [bench.put(0x6081, 0, 777), bench.put(0x1010, 1, signature)];
            bench.nmt(0x81);
            bench.hear(0);
            bench.number(0x6081, 0) == 777
        };
        let signed = [0x6576_6173, 0x7361_7665, 1].map(kept) == [true, false, false];
        vec![("by the signature only", signed), ("reads 1", Bench::new().read(0x1010, 1) == Ok(1))]
    }),
    ("6.2.2.1:masks", || {
        let sends = |low: i64, high: i64| {
            let mut bench = sending(&[]);
            let masked = [bench.put(0x2014, 1, low), bench.put(0x2014, 2, high)] == [Ok(()); 2];
            masked && changed(&mut bench, 0) == 1
        };
        // Bit 4 of the status word changes, and TPDO1 has two bytes.
        let unset = sends(0xFFFF_FFFF, 0xFFFF_FFFF) && sends(0x10, 0) && !sends(!0x10, 0xFFFF_FFFF);
        vec![("an unset bit is not monitored", unset), ("short PDOs too", !sends(0, 0xFFFF_FFFF))]
    }),
    ("6.2.2.9:latches", || {
        let mut bench = Bench::enabled_in(Mode::ProfilePosition);
        let _ = bench.put(0x20A4, 0, 0x01);
        let mut pulse = |target| {
            bench.travel(target);
            bench.rest();
            [true, false].into_iter().for_each(|level| bench.world(|inputs| inputs.probes[0] = level));
            (bench.number(0x20A0, 0), bench.number(0x20A5, 0))
        };
        let first = [pulse(100), pulse(200)] == [(100, 0x01); 2];
        let taken_back = bench.put(0x20A4, 0, 0).is_ok() && bench.number(0x20A5, 0) == 0;
        vec![("the first edge", first), ("until the enable bit is taken back", taken_back)]
    }),
    ("6.2.2.11:changed inputs", || {
        let mut bench = Bench::operational();
        [true, false].into_iter().for_each(|level| bench.world(|inputs| inputs.probes[0] = level));
        let shown = bench.number(0x60FD, 0) == 1 << 24;
        let reset = bench.put(0x20B8, 0, 1).is_ok() && bench.number(0x60FD, 0) == 0;
        vec![("shown until they are reset", shown && reset)]
    }),
    ("6.3:mapping", || {
        let change = |mut bench: Bench| bench.put(0x1600, 0, 0);
        let states = [change(Bench::new()), change(Bench::operational())] == [Ok(()), Err(0x0800_0022)];
        let mut bench = Bench::new();
        let cleared = bench.put(0x1600, 0, 0).is_ok();
        let parts = [0x6040_0001, 0x6040_000C].map(|part| bench.put(0x1600, 1, part).is_ok());
        vec![("before OPERATIONAL only", states), ("whole bytes only", cleared && parts == [false; 2])]
    }),
    ("6.3.1.1:type n", || vec![("the nth SYNC", [1, 3].map(taken_after) == [Some(1), Some(3)])]),
    ("6.3.1.1:type 0", || vec![("the next SYNC", taken_after(0) == Some(1))]),
    ("6.3.1.1:type 255", || vec![("at once", taken_after(255) == Some(0))]),
    ("6.3.2.1:type n", || {
        let sent = |transmission| {
            let mut bench = sending(&[(2, transmission)]);
            [(); 6].map(|()| {
                bench.send(0x080, &[]);
                bench.hear_from(Bench::own(0x180), 0).len()
            })
        };
        vec![("every nth SYNC", (sent(1), sent(3)) == ([1; 6], [0, 0, 1, 0, 0, 1]))]
    }),
    ("6.4.1.2:SWITCHED ON", || {
        let bench = bring_to::<Simulated>(State::SwitchedOn).unwrap_or_else(Bench::new);
        vec![("torque", is_powered(&bench)), ("1002h bit 14", bit(&bench, SYSTEM, 14))]
    }),
    ("6.4.2.1:pause", || {
        let (mut halts, mut goes_on) = (true, true);
        for (mode, index, order) in [(1, 0x607A, 100_000), (3, 0x60FF, 1000), (4, 0x6071, 100)] {
            let mut bench = Bench::operational();
            let _ = bench.put(0x6060, 0, mode);
            bench.controls(&[0x06, 0x07, 0x0F]);
            let _ = bench.put(index, 0, order);
            bench.control(0x1F);
            bench.hear(100);
            bench.control(0x011F);
            let at = bench.rest();
            halts &= at > 0 && !bench.is_moving() && bench.state() == State::OperationEnabled;
            bench.control(0x1F);
            bench.hear(100);
            goes_on &= bench.is_moving() && bench.position() > at;
        }
        vec![("halts in every mode", halts), ("goes on afterwards", goes_on)]
    }),
    ("6.4.2.3:mode", || {
        let mut bench = running();
        let _ = bench.put(0x6060, 0, 1);
        let waits = bench.number(0x6061, 0) == 3;
        let _ = bench.put(0x60FF, 0, 0);
        bench.rest();
        let shown = bench.number(0x6061, 0) == 1;
        vec![("shown by 6061h", shown), ("not while the axis moves", waits && shown)]
    }),
    ("6.7.2.2:current", || {
        let torque = |limit| {
            let mut bench = Bench::enabled_in(Mode::ProfileTorque);
            let _ = [bench.put(0x6073, 0, limit), bench.put(0x6071, 0, 400)];
            bench.hear(5000);
            bench.number(0x6077, 0)
        };
        vec![("limits the torque", torque(300) == 300), ("0: no limit", torque(0) == 400)]
    }),
    ("6.8.2.3:window", || {
        let lags = |window| {
            let mut bench = running();
            let _ = bench.put(0x6065, 0, window);
            bench.world(|inputs| inputs.blocked = true);
            bench.hear(5000);
            bench.see(|drive, _| drive.servo().faults() == [code("F439")])
        };
        vec![("F439 when the axis does not follow", lags(100)), ("0: off", !lags(0))]
    }),
    ("6.9.1:set-points", || {
        let mut bench = Bench::new();
        let _ = [bench.put(0x60C2, 1, 100), bench.put(0x60C2, 2, -3)];
        bench.nmt(0x01);
        let _ = bench.put(0x6060, 0, 7);
        bench.controls(&[0x06, 0x07, 0x0F, 0x1F]);
        let _ = bench.put(0x60C1, 1, 100);
        bench.hear(100);
        let waits = bench.position() == 0;
        bench.send(0x080, &[]);
        let way = [25, 25, 25, 25].map(|ms| {
            bench.hear(ms);
            bench.position()
        });
        vec![("taken over with SYNC", waits && way[3] == 100), ("linear in between", way[..3] == [25, 50, 75])]
    }),
    ("6.9.2.3:period", || {
        let second = |units, exponent| {
            let mut bench = Bench::new();
            bench.put(0x60C2, 1, units).and_then(|()| bench.put(0x60C2, 2, exponent))
        };
        let whole = [second(5, -4), second(5, -3), second(50, -4)] == [Err(0x0609_0030), Ok(()), Ok(())];
        let alone = Bench::new().put(0x60C2, 2, -4).is_ok();
        vec![("multiples of 1 ms", whole), ("both values", alone)]
    }),
    ("6.10.2.1:offset", || vec![("the home position", [0, 25_000].map(homed_with) == [0, 25_000])]),
    ("6.10.2.5:bit 4", || {
        let mut bench = homing(17);
        bench.control(0x1F);
        bench.hear(50);
        let moves = bench.is_moving();
        bench.control(0x0F);
        let stops = bench.rest() > -1000 && !bit(&bench, STATUS, 12) && bench.nmt_state() == NmtState::Operational;
        vec![("interrupts when it falls", moves && stops)]
    }),
    ("6.11.2.2:limits", || {
        let mut bench = Bench::enabled_in(Mode::ProfilePosition);
        bench.travel(5000);
        let free = bench.rest() == 5000;
        let [at_once, later] = [false, true].map(|restarts| {
            let mut bench = limited(restarts);
            bench.travel(5000);
            bench.rest()
        });
        vec![("off by default", free), ("targets end there", later == 1000), ("from the restart on", at_once == 5000)]
    }),
];
