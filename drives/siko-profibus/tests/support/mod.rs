//! A drive behind the master of `profirust`, and what a test does with it.
#![allow(dead_code, reason = "not every test needs all of it")]

use lexican_profibus::pkw::{Refusal, Reply, Task, Value};
use lexican_profibus::virtual_bus::{SlaveId, VirtualBus};
use lexican_runtime::Duration;
use siko::sim::SimulatedDrive;
use siko::sim::inputs::Inputs;
use siko_profibus::{Door, Model, bus};

pub(crate) struct Bench {
    pub(crate) bus: VirtualBus<Door>,
    pub(crate) drive: SlaveId,
    target: i32,
}

impl Bench {
    /// Power on, and data is exchanged.
    pub(crate) fn new(model: &'static Model) -> Self {
        let (mut bus, drive) = bus::with(model, 7);
        assert!(bus.exchange(drive), "data is exchanged");
        Bench { bus, drive, target: 0 }
    }

    /// The same in velocity mode, to turn with so many rev/min.
    pub(crate) fn in_velocity_mode(model: &'static Model) -> Self {
        let mut bench = Bench::new(model);
        assert_eq!(bench.write(930, 1), Ok(1));
        bench
    }

    pub(crate) fn target(&mut self, target: i32) {
        self.target = target;
    }

    /// Sends a control word, twice.
    pub(crate) fn control(&mut self, word: u16) {
        bus::set(&mut self.bus, self.drive, word, self.target);
        assert!(self.bus.exchange(self.drive));
    }

    pub(crate) fn word(&mut self) -> u16 {
        bus::get(&mut self.bus, self.drive).unwrap().0
    }

    pub(crate) fn actual(&mut self) -> i32 {
        bus::get(&mut self.bus, self.drive).unwrap().1
    }

    /// The status word is as in a pattern of a flow chart: 1, 0 and x.
    #[track_caller]
    pub(crate) fn shows(&mut self, pattern: &str) {
        let word = self.word();
        if let Some(bit) = differs(word, pattern) {
            panic!("bit {bit} of {word:016b} is not as in {pattern}");
        }
    }

    /// Lets time pass until the status word is as in a pattern.
    #[track_caller]
    pub(crate) fn comes_to(&mut self, pattern: &str) {
        let drive = self.drive;
        let came = self.bus.run_until(Duration::from_secs(60), |bus| {
            bus::get(bus, drive).is_some_and(|(word, _)| differs(word, pattern).is_none())
        });
        assert!(came, "{:016b} does not become {pattern}", self.word());
    }

    pub(crate) fn pass_ms(&mut self, ms: u64) {
        self.bus.run(Duration::from_millis(ms));
    }

    pub(crate) fn ask(&mut self, task: Task) -> Reply {
        self.bus.ask(self.drive, task).expect("an answer")
    }

    pub(crate) fn read(&mut self, number: u16) -> Result<u32, Refusal> {
        match self.ask(Task::Read { number }) {
            Reply::Value(value) => Ok(value.raw()),
            Reply::Refused(refusal) => Err(refusal),
            other => panic!("{other:?}"),
        }
    }

    /// As wide as the parameter.
    pub(crate) fn write(&mut self, number: u16, value: i32) -> Result<u32, Refusal> {
        let value = value.cast_unsigned();
        let value = if (1016..=1019).contains(&number) { Value::DoubleWord(value) } else { Value::Word(value as u16) };
        match self.ask(Task::Write { number, value }) {
            Reply::Value(value) => Ok(value.raw()),
            Reply::Refused(refusal) => Err(refusal),
            other => panic!("{other:?}"),
        }
    }

    pub(crate) fn door(&self) -> &Door {
        self.bus.slave(self.drive).application()
    }

    pub(crate) fn simulated(&mut self) -> &mut SimulatedDrive {
        self.bus.slave_mut(self.drive).application_mut().drive_mut()
    }

    /// Lets the world change, and the master see it.
    pub(crate) fn world(&mut self, change: impl FnOnce(&mut Inputs)) {
        let now = self.bus.now();
        self.simulated().set_inputs(now, change);
        assert!(self.bus.exchange(self.drive));
    }
}

/// The bit in which a word is not as in a pattern.
pub(crate) fn differs(word: u16, pattern: &str) -> Option<usize> {
    let digits: Vec<char> = pattern.chars().filter(|digit| !digit.is_whitespace()).collect();
    assert_eq!(digits.len(), 16, "{pattern}");
    let is = |bit: &usize| if word >> bit & 1 == 1 { '1' } else { '0' };
    (0..16).find(|bit| digits[15 - bit] != 'x' && digits[15 - bit] != is(bit))
}
