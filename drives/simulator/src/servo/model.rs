//! A servo, and what a data sheet cannot say of it, as data.

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

/// A servo as data. [`ServoModel::CIA_402`] is the standard; a drive's own is written as the difference.
#[derive(Clone, Copy, Debug)]
pub struct ServoModel {
    /// What messages call it.
    pub name: &'static str,
    /// The dictionary with the defaults of the data sheet for a node-ID. [`Servo`] alone does not use it.
    pub storage: fn(NodeId) -> Box<dyn Storage>,
    /// In what it deviates from CiA 301, or fills in what that leaves open.
    pub behaviour: Behaviour,
    /// The entries that are kept without power, besides those that 1010h stores.
    pub persistent: &'static [Address],
    /// The state machine.
    pub transitions: Transitions,
    /// Whether the motor holds the shaft in SWITCHED ON already, and not only from OPERATION ENABLED on.
    pub holds_when_switched_on: bool,
    /// Which number means which mode.
    pub modes: Modes,
    /// Whether a mode that 6502h does not list is refused.
    pub obeys_supported_modes: bool,
    /// The bit of the control word by which a set-point replaces the travel under way; 0 for none.
    pub at_once: u16,
    /// The bit by which the set-point under way is passed on the way to the next one; 0 for none.
    pub on_set_point: u16,
    /// What objects would hold that the data sheet does not have, where it is not what [`DEFAULTS`](super::DEFAULTS) has:
    /// option codes, ramps.
    pub missing: &'static [(Address, i64)],
    /// Whether 6060h takes effect while the axis moves, and not only when it stands.
    pub changes_mode_while_moving: bool,
    /// Whether bit 10 of the status word is set while an enabled axis stands to which nothing was ordered, and while it
    /// stands between the points of interpolated position mode. Otherwise it takes an order that was carried out.
    pub rest_is_reached: bool,
    /// Whether software limits (607Dh) hold as they were when the servo was switched on or reset, and not as they are.
    pub limits_from_start: bool,
    /// Whether a heartbeat or guarding request of the manager that does not come is a fault in every state, and not what 6007h
    /// says of an enabled axis.
    pub lost_manager_is_fault: bool,
    /// 60C2h takes multiples of this only, and a period takes effect when both of its entries have been written; any period,
    /// at once, without it.
    pub cycle_step: Option<Duration>,
    /// Its homing methods, where neither 60E3h nor CiA 402 says it; none for all of CiA 402.
    pub homing_methods: Option<&'static [i8]>,
    /// The EMCY codes of what the servo notices by itself.
    pub codes: FaultCodes,
    /// What velocities and accelerations are counted in.
    pub scales: fn(&dyn Storage) -> Scales,
    /// Whether the encoder knows its position after power-on; otherwise that is 0.
    pub absolute_encoder: bool,
    /// The strongest acceleration, in position units/s²: of ramps that the data sheet does not have or has as 0, and of
    /// stops at the current limit.
    pub strongest: f64,
    /// How an axis without torque comes to rest, in position units/s².
    pub coasting: f64,
    /// How fast 0.1 % of the rated torque turns the axis, in position units/s: the load is a brake whose torque grows
    /// with the velocity.
    pub speed_per_torque: f64,
    /// How many cycles in a row may pass without SYNC, or without a new set-point, before that is a fault. The axis goes
    /// on with its velocity meanwhile.
    pub missed_cycles: u32,
    /// How long a shaft may be blocked before that is a fault, unless it is a following error before.
    pub blocked_for: Duration,
    /// Bits of the status word that CiA 402 leaves open in a state, and that it has as 0 there.
    pub left_open: &'static [(State, u16)],
    /// Bits of the manufacturer in the status word: 8, 14, 15.
    pub status_bits: fn(&Servo, &dyn Storage) -> u16,
    /// Puts measured values of the manufacturer into the dictionary, after each change.
    pub publish: fn(&Servo, Instant, &mut dyn Storage),
    /// Whether an object of the manufacturer waits for an index pulse ([`Servo::passed_index`]).
    pub awaits_index: fn(&dyn Storage) -> bool,
    /// Whether an entry may have a value now; asked before each write of a number.
    pub check: fn(&Servo, &dyn Storage, Address, i64) -> Result<(), AbortCode>,
    /// What an entry keeps of a number in wire form that is written to it, where some of its bits are always 0.
    pub kept: fn(Address, u64) -> u64,
    /// The codes that it aborts SDO transfers with in place of those of CiA 301: `(instead of, code)`.
    pub aborts: &'static [(AbortCode, AbortCode)],
    /// Follows a write of a client, such as a command in an object of the manufacturer.
    pub written: fn(&mut Servo, Instant, &mut dyn Storage, Address),
}

