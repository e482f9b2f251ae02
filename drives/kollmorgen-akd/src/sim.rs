//! The simulated AKD, as a model of the servo of [`simulator`].
//!
//! ```
//! use kollmorgen_akd::driver::{Drive, Outcome};
//! use kollmorgen_akd::sim::{MODEL, SimulatedServo};
//! use lexican_runtime::NodeId;
//! use lexican_runtime::host::VirtualBus;
//!
//! let node = NodeId::literal(3);
//! let bus = VirtualBus::with_bit_rate(500);
//! bus.attach(SimulatedServo::new(bus.now(), &MODEL, node));
//!
//! let mut drive = Drive::connect(bus.link(), node)?;
//! drive.enable()?;
//! assert_eq!(drive.move_to(5000)?, Outcome::Reached { position: 5000 });
//! drive.disable()?;
//! # Ok::<(), kollmorgen_akd::driver::Error>(())
//! ```
//!
//! # Decisions where the manual is silent
//!
//! | Question | Here |
//! |---|---|
//! | 606Ch in PDOs, in rev/min | as by SDO, in 1/1000 position units/s |
//! | which inputs the capture engines listen to (CAP0.TRIGGER, CAP1.TRIGGER) | digital inputs 1 and 2 |
//! | what clears the valid bits of 20A5h | taking the enable bit of 20A4h back |
//! | the position of the index pulse, which comes in 20A0h | the one of 6064h when it is passed, regardless of CAP0.MODE |
//! | the read codes of 20A4h (bits 8 to 12) and their acknowledgement in 20A5h | 0: where the value comes is not said |
//! | which SYNC is the first that an RPDO of type n counts (6.3.1.1) | the first one in OPERATIONAL |
//! | 60C1h, in increments (7.2.2.1) | counts as 6064h, and 6063h by 608Fh, 6091h and 6092h |
//! | 6073h, which is 0 by default | no limit while it is 0 |
//! | STO | the cause of fault F602 or warning n602; 1002h then has bit 13 |
//! | 1003h:01 to 0Ah while they are empty | 0 |
//! | 5.4.5.6 has no code for what CiA 301 has one | the closest one that it has |
//! | a shaft that is blocked | a following error (F439), if 6065h is not 0 |
//! | 1026h, 2026h, DRV.NVSAVE (35EBh) and motion tasks | objects that keep what is written, and do nothing |
//! | speeds of homing, of which the manual has "equivalent 60 rpm" | 1000, and an eighth of it |

use lexican_runtime::device::{Behaviour, ChangeRule};
use lexican_runtime::object::{Address, ObjectDictionary};
use lexican_runtime::profile::cia402::{Mode, State, status};
use lexican_runtime::{AbortCode, Duration, Instant, NodeId};
use simulator::servo::FaultCodes;
pub use simulator::servo::{Causes, Inputs, Machine, Servo, ServoModel};
pub use simulator::{SimulatedServo, Storage};

use crate::driver::{METHODS, MODES, system};
use crate::{fault, od};

/// The simulated AKD.
pub static MODEL: ServoModel = ServoModel {
    name: "AKD",
    storage: |node| Box::new(storage(node)),
    behaviour: BEHAVIOUR,
    modes: MODES,
    // 6502h has neither torque nor cyclic position, which 6060h takes.
    obeys_supported_modes: false,
    at_once: 0,
    on_set_point: lexican_runtime::profile::cia402::control::CHANGE_IMMEDIATELY,
    // It says "drive has torque" after transition 3 (6.4.1.2).
    holds_when_switched_on: true,
    // 0240h and 0250h (7.2.1.2, 7.2.1.7).
    left_open: &[(State::SwitchOnDisabled, status::QUICK_STOP)],
    // 0237h in profile position, homing and interpolated position mode, and 1237h while it interpolates (F146, F205, F326).
    rest_is_reached: false,
    // "Changed values must be saved and the drive must be restarted" (6.11.2.2).
    limits_from_start: true,
    // "Fault F129 appears on the drive, the drive is braked to a stop, and any other movement is prevented" (5.4.7).
    lost_manager_is_fault: true,
    // "Only multiples of 1 ms are allowed", and "both values must be written" (6.9.2.3).
    cycle_step: Some(Duration::from_millis(1)),
    // There is no 605Ah: the drive stays in QUICK STOP ACTIVE, with torque (6.4.1.2).
    missing: &[(Address::new(0x605A, 0), 6)],
    // "Never change the mode while the motor is running" (6.4.2.3).
    changes_mode_while_moving: false,
    homing_methods: Some(METHODS),
    codes: FaultCodes {
        following_error: Some(0x8611),
        blocked: None,
        undervoltage: Some(0x3220),
        cycle_missed: Some(0x8780),
        connection_lost: Some(0x8130),
    },
    publish,
    awaits_index: |od| od.number(od::LATCH_CONTROL_REGISTER.address()).unwrap_or_default() & INDEX_LATCH != 0,
    check,
    kept,
    aborts: ABORTS,
    ..ServoModel::CIA_402
};

