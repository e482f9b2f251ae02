//! Tables 25 and 26 of the manuals, frame by frame, against the simulated drives: they are the same for both.

use std::sync::{Arc, Mutex};

use lexican_runtime::host::{Link, VirtualBus, VirtualLink};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{Duration, Frame, Instant};
use siko_ag02::sim::MODEL as AG02;
use siko_ag03_1::od;
use siko_ag03_1::sim::{MODEL as AG03_1, Model, SimulatedDrive};
use siko_ag03_1::state::State;
use siko_ag03_1::words::status;
use siko_ag03_1::worked_examples::{Action, Example, NODE, POSITIONING, Until, VELOCITY};

/// The drive on a bus of 500 kbit/s, and everything that was heard there.
struct Bench {
    bus: VirtualBus,
    link: VirtualLink,
    drive: Arc<Mutex<SimulatedDrive>>,
    heard: Arc<Mutex<Vec<Frame>>>,
}

impl Bench {
    fn new(model: &'static Model) -> Self {
        let bus = VirtualBus::with_bit_rate(500);
        let drive = Arc::new(Mutex::new(SimulatedDrive::new(model, NODE)));
        bus.attach(Arc::clone(&drive));
        let heard = Arc::new(Mutex::new(Vec::new()));
        let list = Arc::clone(&heard);
        bus.observe(move |_, frame| list.lock().unwrap().push(*frame));
        let link = bus.link();
        let mut bench = Bench { bus, link, drive, heard };
        bench.pass(Duration::from_millis(10));
        bench
    }

    fn pass(&mut self, span: Duration) {
        let until = self.bus.now() + span;
        while self.link.receive_frame(until).unwrap().is_some() {}
        self.bus.advance_to(until);
    }

    /// Sends, and hears the answer, if there is one at once.
    fn send(&mut self, frame: &Frame) {
        self.link.send(frame).unwrap();
        self.pass(Duration::from_millis(2));
    }

    fn see<T>(&self, look: impl FnOnce(&SimulatedDrive, Instant) -> T) -> T {
        look(&self.drive.lock().unwrap(), self.bus.now())
    }

    fn holds(&self, until: Until, since: Instant) -> bool {
        self.see(|drive, now| {
            let reached = drive.status_word(now) & status::TARGET_REACHED != 0;
            match until {
                Until::Position(position) => {
                    reached && drive.position(now) == position && drive.shaft(now).velocity == 0.0
                }
                Until::Velocity(velocity) => reached && drive.velocity(now) == velocity,
                Until::Standstill => drive.shaft(now).velocity == 0.0,
                Until::Elapsed(span) => since + span <= now,
            }
        })
    }

    #[track_caller]
    fn wait(&mut self, until: Until) {
        let since = self.bus.now();
        for _ in 0..100_000 {
            if self.holds(until, since) {
                return;
            }
            self.pass(Duration::from_millis(1));
        }
        panic!("{until:?} does not come");
    }

    #[track_caller]
    fn run(&mut self, example: &Example, mut after: impl FnMut(&mut Bench, usize)) {
        // 6060h by SDO, as the example presupposes.
        let write = if self.see(|drive, _| drive.model().writes_four_bytes) { 0x23 } else { 0x2F };
        let mode = [write, 0x60, 0x60, 0x00, example.operating_mode, 0, 0, 0];
        self.send(&Frame::from_array(lexican_runtime::CobId::of_node(0x600, NODE), mode));
        for (row, step) in example.rows.iter().enumerate() {
            match step.action {
                Action::Send(frame) => self.send(&frame),
                Action::Wait(until) => self.wait(until),
            }
            after(self, row);
        }
        let sent = example.rows.iter().filter_map(|row| match row.action {
            Action::Send(frame) => Some(frame),
            Action::Wait(_) => None,
        });
        let heard = self.heard.lock().unwrap();
        let mut heard = heard.iter();
        for frame in sent {
            assert!(heard.any(|other| *other == frame), "{frame} is not on the bus, or not in its place");
        }
    }

    #[track_caller]
    fn is_at(&self, nmt: NmtState, state: State) {
        assert_eq!(self.see(|drive, _| (drive.nmt_state(), drive.state())), (nmt, state));
    }
}

#[test]
fn table_25_travels_stops_and_resumes() {
    for model in [&AG03_1, &AG02] {
        let mut bench = Bench::new(model);
        let mut stops = Vec::new();
        bench.run(&POSITIONING, |bench, row| match POSITIONING.rows[row].meaning {
            "RPDO1: Enable Operation" => bench.is_at(NmtState::Operational, State::OperationEnabled),
            "still stopped" => stops.push(bench.see(|drive, now| (drive.position(now), drive.status_word(now)))),
            _ => {}
        });
        let [(position, status_word)] = stops[..] else { panic!("the drive stops once") };
        assert!((-5000..5000).contains(&position));
        assert_eq!(
            status_word & (status::POSITIONING | status::MOVING),
            status::POSITIONING,
            "the travel stays active"
        );
        bench.is_at(NmtState::PreOperational, State::SwitchOnDisabled);
        assert_eq!(bench.see(SimulatedDrive::position), -5000);
    }
}

#[test]
fn table_26_runs_at_three_velocities() {
    for model in [&AG03_1, &AG02] {
        let mut bench = Bench::new(model);
        bench.run(&VELOCITY, |_, _| {});
        bench.is_at(NmtState::PreOperational, State::SwitchOnDisabled);
        assert_eq!(bench.see(SimulatedDrive::velocity), 0);
        let mode = bench.see(|drive, _| drive.stored(od::MODES_OF_OPERATION));
        assert_eq!(mode, od::OperatingMode::PROFILE_VELOCITY);
    }
}

#[test]
fn the_boot_up_message_comes_first() {
    for model in [&AG03_1, &AG02] {
        let bench = Bench::new(model);
        let heard = bench.heard.lock().unwrap();
        assert_eq!(heard.iter().map(ToString::to_string).collect::<Vec<_>>(), ["705#00"]);
    }
}
