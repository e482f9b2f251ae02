//! The master's side of one drive against the simulated drives: orders become words that the drives follow, and what they
//! show becomes facts.

use lexican_driver::Direction;
use lexican_profibus::bus::{Bus, Notice, Station};
use lexican_profibus::pkw::{Refusal, Reply, Task, Value};
use lexican_profibus::virtual_bus::{SlaveId, VirtualBus};
use lexican_runtime::{Duration, Instant};
use siko::order::{Braking, Order};
use siko::sim::parameters::Mode;
use siko::words::system;
use siko_profibus::master::{DriveMaster, Event, Facts};
use siko_profibus::{AG02, AG03_1, Door, Model, PPO, bus};

const DRIVES: [&Model; 2] = [&AG03_1, &AG02];

struct Bench {
    bus: Bus<VirtualBus<Door>>,
    drive: SlaveId,
    station: Station<VirtualBus<Door>>,
    master: DriveMaster,
}

impl Bench {
    fn new(model: &'static Model) -> Self {
        let mut line = VirtualBus::new();
        let drive = bus::attach_unknown(&mut line, model, 7);
        let bus = Bus::new(line);
        let station = bus.station(7, bus::options(model), PPO.lengths()).unwrap();
        let mut bench = Bench { bus, drive, station, master: DriveMaster::new() };
        bench.until(Duration::from_secs(1), |bench| bench.master.facts().is_some());
        bench
    }

    fn now(&self) -> Instant {
        self.station.now()
    }

    /// Exchanges data until something holds.
    #[track_caller]
    fn until(&mut self, span: Duration, mut holds: impl FnMut(&mut Bench) -> bool) {
        let end = self.now() + span;
        while !holds(self) {
            assert!(self.now() < end, "it does not come: {:?}", self.master.facts());
            self.turn(end);
        }
    }

    fn turn(&mut self, until: Instant) {
        self.station.set_outputs(&self.master.outputs());
        let until = self.master.poll_timeout().map_or(until, |due| due.min(until));
        match self.station.wait(until).unwrap() {
            Some(Notice::Exchanged(exchange)) => {
                let now = self.now();
                let [sent, received] = [exchange.sent, exchange.received].map(|data| data.try_into().unwrap());
                self.master.handle_exchange(now, &sent, &received);
            }
            Some(Notice::Lost) => self.master.handle_offline(),
            None => self.master.handle_timeout(self.now()),
        }
    }

    fn pass_ms(&mut self, ms: u64) {
        let end = self.now() + Duration::from_millis(ms);
        while self.now() < end {
            self.turn(end);
        }
    }

    #[track_caller]
    fn next(&mut self) -> Event {
        let mut event = None;
        self.until(Duration::from_secs(1), |bench| {
            event = bench.master.poll();
            event.is_some()
        });
        event.unwrap()
    }

    #[track_caller]
    fn order(&mut self, order: Order, target: i32) -> Event {
        let now = self.now();
        self.master.order(now, order, target);
        self.next()
    }

    #[track_caller]
    fn write(&mut self, number: u16, value: u16) -> Event {
        self.master.ask(Task::Write { number, value: Value::Word(value) });
        self.next()
    }

    fn facts(&self) -> Facts {
        self.master.facts().unwrap().value
    }

    fn has(&self, bits: u16) -> bool {
        self.facts().system & bits != 0
    }

    /// What the drive does, whatever it shows.
    fn shaft(&self) -> (i32, i32) {
        let (now, drive) = (self.now(), self.drive);
        self.bus.with(|line| {
            let drive = line.slave(drive).application().drive();
            (drive.position(now), drive.velocity(now))
        })
    }

    fn enabled(model: &'static Model) -> Self {
        let mut bench = Bench::new(model);
        assert_eq!((bench.order(Order::Enable, 0), bench.has(system::MOTOR_RELEASED)), (Event::Followed, false));
        bench
    }
}

#[test]
fn travels_start_with_each_edge_and_end_where_they_are_to() {
    for model in DRIVES {
        let mut bench = Bench::enabled(model);
        for target in [5000, -300, -299] {
            assert_eq!(bench.order(Order::Start, target), Event::Followed, "{}", model.name);
            bench.until(Duration::from_secs(20), |bench| !bench.has(system::POSITIONING | system::MOVING));
            assert_eq!((bench.facts().position, bench.has(system::IN_POSITION)), (target, true), "{}", model.name);
        }
        assert_eq!(bench.order(Order::Start, 2_000_000), Event::NotFollowed, "{}: beyond its limit", model.name);
        bench.pass_ms(500);
        assert_eq!(bench.shaft(), (-299, 0));
    }
}

#[test]
fn a_travel_is_interrupted_resumed_and_given_up() {
    for model in DRIVES {
        let mut bench = Bench::enabled(model);
        assert_eq!(bench.order(Order::Start, 5000), Event::Followed);
        bench.pass_ms(1000);
        let (measured, exact) = (bench.facts().velocity, bench.shaft().1);
        assert!(exact > 0 && (measured - exact).abs() <= 1, "{}: {measured} for {exact} rev/min", model.name);
        assert_eq!(bench.order(Order::Interrupt(Braking::Programmed), 0), Event::Followed);
        bench.pass_ms(500);
        let (at, _) = bench.shaft();
        assert!((500..2000).contains(&at) && bench.has(system::POSITIONING) && bench.facts().velocity == 0);
        assert_eq!(bench.order(Order::Resume, 0), Event::Followed);
        bench.pass_ms(500);
        assert!(bench.shaft().0 > at);
        assert_eq!(bench.order(Order::Abort(Braking::Full), 0), Event::Followed);
        bench.pass_ms(500);
        assert_eq!((bench.shaft().1, bench.has(system::POSITIONING)), (0, false), "{}", model.name);
    }
}