/// In what the AKD deviates from CiA 301 (6.3, 7.2).
const BEHAVIOUR: Behaviour = Behaviour {
    changes: ChangeRule::InPreOperational,
    pdo_bit_30: false,
    generic_error: false,
    dummies: 0,
    // 2014h to 2017h (6.2.2.1).
    tpdo_masks: Some(0x2014),
    // "Values of 1 to 240 mean, that 0 to 239 SYNC-telegrams are ignored, before one is interpreted" (6.3.1.1).
    rpdos_count_syncs: true,
    // There is no code for it in 5.4.5.6.
    empty_history_is_zero: true,
    ..Behaviour::CIA_301
};

/// "Abort codes not listed above are reserved" (5.4.5.6); others of CiA 301 never come of what the drive has.
const ABORTS: &[(AbortCode, AbortCode)] = &[
    (AbortCode::LENGTH_TOO_HIGH, AbortCode::LENGTH_MISMATCH),
    (AbortCode::LENGTH_TOO_LOW, AbortCode::LENGTH_MISMATCH),
    (AbortCode::TOGGLE_BIT, AbortCode::UNKNOWN_COMMAND),
    (AbortCode::UNSUPPORTED_ACCESS, AbortCode::DEVICE_STATE),
];

/// Identifiers of 29 bits are not supported, and "mappings are taken only byte-wise" (6.3.1, 6.3.2).
fn check(_: &Servo, _: &dyn Storage, address: Address, value: i64) -> Result<(), AbortCode> {
    match (address.index(), address.sub()) {
        (0x1400..=0x1403 | 0x1800..=0x1803, 1) if value & 1 << 29 != 0 => Err(AbortCode::INVALID_VALUE),
        (0x1600..=0x1603 | 0x1A00..=0x1A03, 1..) if value & 0x07 != 0 => Err(AbortCode::NOT_MAPPABLE),
        _ => Ok(()),
    }
}

/// "The bits 11 to 30 are always 0" (6.2.1.5).
fn kept(address: Address, raw: u64) -> u64 {
    if address == od::COB_ID_SYNC_MESSAGE.address() { raw & 0x8000_07FF } else { raw }
}

/// The dictionary with what the data sheet leaves to the drive: the example of the manual, an M006.
fn storage(node: NodeId) -> od::Storage {
    let mut storage = od::storage(node);
    for (index, text) in [(0x1008, "M006"), (0x100A, "1.03")] {
        if let Ok(entry) = storage.entry(Address::new(index, 0)) {
            // A text of four characters fits.
            let _ = storage.write(&entry, 0, text.as_bytes(), true);
        }
    }
    for (index, sub, value) in [
        (0x1018, 2, u32::from_le_bytes(*b"M006").into()),
        (0x1018, 3, 0x0014_0000),
        (0x6081, 0, 20_000),
        (0x6083, 0, 100_000),
        (0x6084, 0, 100_000),
        (0x6099, 1, 1000),
        (0x6099, 2, 125),
        (0x609A, 0, 10_000),
    ] {
        storage.set_raw(Address::new(index, sub), value);
    }
    storage
}

/// 1002h, 606Ch and the latches.
fn publish(servo: &Servo, now: Instant, od: &mut dyn Storage) {
    let velocity = Address::new(0x606C, 0);
    if let Some(shown) = od.number(velocity) {
        // 606Ch counts 1/1000.
        od.set_raw(velocity, (shown * 1000) as u64);
    }
    // The capture engines listen to inputs 1 and 2.
    let probes = (16..).zip(servo.inputs().probes).fold(0, |bits, (bit, level)| bits | u64::from(level) << bit);
    let digital = od::DIGITAL_INPUTS.address();
    od.set_raw(digital, od.raw(digital).unwrap_or_default() | probes);
    changed_inputs(servo, od);
    let register = manufacturer_status(servo, now, od);
    od.set_raw(od::MANUFACTURER_STATUS_REGISTER.address(), register.into());
    latch(servo, od);
}

