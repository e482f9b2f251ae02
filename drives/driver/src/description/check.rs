//! Checks of a description.

use lexican_runtime::profile::cia402::State;

use super::{Description, Number, Pdo, Test, Word};
use crate::fault::ByteOrder;
use crate::mode::Mode;

/// The COB-IDs of the predefined connection set (CiA 301, 7.3.5), by which the driver finds the parameters of a PDO.
const RECEIVE: [u16; 4] = [0x200, 0x300, 0x400, 0x500];
const TRANSMIT: [u16; 4] = [0x180, 0x280, 0x380, 0x480];

impl Description {
    /// What cannot be right in it, one sentence each. For the tests of a drive's crate.
    #[must_use]
    pub fn findings(&self) -> Vec<String> {
        let mut findings = Vec::new();
        let mut find = |wrong: bool, what: String| {
            if wrong {
                findings.push(what);
            }
        };
        let outputs = [self.outputs.control, self.outputs.position, self.outputs.velocity];
        let outputs = outputs.iter().flatten().map(|pdo| (pdo, RECEIVE));
        for (pdo, predefined) in outputs.chain(self.inputs.iter().map(|pdo| (pdo, TRANSMIT))) {
            let (base, size) = (pdo.base, pdo.size(self));
            find(size > 8, format!("the PDO {base:X}h has {size} bytes"));
            find(!predefined.contains(&base), format!("the COB-ID {base:X}h is not that of such a PDO"));
        }
        for (number, what) in self.moved() {
            find(!number.fits_i32(), format!("{} is no {what} of 32 bits with a sign", number.address()));
        }
        for test in self.tests() {
            let nowhere = test.word == Word::System && self.objects.system_word.is_none();
            find(nowhere, format!("bits {:X}h of a status register that is not there", test.mask));
        }
        for bits in [self.control.idle, self.control.new_setpoint, self.control.stop] {
            find(bits & 0x8F != 0, format!("{bits:04X}h has bits of commands"));
        }
        for (from, to) in [
            (State::SwitchOnDisabled, State::OperationEnabled),
            (State::OperationEnabled, State::SwitchOnDisabled),
            (State::Fault, State::SwitchOnDisabled),
        ] {
            find(self.transitions.next(from, to).is_none(), format!("no way leads from {from} to {to}"));
        }
        let [positioning, velocity] = [Mode::Positioning, Mode::Velocity].map(|mode| self.code_of(mode).is_some());
        find(!positioning && !velocity, "neither positioning nor velocity mode".to_owned());
        let runs = velocity || self.code_of(Mode::CyclicVelocity).is_some();
        find(self.velocity.is_some() && !runs, "velocities without a velocity mode".to_owned());
        let torque = Mode::ALL.iter().any(|mode| mode.in_profile().is_torque() && self.code_of(*mode).is_some());
        find(self.torque.is_none() && torque, "a torque mode without torques".to_owned());
        for code in self.codes() {
            let same = self.codes().filter(|other| *other == code).count() > 1;
            find(same, format!("the code {code:04X} twice"));
            let mirrored = self.codes.order == ByteOrder::Either
                && code != code.swap_bytes()
                && self.codes().any(|other| other == code.swap_bytes());
            find(mirrored, format!("the code {code:04X} is a mirror image"));
        }
        findings
    }

    /// Positions and velocities, which are INTEGER32 in CiA 402.
    fn moved(&self) -> impl Iterator<Item = (Number, &'static str)> {
        let positions = [self.objects.actual_position, self.objects.target_position];
        let limits = self.objects.position_limits.into_iter().flatten();
        let velocities = [self.objects.actual_velocity, self.velocity.map(|velocity| velocity.target)];
        let velocities = velocities.into_iter().flatten().map(|number| (number, "velocity"));
        positions.into_iter().chain(limits).map(|number| (number, "position")).chain(velocities)
    }

    fn tests(&self) -> impl Iterator<Item = Test> {
        let conditions = self.conditions.iter().map(|row| row.when);
        let status = [self.status.positioning, self.status.moving, self.referenced];
        let modes = [self.velocity.map(|velocity| velocity.reached), self.inching.and_then(|inching| inching.busy)];
        conditions.chain(status.into_iter().chain(modes).flatten())
    }

