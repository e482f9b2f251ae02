//! The simulated drive: how the drives differ, how to observe them, and the situations that show what the manuals say.

use lexican_driver::{Codes, Direction};
use lexican_runtime::object::{Address, Object, Rw};
use lexican_runtime::profile::cia402::{State, Transitions};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{Duration, Instant, NodeId};
use siko::fault::FaultKind;
use siko::sim::controller::{Motor, Network};
use siko::sim::inputs::{BusError, BusState, Inputs, Key, Shaft};
use siko::sim::{Addressing, Braking, DipSwitches, Model, Order, Restore, Setup, SimulatedDrive};
use siko::state::TRANSITIONS;

use crate::kinds::objects::Objects;
use crate::notation::{fits, number};
pub(super) use crate::rig::Rig;
use crate::rig::Simulator;
use crate::script::{Scripted, address, is_in, is_word, write};

/// The node of the manuals' examples.
pub(crate) const NODE: NodeId = NodeId::literal(5);

/// The signature `load`, which 1011h takes.
pub(super) const LOAD: i64 = 0x6461_6F6C;

/// The identifier of emergencies.
pub(crate) const EMCY: i64 = 0x80 + NODE.get() as i64;

/// Index, sub-index, value and size of what is written.
pub(crate) type Write = (u16, u8, i64, u8);

pub(super) const A_POS: (u16, u8) = (0x2410, 0x04);
pub(crate) const V_POS: (u16, u8) = (0x2410, 0x05);
pub(crate) const V_INCH: (u16, u8) = (0x2410, 0x09);
pub(super) const D_POS: (u16, u8) = (0x2410, 0x0A);

/// Writes a parameter of one byte.
pub(crate) const fn one((index, sub): (u16, u8), value: i64) -> Write {
    (index, sub, value, 1)
}

/// A drive of SIKO: how its manual differs from those of the others.
pub(crate) trait Siko: Sized + 'static {
    const MODEL: &'static Model;
    /// Its emergency codes.
    const CODES: &'static Codes;
    /// The settings after delivery for the comparisons: it then moves with 30 rev/min.
    const PREPARED: &'static [Write];
    /// The gears, by their values in 2102h.
    const GEARS: &'static [(u8, &'static str)];
    /// Parameters that 1011h does not restore, and their objects.
    const LASTING: &'static [(u8, u16)];
    /// The line of the overlay with the names of the data sheet's file.
    const FILES: &'static str;
    /// The chapters about parameters and about CANopen.
    const CHAPTERS: [&'static str; 2];
    /// The manual's word for bits without meaning, and whether the manual is not in English: the overlay's words are
    /// then in `terms.csv`.
    const RESERVED: &'static str;
    const IS_TRANSLATED: bool;
    /// Parameters that have another name in the description of their objects: number and name.
    const NAMES: &'static [(u8, &'static str)];

    /// Removes what bit 10 shows.
    fn hinder(inputs: &mut Inputs);
    /// The emergency code of a fault.
    fn code(kind: FaultKind) -> u32 {
        Self::MODEL.fault(kind).map_or(0, |fault| fault.code.number.into())
    }
    /// Whether the drive has an entry.
    fn has((index, sub): (u16, u8)) -> bool {
        (Self::MODEL.storage)(NODE).entry(Address::new(index, sub)).is_ok()
    }
    /// The parameter with the deceleration of a travel.
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

    fn prepare(rig: &mut Rig<D>) {
        rig.set(D::PREPARED);
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

    fn variants() -> Vec<(i128, Rig<D>)> {
        let rig = |(gear, _): &(u8, &str)| {
            let mut rig = Rig::set_up(Setup { gear: *gear, ..Setup::new(D::MODEL, NODE) });
            rig.set(&[(0x607D, 2, 9_999_999, 4), (0x607D, 1, -9_999_999, 4)]);
            ((*gear).into(), rig)
        };
        D::GEARS.iter().map(rig).collect()
    }

    fn is_command(index: u16) -> bool {
        index == 0x6040
    }

    fn kept(drive: &mut SimulatedDrive, _: Instant, index: u16, sub: u8) -> u32 {
        drive.stored(Object::<u32, Rw>::new(index, sub))
    }

    fn power_cycle(rig: &mut Rig<D>) {
        rig.see(SimulatedDrive::power_cycle);
        rig.hear(0);
    }
}

