//! The model of a servo: what its data sheet cannot say, as data.

use std::collections::VecDeque;

use lexican_runtime::device::Behaviour;
use lexican_runtime::object::{Address, Dictionary, Table};
use lexican_runtime::profile::cia402::{Mode, Modes, State, Transitions, control};
use lexican_runtime::{AbortCode, Duration, Instant, NodeId};

use super::inputs::{Causes, Inputs};
use super::objects::*;
use super::parts::{Cycle, Cyclic, Emergency, Ending, Homing, Last, Limit, Points, Probe, Watch};
use crate::storage::Storage;
use crate::trajectory::Trajectory;

/// A servo as data. [`ServoModel::CIA_402`] follows the standard; the model of a drive states the differences.
#[derive(Clone, Copy, Debug)]
pub struct ServoModel {
    /// The name in messages.
    pub name: &'static str,
    /// Makes the dictionary for a node-ID, with the defaults of the data sheet. [`Servo`] alone does not use it.
    pub storage: fn(NodeId) -> Box<dyn Storage>,
    /// Where it deviates from CiA 301, or decides what that leaves open.
    pub behaviour: Behaviour,
    /// The entries that survive a power cut, besides those that 1010h stores.
    pub persistent: &'static [Address],
    /// The state machine.
    pub transitions: Transitions,
    /// Whether the motor holds the shaft in SWITCHED ON, and not only from OPERATION ENABLED on.
    pub holds_when_switched_on: bool,
    /// The number of each mode.
    pub modes: Modes,
    /// Whether it refuses a mode that 6502h does not list.
    pub obeys_supported_modes: bool,
    /// The bit of the control word by which a set-point replaces the travel under way; 0 if it has none.
    pub at_once: u16,
    /// The bit of the control word by which the next set-point follows without a stop; 0 if it has none.
    pub on_set_point: u16,
    /// Values for objects that the data sheet lacks, such as option codes and ramps, where they differ from
    /// [`DEFAULTS`](super::DEFAULTS).
    pub missing: &'static [(Address, i64)],
    /// Whether 6060h takes effect while the axis moves, and not only when it stands.
    pub changes_mode_while_moving: bool,
    /// Whether bit 10 of the status word is set while an enabled axis stands without having had an order, and while it
    /// stands between the points of interpolated position mode. Otherwise it is set only once an order was carried out.
    pub rest_is_reached: bool,
    /// Whether software limits (607Dh) are those at power-on or reset, and later writes have no effect until then.
    pub limits_from_start: bool,
    /// Whether a missing heartbeat or guarding request of the manager is a fault in every state, instead of what 6007h
    /// says for an enabled axis.
    pub lost_manager_is_fault: bool,
    /// The step of 60C2h: only multiples are taken, and they take effect once both entries have been written. With
    /// `None`, any period takes effect at once.
    pub cycle_step: Option<Duration>,
    /// The homing methods, if 60E3h does not list them; `None` for all of CiA 402.
    pub homing_methods: Option<&'static [i8]>,
    /// The EMCY codes of faults that the servo detects itself.
    pub codes: FaultCodes,
    /// The units of velocities and accelerations.
    pub scales: fn(&dyn Storage) -> Scales,
    /// Whether the encoder knows its position after power-on; otherwise the position is 0 then.
    pub absolute_encoder: bool,
    /// The highest acceleration, in position units/s²: for ramps that the data sheet lacks or has as 0, and for stops
    /// at the current limit.
    pub strongest: f64,
    /// The deceleration of an axis without torque, in position units/s².
    pub coasting: f64,
    /// The velocity of the axis at 0.1 % of the rated torque, in position units/s: its load is a brake whose torque is
    /// proportional to the velocity.
    pub speed_per_torque: f64,
    /// How many cycles in a row may pass without SYNC, or without a new set-point, before a fault. Until then the axis
    /// keeps its velocity.
    pub missed_cycles: u32,
    /// How long a shaft may be blocked before a fault, if no following error comes first.
    pub blocked_for: Duration,
    /// Status bits that CiA 402 leaves undefined in a state, and that this drive has as 0.
    pub left_open: &'static [(State, u16)],
    /// The manufacturer's bits of the status word: 8, 14, 15.
    pub status_bits: fn(&Servo, &dyn Storage) -> u16,
    /// Writes measured values of manufacturer objects into the dictionary, after each change.
    pub publish: fn(&Servo, Instant, &mut dyn Storage),
    /// Whether a manufacturer object waits for an index pulse ([`Servo::passed_index`]).
    pub awaits_index: fn(&dyn Storage) -> bool,
    /// Whether an entry may have a value now; called before each write of a number.
    pub check: fn(&Servo, &dyn Storage, Address, i64) -> Result<(), AbortCode>,
    /// The value that an entry keeps of a written number, in wire form; some bits may always be 0.
    pub kept: fn(Address, u64) -> u64,
    /// The codes with which it aborts SDO transfers instead of those of CiA 301: `(instead of, code)`.
    pub aborts: &'static [(AbortCode, AbortCode)],
    /// Handles a write of a client, such as a command in a manufacturer object.
    pub written: fn(&mut Servo, Instant, &mut dyn Storage, Address),
}

