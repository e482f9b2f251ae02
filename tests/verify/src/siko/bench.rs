//! The simulated drive: what of it differs from drive to drive, how to look at it, and the situations that show what
//! the manuals say.

use lexican_driver::Codes;
use lexican_runtime::object::{Address, Object, Rw};
use lexican_runtime::profile::cia402::{State, Transitions};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{Instant, NodeId};
use siko::fault::FaultKind;
use siko::sim::inputs::{Inputs, Shaft};
use siko::sim::{Model, Setup, SimulatedDrive};
use siko::state::TRANSITIONS;

pub(super) use crate::bench::Bench;
use crate::bench::Simulator;
use crate::kinds::objects::Objects;

/// The node of the manuals' examples.
pub(crate) const NODE: NodeId = NodeId::literal(5);

/// `load`, as 1011h takes it.
pub(super) const LOAD: i64 = 0x6461_6F6C;

/// The identifier of emergencies.
pub(crate) const EMCY: i64 = 0x80 + NODE.get() as i64;

/// Index, sub-index, value and size of what is written.
pub(crate) type Write = (u16, u8, i64, u8);

pub(super) const A_POS: (u16, u8) = (0x2410, 0x04);
pub(crate) const V_POS: (u16, u8) = (0x2410, 0x05);
pub(super) const A_ROT: (u16, u8) = (0x2410, 0x06);
pub(super) const A_INCH: (u16, u8) = (0x2410, 0x08);
pub(crate) const V_INCH: (u16, u8) = (0x2410, 0x09);
pub(super) const D_POS: (u16, u8) = (0x2410, 0x0A);

/// Writes a parameter of one byte.
pub(crate) const fn one((index, sub): (u16, u8), value: i64) -> Write {
    (index, sub, value, 1)
}

/// A drive of SIKO's: in what its manual differs from those of the others.
pub(crate) trait Siko: Sized + 'static {
    const MODEL: &'static Model;
    /// Its emergency codes.
    const CODES: &'static Codes;
    /// What a drive that has been delivered is set to, so that it moves as the comparisons have it: with 30 rev/min.
    const PREPARED: &'static [Write];
    /// The gears, by their values in 2102h.
    const GEARS: &'static [(u8, &'static str)];
    /// Parameters that 1011h does not restore, and their objects.
    const LASTING: &'static [(u8, u16)];
    /// The line of the overlay with the names of the data sheet's file.
    const FILES: &'static str;
    /// The chapters about parameters and about CANopen.
    const CHAPTERS: [&'static str; 2];
    /// What bit 10 of 1002h shows while the drive may move, and else.
    const READY: [&'static str; 2];
    /// What bits 5 and 6 of 1002h show.
    const LIMITS: [&'static str; 2];
    /// How a fault is acknowledged, as bit 8 of 1002h has it.
    const ACKNOWLEDGE: &'static str;
    /// What the manual calls bits without meaning, and whether its words are not English: those of the overlay are in
    /// `terms.csv`.
    const RESERVED: &'static str;
    const IS_TRANSLATED: bool;
    /// Parameters that are called otherwise where their objects are described: number and name.
    const NAMES: &'static [(u8, &'static str)];

    /// Takes away what bit 10 shows.
    fn hinder(inputs: &mut Inputs);
    /// The emergency code of a fault.
    fn code(kind: FaultKind) -> u32 {
        Self::MODEL.fault(kind).map_or(0, |fault| fault.code.number.into())
    }
    /// Whether the drive has an entry.
    fn has((index, sub): (u16, u8)) -> bool {
        (Self::MODEL.storage)(NODE).entry(Address::new(index, sub)).is_ok()
    }
    /// The parameter by which a travel slows down.
    fn deceleration() -> (u16, u8) {
        if Self::has(D_POS) { D_POS } else { A_POS }
    }
    /// The name of a bit rate, by its value in 2100h.
    fn bit_rate(value: u8) -> Option<&'static str>;
}

impl<D: Siko> Simulator for D {
    type Drive = SimulatedDrive;

