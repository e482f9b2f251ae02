//! Drives whose simulator is the servo of CiA 402 with their own dictionary: what the comparisons ask of all of them.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::marker::PhantomData;

use lexican_runtime::object::{Address, Entry, ObjectDictionary};
use lexican_runtime::profile::cia402::{Mode, State, Transitions};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{AbortCode, Instant, NodeId};
use simulator::servo::{Causes, Inputs, Machine, ServoModel};
use simulator::{SimulatedServo, Storage};

use crate::kinds::objects::Objects;
use crate::notation::hex;
use crate::rig::{Rig, Simulator};
use crate::script::{Scripted, address, is_in};

/// A drive of this kind.
pub(crate) trait OfModel: Sized + 'static {
    const NODE: NodeId;
    /// The EMCY code of a fault.
    const FAULT: u16;

    fn model() -> &'static ServoModel;

    /// The code of a fault or warning, by its label.
    fn code(label: &str) -> Option<u16>;

    fn has_default_in_words(_rig: &mut Rig<Servo<Self>>, _words: &str) -> bool {
        false
    }
}

/// The simulator of such a drive.
pub(crate) struct Servo<D>(PhantomData<D>);

impl<D: OfModel> Simulator for Servo<D> {
    type Drive = SimulatedServo;

    const NODE: NodeId = D::NODE;

    fn transitions() -> Transitions {
        D::model().transitions
    }

    fn start(now: Instant) -> SimulatedServo {
        SimulatedServo::new(now, D::model(), D::NODE)
    }

    fn nmt(drive: &SimulatedServo) -> NmtState {
        drive.nmt_state()
    }

    fn state(drive: &SimulatedServo) -> State {
        drive.servo().state()
    }

    fn status_word(drive: &mut SimulatedServo, _: Instant) -> u16 {
        drive.storage().raw(Address::new(0x6041, 0)).unwrap_or_default() as u16
    }

    fn fail(drive: &mut SimulatedServo, now: Instant) {
        drive.set_inputs(now, |inputs| inputs.faults = D::FAULT.into());
        drive.set_inputs(now, |inputs| inputs.faults = Causes::NONE);
    }
}

impl<D: OfModel> Objects for Servo<D> {
    // Ranges depend on nothing.
    const VARIANT: u16 = 0;

    fn variant(_: &str) -> Option<i128> {
        None
    }

    fn variants() -> Vec<(i128, Rig<Self>)> {
        vec![(0, Rig::new())]
    }

    fn has_default_in_words(rig: &mut Rig<Self>, words: &str) -> bool {
        D::has_default_in_words(rig, words)
    }

    fn is_command(_: u16) -> bool {
        false
    }

    fn power_cycle(rig: &mut Rig<Self>) {
        rig.see(|drive, now| [false, true].into_iter().for_each(|on| drive.set_power(now, on)));
    }

    fn kept(drive: &mut SimulatedServo, _: Instant, index: u16, sub: u8) -> u32 {
        drive.storage().raw(Address::new(index, sub)).unwrap_or_default() as u32
    }
}

impl<D: OfModel> Scripted for Servo<D> {
    fn has_feature(_: &str) -> bool {
        false
    }

    fn size(rig: &Rig<Self>, index: u16, sub: u8) -> u8 {
        let entry = rig.see(|drive, _| drive.storage().entry(Address::new(index, sub)).ok());
        entry.and_then(|entry| entry.data_type.size()).unwrap_or(4) as u8
    }

    fn value(_: &str) -> Option<i64> {
        None
    }

    fn place(rig: &Rig<Self>) -> i64 {
        rig.position()
    }