#[test]
fn inching_is_a_step_or_lasts_until_it_is_stopped() {
    for model in DRIVES {
        let mut bench = Bench::enabled(model);
        for target in [1600, 3200] {
            assert_eq!(bench.order(Order::Step, 0), Event::Followed);
            bench.until(Duration::from_secs(10), |bench| bench.has(system::MOVING));
            bench.until(Duration::from_secs(10), |bench| !bench.has(system::MOVING));
            bench.pass_ms(100);
            assert_eq!(bench.facts().position, target, "{}", model.name);
        }
        assert_eq!(bench.order(Order::Inch(Direction::Negative), 0), Event::Followed);
        bench.pass_ms(1000);
        assert!(bench.shaft().1 < 0, "{}", model.name);
        assert_eq!(bench.order(Order::StopInching, 0), Event::Followed);
        bench.pass_ms(500);
        assert!(bench.shaft().0 < 3100 && bench.shaft().1 == 0);
        assert_eq!(bench.order(Order::Start, 0), Event::Followed);
    }
}

/// Bit 6 starts travels by its edges, and lets the drive turn in velocity mode while it is set.
#[test]
fn another_mode_starts_nothing() {
    for model in DRIVES {
        let mut bench = Bench::enabled(model);
        assert_eq!(bench.order(Order::Start, 100), Event::Followed);
        let refused = Event::Answered(Reply::Refused(Refusal::WRONG_STATE));
        assert_eq!(bench.write(930, 1), refused, "{}: a travel is under way", model.name);
        bench.pass_ms(5000);
        for (number, mode) in [(1, Mode::Velocity), (2, Mode::Positioning), (1, Mode::Velocity)] {
            assert_eq!(bench.write(930, number), Event::Answered(Reply::Value(Value::Word(number))));
            bench.pass_ms(1000);
            assert_eq!((bench.shaft(), bench.facts().mode), ((100, 0), mode), "{}", model.name);
        }
        for velocity in [30, -20] {
            assert_eq!(bench.order(Order::Start, velocity), Event::Followed);
            bench.pass_ms(1000);
            assert_eq!((bench.shaft().1, bench.facts().velocity), (velocity, velocity), "{}", model.name);
        }
        assert_eq!(bench.order(Order::Interrupt(Braking::Programmed), 0), Event::Followed);
        bench.pass_ms(1000);
        assert_eq!((bench.shaft().1, bench.write(930, 2)), (0, Event::Answered(Reply::Value(Value::Word(2)))));
        bench.pass_ms(1000);
        assert_eq!(bench.shaft().1, 0);
    }
}

#[test]
fn a_fault_is_seen_and_reset_once_its_cause_is_gone() {
    for model in DRIVES {
        let mut bench = Bench::enabled(model);
        let fails = |bench: &mut Bench, fails| {
            let (now, drive) = (bench.now(), bench.drive);
            bench.bus.with(|line| {
                let simulated = line.slave_mut(drive).application_mut().drive_mut();
                simulated.set_inputs(now, |inputs| inputs.sensor_fails = fails);
            });
        };
        fails(&mut bench, true);
        bench.until(Duration::from_secs(1), |bench| bench.has(system::FAULT));
        assert_eq!(bench.order(Order::ResetFault, 0), Event::NotFollowed);
        fails(&mut bench, false);
        assert_eq!((bench.order(Order::ResetFault, 0), bench.has(system::FAULT)), (Event::Followed, false));
        assert!(bench.has(system::MOTOR_RELEASED), "{}", model.name);
        assert_eq!(bench.order(Order::Enable, 0), Event::Followed);
    }
}

#[test]
fn what_was_ordered_does_not_outlive_the_cable() {
    for model in DRIVES {
        for master_is_gone in [false, true] {
            let mut bench = Bench::enabled(model);
            assert_eq!(bench.order(Order::Start, 5000), Event::Followed);
            bench.pass_ms(1000);
            let drive = bench.drive;
            let set = |bench: &Bench, works: bool| {
                bench.bus.with(|line| {
                    if master_is_gone { line.set_master_online(works) } else { line.set_connected(drive, works) }
                });
            };
            set(&bench, false);
            bench.pass_ms(1000);
            set(&bench, true);
            assert_eq!((bench.next(), bench.master.facts()), (Event::Lost, None), "{}", model.name);
            bench.until(Duration::from_secs(1), |bench| bench.master.facts().is_some());
            assert!(bench.has(system::MOTOR_RELEASED) && bench.shaft().1 == 0, "{}", model.name);
            let (at, _) = bench.shaft();
            assert_eq!(bench.order(Order::Enable, 0), Event::Followed);
            bench.pass_ms(1000);
            assert_eq!(bench.shaft(), (at, 0), "{}: it is not taken up again", model.name);
        }
    }
}
