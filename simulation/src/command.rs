//! Commands to a simulated device from outside, parsed from lines.

use lexican_runtime::AbortCode;
use lexican_runtime::object::Address;
use lexican_toolbox::values::lookup::ObjectError;
use lexican_toolbox::values::text::parse_hex;

/// A command to a simulated device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Command {
    /// Returns its state in words.
    Status,
    /// Returns the value of an object, named by number or name.
    Get(String),
    /// Changes an object, regardless of its access.
    Set {
        /// Its number or name.
        object: String,
        /// Its value as text.
        value: String,
    },
    /// Sends an EMCY.
    Emcy {
        /// The error code.
        code: u16,
        /// The error register.
        register: u8,
        /// The manufacturer-specific error field.
        msef: [u8; 5],
    },
    /// Clears all errors.
    EmcyClear,
    /// Switches the supply.
    Power(Power),
    /// Changes an input of a drive: `battery_v = 2.5`.
    Input(String),
}

/// The supply of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Power {
    /// It is switched on.
    On,
    /// It is switched off.
    Off,
    /// It is switched off and on again.
    Cycle,
}

/// The syntax of the lines, for the user.
pub const HELP: &str = "\
get OBJECT                   prints an object: get 6041, get \"Position Actual Value\"
set OBJECT VALUE             sets an object, regardless of its access: set 6064 1000, set 241B:01 \"17.5 V\"
emcy CODE [REGISTER [BYTES]] sends an EMCY: emcy 3120 04; emcy clear clears all errors
power on|off|cycle           switches the device
status                       prints state and counts
KEY = VALUE                  sets an input of a simulated drive: battery_v = 2.5, fault = \"D\";
                             of a CiA 402 drive: fault = 0x4310, blocked = true, positive_limit = 20000";

/// Why a line is no command.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CommandError {
    /// It does not begin with a command.
    #[error("{0:?} is no command")]
    Unknown(String),
    /// `get` without an object.
    #[error("get what? For example: get 6041")]
    NoObject,
    /// `set` without an object and a value.
    #[error("set what? For example: set 6064 1000")]
    NoValue,
    /// `emcy` without an error code.
    #[error("which code? For example: emcy 3120 04")]
    NoCode,
    /// `power` without `on`, `off` or `cycle`.
    #[error("power on, off or cycle")]
    NoPower,
    /// More than five bytes for the manufacturer-specific error field.
    #[error("an EMCY has five bytes of the manufacturer")]
    TooManyBytes,
    /// No hexadecimal number, or one with too many digits.
    #[error("{text:?} is not a number of up to {most} hexadecimal digits")]
    NotHex {
        /// The text that is given.
        text: String,
        /// How many digits it may have.
        most: usize,
    },
}

/// Why a device has not carried out a command.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// It has no such object.
    #[error(transparent)]
    Object(#[from] ObjectError),
    /// The text is not a value of the object.
    #[error("{0}")]
    Value(String),
    /// The device refuses to read or write the object.
    #[error("{address}: {code}")]
    Access {
        /// The object.
        address: Address,
        /// The reason.
        code: AbortCode,
    },
    /// It is not a drive.
    #[error("this device has no inputs but its objects: set OBJECT VALUE")]
    NoInputs,
    /// The drive has no such input, or the input cannot have this value.
    #[error("{problem}; {remedy}")]
    Input {
        /// What is wrong.
        problem: String,
        /// What to write instead.
        remedy: String,
    },
    /// The drive sends EMCYs only for its own faults.
    #[error("this drive sends an EMCY when it has a fault: {instead}")]
    OwnEmergencies {
        /// The input that makes it do so.
        instead: &'static str,
    },
    /// The errors of the drive end only with their cause.
    #[error("the cause of this drive's fault goes with: {instead}")]
    OwnCauses {
        /// The input that ends the cause.
        instead: &'static str,
    },
}

/// Splits a line for one of several devices, such as `5: get 6041`, into the name of the device and the rest.
#[must_use]
pub fn addressee(line: &str) -> (Option<&str>, &str) {
    match line.split_once(':') {
        // In `set 2410:05 7`, other words precede the colon.
        Some((who, rest)) if !who.trim().is_empty() && !who.trim().contains([' ', '\t', '=']) => {
            (Some(who.trim()), rest)
        }
        _ => (None, line),
    }
}

