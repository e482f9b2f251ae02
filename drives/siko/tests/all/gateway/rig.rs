//! A gateway with a scripted door.

use std::collections::VecDeque;

use lexican_driver::Direction;
use lexican_runtime::host::Node;
use lexican_runtime::host::candump::Line;
use lexican_runtime::object::Address;
use lexican_runtime::{AbortCode, Duration, Instant, Measured, NodeId};
use siko::gateway::{Door, Facts, Gateway, Job, Report};
use siko::order::{Braking, Order};
use siko::sim::Model;
use siko::words::system::{MOTOR_RELEASED, MOVING, POSITIONING};

pub(crate) const NODE: NodeId = NodeId::literal(5);
pub(crate) const MODE: Address = Address::new(0x6060, 0);
pub(crate) const WORST_CYCLE: Duration = Duration::from_secs(2);
pub(crate) const FAULTS: Address = Address::new(0x1003, 1);

pub(crate) const STOPPED: Order = Order::Interrupt(Braking::Programmed);
pub(crate) const UP: Order = Order::Inch(Direction::Positive);
pub(crate) const DOWN: Order = Order::Inch(Direction::Negative);

#[derive(Default)]
pub(crate) struct Scripted {
    /// How often it was told that the drive counts as lost.
    pub(crate) lost: usize,
    pub(crate) jobs: Vec<Job>,
    pub(crate) reports: VecDeque<Report>,
    pub(crate) deadline: Option<Instant>,
    /// How often its deadline has been handled.
    pub(crate) timeouts: usize,
}

impl Door for Scripted {
    fn has(&self, address: Address) -> bool {
        match address.index() {
            0x1003 | 0x1011 | 0x2410 => (1..=8).contains(&address.sub()),
            index => [0x6060, 0x6064, 0x606C, 0x60FF].contains(&index),
        }
    }

    fn begin(&mut self, _: Instant, job: Job) {
        self.jobs.push(job);
    }

    fn worst_cycle(&self) -> Duration {
        WORST_CYCLE
    }

    fn worst_job(&self) -> Duration {
        Duration::from_millis(300)
    }

    fn lose(&mut self, _: Instant) {
        self.lost += 1;
    }

    fn poll(&mut self, _: Instant) -> Option<Report> {
        self.reports.pop_front()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.deadline
    }

    fn handle_timeout(&mut self, _: Instant) {
        self.timeouts += 1;
    }
}

pub(crate) struct Rig {
    pub(crate) gateway: Gateway<Scripted>,
    pub(crate) now: Instant,
}

impl Rig {
    pub(crate) fn of(model: &'static Model) -> Self {
        Rig { gateway: Gateway::new(model, NODE, Scripted::default()), now: Instant::ZERO }
    }

    /// A gateway whose drive has not answered yet.
    pub(crate) fn silent() -> Self {
        Rig::of(&siko_ag02::sim::MODEL)
    }

    /// A node in OPERATIONAL, with the motor released, in a mode of 6060h.
    pub(crate) fn operational(mode: i64) -> Self {
        let mut rig = Rig::silent();
        assert_eq!(rig.sees(MOTOR_RELEASED), [Job::Read(MODE)]);
        assert_eq!((rig.done(Ok(mode)), rig.frames()), (vec![], vec!["705#00".to_owned()]));
        assert_eq!(rig.send("000#0105"), []);
        rig
    }

    /// A drive in OPERATION ENABLED, at rest, with Stop in the control word.
    pub(crate) fn enabled(mode: i64) -> Self {
        let mut rig = Rig::operational(mode);
        assert_eq!([rig.control(0x0106), rig.control(0x0107)], [[], []]);
        assert_eq!(rig.control(0x010F), [order(Order::Enable, 0)]);
        assert_eq!(rig.sees_and_is_done(0), []);
        rig
    }

    /// A drive during a travel, in positioning mode.
    pub(crate) fn travelling() -> Self {
        let mut rig = Rig::enabled(1);
        assert_eq!(rig.starts(0x001F), [order(Order::Start, 0)]);
        assert_eq!(rig.sees_and_is_done(POSITIONING | MOVING), []);
        rig
    }

    pub(crate) fn jobs(&mut self) -> Vec<Job> {
        std::mem::take(&mut self.gateway.door_mut().jobs)
    }

    pub(crate) fn report(&mut self, reports: &[Report]) -> Vec<Job> {
        self.gateway.door_mut().reports.extend(reports);
        self.gateway.advance(self.now);
        self.jobs()
    }

    pub(crate) fn sees(&mut self, system: u16) -> Vec<Job> {
        self.report(&[facts_at(system, self.now)])
    }

    pub(crate) fn done(&mut self, result: Result<i64, AbortCode>) -> Vec<Job> {
        self.report(&[Report::Done(result)])
    }

    pub(crate) fn sees_and_is_done(&mut self, system: u16) -> Vec<Job> {
        self.report(&[facts_at(system, self.now), Report::Done(Ok(0))])
    }

    pub(crate) fn send(&mut self, text: &str) -> Vec<Job> {
        let frame = format!("(0000000000.000000) can0 {text}").parse::<Line>().unwrap().frame;
        self.gateway.handle_frame(self.now, &frame);
        self.jobs()
    }

    pub(crate) fn frames(&mut self) -> Vec<String> {
        std::iter::from_fn(|| self.gateway.poll_transmit(self.now)).map(|frame| frame.to_string()).collect()
    }

    pub(crate) fn control(&mut self, word: u16) -> Vec<Job> {
        let [low, high] = word.to_le_bytes();
        let jobs = self.send(&format!("605#23406000{low:02X}{high:02X}0000"));
        assert_eq!(self.frames(), ["585#6040600000000000"]);
        jobs
    }

    /// Sends a control word that is judged after a look.
    #[track_caller]
    pub(crate) fn starts(&mut self, word: u16) -> Vec<Job> {
        assert_eq!(self.control(word), [Job::Look], "{word:04X}");
        self.done(Ok(0))
    }

    /// The status word, 6041h.
    #[track_caller]
    pub(crate) fn status(&mut self) -> u16 {
        assert_eq!(self.send("605#4041600000000000"), [Job::Look]);
        self.done(Ok(0));
        let frames = self.frames();
        let answer = frames.iter().find_map(|frame| frame.split_once("416000")).unwrap_or_else(|| panic!("{frames:?}"));
        u16::from_str_radix(&answer.1[..4], 16).unwrap().swap_bytes()
    }
}

pub(crate) fn facts_at(system: u16, at: Instant) -> Report {
    Report::Facts(Measured::new(Facts { system, ..Facts::default() }, at))
}

/// Facts at time zero.
pub(crate) fn facts(system: u16) -> Report {
    facts_at(system, Instant::ZERO)
}

pub(crate) fn order(order: Order, target: i32) -> Job {
    Job::Order { order, target }
}
