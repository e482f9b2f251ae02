//! Parameters in cyclic data (PKW). The master repeats one task until it is answered, and the slave repeats the answer
//! until there is another task.
//!
//! A PKW has four words: PKE (identifier, and number of the parameter), IND (index of an element), and PWE (the value;
//! a single word is in the second of the two).

mod master;
mod server;
mod typed;

use core::fmt;

pub use master::{Event, PkwMaster};
pub use server::{Access, Format, Parameter, ParameterTable, PkwServer};

/// The four words. The bit for spontaneous messages (SPM) is not used; it is read as 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pkw {
    /// AK: the identifier of the task or of the reply, 0 to 15.
    pub identifier: u8,
    /// PNU: the number of the parameter, 0 to 2047.
    pub number: u16,
    /// IND.
    pub index: u16,
    /// PWE.
    pub value: u32,
}

impl Pkw {
    /// In bytes.
    pub const LEN: usize = 8;

    /// Reads the first eight bytes; `None` if there are fewer.
    #[must_use]
    pub fn parse(data: &[u8]) -> Option<Self> {
        let &[a, b, c, d, e, f, g, h] = data.first_chunk()?;
        let key = u16::from_be_bytes([a, b]);
        Some(Pkw {
            identifier: (key >> 12) as u8,
            number: key & 0x7FF,
            index: u16::from_be_bytes([c, d]),
            value: u32::from_be_bytes([e, f, g, h]),
        })
    }

    /// Its bytes.
    #[must_use]
    pub fn bytes(self) -> [u8; 8] {
        let key = u16::from(self.identifier & 0xF) << 12 | self.number & 0x7FF;
        let ([a, b], [c, d]) = (key.to_be_bytes(), self.index.to_be_bytes());
        let [e, f, g, h] = self.value.to_be_bytes();
        [a, b, c, d, e, f, g, h]
    }
}

/// `13FA 0000 0000 2710`, as manuals print it.
impl fmt::Display for Pkw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b, c, d, e, g, h, i] = self.bytes();
        write!(f, "{a:02X}{b:02X} {c:02X}{d:02X} {e:02X}{g:02X} {h:02X}{i:02X}")
    }
}

/// A task of the master.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Task {
    /// 1: reads a parameter.
    Read { number: u16 },
    /// 2 and 3: writes a parameter.
    Write { number: u16, value: Value },
    /// 4: reads an element of the description of a parameter.
    ReadDescription { number: u16, index: u16 },
    /// 5: writes an element of the description.
    WriteDescription { number: u16, index: u16, value: u32 },
    /// 6: reads an element of an array.
    ReadElement { number: u16, index: u16 },
    /// 7 and 8: writes an element of an array.
    WriteElement { number: u16, index: u16, value: Value },
    /// 9: reads the number of elements of an array.
    CountElements { number: u16 },
}

/// A value with its width.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Value {
    /// In one word.
    Word(u16),
    /// In two.
    DoubleWord(u32),
}

impl Value {
    /// The value without its width.
    #[must_use]
    pub const fn raw(self) -> u32 {
        match self {
            Value::Word(word) => word as u32,
            Value::DoubleWord(double_word) => double_word,
        }
    }

    const fn of(is_double: bool, raw: u32) -> Self {
        if is_double { Value::DoubleWord(raw) } else { Value::Word(raw as u16) }
    }

    const fn is_double(self) -> bool {
        matches!(self, Value::DoubleWord(_))
    }
}

impl Task {
    /// The task of a PKW: `Ok(None)` for no task (0).
    ///
    /// Errors: the identifier, if it is not one of a task.
    pub fn parse(pkw: Pkw) -> Result<Option<Self>, u8> {
        let Pkw { identifier, number, index, value } = pkw;
        Ok(Some(match identifier {
            0 => return Ok(None),
            1 => Task::Read { number },
            2 | 3 => Task::Write { number, value: Value::of(identifier == 3, value) },
            4 => Task::ReadDescription { number, index },
            5 => Task::WriteDescription { number, index, value },
            6 => Task::ReadElement { number, index },
            7 | 8 => Task::WriteElement { number, index, value: Value::of(identifier == 8, value) },
            9 => Task::CountElements { number },
            other => return Err(other),
        }))
    }