    fn step(rig: &mut Rig<Self>, verb: &str, args: &[&str]) -> Option<bool> {
        let code = |label: &str| D::code(label).or_else(|| hex(label).map(|code| code as u16));
        let codes = |labels: &[&str]| labels.iter().map(|label| code(label)).collect::<Option<Vec<u16>>>();
        // First situations, then orders, then questions.
        match (verb, args) {
            ("mode", [mode]) => {
                rig.nmt(0x01);
                rig.hear(0);
                let _ = rig.put(0x6060, 0, mode.parse().ok()?);
                rig.controls(&[0x06, 0x07, 0x0F]);
            }
            ("homing", [method]) => *rig = homing(method.parse().ok()?),
            ("travel", [target]) => rig.travel(target.parse().ok()?),
            ("rest", []) => _ = rig.rest(),
            ("rest", [range]) => return Some(is_in(rig.rest(), range)),
            ("position", [range]) => return Some(is_in(rig.position(), range)),
            ("speed", [range]) => {
                let speed = rig.see(|drive, now| drive.servo().shaft(now).velocity.abs().round());
                return Some(is_in(speed as i64, range));
            }
            ("power", ["cycle"]) => Self::power_cycle(rig),
            ("moving", []) => return Some(rig.is_moving()),
            ("powered", []) => return Some(rig.is_powered()),
            ("unpowered", []) => return Some(rig.is_unpowered()),
            ("faults", labels) => {
                let codes = codes(labels)?;
                return Some(rig.see(|drive, _| drive.servo().faults() == codes));
            }
            ("number", [at, range]) => {
                let (index, sub) = address(at)?;
                return Some(is_in(rig.number(index, sub), range));
            }
            ("bit", [at, bit, value]) => {
                let ((index, sub), bit) = (address(at)?, bit.parse::<u32>().ok()?);
                return Some((rig.number(index, sub) >> bit & 1).to_string() == *value);
            }
            // It is slow over these positions, within two seconds.
            ("slow-at", [range]) => {
                let is_slow = |rig: &Rig<Self>| {
                    let speed = rig.see(|drive, now| drive.servo().shaft(now).velocity.abs());
                    is_in(rig.position(), range) && speed < 500.0
                };
                return Some(rig.comes_to(is_slow));
            }
            ("passes", [at]) => {
                let at = at.parse::<i64>().ok()?;
                return Some(rig.comes_to(|rig| rig.position() >= at));
            }
            (verb, args) => {
                let change: Box<dyn FnOnce(&mut Inputs)> = match (verb, args) {
                    ("well", []) => Box::new(|inputs| {
                        (inputs.faults, inputs.warnings, inputs.probes) = (Causes::NONE, Causes::NONE, [false; 2]);
                    }),
                    ("causes", labels) => {
                        let codes = codes(labels)?;
                        Box::new(move |inputs| codes.iter().for_each(|code| _ = inputs.faults.insert(*code)))
                    }
                    ("over", [label]) => {
                        let code = code(label)?;
                        Box::new(move |inputs| inputs.faults.remove(code))
                    }
                    ("warning", [label]) => {
                        let code = code(label)?;
                        Box::new(move |inputs| inputs.warnings = code.into())
                    }
                    ("supply", [how]) => {
                        let on = *how == "on";
                        Box::new(move |inputs| inputs.supply = on)
                    }
                    ("enable-input", ["off"]) => Box::new(|inputs| inputs.enable = false),
                    ("blocked", []) => Box::new(|inputs| inputs.blocked = true),
                    ("home-switch", []) => Box::new(|inputs| inputs.machine.home_switch = Some((-1.0, 1.0))),
                    ("digital", bits) => {
                        let bits = bits.iter().map(|bit| bit.parse().ok().and_then(|bit| 1_u32.checked_shl(bit)));
                        let all = bits.collect::<Option<Vec<u32>>>()?.into_iter().fold(0, |all, bit| all | bit);
                        Box::new(move |inputs| inputs.digital = all)
                    }
                    ("probe-on", [number]) => {
                        let at = number.parse::<usize>().ok()?.checked_sub(1).filter(|at| *at < 2)?;
                        Box::new(move |inputs| inputs.probes[at] = true)
                    }
                    _ => return None,
                };
                rig.see(|drive, now| drive.set_inputs(now, change));
            }
        }
        Some(true)
    }
}

