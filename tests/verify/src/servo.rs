//! Drives whose simulator is the servo of CiA 402 with their own dictionary: what all of them are asked.

use std::marker::PhantomData;

use lexican_runtime::object::Address;
use lexican_runtime::profile::cia402::{Mode, State, Transitions};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{Instant, NodeId};
use simulator::SimulatedServo;
use simulator::servo::{Causes, Inputs, ServoModel};

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