impl<D: Siko> Scripted for D {
    fn has_feature(name: &str) -> bool {
        match name {
            "keys" => D::MODEL.keys,
            "switches" => D::MODEL.switches,
            "AG02" => D::IS_TRANSLATED,
            "4 s" => D::MODEL.overcurrent_for == Duration::from_secs(4),
            "recovery" => D::MODEL.reports_recovery,
            "sdo control" => D::MODEL.control_by_sdo,
            "address switches" => D::MODEL.addressing == Addressing::Switches,
            object => address(object).is_some_and(D::has),
        }
    }

    fn size(_: &Rig<D>, index: u16, sub: u8) -> u8 {
        let entry = (D::MODEL.storage)(NODE).entry(Address::new(index, sub)).ok();
        entry.and_then(|entry| entry.data_type.size()).unwrap_or(4) as u8
    }

    fn value(name: &str) -> Option<i64> {
        match name.split_once(':') {
            None if name == "load" => Some(LOAD),
            None if name == "sensor" => Some(D::code(FaultKind::Sensor).into()),
            // Writes 1014h with an identifier, and with the bit without which some drives send nothing.
            Some(("emergency", id)) => {
                let id = i64::from_str_radix(id, 16).ok()?;
                let switch = D::MODEL.emergencies.filter(|switch| switch.on_when_set);
                Some(switch.map_or(id, |switch| id | i64::from(switch.bit)))
            }
            _ => None,
        }
    }

    fn place(rig: &Rig<D>) -> i64 {
        rig.position().into()
    }

