//! Each remedy is tried in the state that produces its error: when the advice is followed, the order succeeds.

use std::sync::{Arc, Mutex};

use kollmorgen_akd::driver::{AKD, AKD_BY_SDO};
use kollmorgen_akd::sim::SimulatedServo;
use lexican_driver::sequence::Setting;
use lexican_driver::{Any, Description, Direction, Drive, Error, Missing, Mode, Step, Supervision};
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{BusState, Fate, VirtualBus, VirtualLink};
use lexican_runtime::object::{Address, Mapping, Object, Ro, Rw, Tpdo, Values};
use lexican_runtime::procedure::PdoSettings;
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_runtime::wire::pdo::{PdoCobId, TransmissionType};
use lexican_runtime::{CobId, Duration, Frame, NodeId};
use siko_ag02::driver::AG02;
use siko_ag03_1::driver::AG03_1;
use siko_ag03_1::sim::SimulatedDrive;
use siko_ag03_1::sim::inputs::{Inputs, Shaft};

const NODE: NodeId = NodeId::literal(5);
const UPPER_LIMIT: Object<i32, Rw> = Object::new(0x607D, 0x02);
const LOWER_LIMIT: Object<i32, Rw> = Object::new(0x607D, 0x01);
const GUARDED: Supervision = Supervision::within(Duration::from_secs(1));

type Shell = Drive<VirtualLink, Any>;

struct Rig {
    bus: VirtualBus,
    siko: Arc<Mutex<SimulatedDrive>>,
    drive: Option<Shell>,
    /// The number in the order; the advice may change it.
    number: i32,
    description: &'static Description,
}

impl Rig {
    fn new(description: &'static Description) -> Self {
        let bus = VirtualBus::with_bit_rate(500);
        let model = if description.name == AG02.name { &siko_ag02::sim::MODEL } else { &siko_ag03_1::sim::MODEL };
        let siko = Arc::new(Mutex::new(SimulatedDrive::new(model, NODE)));
        if description.name == AKD.name {
            bus.attach(SimulatedServo::new(bus.now(), &kollmorgen_akd::sim::MODEL, NODE));
        } else {
            bus.attach(Arc::clone(&siko));
        }
        let mut rig = Rig { bus, siko, drive: None, number: 100, description };
        rig.connect().unwrap();
        rig
    }

    fn enabled(description: &'static Description) -> Self {
        let mut rig = Rig::new(description);
        rig.drive().set_mode(Mode::Positioning).unwrap();
        rig.drive().enable().unwrap();
        rig
    }

    /// The rig after some action.
    fn after<R>(mut self, what: impl FnOnce(&mut Rig) -> R) -> Self {
        what(&mut self);
        self
    }

    fn connect(&mut self) -> Result<(), Error> {
        self.drive = None;
        self.drive = Some(Drive::connect_described_unprotected(self.bus.link(), NODE, self.description)?);
        Ok(())
    }

    fn drive(&mut self) -> &mut Shell {
        self.drive.as_mut().unwrap()
    }

    /// Another tool, or a person with one, writes to the node.
    fn by_tool(&mut self, writes: &[(u16, u8, u32)], then: NmtCommand) {
        self.drive = None;
        let mut network = Network::new(self.bus.link());
        for (index, sub, value) in writes {
            network.write_bytes(NODE, Address::new(*index, *sub), &value.to_le_bytes()).unwrap();
        }
        network.command(then, Some(NODE)).unwrap();
        self.bus.advance(Duration::from_secs(1));
    }

    /// Maps a PDO as the program does.
    fn map<V: Values, N>(
        &mut self,
        transmission: TransmissionType,
        mapping: &Mapping<Tpdo, V, N>,
    ) -> Result<(), Error> {
        let number = u16::try_from(self.number).unwrap();
        let id = CobId::of_node(0x80 + 0x100 * number, NODE);
        let mut settings = PdoSettings::of(number, PdoCobId::valid(id), transmission, mapping);
        settings.event_timer_ms = (transmission == TransmissionType::EventProfile).then_some(100);
        self.drive().configure_pdos(&[settings])
    }