/// 1002h (6.2.1.3).
fn manufacturer_status(servo: &Servo, now: Instant, od: &dyn Storage) -> u32 {
    let word = od.number(od::STATUSWORD.address()).unwrap_or_default() as u16;
    let (mode, inputs, moves) = (servo.mode(), servo.inputs(), servo.is_moving(now));
    let homing = mode == Some(Mode::Homing);
    // A search by label would be an eighth of the work of a drive without faults.
    let is = |causes: Causes, label| {
        !causes.is_empty() && fault::find(label).is_some_and(|code| causes.contains(code.number))
    };
    let switches = od.number(od::DIGITAL_INPUTS.address()).unwrap_or_default();
    let input = |number: u8| switches & 1 << (15 + number) != 0;
    let bits = [
        (system::MOVEMENT_ACTIVE, moves && (homing || mode == Some(Mode::ProfilePosition))),
        (1 << 2, switches & 1 << 2 != 0),
        (1 << 3, word & status::TARGET_REACHED != 0),
        (1 << 8, word & status::WARNING != 0),
        (system::TARGET_VELOCITY_REACHED, mode == Some(Mode::ProfileVelocity) && word & status::TARGET_REACHED != 0),
        (1 << 11, homing && word & status::HOMING_ERROR != 0),
        (system::SAFETY_SELECTED, is(inputs.faults, "F602") || is(inputs.warnings, "n602")),
        (1 << 14, servo.has_torque()),
        (1 << 15, servo.state() == State::Fault),
        (1 << 16, homing && moves),
        (1 << 19, servo.state() == State::QuickStopActive),
        (system::HOMING_FINISHED, servo.is_homed()),
        (1 << 25, input(1)),
        (1 << 26, input(2)),
        (1 << 27, input(3)),
        (1 << 28, input(4)),
        (system::HARDWARE_ENABLE, inputs.enable),
    ];
    bits.into_iter().filter(|(_, set)| *set).fold(0, |register, (bit, _)| register | bit)
}

/// The capture engines (6.2.2.4 to 6.2.2.10): bits 15 to 12 of 20A5h are the inputs 1 to 4, as they were before.
fn latch(servo: &Servo, od: &mut dyn Storage) {
    let address = od::LATCH_STATUS_REGISTER.address();
    let armed = od.number(od::LATCH_CONTROL_REGISTER.address()).unwrap_or_default();
    let before = od.number(address).unwrap_or_default();
    let inputs = od.number(od::DIGITAL_INPUTS.address()).unwrap_or_default();
    let position = od.raw(od::POSITION_ACTUAL_VALUE.address()).unwrap_or_default();
    let mut after = before & armed & 0x1F;
    for input in 0..4 {
        let (level, shown) = (inputs & 1 << (16 + input) != 0, 1 << (15 - input));
        after |= if level { shown } else { 0 };
        let edge = 2 * input + i64::from(!level);
        if input < 2 && (before & shown != 0) != level && armed & !after & 1 << edge != 0 {
            // 20A6h has the first edge of either kind.
            if input == 0 && after & 0x03 == 0 {
                od.set_raw(od::LATCH_POSITION_1_EITHER_EDGE.address(), position);
            }
            after |= 1 << edge;
            od.set_raw(Address::new(0x20A0 + edge as u16, 0), position);
        }
    }
    if servo.passed_index() && armed & !after & INDEX_LATCH != 0 {
        after |= INDEX_LATCH;
        od.set_raw(od::LATCH_POSITION_1_POSITIVE_EDGE.address(), position);
    }
    od.set_raw(address, after as u64);
}

/// The encoder's index pulse in 20A4h and 20A5h.
const INDEX_LATCH: i64 = 1 << 4;

/// Bits 24 to 30 of 60FDh say which of the inputs 1 to 7 have changed, until 20B8h resets them (6.2.3.1, 6.2.2.11).
fn changed_inputs(servo: &Servo, od: &mut dyn Storage) {
    let address = od::DIGITAL_INPUTS.address();
    let (before, now) = (servo.inputs_before(), od.raw(address).unwrap_or_default() as u32 & 0x00FF_FFFF);
    let reset = od.raw(od::RESET_OF_CHANGED_INPUT_INFORMATION.address()).unwrap_or_default() as u32;
    let changed = before >> 24 | (before ^ now) >> 16 & 0x7F;
    od.set_raw(address, u64::from(now | (changed & !reset & 0x7F) << 24));
}