    fn step(rig: &mut Rig<D>, verb: &str, args: &[&str]) -> Option<bool> {
        // First situations, then orders, inputs and questions.
        match (verb, args) {
            ("enabled", []) => *rig = Rig::enabled(),
            ("ready", writes) => {
                writes.iter().for_each(|text| _ = write(rig, text));
                rig.nmt(0x01);
                rig.enable();
                rig.control(0x000F);
            }
            ("moving", [target, ms]) => *rig = moving_to(target.parse().ok()?, ms.parse().ok()?),
            ("running", [velocity, ms]) => *rig = running_at(velocity.parse().ok()?, ms.parse().ok()?),
            ("velocity-mode", []) => *rig = in_velocity_mode(),
            ("faulty", []) => *rig = faulty(),
            ("restoring", []) => {
                let switches = DipSwitches::for_node(NODE).with_restore(Some(Restore::All));
                *rig = Rig::set_up(Setup { switches, ..Setup::new(D::MODEL, NODE) });
            }
            ("travel", [target]) => rig.travel(target.parse().ok()?),
            ("run", [velocity]) => rig.run(velocity.parse().ok()?),
            ("power", ["cycle"]) => rig.see(SimulatedDrive::power_cycle),
            ("power", ["off"]) => rig.see(SimulatedDrive::switch_off),
            ("power", ["on"]) => rig.see(SimulatedDrive::switch_on),
            ("switches", [number]) => {
                let switches = DipSwitches::new(number.parse().ok()?);
                rig.see(|drive, _| drive.set_switches(switches));
            }
            ("restore", [which]) => {
                let restore = match *which {
                    "all" => Some(Restore::All),
                    "standard" => Some(Restore::Standard),
                    "controller" => Some(Restore::Controller),
                    _ => None,
                };
                rig.see(|drive, _| drive.set_switches(DipSwitches::for_node(NODE).with_restore(restore)));
            }
            ("turn", [by]) => return Some(rig.turn(by.parse().ok()?)),
            ("position", [range]) => return Some(is_in(rig.position().into(), range)),
            ("velocity", [range]) => return Some(is_in(rig.velocity().into(), range)),
            ("speed", [range]) => return Some(is_in(rig.speed() as i64, range)),
            ("shaft", [at]) => return Some(number(at)? as f64 == rig.shaft()),
            ("stands", []) => return Some(rig.speed() == 0.0),
            ("rest", [range]) => return Some(is_in(rig.way_to_rest().into(), range)),
            ("released", []) => return Some(rig.is_released()),
            ("without", ["torque"]) => return Some(rig.is_released() || !rig.see(|drive, _| drive.is_on())),
            ("fault", []) => return Some(rig.is_fault()),
            ("disabled", []) => return Some(rig.is_disabled()),
            ("system", args) => return is_word(rig.system(), args),
            ("shows", pattern) => return Some(fits(rig.status(), &pattern.concat())),
            ("system-shows", pattern) => return Some(fits(rig.system(), &pattern.concat())),
            ("motor", words) => {
                let motor = match words.concat().as_str() {
                    "incontrol" => Motor::InControl,
                    "shorted" => Motor::Shorted,
                    "released" => Motor::Released,
                    _ => return None,
                };
                return Some(rig.see(|drive, now| drive.controller().motor(now)) == motor);
            }
            ("current", [ma]) => return Some(rig.see(|d, now| d.controller().current_ma(now).to_string()) == *ma),
            ("faults", letters) => {
                let found = rig.see(|drive, _| drive.controller().faults().to_vec());
                return Some(found.iter().map(|fault| fault.code.label).eq(letters.iter().copied()));
            }
            // From now on, each character of the pattern is 100 ms in which an LED is lit (#) or dark.
            ("shines", [led, pattern]) => {
                let lit = |rig: &mut Rig<D>, wanted: char| {
                    let lights = rig.see(|drive, now| drive.lights(now));
                    rig.hear(100);
                    (wanted == '#') == if *led == "bus" { lights.bus } else { lights.status }
                };
                return Some(pattern.chars().all(|wanted| lit(rig, wanted)));
            }
            ("network", ["operational"]) => rig.see(|drive, now| drive.set_network(now, Network::Operational)),
            // An order by another interface is accepted, or refused for this reason.
            ("order", [name, reason @ ..]) => {
                let order = order(name)?;
                let refused = rig.see(|drive, now| drive.order(now, order)).err();
                return Some(refused.iter().map(|refused| format!("{refused:?}")).eq(reason.iter().copied()));
            }
            ("node", [node]) => return Some(rig.see(|drive, _| drive.node().get().to_string()) == *node),
            ("bit-rate", [rate]) => return Some(rig.see(|drive, _| drive.bit_rate().to_string()) == *rate),
            ("velocities", all) => {
                let parsed = all.iter().map(|text| {
                    let (at, velocity) = text.split_once('=')?;
                    Some((at.parse::<u64>().ok()?, velocity.parse::<i32>().ok()?))
                });
                let (times, wanted): (Vec<_>, Vec<_>) = parsed.collect::<Option<Vec<_>>>()?.into_iter().unzip();
                return Some(rig.velocities(&times) == wanted);
            }
            ("least", [ms, range]) => {
                return Some(is_in(rig.way(ms.parse().ok()?).into_iter().min()?.into(), range));
            }
            // How far before the target a travel begins to brake: the last position at which it does not yet.
            ("brakes", [target, range]) => {
                let way = rig.way(20_000);
                let last = way.windows(2).rev().find(|pair| pair[1] - pair[0] >= 31)?;
                return Some(is_in(target.parse::<i64>().ok()? - i64::from(last[1]), range));
            }
            // The farthest position in the other direction, with bit 9 of 1002h set while it travels there.
            ("loops", [sign, range]) => {
                let sign = if *sign == "-" { -1 } else { 1 };
                let (mut far, mut right) = (0, true);
                for _ in 0..500 {
                    rig.hear(20);
                    let (at, speed) = (rig.position() * sign, rig.velocity() * sign);
                    far = far.min(at);
                    right &= (rig.system() >> 9 & 1 == 1) == (speed < 0) || speed == 0;
                }
                return Some(right && is_in(far.into(), range));
            }
            // A travel under way arrives at the same time as without this change.
            ("undisturbed", [change]) => {
                let arrives = |change: Option<&&str>| {
                    let mut rig = moving_to::<D>(5000, 1000);
                    change.into_iter().for_each(|text| _ = write(&mut rig, text));
                    let way = rig.way(8000);
                    (way.iter().position(|at| *at == 5000), way.last().copied())
                };
                return Some(arrives(Some(change)) == arrives(None));
            }
            // In velocity mode, the drive runs and stops as without this parameter.
            ("runs-alike", [change]) => {
                let run = |writes: &[&str]| {
                    let mut rig = Rig::<D>::new();
                    D::step(&mut rig, "ready", writes)?;
                    rig.control(0x010F);
                    rig.run(-30);
                    rig.hear(3000);
                    let before = (rig.velocity(), rig.system());
                    rig.control(0x010F);
                    rig.hear(3000);
                    Some((before, rig.position(), rig.system()))
                };
                return Some(run(&["6060:00=2", change])? == run(&["6060:00=2"])?);
            }
            // The PDO is sent at every change of its number.
            ("without-gap", [id]) => {
                let sent = rig.hear_from(u16::from_str_radix(id, 16).ok()?, 300);
                let readings = sent.iter().filter_map(|data| data.get(2..6)?.try_into().ok().map(i32::from_le_bytes));
                let readings: Vec<i32> = readings.collect();
                let in_steps = readings.windows(2).all(|pair| pair[1] - pair[0] <= 1);
                return Some(in_steps && readings.last().is_some_and(|last| *last > 15));
            }
            ("one-refused", writes) => {
                return Some(writes.iter().filter(|text| write(rig, text).is_some_and(|it| it.is_err())).count() == 1);
            }
            ("lights", ["alternate"]) => {
                let mut seen = std::collections::BTreeSet::new();
                for _ in 0..40 {
                    seen.insert(rig.see(|drive, now| (drive.lights(now).status, drive.lights(now).bus)));
                    rig.hear(50);
                }
                return Some(seen.into_iter().eq([(false, true), (true, false)]));
            }
            (verb, args) => {
                let mut inputs = rig.see(|drive, _| *drive.inputs());
                change::<D>(&mut inputs, verb, args)?;
                rig.world(|world| *world = inputs);
            }
        }
        Some(true)
    }
}