    /// The node gives another answer for an object until that is written.
    fn says(&mut self, index: u16, answer: [u8; 8], until: [u8; 3]) {
        let id = CobId::of_node(0x580, NODE);
        let [low, high] = index.to_le_bytes();
        let mut is_over = false;
        self.bus.set_fate(move |_, frame| {
            is_over |= frame.data().starts_with(&until);
            match frame.data() {
                [0x42..=0x4F, a, b, ..] if frame.id() == id && !is_over && (*a, *b) == (low, high) => {
                    Fate::Replace(Frame::from_array(id, answer))
                }
                _ => Fate::Deliver,
            }
        });
    }

    /// The node does not receive control words with these bits.
    fn misses(&mut self, bits: u16) {
        self.bus.set_fate(move |_, frame| {
            let is_control = [0x205, 0x405].contains(&frame.id().raw());
            match frame.data() {
                [a, b, ..] if is_control && u16::from_le_bytes([*a, *b]) & bits != 0 => Fate::Lose,
                _ => Fate::Deliver,
            }
        });
    }

    fn hears(&mut self) {
        self.bus.set_fate(|_, _| Fate::Deliver);
    }

    fn world(&mut self, change: impl FnOnce(&mut Inputs)) {
        self.siko.lock().unwrap().set_inputs(self.bus.now(), change);
    }

    /// Turns the shaft by hand while the drive is off, with limits of 1000 in both directions: to a limit, or beyond
    /// it.
    fn beyond(increments: i32) -> Self {
        let mut rig = Rig::new(&AG03_1);
        rig.drive().write(LOWER_LIMIT, -1000).unwrap();
        rig.drive().write(UPPER_LIMIT, 1000).unwrap();
        assert!(rig.siko.lock().unwrap().turn_shaft(rig.bus.now(), increments));
        rig.drive().set_mode(Mode::Positioning).unwrap();
        rig.drive().enable().unwrap();
        rig.number = 0;
        rig
    }

    fn inch(&mut self, direction: Direction) {
        self.drive().inch(direction).unwrap();
        self.drive().pass(Duration::from_millis(500)).unwrap();
        self.drive().stop_inching().unwrap();
    }

    fn inch_back(&mut self, direction: Direction) {
        while self.drive().position().unwrap().abs() > 1000 {
            self.inch(direction);
        }
    }

    fn step(&mut self, step: Step) -> Result<(), Error> {
        let drive = self.drive();
        match step {
            Step::Enable => drive.enable(),
            Step::Disable => drive.disable(),
            Step::Stop => drive.stop(),
            Step::Resume => drive.resume().and_then(|()| drive.finish().map(|_| ())),
            Step::Drop => drive.drop_travel(),
            Step::ResetFault => drive.reset_fault().map(|_| ()),
            other => panic!("{other:?}: how is it done?"),
        }
    }
}

fn word(error: &Error) -> &'static str {
    match error {
        Error::Refused(refusal) => refusal.first().unwrap().word(),
        error => error.word(),
    }
}

type Act = fn(&mut Rig) -> Result<(), Error>;
type Person = fn(&mut Rig);

fn nothing(_: &mut Rig) {}
fn travel(rig: &mut Rig) -> Result<(), Error> {
    let target = rig.number;
    rig.drive().move_to(target).map(|_| ())
}
fn enable(rig: &mut Rig) -> Result<(), Error> {
    rig.drive().enable()
}
fn run(rig: &mut Rig) -> Result<(), Error> {
    let velocity = rig.number;
    rig.drive().run_at(velocity)?;
    rig.drive().stop()
}

