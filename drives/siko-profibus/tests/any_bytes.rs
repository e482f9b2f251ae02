//! A million bytes by chance and a hundred thousand altered telegrams: the drive behind its slave goes on.

#[path = "../../../profibus/tests/support/random.rs"]
mod random;
mod support;

use lexican_profibus::State;
use lexican_profibus::fdl::{Data, FrameCount, Function, Service, Telegram};
use lexican_profibus::pkw::Task;
use lexican_runtime::{Duration, Instant};
use random::Random;
use siko_profibus::{AG02, AG03_1, Model, PPO};
use support::Bench;

const DRIVES: [&Model; 2] = [&AG03_1, &AG02];

/// The slave of a bench, to which bytes come that its master has not sent: the master comes back afterwards, and finds a
/// drive that answers and travels.
fn disturbed(model: &'static Model, mut disturb: impl FnMut(&mut Bench, Instant) -> Instant) {
    let mut bench = Bench::new(model);
    bench.bus.set_master_online(false);
    let now = bench.bus.now();
    let until = disturb(&mut bench, now);
    // The time that the bytes took has not passed on the bus.
    bench.bus.run(until.since(now) + Duration::from_secs(1));
    bench.bus.slave_mut(bench.drive).restart(until + Duration::from_secs(1), 7);
    bench.bus.set_master_online(true);
    let drive = bench.drive;
    assert!(bench.bus.run_until(Duration::from_secs(2), |bus| bus.slave(drive).state() == State::DataExchange));
    assert!(bench.bus.ask(drive, Task::Read { number: 918 }).is_some(), "{}", model.name);
}

#[test]
fn a_million_random_bytes_leave_a_drive_that_answers() {
    for model in DRIVES {
        let mut random = Random(0x5EED_1234_5678_9ABC);
        disturbed(model, |bench, mut now| {
            for _ in 0..1000 {
                now += Duration::from_micros(random.next() >> 56);
                let bytes = random.line(1000);
                let slave = bench.bus.slave_mut(bench.drive);
                slave.handle_bytes(now, &bytes);
                let _answer = slave.poll_transmit(now);
            }
            now
        });
    }
}

#[test]
fn a_hundred_thousand_altered_telegrams_leave_a_drive_that_answers() {
    for model in DRIVES {
        let mut random = Random(0xF00D_1234_5678_9ABC);
        let mut outputs = [0; 14];
        disturbed(model, |bench, mut now| {
            for _ in 0..100_000 {
                PPO.set_pkw(&mut outputs, Task::Read { number: 900 + random.below(150) as u16 }.pkw());
                PPO.set_word(&mut outputs, 0, random.next() as u16);
                PPO.set_double_word(&mut outputs, 1, random.next() as i32 >> 16);
                let count = FrameCount { bit: random.below(2) == 0, valid: true };
                let function = Function::Request { service: Service::SrdHigh, count };
                let data = Data { to: 7, from: 2, to_sap: None, from_sap: None, function, payload: &outputs };
                let mut telegram = Telegram::Data(data).encode().unwrap().to_vec();
                // Some stay as they are, and order something.
                if random.below(4) != 0 {
                    random.alter(&mut telegram);
                }
                now += Duration::from_micros(random.next() >> 55);
                let slave = bench.bus.slave_mut(bench.drive);
                slave.handle_bytes(now, &telegram);
                let _answer = slave.poll_transmit(now);
            }
            now
        });
    }
}
