//! A drive that gets telegrams one by one, without a bus.
#![allow(dead_code, reason = "not every test needs all of it")]

use lexican_profibus::pkw::{Event, Pkw, PkwMaster, Refusal, Reply, Task, Value};
use lexican_profibus::{Application, State};
use lexican_runtime::{Duration, Instant};
use siko::sim::SimulatedDrive;
use siko::sim::inputs::Inputs;
use siko_profibus::master::Telegram;
use siko_profibus::{Model, PPO, ProfibusDrive};

/// The interval of data exchange.
const CYCLE_MS: u64 = 10;

pub(crate) struct Rig {
    pub(crate) drive: ProfibusDrive,
    pub(crate) now: Instant,
    tasks: PkwMaster,
    control: u16,
    target: i32,
    inputs: Telegram,
    model: &'static Model,
    /// The actual value at the step `mark`.
    mark: i32,
}

impl Rig {
    /// A drive with power and data exchange.
    pub(crate) fn new(model: &'static Model) -> Self {
        let mut rig = Rig::power_on(model);
        rig.turn();
        rig
    }

    /// A drive before its first exchange.
    pub(crate) fn power_on(model: &'static Model) -> Self {
        let now = Instant::ZERO;
        let tasks = PkwMaster::new(Duration::from_secs(1));
        let mut rig = Rig {
            drive: ProfibusDrive::new(now, model, 7),
            now,
            tasks,
            control: 0,
            target: 0,
            inputs: [0; 14],
            model,
            mark: 0,
        };
        rig.drive.enter(now, State::DataExchange);
        rig
    }

    /// A drive in velocity mode, to turn with this many rev/min.
    pub(crate) fn in_velocity_mode(model: &'static Model) -> Self {
        let mut rig = Rig::new(model);
        assert_eq!(rig.write(930, 1), Ok(1));
        rig
    }

    /// Exchanges data.
    pub(crate) fn turn(&mut self) -> Option<Event> {
        self.now += Duration::from_millis(CYCLE_MS);
        self.drive.take_outputs(self.now, &self.outputs(self.tasks.output()));
        self.drive.write_inputs(self.now, &mut self.inputs);
        self.tasks.handle_input(PPO.pkw(&self.inputs).unwrap())
    }

    /// The outputs, with a task.
    pub(crate) fn outputs(&self, task: Pkw) -> Telegram {
        let mut outputs = Telegram::default();
        PPO.set_pkw(&mut outputs, task);
        PPO.set_word(&mut outputs, 0, self.control);
        PPO.set_double_word(&mut outputs, 1, self.target);
        outputs
    }

    pub(crate) fn target(&mut self, target: i32) {
        self.target = target;
    }

    /// Sends a control word, twice.
    pub(crate) fn control(&mut self, word: u16) {
        self.control_once(word);
        self.turn();
    }

    pub(crate) fn control_once(&mut self, word: u16) {
        self.control = word;
        self.turn();
    }

    pub(crate) fn word(&self) -> u16 {
        PPO.word(&self.inputs, 0).unwrap()
    }

    pub(crate) fn actual(&self) -> i32 {
        PPO.double_word(&self.inputs, 1).unwrap()
    }

    /// Checks that the status word matches a pattern of a flow chart, in 1, 0 and x.
    #[track_caller]
    pub(crate) fn shows(&mut self, pattern: &str) {
        let word = self.word();
        if let Some(bit) = differs(word, pattern) {
            panic!("bit {bit} of {word:016b} is not as in {pattern}");
        }
    }

    /// Waits until the status word matches a pattern.
    #[track_caller]
    pub(crate) fn comes_to(&mut self, pattern: &str) {
        let end = self.now + Duration::from_secs(60);
        while differs(self.word(), pattern).is_some() {
            assert!(self.now < end, "{:016b} does not become {pattern}", self.word());
            self.turn();
        }
    }

    pub(crate) fn pass_ms(&mut self, ms: u64) {
        for _ in 0..ms.div_ceil(CYCLE_MS) {
            self.turn();
        }
    }

    pub(crate) fn ask(&mut self, task: Task) -> Reply {
        assert!(self.tasks.start(self.now, task));
        for _ in 0..10 {
            if let Some(Event::Answered { reply, .. }) = self.turn() {
                return reply;
            }
        }
        panic!("it does not answer {task:?}");
    }

    pub(crate) fn read(&mut self, number: u16) -> Result<u32, Refusal> {
        match self.ask(Task::Read { number }) {
            Reply::Value(value) => Ok(value.raw()),
            Reply::Refused(refusal) => Err(refusal),
            other => panic!("{other:?}"),
        }
    }

    /// Writes a value with the width of the parameter.
    pub(crate) fn write(&mut self, number: u16, value: i32) -> Result<u32, Refusal> {
        let value = value.cast_unsigned();
        let value = if (1016..=1019).contains(&number) { Value::DoubleWord(value) } else { Value::Word(value as u16) };
        match self.ask(Task::Write { number, value }) {
            Reply::Value(value) => Ok(value.raw()),
            Reply::Refused(refusal) => Err(refusal),
            other => panic!("{other:?}"),
        }
    }