/// The EMCY codes of faults that the servo detects itself; `None` where the drive reports no fault.
#[derive(Clone, Copy, Debug)]
pub struct FaultCodes {
    /// The axis did not follow its set-points (6065h, 6066h).
    pub following_error: Option<u16>,
    /// The shaft is blocked.
    pub blocked: Option<u16>,
    /// The motor is switched on without supply.
    pub undervoltage: Option<u16>,
    /// No SYNC, or no set-point, for too many cycles.
    pub cycle_missed: Option<u16>,
    /// The connection is lost (6007h). The device itself may already have sent an EMCY.
    pub connection_lost: Option<u16>,
}

/// How many position units/s make one unit of velocity, and how many position units/s² one unit of acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scales {
    /// Position units/s.
    pub velocity: f64,
    /// Position units/s².
    pub acceleration: f64,
}

/// A simulated servo.
#[derive(Clone, Debug)]
pub struct Servo {
    pub(super) model: &'static ServoModel,
    pub(super) now: Instant,
    pub(super) next: Option<Instant>,
    pub(super) inputs: Inputs,
    pub(super) state: State,
    /// The last control word taken.
    pub(super) control: u16,
    /// What happens once the axis stands.
    pub(super) ending: Option<Ending>,
    /// The EMCY codes of the faults. The last one stays until it is reset.
    pub(super) faults: Vec<u16>,
    /// The faults whose cause in the world still lasts.
    pub(super) causes: Causes,
    pub(super) warnings: Causes,
    pub(super) emergencies: VecDeque<Emergency>,
    pub(super) mode: Option<Mode>,
    /// The number of the mode, as 6061h shows it.
    pub(super) mode_code: i8,
    /// The demanded motion of the axis.
    pub(super) way: Trajectory,
    /// The position at which a blocked shaft stands instead.
    pub(super) held: Option<f64>,
    /// The position of the shaft at which 6064h is 0.
    pub(super) zero: f64,
    /// The software limits (607Dh) at the first look after power-on or reset; the inner `None` means no limits.
    pub(super) limits: Option<Option<(f64, f64)>>,
    /// What limits the motion (status word, bit 11).
    pub(super) limit: Limit,
    pub(super) points: Points,
    /// In velocity or torque mode: target, acceleration, deceleration, and the target before limiting.
    pub(super) running: Option<[f64; 4]>,
    pub(super) homing: Homing,
    pub(super) cyclic: Cyclic,
    pub(super) cycle: Cycle,
    pub(super) probes: [Probe; 2],
    pub(super) watch: Watch,
    pub(super) last: Last,
    /// Whether TPDOs are sent when a measured value changes, cached by the generation of the device's configuration.
    pub(super) sampled: (Option<u32>, bool),
    /// When to check these TPDOs while the axis moves.
    pub(super) sample: Option<Instant>,
}