/// Parses a line; `None` if it is empty or a comment.
pub fn parse(line: &str) -> Result<Option<Command>, CommandError> {
    let line = line.trim();
    let words = words(line);
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    Ok(Some(match words.as_slice() {
        [] => return Ok(None),
        [word, ..] if word.starts_with('#') => return Ok(None),
        ["status"] => Command::Status,
        ["get", object] => Command::Get((*object).to_owned()),
        ["set", object, value] => Command::Set { object: (*object).to_owned(), value: (*value).to_owned() },
        ["emcy", "clear"] => Command::EmcyClear,
        ["emcy", code] => emcy(code, "01", &[])?,
        ["emcy", code, register, msef @ ..] => emcy(code, register, msef)?,
        ["power", "on"] => Command::Power(Power::On),
        ["power", "off"] => Command::Power(Power::Off),
        ["power", "cycle"] => Command::Power(Power::Cycle),
        _ if line.split_once('=').is_some_and(|(key, _)| is_key(key.trim())) => Command::Input(line.to_owned()),
        ["get"] => return Err(CommandError::NoObject),
        ["set", ..] => return Err(CommandError::NoValue),
        ["emcy"] => return Err(CommandError::NoCode),
        ["power", ..] => return Err(CommandError::NoPower),
        [word, ..] => return Err(CommandError::Unknown((*word).to_owned())),
    }))
}

fn is_key(text: &str) -> bool {
    text.starts_with(|first: char| first.is_ascii_lowercase())
        && text.bytes().all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_')
}

fn emcy(code: &str, register: &str, msef: &[&str]) -> Result<Command, CommandError> {
    let (code, register) = (hex(code, 4)?, hex(register, 2)? as u8);
    if msef.len() > 5 {
        return Err(CommandError::TooManyBytes);
    }
    let mut bytes = [0; 5];
    for (byte, text) in bytes.iter_mut().zip(msef) {
        *byte = hex(text, 2)? as u8;
    }
    Ok(Command::Emcy { code, register, msef: bytes })
}

fn hex(text: &str, most: usize) -> Result<u16, CommandError> {
    parse_hex(text, most).ok_or_else(|| CommandError::NotHex { text: text.to_owned(), most })
}

/// Splits a line into words. Quoted words may contain spaces.
fn words(line: &str) -> Vec<String> {
    let (mut words, mut word, mut quoted, mut begun) = (Vec::new(), String::new(), false, false);
    for letter in line.chars() {
        match letter {
            '"' => (quoted, begun) = (!quoted, true),
            letter if letter.is_whitespace() && !quoted => {
                if begun {
                    words.push(std::mem::take(&mut word));
                }
                begun = false;
            }
            letter => {
                word.push(letter);
                begun = true;
            }
        }
    }
    if begun {
        words.push(word);
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(line: &str, command: Command) {
        assert_eq!(parse(line), Ok(Some(command)), "{line}");
    }

    #[test]
    fn lines_are_parsed() {
        let set = |object: &str, value: &str| Command::Set { object: object.to_owned(), value: value.to_owned() };
        check("  get 6041 ", Command::Get("6041".to_owned()));
        check("get \"Position Actual Value\"", Command::Get("Position Actual Value".to_owned()));
        check("set 241B:01 \"17.5 V\"", set("241B:01", "17.5 V"));
        check("set 2410:05 -5", set("2410:05", "-5"));
        let emcy = |code, register, msef| Command::Emcy { code, register, msef };
        check("emcy 0x3120 0x04", emcy(0x3120, 4, [0; 5]));
        check("emcy 3120h", emcy(0x3120, 1, [0; 5]));
        check("emcy 8130 11 01 FF", emcy(0x8130, 0x11, [1, 0xFF, 0, 0, 0]));
        check("emcy clear", Command::EmcyClear);
        check("power off", Command::Power(Power::Off));
        check("battery_v = 2.5", Command::Input("battery_v = 2.5".to_owned()));
        check("probe_1 = true", Command::Input("probe_1 = true".to_owned()));
        check("fault=\"D\"", Command::Input("fault=\"D\"".to_owned()));
        assert_eq!(parse(""), Ok(None));
        assert_eq!(parse("# a note"), Ok(None));
    }

    #[test]
    fn a_line_names_its_device() {
        for (line, split) in [
            ("5: get 6041", (Some("5"), " get 6041")),
            ("0x05:get 2410:05", (Some("0x05"), "get 2410:05")),
            (" feeder : fault = \"a:b\"", (Some("feeder"), " fault = \"a:b\"")),
            ("set 2410:05 7", (None, "set 2410:05 7")),
            ("fault=\"a:b\"", (None, "fault=\"a:b\"")),
            ("status", (None, "status")),
        ] {
            assert_eq!(addressee(line), split, "{line}");
        }
    }

    #[test]
    fn errors_suggest_what_to_type() {
        for (line, words) in [
            ("jump", "\"jump\" is no command"),
            ("get", "get what?"),
            ("set 6064", "set what?"),
            ("emcy", "which code?"),
            ("emcy 31200", "up to 4 hexadecimal digits"),
            ("emcy 3120 1FF", "up to 2 hexadecimal digits"),
            ("emcy 3120 1 1 2 3 4 5 6", "five bytes"),
            ("power up", "on, off or cycle"),
            ("Set = 5", "is no command"),
        ] {
            let error = parse(line).unwrap_err();
            let error = error.to_string();
            assert!(error.contains(words), "{line}: {error}");
        }
    }
}