    /// The PKW that carries it.
    #[must_use]
    pub fn pkw(self) -> Pkw {
        let (identifier, number, index, value) = match self {
            Task::Read { number } => (1, number, 0, 0),
            Task::Write { number, value } => (2 + u8::from(value.is_double()), number, 0, value.raw()),
            Task::ReadDescription { number, index } => (4, number, index, 0),
            Task::WriteDescription { number, index, value } => (5, number, index, value),
            Task::ReadElement { number, index } => (6, number, index, 0),
            Task::WriteElement { number, index, value } => {
                (7 + u8::from(value.is_double()), number, index, value.raw())
            }
            Task::CountElements { number } => (9, number, 0, 0),
        };
        Pkw { identifier, number, index, value }
    }

    /// The parameter that it is about.
    #[must_use]
    pub fn number(self) -> u16 {
        self.pkw().number
    }
}

/// A reply of the slave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reply {
    /// 1 and 2: the value of a parameter.
    Value(Value),
    /// 3: an element of its description.
    Description(u32),
    /// 4 and 5: an element of an array.
    Element(Value),
    /// 6: how many elements an array has.
    Count(u16),
    /// 7: the task cannot be carried out.
    Refused(Refusal),
    /// 8: another interface has the parameters.
    NoAuthority,
}

impl Reply {
    /// The reply of a PKW: `Ok(None)` for no reply (0).
    ///
    /// The error number of a refusal is in the second word of PWE, as a single word is. The manuals do not confirm this
    /// for error numbers, so one in the first word is understood as well.
    ///
    /// Errors: the identifier, if it is not one of a reply.
    pub fn parse(pkw: Pkw) -> Result<Option<Self>, u8> {
        Ok(Some(match pkw.identifier {
            0 => return Ok(None),
            1 | 2 => Reply::Value(Value::of(pkw.identifier == 2, pkw.value)),
            3 => Reply::Description(pkw.value),
            4 | 5 => Reply::Element(Value::of(pkw.identifier == 5, pkw.value)),
            6 => Reply::Count(pkw.value as u16),
            7 => {
                Reply::Refused(Refusal(if pkw.value as u16 == 0 { (pkw.value >> 16) as u16 } else { pkw.value as u16 }))
            }
            8 => Reply::NoAuthority,
            other => return Err(other),
        }))
    }

    /// The PKW of this reply to `task`.
    #[must_use]
    pub fn pkw(self, task: Pkw) -> Pkw {
        let (identifier, value) = match self {
            Reply::Value(value) => (1 + u8::from(value.is_double()), value.raw()),
            Reply::Description(value) => (3, value),
            Reply::Element(value) => (4 + u8::from(value.is_double()), value.raw()),
            Reply::Count(count) => (6, count.into()),
            Reply::Refused(Refusal(number)) => (7, number.into()),
            Reply::NoAuthority => (8, 0),
        };
        Pkw { identifier, value, ..task }
    }
}

/// The number of an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Refusal(pub u16);

macro_rules! refusals {
    ($($name:ident = $number:literal, $text:literal;)*) => {
        impl Refusal {
            $(#[doc = concat!($number, ": ", $text, ".")]
            pub const $name: Refusal = Refusal($number);)*

            /// All numbers of the profile, with their texts.
            pub const TEXTS: &'static [(Refusal, &'static str)] = &[$((Refusal::$name, $text)),*];
        }
    };
}