impl ServoModel {
    /// A servo that does what CiA 402-2 says, without objects.
    pub const CIA_402: ServoModel = ServoModel {
        name: "servo",
        storage: |node| Box::new(Dictionary::<0>::new(&NO_OBJECTS, node)),
        behaviour: Behaviour::CIA_301,
        persistent: &[],
        transitions: Transitions::CIA_402,
        holds_when_switched_on: false,
        modes: Modes::CIA_402,
        obeys_supported_modes: true,
        at_once: control::CHANGE_IMMEDIATELY,
        on_set_point: control::CHANGE_ON_SET_POINT,
        missing: &[],
        changes_mode_while_moving: true,
        rest_is_reached: true,
        limits_from_start: false,
        lost_manager_is_fault: false,
        cycle_step: None,
        homing_methods: None,
        codes: FaultCodes::CIA_402,
        scales: Scales::of_units,
        absolute_encoder: false,
        strongest: 1e6,
        coasting: 1e4,
        speed_per_torque: 10.0,
        missed_cycles: 3,
        blocked_for: Duration::from_millis(500),
        left_open: &[],
        status_bits: |_, _| 0,
        publish: |_, _, _| {},
        awaits_index: |_| false,
        check: |_, _, _, _| Ok(()),
        kept: |_, raw| raw,
        aborts: &[],
        written: |_, _, _, _| {},
    };
}

static NO_OBJECTS: Table = Table { rows: &[], limits: &[], image: &[] };

impl FaultCodes {
    /// The codes of CiA 402-2, table 5.
    pub const CIA_402: FaultCodes = FaultCodes {
        following_error: Some(0x8611),
        blocked: Some(0x7121),
        undervoltage: Some(0x3220),
        cycle_missed: Some(0x8700),
        connection_lost: Some(0x8130),
    };
}

/// The ratio of two objects; `None` if one of them is missing or not positive.
pub(super) fn ratio(od: &dyn Storage, numerator: Address, denominator: Address) -> Option<f64> {
    match (od.number(numerator), od.number(denominator)) {
        (Some(a), Some(b)) if a > 0 && b > 0 => Some(a as f64 / b as f64),
        _ => None,
    }
}

impl Scales {
    /// The units of 60A9h and 60AAh: revolutions per minute or second, a revolution being that of 6092h or 608Fh.
    /// Otherwise position units per second, the default of CiA 402.
    #[must_use]
    pub fn of_units(od: &dyn Storage) -> Scales {
        let ratio = |numerator, denominator| ratio(od, numerator, denominator);
        let gear = ratio(GEAR_MOTOR, GEAR_SHAFT).unwrap_or(1.0);
        let feed = ratio(FEED, FEED_REVOLUTIONS).map(|feed| feed / gear);
        let revolution = feed.or_else(|| ratio(ENCODER_INCREMENTS, ENCODER_REVOLUTIONS)).unwrap_or(1.0);
        // CiA 303-2: the numerator in bits 16 to 23 is B4h for a revolution; 47h in bits 8 to 15 is a minute, 03h a second.
        let unit = |address| match od.raw(address).unwrap_or_default() as u32 & 0x00FF_FF00 {
            0x00B4_4700 => revolution / 60.0,
            0x00B4_0300 => revolution,
            _ => 1.0,
        };
        // Revolutions per minute and second, or revolutions per second squared.
        let acceleration = match od.raw(ACCELERATION_UNIT).unwrap_or_default() as u32 & 0x00FF_FFFF {
            0x00C0_0300 => revolution / 60.0,
            0x00B4_5700 => revolution,
            _ => 1.0,
        };
        Scales { velocity: unit(VELOCITY_UNIT), acceleration }
    }
}
