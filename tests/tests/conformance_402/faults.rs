//! Servos with one mistake each, and the cases that notice it. The servo has node-ID 5, takes orders by RPDO 1, and
//! shows its state by SDO.

use std::sync::LazyLock;

use lexican_runtime::object::Address;
use lexican_runtime::profile::cia402::{Cause, Command, Mode, State, Transition, Transitions};
use lexican_runtime::{AbortCode, Instant};
use simulator::Storage;
use simulator::servo::{FaultCodes, Scales, Servo, ServoModel};

use crate::faulty::{Fault, named};
use crate::od;

/// A servo with a fault, either of its own or in its frames.
pub struct DriveFault {
    pub model: ServoModel,
    pub frames: Fault,
    /// Whether the fault is in the servo itself, so that no frame tells which cases it concerns.
    pub servo: bool,
}

/// The servo without a fault.
pub static MODEL: ServoModel = SERVO;

/// Velocities are in revolutions per minute and positions in revolutions, so that even at its fastest, it lags behind
/// every ramp of the test.
pub static SLOW: ServoModel = ServoModel { scales: |_| Scales { velocity: 1.0 / 60.0, acceleration: 1.0 }, ..SERVO };

const SERVO: ServoModel = ServoModel { storage: |node| Box::new(od::storage(node)), ..ServoModel::CIA_402 };

impl DriveFault {
    pub fn concerns(&self, frames: &[String]) -> bool {
        self.servo || self.frames.concerns(frames)
    }

    /// Whether, of all cases, exactly those have failed that must notice the fault.
    pub fn is_noticed_by(&self, failed: &[&str], all: &[&str]) -> bool {
        let named = self.frames.fails.strip_prefix("all but ");
        let passed = all.iter().filter(|id| !failed.contains(id)).copied();
        match named {
            Some(named) => named == passed.collect::<Vec<_>>().join(" "),
            None => !failed.is_empty() && failed.join(" ") == self.frames.fails,
        }
    }
}

fn frames(title: &'static str, rules: &'static str, fails: &'static str) -> DriveFault {
    DriveFault { model: SERVO, frames: named(title, rules, fails), servo: false }
}

fn servo(title: &'static str, model: ServoModel, fails: &'static str) -> DriveFault {
    DriveFault { model, frames: named(title, "", fails), servo: true }
}

/// The servo shows something other than it measures.
fn shows(title: &'static str, publish: fn(&Servo, Instant, &mut dyn Storage), fails: &'static str) -> DriveFault {
    servo(title, ServoModel { publish, ..SERVO }, fails)
}

/// The servo handles a write wrongly.
fn writes(
    title: &'static str,
    written: fn(&mut Servo, Instant, &mut dyn Storage, Address),
    fails: &'static str,
) -> DriveFault {
    servo(title, ServoModel { written, ..SERVO }, fails)
}

/// The servo has wrong transitions.
fn follows(title: &'static str, transitions: &[Transition], fails: &'static str) -> DriveFault {
    servo(title, ServoModel { transitions: Transitions(transitions.to_vec().leak()), ..SERVO }, fails)
}

/// The transitions, and an additional one.
fn with(from: State, to: State, command: Command) -> Vec<Transition> {
    let more = Transition { number: 0, from, to, cause: Cause::Command(command) };
    [&[more], Transitions::CIA_402.0].concat()
}

fn without(number: u8) -> Vec<Transition> {
    Transitions::CIA_402.0.iter().copied().filter(|transition| transition.number != number).collect()
}

const fn at(index: u16) -> Address {
    Address::new(index, 0)
}

fn clear(od: &mut dyn Storage, bits: u64) {
    let word = od.raw(at(0x6041)).unwrap_or_default();
    od.set_raw(at(0x6041), word & !bits);
}

fn set(od: &mut dyn Storage, bits: u64) {
    let word = od.raw(at(0x6041)).unwrap_or_default();
    od.set_raw(at(0x6041), word | bits);
}

/// An object keeps one value, whatever is written.
fn keep(od: &mut dyn Storage, written: Address, index: u16, value: u64) {
    if written == at(index) {
        od.set_raw(written, value);
    }
}

