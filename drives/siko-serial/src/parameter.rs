//! The commands of the parameters: the rows of [`od::serial`](siko_ag02::od::serial), from the overlay of the data
//! sheet.
//!
//! The number of a row consists of the command that reads it, as far as it names the parameter, and the command that
//! writes it: `E1/F1`, `Q/X`, `T`.

use lexican_runtime::object::{Address, ParameterRow};
use siko_ag02::od::serial::{self, TABLE};

use crate::answer::{Answer, Flags};
use crate::command::{Command, Long, Mode, PosType, Short, Turning};
use crate::telegram;

/// A parameter of the serial port.
pub type Row = ParameterRow<&'static str>;

/// Parameter 18.
pub const SENSE_OF_ROTATION: Address = object(serial::SENSE_OF_ROTATION.row());
/// Parameter 19.
pub const POS_TYPE: Address = object(serial::POS_TYPE.row());
/// Parameter 20.
pub const MODE: Address = object(serial::OPERATING_MODE.row());

const fn object(row: Row) -> Address {
    row.object.expect("the overlay has its object")
}

/// The command that reads a parameter; `None` if it can only be written.
#[must_use]
pub fn reading(row: &Row) -> Option<Command> {
    let (read, _) = row.number.split_once('/')?;
    Command::parse(read.as_bytes()).ok()
}

/// The command that writes a number of the port to a parameter; `None` if the parameter does not take it.
#[must_use]
pub fn writing(row: &Row, number: i64) -> Option<Command> {
    let write = row.number.split('/').next_back()?.as_bytes();
    match write.split_first()? {
        (b'F', which) => {
            let long = Long::from_number(telegram::decimal(which)?)?;
            Some(Command::WriteLong(long, i32::try_from(number).ok()?))
        }
        (b'H', which) => {
            let short = Short::from_number(telegram::decimal(which)?)?;
            Some(Command::WriteShort(short, u32::try_from(number).ok()?))
        }
        (letter, _) => {
            let digit = b'0'.checked_add(u8::try_from(number).ok()?)?;
            Command::parse(&[*letter, digit]).ok()
        }
    }
}

/// The number of a parameter in the answer to its reading command. Three parameters are bits of the flag register.
#[must_use]
pub fn answered(row: &Row, answer: Answer) -> Option<i64> {
    let Answer::Flags(Flags(bits)) = answer else { return answer.number().map(i64::from) };
    Some(match object(*row) {
        SENSE_OF_ROTATION => i64::from(bits & Flags::SENSE_E != 0),
        POS_TYPE => i64::from((bits & (Flags::LOOP_POSITIVE | Flags::LOOP_NEGATIVE)) >> 1),
        MODE => i64::from(bits & Flags::VELOCITY != 0),
        _ => return None,
    })
}

fn object_of(names: Command, mode: Mode) -> Address {
    let is = |row: &&Row| {
        let is_now = row.when.is_none_or(|when| when.holds(mode.in_object().into()));
        is_now && reading(row) == Some(names)
    };
    object(*TABLE.iter().find(is).expect("the overlay has every parameter that can be read"))
}

impl Long {
    /// The object with the same number in the same unit. That of the set-point depends on the mode.
    #[must_use]
    pub fn object(self, mode: Mode) -> Address {
        object_of(Command::ReadLong(self), mode)
    }
}

impl Short {
    /// The object with the same number in the same unit.
    #[must_use]
    pub fn object(self) -> Address {
        object_of(Command::ReadShort(self), Mode::Positioning)
    }
}

/// The number in the object for a number of the port.
fn in_object(row: Row, number: u16) -> Option<u8> {
    row.in_object(number.into()).and_then(|number| number.try_into().ok())
}

impl PosType {
    /// The number in [`POS_TYPE`], which is that of the port.
    #[must_use]
    pub fn in_object(self) -> u8 {
        in_object(serial::POS_TYPE.row(), self.number()).unwrap_or_default()
    }
}

impl Turning {
    /// The number in [`SENSE_OF_ROTATION`]; `None` for parameter 25, for which the AG02 has no object.
    #[must_use]
    pub fn in_object(self) -> Option<u8> {
        let is_other = serial::STOP_MODE_INCHING_MODE_2.row().in_object(self.number().into()).is_some();
        if is_other { None } else { in_object(serial::SENSE_OF_ROTATION.row(), self.number()) }
    }
}

impl Mode {
    /// The number in [`MODE`]: one more than that of the port.
    #[must_use]
    pub fn in_object(self) -> u8 {
        in_object(serial::OPERATING_MODE.row(), self.number()).unwrap_or_default()
    }
}