    /// Carries out orders separated by semicolons: hexadecimal control words are sent twice; `t5000` sets the target,
    /// `w1000` waits for this many milliseconds. The other words of the manuals' tables and of tests are below.
    #[track_caller]
    pub(crate) fn plays(&mut self, orders: &str) {
        for order in orders.split(';').map(str::trim).filter(|order| !order.is_empty()) {
            match order.split_whitespace().collect::<Vec<_>>().as_slice() {
                ["velocity"] => _ = self.write(930, 1),
                ["nosupply"] => self.world(|inputs| inputs.output_stage_supply_100mv = 0),
                ["supply"] => self.world(|inputs| inputs.output_stage_supply_100mv = 240),
                ["dark"] => self.world(|inputs| inputs.control_supply_100mv = 0),
                ["fault"] => self.world(|inputs| inputs.sensor_fails = true),
                ["heal"] => self.world(|inputs| inputs.sensor_fails = false),
                ["battery"] => self.world(|inputs| inputs.battery_10mv = 250),
                ["lag"] => self.world(|inputs| inputs.attainable_rpm = Some(5)),
                ["enable", how] => self.world(|inputs| inputs.enable = *how == "on"),
                ["switch", how] => self.world(|inputs| inputs.limit_switches[0] = *how == "on"),
                ["limit"] => {
                    _ = self.write(1017, 1000);
                    self.turn();
                }
                ["set", number, value] => {
                    let value: i32 = value.parse().unwrap();
                    assert_eq!(self.write(number.parse().unwrap(), value), Ok(value.cast_unsigned()), "{order}");
                }
                ["refused", number, value] => {
                    let refused = self.write(number.parse().unwrap(), value.parse().unwrap());
                    assert_eq!(refused, Err(Refusal::WRONG_STATE), "{order}");
                }
                ["pnu", number, mask, value] => {
                    let mask = u32::from_str_radix(mask, 16).unwrap();
                    let found = self.read(number.parse().unwrap()).map(|found| found & mask);
                    assert_eq!(found, Ok(value.parse().unwrap()), "{order}");
                }
                ["shows", pattern @ ..] => self.shows(&self.pattern(pattern)),
                ["comes-to", pattern @ ..] => self.comes_to(&self.pattern(pattern)),
                ["actual", range] => assert!(is_in(self.actual(), range), "{} in {orders}", self.actual()),
                ["mark"] => self.mark = self.actual(),
                ["way", range] => {
                    let way = self.actual() - self.mark;
                    assert!(is_in(way, range), "{way} in {orders}");
                }
                ["once", word] => self.control_once(u16::from_str_radix(word, 16).unwrap()),
                [other] => match (other.strip_prefix('t'), other.strip_prefix('w')) {
                    (Some(target), _) => self.target(target.parse().unwrap()),
                    (_, Some(ms)) => self.pass_ms(ms.parse().unwrap()),
                    _ => self.control(u16::from_str_radix(other, 16).unwrap()),
                },
                _ => panic!("there is no order {order:?}"),
            }
        }
    }

    /// Resolves a box of figure 13 by name, or a pattern in which b is bit 14 of velocity mode, where the drives
    /// differ.
    fn pattern(&self, words: &[&str]) -> String {
        let bit_14 = if self.model.velocity_bit_14 { "1" } else { "0" };
        match words {
            ["ready"] => "101x 1x11 x011 0111".to_owned(),
            ["travelling"] => "000x 1x1x x011 0111".to_owned(),
            ["inching"] => "0x0x 1x1x x011 0111".to_owned(),
            _ => words.concat().replace('b', bit_14),
        }
    }

    pub(crate) fn simulated(&mut self) -> &mut SimulatedDrive {
        self.drive.drive_mut()
    }

    /// Changes the inputs of the drive, and lets the master notice it.
    pub(crate) fn world(&mut self, change: impl FnOnce(&mut Inputs)) {
        let now = self.now;
        self.simulated().set_inputs(now, change);
        self.turn();
        self.turn();
    }
}

/// Whether a number is as `5000`, `>0`, `<5000` or `35..50` says.
fn is_in(found: i32, range: &str) -> bool {
    let number = |text: &str| text.parse::<i32>().unwrap();
    match (range.strip_prefix('>'), range.strip_prefix('<'), range.split_once("..")) {
        (Some(low), ..) => found > number(low),
        (_, Some(high), _) => found < number(high),
        (.., Some((low, high))) => (number(low)..=number(high)).contains(&found),
        _ => found == number(range),
    }
}

/// A bit in which a word differs from a pattern.
pub(crate) fn differs(word: u16, pattern: &str) -> Option<usize> {
    let digits: Vec<char> = pattern.chars().filter(|digit| !digit.is_whitespace()).collect();
    assert_eq!(digits.len(), 16, "{pattern}");
    let is = |bit: &usize| if word >> bit & 1 == 1 { '1' } else { '0' };
    (0..16).find(|bit| digits[15 - bit] != 'x' && digits[15 - bit] != is(bit))
}
