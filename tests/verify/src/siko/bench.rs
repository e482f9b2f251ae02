//! The simulated drive: how to look at it, and the situations that shows what its manual says.

use lexican_runtime::profile::cia402::{State, Transitions};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{Instant, NodeId};
use siko_ag03_1::sim::inputs::{Inputs, Shaft};
use siko_ag03_1::sim::{MODEL, Setup, SimulatedDrive};
use siko_ag03_1::state::TRANSITIONS;

use crate::bench::Simulator;
use crate::kinds::objects::Objects;

/// The node of the manual's examples.
pub(crate) const NODE: NodeId = NodeId::literal(5);

/// `load`, as 1011h takes it.
pub(super) const LOAD: i64 = 0x6461_6F6C;

pub(super) type Bench = crate::bench::Bench<SimulatedDrive>;

/// Index, sub-index, value and size of what is written.
pub(super) type Write = (u16, u8, i64, u8);

pub(super) const A_POS: (u16, u8) = (0x2410, 0x04);
pub(super) const V_POS: (u16, u8) = (0x2410, 0x05);
pub(super) const A_ROT: (u16, u8) = (0x2410, 0x06);
pub(super) const A_INCH: (u16, u8) = (0x2410, 0x08);
pub(super) const V_INCH: (u16, u8) = (0x2410, 0x09);
pub(super) const D_POS: (u16, u8) = (0x2410, 0x0A);

/// Writes a parameter of one byte.
pub(super) const fn one((index, sub): (u16, u8), value: i64) -> Write {
    (index, sub, value, 1)
}

impl Simulator for SimulatedDrive {
    const NODE: NodeId = NODE;
    const TRANSITIONS: Transitions = TRANSITIONS;

    fn start(now: Instant) -> Self {
        SimulatedDrive::power_on(now, Setup::new(&MODEL, NODE))
    }

    fn nmt(&self) -> NmtState {
        self.nmt_state()
    }

    fn state(&self) -> State {
        SimulatedDrive::state(self)
    }

    fn status_word(&mut self, now: Instant) -> u16 {
        SimulatedDrive::status_word(self, now)
    }

    fn fail(&mut self, now: Instant) {
        self.set_inputs(now, |inputs| inputs.internal_error = true);
        self.set_inputs(now, |inputs| inputs.internal_error = false);
    }
}

impl Objects for SimulatedDrive {
    const VARIANT: u16 = 0x2102;

    fn variant(printed: &str) -> Option<i128> {
        GEARS.iter().find(|(_, _, name)| *name == printed).map(|(_, value, _)| *value)
    }

    fn variants() -> Vec<(i128, Bench)> {
        let bench = |(gear, value, _): &(u8, i128, &str)| {
            let mut bench = Bench::set_up(Setup { gear: *gear, ..Setup::new(&MODEL, NODE) });
            bench.set(&[(0x607D, 2, 9_999_999, 4), (0x607D, 1, -9_999_999, 4)]);
            (*value, bench)
        };
        GEARS.iter().map(bench).collect()
    }

    fn instead_of_default(index: u16, default: i128) -> i128 {
        // The node-ID is that of the switches.
        if index == 0x2101 { NODE.get().into() } else { default }
    }

    fn is_command(index: u16) -> bool {
        index == 0x6040
    }

    fn power_cycle(bench: &mut Bench) {
        bench.see(SimulatedDrive::power_cycle);
        bench.hear(0);
    }
}

/// The gears, with their values in 2102h.
pub(super) const GEARS: [(u8, i128, &str); 2] = [(2, 2, "24:1"), (3, 3, "48:1")];

impl Bench {
    pub(super) fn set_up(setup: Setup) -> Self {
        Bench::with(|now| SimulatedDrive::power_on(now, setup))
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
pub(super) fn enabled_with(set: &[Write]) -> Bench {
    let mut bench = Bench::new();
    bench.set(set);
    bench.nmt(0x01);
    bench.enable();
    bench.control(0x000F);
    bench
}

/// On a travel for so long.
pub(super) fn moving_to(target: i32, ms: u64) -> Bench {
    let mut bench = Bench::enabled();
    bench.travel(target);
    bench.hear(ms);
    bench
}

/// In velocity mode, running at a velocity.
pub(super) fn running_at(velocity: i32, ms: u64) -> Bench {
    let mut bench = in_velocity_mode();
    bench.run(velocity);
    bench.hear(ms);
    bench
}

/// In velocity mode, in OPERATION ENABLED, standing.
pub(super) fn in_velocity_mode() -> Bench {
    let mut bench = Bench::operational();
    bench.set(&[(0x6060, 0, 2, 1)]);
    bench.enable();
    bench
}

/// Something in the world, in OPERATION ENABLED.
pub(super) fn with_inputs(change: impl FnOnce(&mut Inputs)) -> Bench {
    Bench::enabled().after(change)
}

pub(super) fn faulty() -> Bench {
    with_inputs(|inputs| inputs.internal_error = true)
}

pub(super) fn unsupplied() -> Bench {
    with_inputs(|inputs| inputs.output_stage_supply_100mv = 0)
}

/// Whose shaft is held, while it should move.
pub(super) fn held() -> Bench {
    let mut bench = moving_to(5000, 500);
    bench.world(|inputs| inputs.shaft = Shaft::Blocked);
    bench.hear(100);
    bench
}

pub(super) fn overcurrent() -> Bench {
    let mut bench = moving_to(5000, 500);
    bench.world(|inputs| inputs.load_ma = 2401);
    bench
}

/// Beyond a limit: the position is 0, and the limits lie elsewhere.
pub(super) fn beyond(above: bool, mut bench: Bench) -> Bench {
    let limits = if above { [(1, -1000), (2, -500)] } else { [(2, 1000), (1, 500)] };
    bench.set(&limits.map(|(sub, limit)| (0x607D, sub, limit, 4)));
    bench
}

/// On the way to the turn of a loop.
pub(super) fn in_loop(ms: u64) -> Bench {
    let mut bench = Bench::enabled();
    bench.set(&[(0x2413, 0, 1, 1)]);
    bench.travel(-5000);
    bench.hear(ms);
    bench
}