/// A drive in OPERATION ENABLED and the homing mode, on a machine with all switches.
fn homing<D: OfModel>(method: i8) -> Rig<Servo<D>> {
    let mut rig = Rig::enabled_in(Mode::Homing);
    rig.world(|inputs| {
        inputs.machine = Machine {
            negative_limit: Some(-1000.0),
            positive_limit: Some(1000.0),
            home_switch: Some((-200.0, 200.0)),
            index: Some((50.0, 100.0)),
        };
    });
    let _ = rig.put(0x6098, 0, method.into());
    rig
}

/// A dictionary that records which entries the drive itself reads or sets.
#[derive(Debug)]
struct Noted(Box<dyn Storage>);

thread_local! {
    /// The entries recorded since [`used`] has begun. A bus runs its drives in the thread that waits.
    static NOTED: RefCell<BTreeSet<Address>> = const { RefCell::new(BTreeSet::new()) };
}

fn note(address: Address) {
    NOTED.with_borrow_mut(|noted| _ = noted.insert(address));
}

impl ObjectDictionary for Noted {
    fn entry(&self, address: Address) -> Result<Entry, AbortCode> {
        self.0.entry(address)
    }

    fn len(&self, entry: &Entry) -> Option<u32> {
        self.0.len(entry)
    }

    fn read(&mut self, entry: &Entry, offset: u32, buffer: &mut [u8]) -> Result<usize, AbortCode> {
        note(entry.address);
        self.0.read(entry, offset, buffer)
    }

    fn write(&mut self, entry: &Entry, offset: u32, data: &[u8], last: bool) -> Result<(), AbortCode> {
        self.0.write(entry, offset, data, last)
    }
}

impl Storage for Noted {
    fn raw(&self, address: Address) -> Option<u64> {
        note(address);
        self.0.raw(address)
    }

    fn set_raw(&mut self, address: Address, raw: u64) {
        note(address);
        self.0.set_raw(address, raw);
    }

    fn addresses(&self) -> Vec<Address> {
        self.0.addresses()
    }

    fn duplicate(&self) -> Box<dyn Storage> {
        Box::new(Noted(self.0.duplicate()))
    }
}

/// The entries that a drive reads or sets by itself while it is moved in each of its modes, and while inputs around it
/// change. Meanwhile, no SDO reads any entry.
pub(crate) fn used<D: OfModel>() -> BTreeSet<Address> {
    let storage = |node| Box::new(Noted((D::model().storage)(node))) as Box<dyn Storage>;
    let model: &'static ServoModel = Box::leak(Box::new(ServoModel { storage, ..*D::model() }));
    let homing = model.homing_methods.unwrap_or(&[35]);
    let orders = model.modes.0.iter().flat_map(|(code, mode)| {
        let methods = if *mode == Mode::Homing { homing } else { &[35] };
        methods.iter().map(move |method| (*code, *method))
    });
    for (code, method) in orders {
        let mut rig = Rig::<Servo<D>>::with(|now| SimulatedServo::new(now, model, D::NODE));
        rig.world(|inputs| {
            let home_switch = Some((-2000.0, -1000.0));
            inputs.machine =
                Machine { negative_limit: Some(-5e3), positive_limit: Some(5e3), home_switch, ..inputs.machine };
        });
        let set = [(0x6060, 0, code.into()), (0x6098, 0, method.into()), (0x6065, 0, 100), (0x1016, 1, 0x007F_03E8)];
        set.iter().for_each(|(index, sub, value)| _ = rig.put(*index, *sub, *value));
        rig.send(0x77F, &[5]);
        rig.nmt(0x01);
        rig.controls(&[0x06, 0x07, 0x0F]);
        let orders = [(0x607A, 0, 90), (0x60FF, 0, 90), (0x6071, 0, 90), (0x60C1, 1, 90), (0x20A4, 0, 0x1F)];
        orders.iter().for_each(|(index, sub, value)| _ = rig.put(*index, *sub, *value));
        rig.control(0x1F);
        for probe in [true, false] {
            rig.world(|inputs| inputs.probes = [probe; 2]);
            rig.send(0x080, &[]);
            rig.hear(100);
        }
        rig.controls(&[0x11F, 0x1F]);
        rig.world(|inputs| inputs.blocked = true);
        rig.hear(2000);
        rig.world(|inputs| inputs.blocked = false);
        rig.controls(&[0x00, 0x80, 0x06, 0x07, 0x0F, 0x1F, 0x0B]);
        Servo::<D>::power_cycle(&mut rig);
        rig.hear(100);
    }
    NOTED.take()
}