    fn codes(&self) -> impl Iterator<Item = u16> {
        self.codes.faults.iter().chain(self.codes.notices).map(|code| code.number)
    }
}

impl Pdo {
    /// In bytes.
    pub(super) fn size(&self, description: &Description) -> usize {
        self.signals.iter().map(|signal| description.carried_bytes(*signal)).sum()
    }
}

#[cfg(test)]
mod tests {
    use lexican_runtime::Duration;
    use lexican_runtime::object::DataType;
    use lexican_runtime::profile::cia402::{self, Modes, Transitions};

    use super::*;
    use crate::description::{Condition, ControlBits, Inching, Orders, Outputs, Signal};
    use crate::error::Missing;
    use crate::fault::{Code, Codes};

    const NOWHERE: &[Condition] =
        &[Condition { when: Test::of_system(1 << 10), refuses: Orders::MOVE, missing: Missing::Supply }];
    const TWICE: &[Code] = &[code(0x2100), code(0x2100)];
    const MIRRORED: &[Code] = &[code(0x8120), code(0x2081)];

    const fn code(number: u16) -> Code {
        Code { number, label: "", text: "" }
    }

    #[track_caller]
    fn check(description: Description, findings: &[&str]) {
        assert_eq!(description.findings(), findings);
    }

    #[test]
    fn nothing_is_wrong_with_cia_402() {
        check(Description::CIA_402, &[]);
    }

    #[test]
    fn what_cannot_be_right_is_found() {
        let base = Description::CIA_402;
        let long = Pdo { base: 0x200, signals: &[Signal::ControlWord, Signal::Other(7)] };
        check(
            Description { outputs: Outputs { control: Some(long), ..base.outputs }, ..base },
            &["the PDO 200h has 9 bytes"],
        );
        let elsewhere = Pdo { base: 0x180, signals: &[Signal::ControlWord] };
        check(
            Description { outputs: Outputs { control: Some(elsewhere), ..base.outputs }, ..base },
            &["the COB-ID 180h is not that of such a PDO"],
        );
        let mut objects = base.objects;
        objects.actual_position = Number::new(0x6064, 0x00, DataType::Unsigned32);
        check(Description { objects, ..base }, &["6064:00 is no position of 32 bits with a sign"]);
        check(Description { conditions: NOWHERE, ..base }, &["bits 400h of a status register that is not there"]);
        let inching = Inching {
            step: 1 << 13,
            positive: 1 << 14,
            negative: 1 << 15,
            width: Number::new(0x2415, 0x00, DataType::Integer32),
            busy: Some(Test::of_system(1 << 11)),
            begins: Duration::from_millis(50),
        };
        check(Description { inching: Some(inching), ..base }, &["bits 800h of a status register that is not there"]);
        check(
            Description { control: ControlBits { stop: 1 << 3, ..base.control }, ..base },
            &["0008h has bits of commands"],
        );
        check(
            Description { transitions: Transitions(&[]), ..base },
            &[
                "no way leads from SWITCH ON DISABLED to OPERATION ENABLED",
                "no way leads from OPERATION ENABLED to SWITCH ON DISABLED",
                "no way leads from FAULT to SWITCH ON DISABLED",
            ],
        );
        let mut modes = base.modes;
        modes.codes = Modes(&[(1, cia402::Mode::ProfilePosition)]);
        check(Description { modes, ..base }, &["velocities without a velocity mode"]);
        modes.codes = Modes(&[(6, cia402::Mode::Homing)]);
        check(Description { modes, velocity: None, ..base }, &["neither positioning nor velocity mode"]);
        check(
            Description { codes: Codes { faults: TWICE, ..base.codes }, ..base },
            &["the code 2100 twice", "the code 2100 twice"],
        );
        check(
            Description { codes: Codes { notices: MIRRORED, order: ByteOrder::Either, ..base.codes }, ..base },
            &["the code 8120 is a mirror image", "the code 2081 is a mirror image"],
        );
    }
}
