//! The behaviour of the simulated AKD, asked by its script, and by comparing states, errors and refusals.

use std::sync::LazyLock;

use kollmorgen_akd::fault;
use lexican_runtime::profile::cia402::{Mode, State};

use super::simulated::Simulated;
use crate::kinds::cia402::{bring_to, distinguishes_states};
use crate::rig::{Rig as OnBus, once};
use crate::script::Clauses;
use crate::script::Script;

type Rig = OnBus<Simulated>;

const SYSTEM: u16 = 0x1002;
const STATUS: u16 = 0x6041;

pub(super) static SCRIPT: LazyLock<Script> = LazyLock::new(|| Script::parse(include_str!("../../../scripts/akd.txt")));

/// What the simulated drive does where the manual leaves it open.
pub(super) static LEFT_OPEN: LazyLock<Script> =
    LazyLock::new(|| Script::parse(include_str!("../../../scripts/akd_beyond.txt")));

fn clauses(key: &str) -> Option<Clauses> {
    SCRIPT.clauses::<Simulated>(key)
}

/// Whether a bit is set exactly while what it shows is true.
pub(super) fn shown(index: u16, of: u8) -> Option<bool> {
    let states = [State::SwitchOnDisabled, State::SwitchedOn, State::QuickStopActive, State::Fault];
    let in_states = |holds: fn(State) -> bool| {
        let brought = states.into_iter().filter_map(|state| Some((holds(state), bring_to::<Simulated>(state)?)));
        brought.into_iter().all(|(holds, rig)| rig.number(index, 0) >> of & 1 == i64::from(holds))
    };
    match (index, of) {
        (SYSTEM, 14) => {
            let agree = |state| bring_to::<Simulated>(state).is_some_and(|rig| rig.is_powered() != rig.is_unpowered());
            Some(
                in_states(|state| matches!(state, State::SwitchedOn | State::QuickStopActive))
                    && states.into_iter().all(agree),
            )
        }
        (SYSTEM, 15) => Some(in_states(|state| state == State::Fault)),
        (SYSTEM, 19) => Some(in_states(|state| state == State::QuickStopActive)),
        (STATUS, 9) => Some(in_states(|_| true)),
        (STATUS, 0..=3 | 5 | 6) => Some(distinguishes_states::<Simulated>(of.into())),
        _ => {
            let found = once::<Simulated, _>((index, of), || clauses(&format!("{index:04X} bit {of}")));
            found.map(|clauses| clauses.iter().all(|(_, holds)| *holds))
        }
    }
}

/// Whether the drive homes by a method.
pub(super) fn homes(method: i8) -> bool {
    SCRIPT.holds::<Simulated>(&format!("homed {method}"))
}

/// What the drive does at a state change (6.4.1.2).
pub(super) fn action(number: u8) -> Clauses {
    clauses(&format!("transition {number}")).unwrap_or_default()
}

/// What an NMT command does (5.4.1).
pub(super) fn effect(command: u8) -> Clauses {
    clauses(&format!("NMT {command:02X}")).unwrap_or_default()
}

/// What a bit of the control word or status word does in a mode, or that it is reserved.
pub(super) fn mode_bit(object: u16, of: u8, mode: Mode) -> &'static str {
    let code = kollmorgen_akd::sim::MODEL.modes.code(mode).unwrap_or_default();
    if let Some(clauses) = clauses(&format!("{object:04X} bit {of} in mode {code}")) {
        return clauses.into_iter().find_map(|(meaning, holds)| holds.then_some(meaning)).unwrap_or_default();
    }
    // A reserved bit has no effect: the drive runs in the same way, and shows the same.
    let with = |word: u16| {
        let mut rig = Rig::enabled_in(mode);
        let _ = [rig.put(0x60FF, 0, 1000), rig.put(0x6071, 0, 100), rig.put(0x607A, 0, 500)];
        rig.control(word);
        rig.hear(1000);
        (rig.position(), rig.status())
    };
    if object == 0x6040 && with(0x0F) == with(0x0F | 1 << of) { "reserved" } else { "" }
}

/// The EMCY of an error, and whether it leads to FAULT.
pub(super) fn raised(code: u16) -> (Vec<u8>, bool) {
    let mut rig = Rig::operational();
    let is_fault = fault::FAULTS.iter().any(|known| known.number == code);
    rig.see(|drive, now| {
        drive.set_inputs(now, |inputs| {
            let cause = if is_fault { &mut inputs.faults } else { &mut inputs.warnings };
            *cause = code.into();
        });
    });
    let heard = rig.hear_from(Rig::own(0x80), 0).pop().unwrap_or_default();
    (heard, rig.state() == State::Fault)
}

/// The code with which the drive refuses what a row describes (5.4.5.6).
pub(super) fn refused(meaning: &str) -> Option<u32> {
    let mut rig = Rig::new();
    match meaning {
        "Command specifier invalid" => {
            let answer = rig.sdo(&[0xE0, 0, 0x10, 0, 0, 0, 0, 0])?;
            (answer[0] == 0x80).then(|| u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]]))
        }
        "Attempted read access to a write-only object" => rig.read(0x2026, 1).err(),
        "Attempted write access to a read-only object" => rig.put(0x1000, 0, 0).err(),
        "Object does not exist in Object Dictionary" => rig.read(0x5FFF, 0).err(),
        "Object cannot be mapped to a PDO" => {
            rig.put(0x1600, 0, 0).ok().and_then(|()| rig.put(0x1600, 1, 0x1017_0010).err())
        }
        "Size and number of mapped objects exceed permissible PDO length" => {
            let entries = [0x607A_0020, 0x60FF_0020, 0x6081_0020];
            let taken = rig.put(0x1600, 0, 0).is_ok();
            let written = (1..).zip(entries).map(|(sub, mapped)| rig.put(0x1600, sub, mapped)).collect::<Vec<_>>();
            let count = rig.put(0x1600, 0, 3);
            written.into_iter().chain([count]).find_map(Result::err).filter(|_| taken)
        }
        "Data type incompatible, length of service parameter is incompatible" => rig.write(0x6081, 0, 0, 2).err(),
        "Subindex does not exist" => rig.read(0x6099, 3).err(),
        "Outside value range for the parameter (only for write access)" => {
            // Half a millisecond.
            let units = rig.put(0x60C2, 1, 5).is_ok();
            rig.put(0x60C2, 2, -4).err().filter(|_| units)
        }
        "Parameter value too high" => rig.put(0x6060, 0, 9).err(),
        "Parameter value too low" => rig.put(0x6060, 0, 0).err(),
        "Data cannot be transmitted or saved" => rig.put(0x1010, 1, 1).err(),
        "Data cannot be transmitted or saved because of device status" => {
            rig.nmt(0x01);
            rig.put(0x1600, 0, 0).err()
        }
        _ => None,
    }
}