refusals! {
    NO_SUCH_PARAMETER = 0, "there is no parameter with this number";
    READ_ONLY = 1, "the value cannot be changed";
    OUT_OF_RANGE = 2, "the value is out of range";
    NO_SUCH_ELEMENT = 3, "there is no element with this index";
    NO_ARRAY = 4, "the parameter is no array";
    WRONG_TYPE = 5, "the parameter has another width";
    RESET_ONLY = 6, "the value can only be reset";
    DESCRIPTION_READ_ONLY = 7, "the description cannot be changed";
    NO_PPO_WRITE_IN_IR = 8, "the PPO write that the IR asks for does not exist";
    NO_DESCRIPTION = 9, "there is no description";
    WRONG_ACCESS_GROUP = 10, "the access group is wrong";
    NO_CONTROL = 11, "the master has no control";
    WRONG_PASSWORD = 12, "the password is wrong";
    TEXT_NOT_CYCLIC = 13, "the text cannot be read in cyclic data";
    NAME_NOT_CYCLIC = 14, "the name cannot be read in cyclic data";
    NO_TEXT_ARRAY = 15, "there is no array of texts";
    NO_PPO_WRITE = 16, "the PPO write is missing";
    WRONG_STATE = 17, "not in this operating state";
    OTHER = 18, "another error";
    DATE_NOT_CYCLIC = 19, "the date cannot be read in cyclic data";
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let known = Refusal::TEXTS.iter().find(|(refusal, _)| refusal == self);
        write!(f, "{} (error {})", known.map_or("unknown", |(_, text)| *text), self.0)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;

    use super::*;

    /// The telegrams printed in two manuals, the same in both.
    #[test]
    fn the_printed_telegrams_are_read_and_written() {
        let read = Task::Read { number: 1018 };
        let write = Task::Write { number: 1016, value: Value::DoubleWord(250_000) };
        let value = |raw| Reply::Value(Value::DoubleWord(raw));
        for (pkw, text) in [
            (read.pkw(), "13FA 0000 0000 0000"),
            (value(10_000).pkw(read.pkw()), "23FA 0000 0000 2710"),
            (write.pkw(), "33F8 0000 0003 D090"),
            (value(250_000).pkw(write.pkw()), "23F8 0000 0003 D090"),
        ] {
            assert_eq!(pkw.to_string(), text);
            assert_eq!(Pkw::parse(&pkw.bytes()), Some(pkw));
        }
        assert_eq!(Task::parse(read.pkw()), Ok(Some(read)));
        assert_eq!(Task::parse(write.pkw()), Ok(Some(write)));
    }

    #[test]
    fn every_identifier_is_a_task_or_none() {
        for identifier in 0..=15 {
            let pkw = Pkw { identifier, number: 2047, index: 3, value: 0xFFFF_FFFF };
            match Task::parse(pkw) {
                Ok(None) => assert_eq!(identifier, 0),
                Ok(Some(task)) => assert_eq!((task.pkw().identifier, task.number()), (identifier, 2047)),
                Err(other) => assert_eq!((other, identifier > 9), (identifier, true)),
            }
            match Reply::parse(pkw) {
                Ok(None) => assert_eq!(identifier, 0),
                Ok(Some(reply)) => assert_eq!(reply.pkw(pkw).identifier, identifier),
                Err(other) => assert_eq!((other, identifier > 8), (identifier, true)),
            }
        }
    }

    #[test]
    fn the_number_of_an_error_is_found_in_either_word() {
        let reply = |value| Reply::parse(Pkw { identifier: 7, number: 1, index: 0, value });
        for value in [17, 17 << 16] {
            assert_eq!(reply(value), Ok(Some(Reply::Refused(Refusal::WRONG_STATE))));
        }
        assert_eq!(reply(0), Ok(Some(Reply::Refused(Refusal::NO_SUCH_PARAMETER))));
        assert_eq!(Refusal(2).to_string(), "the value is out of range (error 2)");
        assert_eq!(Refusal(20).to_string(), "unknown (error 20)");
        assert!(Refusal::TEXTS.iter().map(|(refusal, _)| refusal.0).eq(0..20));
    }
}