/// An order that does not come by CAN.
fn order(name: &str) -> Option<Order> {
    Some(match name {
        "enable" => Order::Enable,
        "hold" => Order::Hold,
        "release" => Order::Release,
        "start" => Order::Start,
        "interrupt" => Order::Interrupt(Braking::Programmed),
        "interrupt-fully" => Order::Interrupt(Braking::Full),
        "resume" => Order::Resume,
        "abort" => Order::Abort(Braking::Full),
        "step" => Order::Step,
        "inch+" => Order::Inch(Direction::Positive),
        "inch-" => Order::Inch(Direction::Negative),
        "stop-inching" => Order::StopInching,
        "reset-fault" => Order::ResetFault,
        _ => return None,
    })
}

/// Changes the inputs of a drive.
fn change<D: Siko>(inputs: &mut Inputs, verb: &str, args: &[&str]) -> Option<()> {
    match (verb, args) {
        ("well", []) => *inputs = Inputs::default(),
        ("hinder", []) => D::hinder(inputs),
        ("sensor", [how]) => inputs.sensor_fails = *how == "fails",
        ("temperature", [tenths]) => inputs.temperature_100mdegc = tenths.parse().ok()?,
        ("load", [ma]) => inputs.load_ma = ma.parse().ok()?,
        ("stage", [tenths]) => inputs.output_stage_supply_100mv = tenths.parse().ok()?,
        ("control-supply", [tenths]) => inputs.control_supply_100mv = tenths.parse().ok()?,
        ("blocked", []) => inputs.shaft = Shaft::Blocked,
        ("free", []) => inputs.shaft = Shaft::Free,
        ("force", [name]) => inputs.force(FaultKind::ALL.iter().find(|(_, known)| known == name)?.0),
        ("internal", ["fails"]) => inputs.internal_error = true,
        ("enable", [how]) => inputs.enable = *how == "on",
        ("battery", [hundredths]) => inputs.battery_10mv = hundredths.parse().ok()?,
        ("attainable", ["any"]) => inputs.attainable_rpm = None,
        ("attainable", [rpm]) => inputs.attainable_rpm = Some(rpm.parse().ok()?),
        ("bus", ["passive"]) => inputs.bus = BusState::Passive,
        ("bus", ["active"]) => inputs.bus = BusState::Active,
        ("bus", ["off"]) => inputs.bus = BusState::Off,
        ("bus-kbit", [kbit]) => inputs.bus_bit_rate = Some(kbit.parse::<u32>().ok()? * 1000),
        ("bus-error", [name]) => {
            inputs.bus_error = BusError::ALL.iter().find(|(_, known)| known == name).map(|(error, _)| *error);
        }
        ("switch", [number]) => *inputs.limit_switches.get_mut(number.parse::<usize>().ok()?.checked_sub(1)?)? = true,
        ("calibration", [how]) => inputs.calibration_switch = *how == "on",
        ("key", ["1"]) => inputs.key = Some(Key::Clockwise),
        ("key", ["2"]) => inputs.key = Some(Key::CounterClockwise),
        ("key", ["none"]) => inputs.key = None,
        _ => return None,
    }
    Some(())
}