    const NODE: NodeId = NODE;
    const WRITES_FOUR_BYTES: bool = D::MODEL.writes_four_bytes;

    fn transitions() -> Transitions {
        TRANSITIONS
    }

    fn start(now: Instant) -> SimulatedDrive {
        SimulatedDrive::power_on(now, Setup::new(D::MODEL, NODE))
    }

    fn prepare(bench: &mut Bench<D>) {
        bench.set(D::PREPARED);
    }

    fn nmt(drive: &SimulatedDrive) -> NmtState {
        drive.nmt_state()
    }

    fn state(drive: &SimulatedDrive) -> State {
        drive.state()
    }

    fn status_word(drive: &mut SimulatedDrive, now: Instant) -> u16 {
        drive.status_word(now)
    }

    fn fail(drive: &mut SimulatedDrive, now: Instant) {
        drive.set_inputs(now, |inputs| inputs.sensor_fails = true);
        drive.set_inputs(now, |inputs| inputs.sensor_fails = false);
    }
}

impl<D: Siko> Objects for D {
    const VARIANT: u16 = 0x2102;

    fn variant(printed: &str) -> Option<i128> {
        D::GEARS.iter().find(|(_, name)| *name == printed).map(|(value, _)| (*value).into())
    }

    fn variants() -> Vec<(i128, Bench<D>)> {
        let bench = |(gear, _): &(u8, &str)| {
            let mut bench = Bench::set_up(Setup { gear: *gear, ..Setup::new(D::MODEL, NODE) });
            bench.set(&[(0x607D, 2, 9_999_999, 4), (0x607D, 1, -9_999_999, 4)]);
            ((*gear).into(), bench)
        };
        D::GEARS.iter().map(bench).collect()
    }

    fn is_command(index: u16) -> bool {
        index == 0x6040
    }

    fn kept(drive: &mut SimulatedDrive, _: Instant, index: u16, sub: u8) -> u32 {
        drive.stored(Object::<u32, Rw>::new(index, sub))
    }

    fn power_cycle(bench: &mut Bench<D>) {
        bench.see(SimulatedDrive::power_cycle);
        bench.hear(0);
    }
}

impl<D: Siko> Bench<D> {
    pub(super) fn set_up(setup: Setup) -> Self {
        Bench::<D>::with(|now| SimulatedDrive::power_on(now, setup))
    }

    /// Lets the world around the drive change.
    pub(super) fn world(&mut self, change: impl FnOnce(&mut Inputs)) {
        self.see(|drive, now| drive.set_inputs(now, change));
    }

    /// The system status word.
    pub(super) fn system(&self) -> u16 {
        self.see(|drive, now| drive.controller().system_status(now))
    }

    pub(super) fn position(&self) -> i32 {
        self.see(|drive, now| drive.position(now))
    }

    /// In rev/min.
    pub(super) fn velocity(&self) -> i32 {
        self.see(|drive, now| drive.velocity(now))
    }

    /// In increments/s, without rounding.
    pub(super) fn speed(&self) -> f64 {
        self.see(|drive, now| drive.shaft(now).velocity)
    }

    /// Where the shaft is, in increments.
    pub(super) fn shaft(&self) -> f64 {
        self.see(|drive, now| drive.shaft(now).position)
    }

    /// Whether the shaft lets itself be turned by hand.
    pub(super) fn turn(&self, increments: i32) -> bool {
        self.see(|drive, now| drive.turn_shaft(now, increments))
    }

    pub(super) fn is_fault(&self) -> bool {
        self.status() & 0x4F == 0x08
    }

    pub(super) fn is_disabled(&self) -> bool {
        self.status() & 0x4F == 0x40
    }

    /// 1002h, bit 7.
    pub(super) fn is_released(&self) -> bool {
        self.system() >> 7 & 1 == 1
    }

    /// Orders a travel.
    pub(super) fn travel(&mut self, target: i32) {
        self.command(0x405, 0x001F, target);
    }