impl<D: OfModel> Rig<Servo<D>> {
    /// Changes the inputs of the drive.
    pub(crate) fn world(&mut self, change: impl FnOnce(&mut Inputs)) {
        self.see(|drive, now| drive.set_inputs(now, change));
        self.hear(0);
    }

    /// Writes to the dictionary as a client would.
    pub(crate) fn put(&mut self, index: u16, sub: u8, value: i64) -> Result<(), u32> {
        let entry = self.see(|drive, _| drive.storage().entry(Address::new(index, sub)).ok());
        let size = entry.and_then(|entry| entry.data_type.size()).unwrap_or(4);
        self.write(index, sub, value, size as u8)
    }

    /// A number in the dictionary.
    pub(crate) fn number(&self, index: u16, sub: u8) -> i64 {
        self.see(|drive, now| drive.with_servo(now, |_, od| od.number(Address::new(index, sub)).unwrap_or_default()))
    }

    /// A drive in OPERATION ENABLED and a mode, without halt and with nothing ordered.
    pub(crate) fn enabled_in(mode: Mode) -> Self {
        let mut rig = Rig::operational();
        let code = D::model().modes.code(mode).unwrap_or_default();
        let _ = rig.put(0x6060, 0, code.into());
        rig.controls(&[0x06, 0x07, 0x0F]);
        rig
    }

    /// Travels to an absolute position, with the ramps in the dictionary.
    pub(crate) fn travel(&mut self, target: i64) {
        let _ = self.put(0x607A, 0, target);
        self.controls(&[0x0F, 0x1F]);
    }

    /// Whether the power stage is enabled: 1002h shows it, and the shaft cannot be turned by hand. A moving shaft
    /// cannot be turned anyway.
    pub(crate) fn is_powered(&self) -> bool {
        self.number(0x1002, 0) >> 14 & 1 == 1 && !self.turns()
    }

    /// Whether the power stage is disabled. Both are false if 1002h and the shaft disagree.
    pub(crate) fn is_unpowered(&self) -> bool {
        self.number(0x1002, 0) >> 14 & 1 == 0 && (self.turns() || self.is_moving())
    }

    fn turns(&self) -> bool {
        self.see(|drive, now| drive.with_servo(now, |servo, od| servo.turn(now, od, 0.0)))
    }

    /// Whether a condition becomes true within two seconds.
    fn comes_to(&mut self, is_so: impl Fn(&Self) -> bool) -> bool {
        (0..400).any(|_| {
            self.hear(5);
            is_so(self)
        })
    }

    pub(crate) fn is_moving(&self) -> bool {
        self.see(|drive, now| drive.servo().is_moving(now))
    }

    pub(crate) fn position(&self) -> i64 {
        self.see(|drive, now| drive.servo().shaft(now).position.round() as i64)
    }

    /// Waits until the drive stands, for ten seconds at most. Returns its position.
    pub(crate) fn rest(&mut self) -> i64 {
        for _ in 0..100 {
            self.hear(100);
            if !self.is_moving() {
                break;
            }
        }
        self.position()
    }
}