/// A message, the state that produces it, the order that fails there, and what a person does about it.
struct Row(&'static str, fn() -> Rig, Act, Person);

const ROWS: &[Row] = &[
    Row(
        "fault",
        || {
            let mut rig = Rig::enabled(&AG03_1);
            rig.drive().start_moving_to(5000).unwrap();
            rig.world(|inputs| inputs.shaft = Shaft::Blocked);
            assert!(rig.drive().finish().is_ok());
            rig
        },
        travel,
        |rig| rig.world(|inputs| inputs.shaft = Shaft::Free),
    ),
    Row(
        "supply",
        || Rig::new(&AG03_1).after(|rig| rig.world(|inputs| inputs.output_stage_supply_100mv = 0)),
        enable,
        |rig| rig.world(|inputs| inputs.output_stage_supply_100mv = 240),
    ),
    Row(
        "enable-input",
        || Rig::enabled(&AG02).after(|rig| rig.world(|inputs| inputs.enable = false)),
        travel,
        |rig| rig.world(|inputs| inputs.enable = true),
    ),
    Row("interrupted", interrupted, travel, nothing),
    Row(
        "under-way",
        || {
            let mut rig = Rig::enabled(&AG03_1);
            rig.drive().start_moving_to(5000).unwrap();
            rig.drive().pass(Duration::from_secs(1)).unwrap();
            rig
        },
        travel,
        nothing,
    ),
    Row("disabled", || Rig::new(&AG03_1), travel, nothing),
    Row("enabled", || Rig::enabled(&AG03_1), |rig| rig.drive().set_start_by_sync(true), nothing),
    Row(
        "mode",
        || {
            let mut rig = Rig::new(&AG03_1);
            rig.drive().set_mode(Mode::Velocity).unwrap();
            rig.drive().enable().unwrap();
            rig
        },
        travel,
        |rig| rig.drive().set_mode(Mode::Positioning).unwrap(),
    ),
    Row("above-limit", || Rig::beyond(1300), travel, |rig| rig.inch_back(Direction::Negative)),
    Row("below-limit", || Rig::beyond(-1300), travel, |rig| rig.inch_back(Direction::Positive)),
    Row(
        "target",
        || Rig::beyond(0).after(|rig| rig.number = 2000),
        travel,
        |rig| rig.drive().write(UPPER_LIMIT, 3000).unwrap(),
    ),
    Row(
        "velocity",
        || {
            let mut rig = Rig::new(&AG03_1);
            rig.drive().set_mode(Mode::Velocity).unwrap();
            rig.drive().enable().unwrap();
            rig.number = 32_000;
            rig
        },
        run,
        |rig| rig.number = 20,
    ),
    Row(
        "no-travel",
        || Rig::enabled(&AG03_1),
        |rig| rig.drive().resume(),
        |rig| {
            rig.drive().start_moving_to(500).unwrap();
            rig.drive().interrupt().unwrap();
        },
    ),
    Row(
        "start-by-sync",
        || Rig::enabled(&AG03_1),
        |rig| rig.drive().prepare_moving_to(100),
        |rig| {
            rig.drive().disable().unwrap();
            rig.drive().set_start_by_sync(true).unwrap();
            rig.drive().enable().unwrap();
        },
    ),
    Row("at-upper-limit", || Rig::beyond(1000), inch_up, |rig| rig.inch(Direction::Negative)),
    Row("at-lower-limit", || Rig::beyond(-1000), inch_down, |rig| rig.inch(Direction::Positive)),
    Row(
        "link",
        || {
            let rig = Rig::enabled(&AG03_1);
            rig.bus.set_state(BusState::Down);
            rig
        },
        travel,
        |rig| rig.bus.set_state(BusState::Active),
    ),
    Row(
        "may-be-moving",
        || {
            let mut rig = Rig::enabled(&AG03_1);
            rig.drive().start_moving_to(5000).unwrap();
            rig.bus.set_fate(|_, _| Fate::Lose);
            rig
        },
        |rig| rig.drive().finish().map(|_| ()),
        |rig| rig.bus.set_fate(|_, _| Fate::Deliver),
    ),
    Row(
        "out-of-range",
        || Rig::new(&AG03_1).after(|rig| rig.number = 70_000),
        |rig| {
            let within = Duration::from_millis(rig.number as u64);
            rig.drive().protect(Supervision::within(within)).map(|_| ())
        },
        |rig| rig.number = 1000,
    ),
    Row(
        "aborted",
        || Rig::new(&AG03_1).after(|rig| rig.number = i32::MAX),
        |rig| {
            let limit = rig.number;
            rig.drive().write(UPPER_LIMIT, limit)
        },
        |rig| rig.number = 1000,
    ),
    Row(
        "limit-switch",
        || Rig::enabled(&AG02).after(|rig| rig.world(|inputs| inputs.limit_switches = [true, false])),
        travel,
        |rig| {
            rig.inch(Direction::Negative);
            // The drive is then off the switch.
            rig.world(|inputs| inputs.limit_switches = [false, false]);
        },
    ),
    Row(
        "no-answer",
        || Rig::new(&AG03_1).after(|rig| rig.bus = VirtualBus::new()),
        Rig::connect,
        |rig| drop(rig.bus.attach(Arc::clone(&rig.siko))),
    ),
    Row(
        "restarted",
        || {
            let rig = Rig::enabled(&AG03_1);
            rig.siko.lock().unwrap().power_cycle(rig.bus.now());
            rig
        },
        |rig| rig.drive().pass(Duration::from_secs(1)),
        nothing,
    ),
    Row("cancelled", || Rig::enabled(&AG03_1).after(|rig| rig.drive().cancel_handle().cancel()), travel, nothing),
    Row(
        "not-this-drive",
        || Rig::new(&AG03_1).after(|rig| rig.description = &AKD),
        Rig::connect,
        |rig| rig.description = &AG03_1,
    ),
    Row(
        "heartbeat",
        || Rig::new(&AG03_1).after(|rig| rig.drive().write(Object::<u16, Rw>::new(0x1017, 0x00), 100).unwrap()),
        |rig| rig.drive().protect(GUARDED).map(|_| ()),
        |rig| rig.drive().write(Object::<u16, Rw>::new(0x1017, 0x00), 0).unwrap(),
    ),
];

const POSITION: Object<i32, Ro, Tpdo> = Object::new(0x6064, 0x00);
const VELOCITY: Object<i32, Ro, Tpdo> = Object::new(0x606C, 0x00);
const ACTUAL: Mapping<Tpdo, (i32,)> = Mapping::transmit().with(POSITION);
const BOTH: Mapping<Tpdo, (i32, i32)> = Mapping::transmit().with(POSITION).with(VELOCITY);
const LOAD: u32 = u32::from_le_bytes(*b"load");
const FREE: i32 = 2;

/// Rows about PDOs, and about wrong answers and lost frames.
const MORE_ROWS: &[Row] = &[
    Row(
        "other-cob-id",
        || Rig::new(&AG03_1).after(|rig| rig.by_tool(&[(0x1400, 1, 0x206)], NmtCommand::EnterPreOperational)),
        Rig::connect,
        |rig| rig.by_tool(&[(0x1011, 1, LOAD)], NmtCommand::ResetNode),
    ),
    Row(
        "other-cob-id",
        || Rig::new(&AKD).after(|rig| rig.by_tool(&[(0x1400, 1, 0x206)], NmtCommand::EnterPreOperational)),
        Rig::connect,
        // The drive has no 1011h.
        |rig| rig.by_tool(&[(0x1400, 1, 0x205)], NmtCommand::EnterPreOperational),
    ),
    Row(
        "pdo-in-use",
        || Rig::new(&AKD).after(|rig| rig.number = 1),
        |rig| rig.map(TransmissionType::EventProfile, &ACTUAL),
        // The driver has all four PDOs.
        |rig| {
            rig.description = &AKD_BY_SDO;
            rig.connect().unwrap();
        },
    ),
    Row(
        "no-pdo",
        || {
            let mut rig = Rig::new(&AKD_BY_SDO);
            rig.number = FREE;
            rig.map(TransmissionType::SynchronousCyclic(1), &ACTUAL).unwrap();
            rig
        },
        |rig| rig.drive().receive_pdo(FREE as u16, &ACTUAL).map(|_| ()),
        // The PDO waits for a SYNC that nobody sends.
        |rig| rig.map(TransmissionType::EventProfile, &ACTUAL).unwrap(),
    ),
    Row(
        "short-pdo",
        || {
            let mut rig = Rig::new(&AKD_BY_SDO);
            rig.number = FREE;
            rig.map(TransmissionType::EventProfile, &ACTUAL).unwrap();
            rig
        },
        |rig| rig.drive().receive_pdo(FREE as u16, &BOTH).map(|_| ()),
        |rig| rig.map(TransmissionType::EventProfile, &BOTH).unwrap(),
    ),
    Row(
        "data-sheet",
        || Rig::new(&AG03_1).after(|rig| rig.says(0x6064, [0x4B, 0x64, 0x60, 0, 7, 0, 0, 0], [0xFF; 3])),
        |rig| match rig.number {
            100 => rig.drive().read(POSITION).map(|_| ()),
            _ => rig.drive().read(Object::<i16, Ro>::new(0x6064, 0x00)).map(|_| ()),
        },
        |rig| rig.number = 0,
    ),
    Row(
        "no-parameter",
        || Rig::new(&AG03_1),
        |rig| {
            let foreign = Setting { address: Address::new(0x2410, 0x07), value: 1 };
            let settings = if rig.number == 100 { vec![foreign] } else { Vec::new() };
            rig.drive().write_parameters(&settings).map(|_| ())
        },
        |rig| rig.number = 0,
    ),
    Row(
        "unknown-mode",
        || Rig::enabled(&AG03_1).after(|rig| rig.says(0x6060, [0x4F, 0x60, 0x60, 0, 6, 0, 0, 0], [0x2F, 0x60, 0x60])),
        travel,
        |rig| rig.drive().set_mode(Mode::Positioning).unwrap(),
    ),
    Row("no-reaction", || Rig::new(&AG03_1).after(|rig| rig.misses(0x000F)), enable, Rig::hears),
    Row("not-taken", || Rig::enabled(&AG03_1).after(|rig| rig.misses(0x0010)), travel, Rig::hears),
    Row(
        "no-way",
        || {
            let rig = Rig::new(&AG03_1);
            // NOT READY TO SWITCH ON whenever it is read; the drive sends nothing.
            let shown = [0x4B, 0x41, 0x60, 0, 0x00, 0x02, 0, 0];
            rig.bus.set_fate(move |_, frame| match (frame.id().raw(), frame.data()) {
                (0x585, [_, 0x41, 0x60, ..]) => Fate::Replace(Frame::from_array(frame.id(), shown)),
                (0x185 | 0x385 | 0x485, _) => Fate::Lose,
                _ => Fate::Deliver,
            });
            rig
        },
        enable,
        Rig::hears,
    ),
];

/// Messages that no row tries, and why.
const NOT_TRIED: &[(&str, &str)] = &[
    ("safety", "by an AKD: it has a test of its own below"),
    ("profile-velocity", "by a drive made of its data sheet: its test is in `data_sheets/`"),
    ("unsupported", "names no way out: the drive cannot do it"),
    ("refused", "is what is missing: a row each"),
    ("mode-not-taken", "the drives here take each mode at once"),
    ("not-calibrated", "takes a drive whose homing on the spot fails"),
    ("not-stopped", "takes a shaft that nothing stops: the way out is an emergency stop"),
    ("unknown-state", "takes a status word that no simulated drive has"),
    ("other-mapping", "its ways out are those of `other-cob-id`"),
];

fn inch_up(rig: &mut Rig) -> Result<(), Error> {
    rig.drive().inch(Direction::Positive)?;
    rig.drive().stop_inching().map(|_| ())
}

fn inch_down(rig: &mut Rig) -> Result<(), Error> {
    rig.drive().inch(Direction::Negative)?;
    rig.drive().stop_inching().map(|_| ())
}

fn interrupted() -> Rig {
    let mut rig = Rig::enabled(&AG03_1);
    rig.drive().start_moving_to(5000).unwrap();
    rig.drive().pass(Duration::from_secs(1)).unwrap();
    rig.drive().stop().unwrap();
    rig
}

/// Follows the advice, always with the step of this number, until the order succeeds.
fn leads_out(row: &Row, choice: usize) {
    let &Row(expected, state, order, person) = row;
    let mut rig = state();
    let mut said = Vec::new();
    for _ in 0..5 {
        let error = match order(&mut rig) {
            Ok(()) => break,
            Err(error) => error,
        };
        let (word, remedy) = (word(&error), error.remedy());
        if said.is_empty() {
            assert_eq!(word, expected, "{error}");
            person(&mut rig);
        }
        said.push(format!("{error}: {}", remedy.text));
        if let Some(step) = remedy.steps.get(choice).or(remedy.steps.first()) {
            rig.step(*step).unwrap_or_else(|error| panic!("{expected}: {step:?} fails: {error}; {said:?}"));
        }
    }
    assert!(!said.is_empty(), "{expected}: nothing is wrong");
    if let Err(error) = order(&mut rig) {
        panic!("{expected}: the advice is a loop: {said:?}, then {error}");
    }
}

#[test]
fn each_advice_leads_out() {
    for row in ROWS.iter().chain(MORE_ROWS) {
        leads_out(row, 0);
    }
}

#[test]
fn an_interrupted_travel_can_be_resumed_or_dropped() {
    let row = ROWS.iter().find(|row| row.0 == "interrupted").unwrap();
    for choice in [0, 1] {
        leads_out(row, choice);
    }
}

/// Also for another program, which has not stopped the drive itself.
#[test]
fn a_program_that_finds_an_interrupted_travel_is_told_so() {
    let mut rig = interrupted();
    drop(rig.drive.take().unwrap().release());
    rig.connect().unwrap();
    let Err(Error::Refused(refusal)) = travel(&mut rig) else { panic!("it is refused") };
    assert_eq!(refusal.0, [Missing::TravelResumed]);
    rig.drive().resume().unwrap();
    assert_eq!(rig.drive().finish().unwrap(), lexican_driver::Outcome::Reached { position: 5000 });
    travel(&mut rig).unwrap();
}

#[test]
fn each_error_is_tried_or_named() {
    let rows =
        ROWS.iter().chain(MORE_ROWS).map(|row| row.0).chain(NOT_TRIED.iter().map(|row| row.0)).collect::<Vec<_>>();
    for word in Missing::WORDS.iter().chain(Error::WORDS) {
        assert!(rows.contains(word), "{word}: what is its remedy worth?");
    }
    let unknown: Vec<_> =
        rows.iter().filter(|row| !Missing::WORDS.contains(row) && !Error::WORDS.contains(row)).collect();
    assert!(unknown.is_empty(), "{unknown:?}");
}

/// STO of an AKD, the cause of a fault.
#[test]
fn a_safety_function_is_named_before_the_rest() {
    let bus = VirtualBus::with_bit_rate(500);
    let servo = Arc::new(Mutex::new(SimulatedServo::new(bus.now(), &kollmorgen_akd::sim::MODEL, NODE)));
    bus.attach(Arc::clone(&servo));
    let mut drive = Drive::<_, Any>::connect_described_unprotected(bus.link(), NODE, &AKD).unwrap();
    let warning = kollmorgen_akd::fault::find("n602").map(|code| code.number);
    servo.lock().unwrap().set_inputs(bus.now(), |inputs| inputs.warnings = warning.into());
    let Err(Error::Refused(refusal)) = drive.enable() else { panic!("it is refused") };
    assert_eq!(refusal.first().unwrap().word(), "safety");
    servo.lock().unwrap().set_inputs(bus.now(), |inputs| inputs.warnings = None.into());
    drive.enable().unwrap();
}