    /// Orders a velocity.
    pub(super) fn run(&mut self, velocity: i32) {
        self.command(0x505, 0x000F, velocity);
    }

    /// Velocities after each of these times, in milliseconds from the start.
    pub(super) fn velocities(&mut self, times: &[u64]) -> Vec<i32> {
        let mut passed = 0;
        let mut at = |time: &u64| {
            self.hear(time - passed);
            passed = *time;
            self.velocity()
        };
        times.iter().map(&mut at).collect()
    }

    /// How far the shaft turns until it stands, in increments.
    pub(super) fn way_to_rest(&mut self) -> i32 {
        let before = self.position();
        self.hear(30_000);
        if self.speed() == 0.0 { self.position() - before } else { i32::MAX }
    }

    /// The positions that the drive passes, every 20 ms.
    pub(super) fn way(&mut self, ms: u64) -> Vec<i32> {
        let mut look = || {
            self.hear(20);
            self.position()
        };
        (0..ms / 20).map(|_| look()).collect()
    }

    /// When the world has changed.
    pub(super) fn after(mut self, change: impl FnOnce(&mut Inputs)) -> Self {
        self.world(change);
        self.hear(0);
        self
    }
}

/// Enabled, with what `set` has written before.
pub(super) fn enabled_with<D: Siko>(set: &[Write]) -> Bench<D> {
    let mut bench = Bench::<D>::new();
    bench.set(set);
    bench.nmt(0x01);
    bench.enable();
    bench.control(0x000F);
    bench
}

/// On a travel for so long.
pub(super) fn moving_to<D: Siko>(target: i32, ms: u64) -> Bench<D> {
    let mut bench = Bench::<D>::enabled();
    bench.travel(target);
    bench.hear(ms);
    bench
}

/// In velocity mode, running at a velocity.
pub(super) fn running_at<D: Siko>(velocity: i32, ms: u64) -> Bench<D> {
    let mut bench = in_velocity_mode::<D>();
    bench.run(velocity);
    bench.hear(ms);
    bench
}

/// In velocity mode, in OPERATION ENABLED, standing.
pub(super) fn in_velocity_mode<D: Siko>() -> Bench<D> {
    let mut bench = Bench::<D>::operational();
    bench.set(&[(0x6060, 0, 2, 1)]);
    bench.enable();
    bench
}

/// Something in the world, in OPERATION ENABLED.
pub(super) fn with_inputs<D: Siko>(change: impl FnOnce(&mut Inputs)) -> Bench<D> {
    Bench::<D>::enabled().after(change)
}

pub(super) fn faulty<D: Siko>() -> Bench<D> {
    with_inputs::<D>(|inputs| inputs.sensor_fails = true)
}

pub(super) fn hindered<D: Siko>() -> Bench<D> {
    with_inputs::<D>(D::hinder)
}

/// Whose shaft is held, while it should move.
pub(super) fn held<D: Siko>() -> Bench<D> {
    let mut bench = moving_to::<D>(5000, 500);
    bench.world(|inputs| inputs.shaft = Shaft::Blocked);
    bench.hear(100);
    bench
}

pub(super) fn overcurrent<D: Siko>() -> Bench<D> {
    let mut bench = moving_to::<D>(900_000, 500);
    bench.world(|inputs| inputs.load_ma = 2401);
    bench
}

/// Beyond a limit: the position is 0, and the limits lie elsewhere.
pub(super) fn beyond<D: Siko>(above: bool, mut bench: Bench<D>) -> Bench<D> {
    let limits = if above { [(1, -1000), (2, -500)] } else { [(2, 1000), (1, 500)] };
    bench.set(&limits.map(|(sub, limit)| (0x607D, sub, limit, 4)));
    bench
}

/// On the way to the turn of a loop.
pub(super) fn in_loop<D: Siko>(ms: u64) -> Bench<D> {
    let mut bench = Bench::<D>::enabled();
    bench.set(&[(0x2413, 0, 1, 1)]);
    bench.travel(-5000);
    bench.hear(ms);
    bench
}
