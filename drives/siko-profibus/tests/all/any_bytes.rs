//! A million random bytes and a hundred thousand altered telegrams: the drive behind its slave keeps working.

use super::random::Random;
use lexican_profibus::fdl::{Data, FrameCount, Function, Service, Telegram};
use lexican_profibus::pkw::{Pkw, Task};
use lexican_profibus::{Slave, State};
use lexican_runtime::object::Address;
use lexican_runtime::{Duration, Instant};
use siko::gateway::{Door, Job, Report};
use siko::order::Order;
use siko_profibus::gateway::ProfibusDoor;
use siko_profibus::{AG02, AG03_1, Model, PPO, ProfibusDrive as Drive, bus};

const DRIVES: [&Model; 2] = [&AG03_1, &AG02];

/// The slave of a rig receives bytes that its master has not sent. Afterwards the master comes back, and finds a drive
/// that answers and travels.
fn disturbed(model: &'static Model, mut disturb: impl FnMut(&mut Slave<Drive>, Instant) -> Instant) {
    let (mut bus, drive) = bus::with(model, 7);
    assert!(bus.exchange(drive));
    bus.set_master_online(false);
    let now = bus.now();
    let until = disturb(bus.slave_mut(drive), now);
    // The bus must catch up with the time that the bytes took.
    bus.run(until.since(now) + Duration::from_secs(1));
    bus.slave_mut(drive).restart(until + Duration::from_secs(1), 7);
    bus.set_master_online(true);
    assert!(bus.run_until(Duration::from_secs(2), |bus| bus.slave(drive).state() == State::DataExchange));
    assert!(bus.ask(drive, Task::Read { number: 918 }).is_some(), "{}", model.name);
}

#[test]
fn a_million_random_bytes_leave_a_drive_that_answers() {
    for model in DRIVES {
        let mut random = Random(0x5EED_1234_5678_9ABC);
        disturbed(model, |slave, mut now| {
            for _ in 0..1000 {
                now += Duration::from_micros(random.next() >> 56);
                let bytes = random.line(1000);
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
        disturbed(model, |slave, mut now| {
            for _ in 0..100_000 {
                PPO.set_pkw(&mut outputs, Task::Read { number: 900 + random.below(150) as u16 }.pkw());
                PPO.set_word(&mut outputs, 0, random.next() as u16);
                PPO.set_double_word(&mut outputs, 1, random.next() as i32 >> 16);
                let count = FrameCount { bit: random.below(2) == 0, valid: true };
                let function = Function::Request { service: Service::SrdHigh, count };
                let data = Data { to: 7, from: 2, to_sap: None, from_sap: None, function, payload: &outputs };
                let mut telegram = Telegram::Data(data).encode().unwrap().to_vec();
                // One telegram in four stays unchanged, so that some orders are carried out.
                if random.below(4) != 0 {
                    random.alter(&mut telegram);
                }
                now += Duration::from_micros(random.next() >> 55);
                slave.handle_bytes(now, &telegram);
                let _answer = slave.poll_transmit(now);
            }
            now
        });
    }
}

/// With a slave that answers anything, the door ends every job, and enables nothing without an order.
#[test]
fn a_hundred_thousand_random_answers_end_every_job() {
    let addresses = [0x1003, 0x100A, 0x1011, 0x2410, 0x2422, 0x6060, 0x6064, 0x606C, 0x607D, 0x7000];
    let orders =
        [Order::Enable, Order::Start, Order::Resume, Order::Step, Order::Hold, Order::ResetFault, Order::Release];
    for (model, orders) in [(DRIVES[0], &orders[..]), (DRIVES[1], &orders), (DRIVES[0], &[]), (DRIVES[1], &[])] {
        let mut random = Random(0xD00D_1234_5678_9ABC);
        let mut door = ProfibusDoor::new(model);
        let (mut now, mut waits, mut is_ordered) = (Instant::ZERO, None, false);
        for _ in 0..100_000 {
            now += Duration::from_micros(random.next() >> 52);
            let sent = door.master().outputs();
            // Often enough, the answer matches the task.
            let mut received: [u8; PPO.len()] = core::array::from_fn(|_| random.next() as u8);
            let task = PPO.pkw(&sent).unwrap_or_default();
            if random.below(2) == 0 {
                PPO.set_pkw(&mut received, Pkw { identifier: random.below(10) as u8, ..task });
            }
            match random.below(200) {
                0 => door.master_mut().handle_offline(),
                _ => door.master_mut().handle_exchange(now, &sent, &received),
            }
            if door.poll_timeout().is_some_and(|due| due <= now) {
                door.handle_timeout(now);
            }
            while let Some(report) = door.poll(now) {
                waits = waits.filter(|_| matches!(report, Report::Facts(_)));
                is_ordered &= report != Report::Lost;
            }
            assert!(waits.is_none_or(|since| now.since(since) < Duration::from_secs(2)), "{}", model.name);
            let is_there = door.master().facts().is_some();
            if waits.is_none() && is_there {
                let address = Address::new(addresses[random.below(addresses.len())], random.below(12) as u8);
                let order = orders.get(random.below(3 * orders.len() + 1));
                let job = match (order, random.below(3)) {
                    (Some(order), _) => Job::Order { order: *order, target: random.next() as i32 },
                    (None, 0) => Job::Read(address),
                    (None, 1) => Job::Write(address, (1 + random.below(3)) as i64),
                    (None, _) => Job::Look,
                };
                is_ordered |= matches!(job, Job::Order { .. });
                waits = Some(now);
                door.begin(now, job);
            }
            let word = PPO.word(&door.master().outputs(), 0).unwrap_or(0);
            assert!(is_ordered || word == 0, "{}: {word:04X} without an order", model.name);
        }
    }
}
