//! The command for each object, and the value of the object in its answer.

use lexican_runtime::object::Address;
use lexican_runtime::{AbortCode, cia301};
use siko_ag02::fault::FAULTS;
use siko_ag02::od;
use siko_ag02::od::serial::TABLE;

use crate::answer::Answer;
use crate::command::{Command, Identity, Setting};
use crate::parameter::{self, Row};

/// The code for a letter that is not in table 2: 1000h is "generic error" in CiA 301.
const UNKNOWN_FAULT: u16 = 0x1000;

const POSITION: Address = Address::new(0x6064, 0x00);
const VELOCITY: Address = Address::new(0x606C, 0x00);
const SOFTWARE_VERSION: Address = Address::new(0x100A, 0x00);
const GEAR: Address = od::GEAR_REDUCTION.address();

/// The parameter with this object. The gateway itself knows which of the two targets the set-point is.
fn row(address: Address) -> Option<&'static Row> {
    TABLE.iter().find(|row| row.object == Some(address))
}

pub(super) fn read(address: Address) -> Option<Command> {
    match address {
        POSITION => Some(Command::Position),
        VELOCITY => Some(Command::Velocity),
        SOFTWARE_VERSION => Some(Command::Identity(Identity::Software)),
        GEAR => Some(Command::Identity(Identity::Gear)),
        _ => match (address.index(), address.sub()) {
            (cia301::PREDEFINED_ERROR_FIELD, 0) => Some(Command::FaultCount),
            (cia301::PREDEFINED_ERROR_FIELD, 1..=10) => Some(Command::Faults),
            _ => parameter::reading(row(address)?),
        },
    }
}

/// The command that writes an object.
///
/// Errors: the abort code for the client; [`AbortCode::NO_SUCH_OBJECT`] for an object that the interface does not
/// write.
pub(super) fn write(address: Address, value: i64) -> Result<Command, AbortCode> {
    let settings =
        [Setting::AllParameters, Setting::StandardParameters, Setting::ControllerParameters, Setting::Calibrate];
    match (address.index(), address.sub()) {
        (cia301::PREDEFINED_ERROR_FIELD, 0) if value == 0 => Ok(Command::Set(Setting::ClearFaults)),
        (cia301::PREDEFINED_ERROR_FIELD, 0) => Err(AbortCode::INVALID_VALUE),
        (cia301::RESTORE_DEFAULT_PARAMETERS, sub @ 1..=4) => {
            let setting = settings.get(usize::from(sub) - 1).filter(|_| value == LOAD);
            setting.copied().map(Command::Set).ok_or(AbortCode::INVALID_VALUE)
        }
        _ => {
            let row = row(address).ok_or(AbortCode::NO_SUCH_OBJECT)?;
            let number = row.of_object(value).ok_or(AbortCode::INVALID_VALUE)?;
            parameter::writing(row, number).ok_or(AbortCode::INVALID_VALUE)
        }
    }
}

/// Whether the interface has an object.
pub(super) fn has(address: Address) -> bool {
    read(address).is_some() || write(address, LOAD) != Err(AbortCode::NO_SUCH_OBJECT)
}

/// The value that restores when written to 1011h.
const LOAD: i64 = u32::from_le_bytes(*b"load") as i64;

/// The value of an object in the answer to its reading command.
pub(super) fn value(address: Address, answer: Answer) -> Option<i64> {
    Some(match answer {
        // 1003h has the newest fault first.
        Answer::Letters(letters) => {
            let newest = letters.iter().rev().skip_while(|letter| **letter == b'-');
            newest.copied().nth(usize::from(address.sub()) - 1).map_or(0, code).into()
        }
        Answer::Text(text) if address == GEAR => gear(&text),
        Answer::Text(text) => version(&text),
        answer => match row(address) {
            Some(row) => row.in_object(parameter::answered(row, answer)?)?,
            None => answer.number()?.into(),
        },
    })
}

fn code(letter: u8) -> u16 {
    let fault = FAULTS.iter().find(|fault| fault.letter() == char::from(letter));
    fault.map_or(UNKNOWN_FAULT, |fault| fault.code.number)
}

/// The manual does not say how the gear is written. The three gears are told apart by their number of turns.
fn gear(text: &[u8]) -> i64 {
    let turns = str::from_utf8(text).unwrap_or_default().trim().split(':').next().unwrap_or_default();
    i64::from(match turns {
        "55" => od::GearReduction::GEAR_55_1.0,
        "62" => od::GearReduction::GEAR_62_1.0,
        "135" => od::GearReduction::GEAR_135_1.0,
        _ => 0,
    })
}

/// 100Ah has four characters, the first one in bits 31 to 24.
fn version(text: &[u8]) -> i64 {
    let text = text.trim_ascii();
    let text = text.strip_prefix(b"0").filter(|rest| rest.len() >= 4).unwrap_or(text);
    text.iter().copied().chain(std::iter::repeat(0)).take(4).fold(0, |number, byte| number << 8 | i64::from(byte))
}