impl<D: Siko> Rig<D> {
    pub(super) fn set_up(setup: Setup) -> Self {
        Rig::<D>::with(|now| SimulatedDrive::power_on(now, setup))
    }

    /// Changes the inputs of the drive.
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

    /// The velocity in rev/min.
    pub(super) fn velocity(&self) -> i32 {
        self.see(|drive, now| drive.velocity(now))
    }

    /// The velocity in increments/s, without rounding.
    pub(super) fn speed(&self) -> f64 {
        self.see(|drive, now| drive.shaft(now).velocity)
    }

    /// The position of the shaft, in increments.
    pub(super) fn shaft(&self) -> f64 {
        self.see(|drive, now| drive.shaft(now).position)
    }

    /// Whether the shaft can be turned by hand.
    pub(super) fn turn(&self, increments: i32) -> bool {
        self.see(|drive, now| drive.turn_shaft(now, increments))
    }

    pub(super) fn is_fault(&self) -> bool {
        self.status() & 0x4F == 0x08
    }

    pub(super) fn is_disabled(&self) -> bool {
        self.status() & 0x4F == 0x40
    }

    /// Bit 7 of 1002h.
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

    /// The velocity at each of these times, in ms from the start.
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

    /// The positions that the drive passes in `ms` milliseconds, every 20 ms.
    pub(super) fn way(&mut self, ms: u64) -> Vec<i32> {
        let mut look = || {
            self.hear(20);
            self.position()
        };
        (0..ms / 20).map(|_| look()).collect()
    }

    /// The drive after a change of its inputs.
    pub(super) fn after(mut self, change: impl FnOnce(&mut Inputs)) -> Self {
        self.world(change);
        self.hear(0);
        self
    }
}

/// A drive in OPERATION ENABLED, for which `set` was written before.
pub(super) fn enabled_with<D: Siko>(set: &[Write]) -> Rig<D> {
    let mut rig = Rig::<D>::new();
    rig.set(set);
    rig.nmt(0x01);
    rig.enable();
    rig.control(0x000F);
    rig
}

/// A drive that has been travelling for `ms`.
pub(super) fn moving_to<D: Siko>(target: i32, ms: u64) -> Rig<D> {
    let mut rig = Rig::<D>::enabled();
    rig.travel(target);
    rig.hear(ms);
    rig
}

/// A drive in velocity mode that has been running at a velocity for `ms`.
pub(super) fn running_at<D: Siko>(velocity: i32, ms: u64) -> Rig<D> {
    let mut rig = in_velocity_mode::<D>();
    rig.run(velocity);
    rig.hear(ms);
    rig
}

/// A drive in velocity mode and OPERATION ENABLED, at standstill.
pub(super) fn in_velocity_mode<D: Siko>() -> Rig<D> {
    let mut rig = Rig::<D>::operational();
    rig.set(&[(0x6060, 0, 2, 1)]);
    rig.enable();
    rig
}

/// A drive in OPERATION ENABLED with changed inputs.
pub(super) fn with_inputs<D: Siko>(change: impl FnOnce(&mut Inputs)) -> Rig<D> {
    Rig::<D>::enabled().after(change)
}

pub(super) fn faulty<D: Siko>() -> Rig<D> {
    with_inputs::<D>(|inputs| inputs.sensor_fails = true)
}

pub(super) fn hindered<D: Siko>() -> Rig<D> {
    with_inputs::<D>(D::hinder)
}

pub(super) fn overcurrent<D: Siko>() -> Rig<D> {
    let mut rig = moving_to::<D>(900_000, 500);
    rig.world(|inputs| inputs.load_ma = 2401);
    rig
}

/// A drive beyond a limit: its position is 0, and the limits are set to exclude it.
pub(super) fn beyond<D: Siko>(above: bool, mut rig: Rig<D>) -> Rig<D> {
    let limits = if above { [(1, -1000), (2, -500)] } else { [(2, 1000), (1, 500)] };
    rig.set(&limits.map(|(sub, limit)| (0x607D, sub, limit, 4)));
    rig
}