/// An object takes another value than the one written.
fn becomes(od: &mut dyn Storage, written: Address, index: u16, [from, to]: [u64; 2]) {
    if written == at(index) && od.raw(written) == Some(from) {
        od.set_raw(written, to);
    }
}

pub static FAULTS: LazyLock<Vec<DriveFault>> = LazyLock::new(|| {
    vec![
        // States.
        follows("transition 2 is missing", &without(2), "all but 8.4.1/1 8.3/1 8.3/2 8.3/3 8.4.1/8 60E3h/1"),
        follows(
            "transition 3 is missing",
            &without(3),
            "all but 8.1/2 8.1/7 8.4.1/1 8.4.1/2 6040h/1 6040h/2 6041h/1 8.3/1 8.3/2 8.3/3 8.4.1/8 60E3h/1",
        ),
        follows(
            "transition 4 is missing",
            &without(4),
            "all but 8.1/2 8.1/3 8.1/6 8.1/7 8.1/10 8.1/17 8.4.1/1 8.4.1/2 8.4.1/3 6040h/1 6040h/2 6041h/1 8.3/1 8.3/2 8.3/3 \
         6071h/1 8.4.1/8 60FFh/3 60E3h/1",
        ),
        follows("transition 5 is missing", &without(5), "8.1/5 605Ch/1 605Ch/2 607Ah/7"),
        follows("transition 6 is missing", &without(6), "8.1/6"),
        follows("transition 7 is missing", &without(7), "8.1/7 8.1/17 605Bh/1 605Bh/2"),
        follows("transition 8 is missing", &without(8), "8.1/8 605Bh/1 605Bh/2"),
        follows(
            "transition 9 is missing",
            &without(9),
            "8.1/9 8.4.1/6 605Dh/1 605Dh/2 6007h/1 607Dh/1 607Eh/1 607Eh/2 6098h/3",
        ),
        follows("transition 10 is missing", &without(10), "8.1/10 8.1/17 6071h/1 605Ch/1 605Ch/2"),
        follows(
            "transition 11 is missing: a quick stop is ignored",
            &without(11),
            "8.1/11 8.1/12 8.1/16 8.4.1/5 605Ah/1 605Ah/2",
        ),
        follows("transition 12 is missing", &without(12), "8.1/12 605Ah/1 605Ah/2"),
        follows(
            "transition 15 is missing: a fault is not reset",
            &without(15),
            "8.1/15 603Fh/2 605Eh/1 605Eh/2 6007h/1",
        ),
        follows("transition 16 is missing", &without(16), "8.1/16"),
        follows(
            "switch on leads out of SWITCH ON DISABLED",
            &with(State::SwitchOnDisabled, State::SwitchedOn, Command::SwitchOn),
            "8.4.1/1",
        ),
        follows(
            "enable operation leads out of SWITCH ON DISABLED",
            &with(State::SwitchOnDisabled, State::OperationEnabled, Command::EnableOperation),
            "8.4.1/1",
        ),
        follows(
            "fault reset leads out of READY TO SWITCH ON",
            &with(State::ReadyToSwitchOn, State::SwitchOnDisabled, Command::FaultReset),
            "8.4.1/2",
        ),
        follows(
            "fault reset leads out of SWITCHED ON",
            &with(State::SwitchedOn, State::SwitchOnDisabled, Command::FaultReset),
            "8.4.1/3",
        ),
        follows(
            "fault reset leads out of OPERATION ENABLED",
            &with(State::OperationEnabled, State::SwitchOnDisabled, Command::FaultReset),
            "8.4.1/4",
        ),
        follows(
            "shutdown leads out of QUICK STOP ACTIVE",
            &with(State::QuickStopActive, State::ReadyToSwitchOn, Command::Shutdown),
            "8.4.1/5",
        ),
        follows(
            "shutdown leads out of FAULT",
            &with(State::Fault, State::SwitchOnDisabled, Command::Shutdown),
            "8.4.1/7",
        ),
        follows(
            "a fault is reset without an edge of bit 7",
            &with(State::Fault, State::SwitchOnDisabled, Command::DisableVoltage),
            "8.4.1/7 8.4.1/8 603Fh/2 605Eh/1 605Eh/2",
        ),
        frames("a fault is reset by the level of bit 7", "heard 205#8F00 becomes 205#0F00 after 77F#05", "8.4.1/8"),
        frames("a reset does not disable the drive", "heard 000#8105 answered 705#00", "8.1/1"),
        frames("the halt bit keeps the drive from being switched on", "heard 205#0701", "8.4.1/6"),
        frames("RPDO 1 is not received", "heard 205#*", "all but 8.4.1/1 6040h/2 8.3/1 8.3/2 8.3/3 8.4.1/8 60E3h/1"),
        frames("a control word by SDO is ignored", "heard 605#2B406000* answered 585#6040600000000000", "6040h/2"),
        frames("TPDO 1 is not sent", "sent 185#*", "6041h/1"),
        shows(
            "SWITCHED ON looks like READY TO SWITCH ON",
            |servo, _, od| {
                if servo.state() == State::SwitchedOn {
                    clear(od, 1 << 1);
                }
            },
            "all but 8.1/2 8.1/7 8.4.1/1 8.4.1/2 6040h/1 6040h/2 6041h/1 8.3/1 8.3/2 8.3/3 8.4.1/8 60E3h/1",
        ),
        shows(
            "QUICK STOP ACTIVE looks like OPERATION ENABLED",
            |_, _, od| set(od, 1 << 5),
            "8.1/12 8.1/16 8.4.1/5 605Ah/1",
        ),
        shows(
            "FAULT looks like SWITCH ON DISABLED",
            |servo, _, od| {
                if servo.state() == State::Fault {
                    clear(od, 1 << 3);
                    set(od, 1 << 6);
                }
            },
            "8.1/13 8.1/15 8.4.1/7 8.4.1/8 603Fh/1 603Fh/2 605Eh/1 605Eh/2 6007h/1 6007h/2 6065h/1",
        ),
        shows("bit 4 is never set", |_, _, od| clear(od, 1 << 4), "8.4.2/1"),
        shows("bit 9 is never set", |_, _, od| clear(od, 1 << 9), "8.4.2/2"),
        // Modes.
        servo(
            "mode 9 is refused",
            ServoModel {
                check: |_, _, object, value| match (object, value) {
                    (object, 9) if object == at(0x6060) => Err(AbortCode::INVALID_VALUE),
                    _ => Ok(()),
                },
                ..SERVO
            },
            "8.3/1 60FFh/5 60FFh/6 60FFh/7",
        ),
        servo("a mode that 6502h lacks is taken", ServoModel { obeys_supported_modes: false, ..SERVO }, "8.3/2"),
        shows(
            "6061h shows what 6060h has",
            |_, _, od| {
                let mode = od.raw(at(0x6060)).unwrap_or_default();
                od.set_raw(at(0x6061), mode);
            },
            "8.3/2 8.3/3",
        ),
        shows(
            "6061h shows mode 1 in mode 3",
            |servo, _, od| {
                if servo.mode() == Some(Mode::ProfileVelocity) {
                    od.set_raw(at(0x6061), 1);
                }
            },
            "8.3/1 8.3/4 60FFh/1 60FFh/2 60FFh/3 606Ch/1 606Fh/1 60FFh/4 607Eh/2",
        ),
        writes(
            "another mode turns the shaft",
            |servo, now, od, written| {
                if written == at(0x6060) && servo.state() == State::OperationEnabled {
                    servo.set_position(now, od, now.as_micros() as f64 / 1000.0);
                }
            },
            "8.3/4",
        ),
        // Option codes.
        writes(
            "605Ah: the drive does not stay with 5 to 8",
            |_, _, od, written| {
                let value = od.raw(at(0x605A)).unwrap_or_default();
                keep(od, written, 0x605A, if value > 4 { value - 4 } else { value });
            },
            "8.1/12 8.1/16 8.4.1/5 605Ah/1",
        ),
        writes("605Ah: 2 has the ramp of 1", |_, _, od, written| becomes(od, written, 0x605A, [2, 1]), "605Ah/2"),
        writes("605Ah: 6 has the ramp of 5", |_, _, od, written| becomes(od, written, 0x605A, [6, 5]), "605Ah/2"),
        writes("605Bh: 1 is taken as 0", |_, _, od, written| keep(od, written, 0x605B, 0), "605Bh/2"),
        writes("605Ch: 1 is taken as 0", |_, _, od, written| keep(od, written, 0x605C, 0), "605Ch/2"),
        writes("605Dh: 2 has the ramp of 1", |_, _, od, written| becomes(od, written, 0x605D, [2, 1]), "605Dh/2"),
        writes("605Eh: 1 has the ramp of 2", |_, _, od, written| keep(od, written, 0x605E, 2), "605Eh/2"),
        frames(
            "shutdown is ignored after a set-point",
            "heard 205#0600 after 205#1F00 205#0F00 until 205#0000",
            "605Ah/1 605Ah/2 605Bh/1 605Bh/2",
        ),
        frames("halt is ignored", "heard 205#0F01 becomes 205#0F00", "605Dh/1 605Dh/2 607Ah/8 60FFh/4"),
        frames(
            "the end of halt is ignored",
            "heard 205#0F00 becomes 205#0F01 after 205#0F01 until 205#1F00",
            "607Ah/8 60FFh/4",
        ),
        // Faults.
        servo(
            "a lost heartbeat is no fault",
            ServoModel { codes: FaultCodes { connection_lost: None, ..FaultCodes::CIA_402 }, ..SERVO },
            "8.1/13 8.1/15 8.4.1/7 8.4.1/8 603Fh/1 603Fh/2 605Eh/1 605Eh/2 6007h/1 6007h/2",
        ),
        servo(
            "a following error is no fault",
            ServoModel { codes: FaultCodes { following_error: None, ..FaultCodes::CIA_402 }, ..SERVO },
            "6065h/1",
        ),
        frames("NMT stop is ignored", "heard 000#0205", "6007h/2"),
        writes("6007h is always 1", |_, _, od, written| keep(od, written, 0x6007, 1), "6007h/1"),
        shows("603Fh is always 0", |_, _, od| od.set_raw(at(0x603F), 0), "603Fh/1"),
        frames("no emergency comes with a fault", "sent 085#3081*", "603Fh/1"),
        frames("no emergency says that a fault is over", "sent 085#0000*", "603Fh/2"),
        // Profile position mode.
        shows(
            "no set-point is acknowledged",
            |servo, _, od| {
                if servo.mode() == Some(Mode::ProfilePosition) {
                    clear(od, 1 << 12);
                }
            },
            "605Ah/1 605Ah/2 605Bh/1 605Bh/2 605Ch/1 605Ch/2 605Dh/1 605Dh/2 8.1/13 605Eh/1 605Eh/2 607Ah/1 607Ah/2 607Ah/3 607Ah/4 607Ah/5 607Ah/6 607Ah/7 607Ah/8 607Ah/10 607Dh/1 607Eh/1 6081h/1 6083h/1 6084h/1 6068h/1",
        ),
        frames(
            "the acknowledge ends before bit 4 falls",
            "sent 585#4B416000..1.* becomes 585#4B416000..0.* after 205#1F00 585#4B416000..1.* until 205#0F00",
            "607Ah/1",
        ),
        frames(
            "the acknowledge does not end",
            "sent 585#4B416000..0.* becomes 585#4B416000..1.* after 205#1F00 585#4B416000..1.* until 205#0000",
            "605Ah/1 605Ah/2 605Bh/1 605Bh/2 605Ch/1 605Ch/2 605Dh/1 605Dh/2 8.1/13 605Eh/1 605Eh/2 607Ah/1 607Ah/2 607Ah/3 607Ah/4 607Ah/5 607Ah/6 607Ah/7 607Ah/8 607Ah/10 607Dh/1 607Eh/1 6081h/1 6083h/1 6084h/1 6068h/1",
        ),
        shows(
            "bit 10 is set while the drive travels",
            |servo, now, od| {
                if servo.mode() == Some(Mode::ProfilePosition) && servo.is_moving(now) {
                    set(od, 1 << 10);
                }
            },
            "607Ah/2 607Ah/3",
        ),
        shows(
            "bit 10 is never set",
            |_, _, od| clear(od, 1 << 10),
            "607Ah/1 607Ah/2 607Ah/3 607Ah/4 607Ah/5 607Ah/6 607Ah/7 607Ah/8 607Ah/10 607Dh/1 607Eh/1 6081h/1 6083h/1 6084h/1 6068h/1 60FFh/1 606Ch/1 60FFh/4 6098h/1",
        ),
        shows(
            "bit 10 is not set while the drive is halted",
            |_, _, od| {
                if od.raw(at(0x6040)).unwrap_or_default() & 1 << 8 != 0 {
                    clear(od, 1 << 10);
                }
            },
            "607Ah/8 60FFh/4",
        ),
        frames("relative set-points are taken as absolute", "heard 205#5F00 becomes 205#1F00", "607Ah/3"),
        servo("a set-point with bit 5 waits", ServoModel { at_once: 0, ..SERVO }, "607Ah/4"),
        servo("a set-point without bit 5 does not wait", ServoModel { at_once: 1 << 4, ..SERVO }, "607Ah/5"),
        writes(
            "607Ah counts without an edge of bit 4",
            |servo, now, od, written| {
                let waits = od.raw(at(0x6041)).unwrap_or_default() & 1 << 12 != 0;
                if written == at(0x607A) && servo.mode() == Some(Mode::ProfilePosition) && waits {
                    let target = od.number(at(0x607A)).unwrap_or_default();
                    servo.set_position(now, od, target as f64);
                }
            },
            "607Ah/6",
        ),
        frames(
            "a set-point is acknowledged in SWITCHED ON",
            "sent 585#4B416000..0.* becomes 585#4B416000..1.* after 205#1700 until 205#0700",
            "607Ah/7",
        ),
        writes(
            "607Dh limits nothing",
            |_, _, od, written| {
                if written.index() == 0x607D {
                    od.set_raw(written, 0);
                }
            },
            "607Dh/1",
        ),
        writes("607Eh inverts nothing", |_, _, od, written| keep(od, written, 0x607E, 0), "607Eh/1 607Eh/2"),
        shows(
            "the drive runs past its target, and comes back",
            |servo, now, od| {
                if servo.mode() == Some(Mode::ProfilePosition) && servo.is_moving(now) {
                    let [position, target] = [0x6064, 0x607A].map(|object| od.number(at(object)).unwrap_or_default());
                    if (0..5).contains(&(target - position)) {
                        od.set_raw(at(0x6064), (target + 30) as u64);
                    }
                }
            },
            "607Ah/10",
        ),
        writes(
            "the drive runs on past its target",
            |servo, _, od, written| {
                let position = od.number(at(0x6064)).unwrap_or_default();
                let target = od.number(written).unwrap_or_default();
                if servo.mode() == Some(Mode::ProfilePosition) && target > position {
                    keep(od, written, 0x607A, (target + 100_000) as u64);
                }
            },
            "605Dh/2 607Ah/1 607Ah/2 607Ah/3 607Ah/5 607Ah/6 607Ah/8 607Ah/10 607Dh/1 607Eh/1 6081h/1 6083h/1 6084h/1 6068h/1",
        ),
        writes("6068h is ignored", |_, _, od, written| keep(od, written, 0x6068, 0), "6068h/1"),
        writes("6081h is ignored", |_, _, od, written| keep(od, written, 0x6081, 100), "6081h/1"),
        writes("6083h is ignored", |_, _, od, written| keep(od, written, 0x6083, 10_000), "6083h/1"),
        writes(
            "6084h is ignored",
            |_, _, od, written| keep(od, written, 0x6084, 10_000),
            "605Ah/2 605Bh/2 605Ch/2 605Dh/2 605Eh/2 6084h/1",
        ),
        // Profile velocity mode.
        writes(
            "60FFh turns the drive the other way",
            |_, _, od, written| {
                let turned = -od.number(at(0x60FF)).unwrap_or_default();
                keep(od, written, 0x60FF, turned as u64);
            },
            "60FFh/1 60FFh/2 606Ch/1 60FFh/4 607Eh/2 60FFh/5",
        ),
        writes(
            "60FFh: 0 is ignored while the drive turns",
            |servo, now, od, written| {
                if servo.is_moving(now) {
                    becomes(od, written, 0x60FF, [0, 100]);
                }
            },
            "60FFh/2 606Fh/1 60FFh/5",
        ),
        shows(
            "the drive turns in SWITCHED ON",
            |servo, now, od| {
                if servo.state() == State::SwitchedOn && servo.mode() == Some(Mode::ProfileVelocity) {
                    od.set_raw(at(0x6064), now.as_micros() / 1000);
                }
            },
            "60FFh/3",
        ),
        shows(
            "606Ch is three times the velocity",
            |_, _, od| {
                let velocity = od.number(at(0x606C)).unwrap_or_default();
                od.set_raw(at(0x606C), (3 * velocity) as u64);
            },
            "606Ch/1",
        ),
        shows(
            "bit 12 does not say that the drive stands",
            |servo, _, od| {
                if servo.mode() == Some(Mode::ProfileVelocity) {
                    clear(od, 1 << 12);
                }
            },
            "606Fh/1",
        ),
        // Homing.
        shows(
            "homing is never attained",
            |servo, _, od| {
                if servo.mode() == Some(Mode::Homing) {
                    clear(od, 1 << 12);
                }
            },
            "6098h/1",
        ),
        shows(
            "homing is attained before it begins",
            |servo, _, od| {
                if servo.mode() == Some(Mode::Homing) {
                    set(od, 1 << 12);
                }
            },
            "6098h/2 6098h/3",
        ),
        shows(
            "homing leads to another position than 607Ch",
            |servo, _, od| {
                if servo.is_homed() {
                    let position = od.number(at(0x6064)).unwrap_or_default();
                    od.set_raw(at(0x6064), (position + 10) as u64);
                }
            },
            "6098h/1",
        ),
        writes(
            "a reserved homing method is taken as 37",
            |_, _, od, written| {
                becomes(od, written, 0x6098, [15, 37]);
                becomes(od, written, 0x6098, [31, 37]);
            },
            "6098h/3",
        ),
        servo(
            "homing method 1 is refused",
            ServoModel {
                check: |_, _, object, value| match (object, value) {
                    (object, 1) if object == at(0x6098) => Err(AbortCode::INVALID_VALUE),
                    _ => Ok(()),
                },
                ..SERVO
            },
            "60E3h/1",
        ),
        // Cyclic modes.
        frames("SYNC is not heard", "heard 080#", "6065h/1 607Ah/9 60FFh/5 607Ah/11 60FFh/6 60C1h/1"),
        frames("in mode 8, set-points by RPDO are not taken", "heard 305#0F00*", "607Ah/11"),
        frames("in mode 9, set-points by RPDO are not taken", "heard 305#........", "60FFh/6"),
        frames(
            "in mode 8, a second set-point by RPDO is followed without SYNC",
            "heard 305#* becomes 080# after 305#0F00* until 080#",
            "607Ah/12",
        ),
        frames(
            "in mode 9, a second set-point by RPDO is followed without SYNC",
            "heard 305#* becomes 080# after 305#........ until 080#",
            "60FFh/7",
        ),
        frames("in mode 7, 60C1h:01 is not followed", "heard 605#23C16001* answered 585#60C1600100000000", "60C1h/1"),
        frames("in mode 7, bit 4 does not matter", "heard 205#0F00 becomes 205#1F00 after 605#2F60600007*", "60C1h/2"),
        shows(
            "in SWITCHED ON, the drive turns by its torque",
            |servo, now, od| {
                let is_switched_on = servo.state() == State::SwitchedOn;
                if is_switched_on && matches!(servo.mode(), Some(Mode::ProfileTorque | Mode::CyclicTorque)) {
                    od.set_raw(at(0x6064), now.as_micros() / 1000);
                }
            },
            "6071h/1",
        ),
        shows(
            "bit 12 does not say that the drive follows",
            |servo, _, od| {
                if servo.mode() == Some(Mode::CyclicPosition) {
                    clear(od, 1 << 12);
                }
            },
            "607Ah/9",
        ),
    ]
});