/// The EMCY codes of what the servo notices by itself; `None` where that is no fault.
#[derive(Clone, Copy, Debug)]
pub struct FaultCodes {
    /// The axis did not follow its set-points (6065h, 6066h).
    pub following_error: Option<u16>,
    /// The shaft is blocked.
    pub blocked: Option<u16>,
    /// No supply of the motor while it is switched on.
    pub undervoltage: Option<u16>,
    /// No SYNC, or no set-point, for too many cycles.
    pub cycle_missed: Option<u16>,
    /// The connection is lost (6007h). The device may have sent an EMCY of its own already.
    pub connection_lost: Option<u16>,
}

/// How many position units/s one unit of a velocity is, and position units/s² one unit of an acceleration.
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
    /// The control word that was taken last.
    pub(super) control: u16,
    /// What follows once the axis stands.
    pub(super) ending: Option<Ending>,
    /// The EMCY codes of the faults. The last one stays until it is reset.
    pub(super) faults: Vec<u16>,
    /// Which of them have a cause in the world that lasts.
    pub(super) causes: Causes,
    pub(super) warnings: Causes,
    pub(super) emergencies: VecDeque<Emergency>,
    pub(super) mode: Option<Mode>,
    /// The number of the mode, as 6061h shows it.
    pub(super) mode_code: i8,
    /// Where the axis is to be.
    pub(super) way: Trajectory,
    /// Where a blocked shaft stands instead.
    pub(super) held: Option<f64>,
    /// Where 6064h is 0.
    pub(super) zero: f64,
    /// The software limits (607Dh) as they were first seen after it was switched on or reset, and none where they did not limit.
    pub(super) limits: Option<Option<(f64, f64)>>,
    /// What limits the motion (status word, bit 11).
    pub(super) limit: Limit,
    pub(super) points: Points,
    /// What the velocity or torque mode runs at: target, acceleration, deceleration, and the target before its limits.
    pub(super) running: Option<[f64; 4]>,
    pub(super) homing: Homing,
    pub(super) cyclic: Cyclic,
    pub(super) cycle: Cycle,
    pub(super) probes: [Probe; 2],
    pub(super) watch: Watch,
    pub(super) last: Last,
    /// Whether TPDOs are sent when something measured changes, by the generation of the device.
    pub(super) sampled: (Option<u32>, bool),
    /// When the moving axis is to be looked at for them.
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

/// What two objects say of a revolution; none if one of them is not there, or 0.
pub(super) fn ratio(od: &dyn Storage, numerator: Address, denominator: Address) -> Option<f64> {
    match (od.number(numerator), od.number(denominator)) {
        (Some(a), Some(b)) if a > 0 && b > 0 => Some(a as f64 / b as f64),
        _ => None,
    }
}

impl Scales {
    /// As 60A9h and 60AAh say: revolutions per minute or per second of what 6092h or 608Fh counts. Otherwise position
    /// units per second, as CiA 402 has it without factors.
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
        // Revolutions per minute and second, and revolutions per second squared.
        let acceleration = match od.raw(ACCELERATION_UNIT).unwrap_or_default() as u32 & 0x00FF_FFFF {
            0x00C0_0300 => revolution / 60.0,
            0x00B4_5700 => revolution,
            _ => 1.0,
        };
        Scales { velocity: unit(VELOCITY_UNIT), acceleration }
    }
}
