//! Drives whose simulator is the servo of CiA 402 with their own dictionary: what all of them are asked.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::marker::PhantomData;

use lexican_runtime::object::{Address, Entry, ObjectDictionary};
use lexican_runtime::profile::cia402::{Mode, State, Transitions};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{AbortCode, Instant, NodeId};
use simulator::servo::{Causes, Inputs, Machine, ServoModel};
use simulator::{SimulatedServo, Storage};

use crate::bench::{Bench, Simulator};
use crate::kinds::objects::Objects;

/// A drive of this kind.
pub(crate) trait OfModel: Sized + 'static {
    const NODE: NodeId;
    /// The EMCY code of a fault.
    const FAULT: u16;

    fn model() -> &'static ServoModel;

    fn has_default_in_words(_bench: &mut Bench<Servo<Self>>, _words: &str) -> bool {
        false
    }
}

/// Its simulator.
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

    fn variants() -> Vec<(i128, Bench<Self>)> {
        vec![(0, Bench::new())]
    }

    fn has_default_in_words(bench: &mut Bench<Self>, words: &str) -> bool {
        D::has_default_in_words(bench, words)
    }

    fn is_command(_: u16) -> bool {
        false
    }

    fn power_cycle(bench: &mut Bench<Self>) {
        bench.see(|drive, now| [false, true].into_iter().for_each(|on| drive.set_power(now, on)));
    }

    fn kept(drive: &mut SimulatedServo, _: Instant, index: u16, sub: u8) -> u32 {
        drive.storage().raw(Address::new(index, sub)).unwrap_or_default() as u32
    }
}

/// A dictionary that notes which entries the drive itself looks at or sets.
#[derive(Debug)]
struct Noted(Box<dyn Storage>);

thread_local! {
    /// The entries noted since [`used`] has begun. A bus runs its drives in the thread that waits.
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

/// The entries that a drive looks at or sets by itself while it is moved in each of its modes, in a world in which things
/// happen. Nothing is read of it by SDO meanwhile.
pub(crate) fn used<D: OfModel>() -> BTreeSet<Address> {
    let storage = |node| Box::new(Noted((D::model().storage)(node))) as Box<dyn Storage>;
    let model: &'static ServoModel = Box::leak(Box::new(ServoModel { storage, ..*D::model() }));
    let homing = model.homing_methods.unwrap_or(&[35]);
    let orders = model.modes.0.iter().flat_map(|(code, mode)| {
        let methods = if *mode == Mode::Homing { homing } else { &[35] };
        methods.iter().map(move |method| (*code, *method))
    });
    for (code, method) in orders {
        let mut bench = Bench::<Servo<D>>::with(|now| SimulatedServo::new(now, model, D::NODE));
        bench.world(|inputs| {
            let home_switch = Some((-2000.0, -1000.0));
            inputs.machine =
                Machine { negative_limit: Some(-5e3), positive_limit: Some(5e3), home_switch, ..inputs.machine };
        });
        let set = [(0x6060, 0, code.into()), (0x6098, 0, method.into()), (0x6065, 0, 100), (0x1016, 1, 0x007F_03E8)];
        set.iter().for_each(|(index, sub, value)| _ = bench.put(*index, *sub, *value));
        bench.send(0x77F, &[5]);
        bench.nmt(0x01);
        bench.controls(&[0x06, 0x07, 0x0F]);
        let orders = [(0x607A, 0, 90), (0x60FF, 0, 90), (0x6071, 0, 90), (0x60C1, 1, 90), (0x20A4, 0, 0x1F)];
        orders.iter().for_each(|(index, sub, value)| _ = bench.put(*index, *sub, *value));
        bench.control(0x1F);
        for probe in [true, false] {
            bench.world(|inputs| inputs.probes = [probe; 2]);
            bench.send(0x080, &[]);
            bench.hear(100);
        }
        bench.controls(&[0x11F, 0x1F]);
        bench.world(|inputs| inputs.blocked = true);
        bench.hear(2000);
        bench.world(|inputs| inputs.blocked = false);
        bench.controls(&[0x00, 0x80, 0x06, 0x07, 0x0F, 0x1F, 0x0B]);
        Servo::<D>::power_cycle(&mut bench);
        bench.hear(100);
    }
    NOTED.take()
}

impl<D: OfModel> Bench<Servo<D>> {
    /// Lets the world change.
    pub(crate) fn world(&mut self, change: impl FnOnce(&mut Inputs)) {
        self.see(|drive, now| drive.set_inputs(now, change));
        self.hear(0);
    }

    /// Writes to the dictionary what a client would.
    pub(crate) fn put(&mut self, index: u16, sub: u8, value: i64) -> Result<(), u32> {
        let entry = self.see(|drive, _| drive.storage().entry(Address::new(index, sub)).ok());
        let size = entry.and_then(|entry| entry.data_type.size()).unwrap_or(4);
        self.write(index, sub, value, size as u8)
    }

    /// A number of the dictionary.
    pub(crate) fn number(&self, index: u16, sub: u8) -> i64 {
        self.see(|drive, now| drive.with_servo(now, |_, od| od.number(Address::new(index, sub)).unwrap_or_default()))
    }

    /// Enabled in a mode, without halt and with nothing ordered.
    pub(crate) fn enabled_in(mode: Mode) -> Self {
        let mut bench = Bench::operational();
        let code = D::model().modes.code(mode).unwrap_or_default();
        let _ = bench.put(0x6060, 0, code.into());
        bench.controls(&[0x06, 0x07, 0x0F]);
        bench
    }

    /// Travels to a position, relative to 0, with the ramps of the dictionary.
    pub(crate) fn travel(&mut self, target: i64) {
        let _ = self.put(0x607A, 0, target);
        self.controls(&[0x0F, 0x1F]);
    }

    pub(crate) fn is_moving(&self) -> bool {
        self.see(|drive, now| drive.servo().is_moving(now))
    }

    pub(crate) fn position(&self) -> i64 {
        self.see(|drive, now| drive.servo().shaft(now).position.round() as i64)
    }

    /// Until it stands, for ten seconds at most; where it stands then.
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
