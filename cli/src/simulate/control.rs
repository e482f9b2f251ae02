//! The lines on stdin that control a simulated device.

use lexican_runtime::NodeId;
use lexican_toolbox::values::text::parse_hex;

use crate::bus::node_id;
use crate::bus::simulated::Power;

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Command {
    Help,
    Status,
    Quit,
    Get(String),
    Set(String, String),
    Emcy {
        code: u16,
        register: u8,
        msef: [u8; 5],
    },
    EmcyClear,
    Power(Power),
    /// `battery_v = 2.5`: an input of a simulated drive.
    Input(String),
}

pub(super) const HELP: &str = "\
get OBJECT                   prints an object: get 6041, get \"Position Actual Value\"
set OBJECT VALUE             sets an object, regardless of its access: set 6064 1000, set 241B:01 \"17.5 V\"
emcy CODE [REGISTER [BYTES]] sends an EMCY: emcy 3120 04; emcy clear clears all errors
power on|off|cycle           switches the device
status                       prints state and counts
KEY = VALUE                  sets an input of a simulated drive: battery_v = 2.5, fault = \"D\";
                             of a CiA 402 drive: fault = 0x4310, blocked = true, positive_limit = 20000
quit                         ends, as Ctrl-C does
with several devices, each line begins with the node-ID or the name of one: 5: get 6041, feeder: blocked = true";

/// Splits a line for one of several devices, `5: get 6041`, into whom it is for and the rest.
pub(super) fn addressee(line: &str) -> (Option<&str>, &str) {
    match line.split_once(':') {
        // The colon of `set 2410:05 7` follows other words.
        Some((who, rest)) if !who.trim().is_empty() && !who.trim().contains([' ', '\t', '=']) => {
            (Some(who.trim()), rest)
        }
        _ => (None, line),
    }
}

/// Whether an addressee is this device.
pub(super) fn means(who: &str, node: Option<NodeId>, name: Option<&str>) -> bool {
    name == Some(who) || node.is_some() && node_id(who).ok() == node
}

/// Parses a line; `None` if it is empty or a comment.
pub(super) fn parse(line: &str) -> Result<Option<Command>, String> {
    let line = line.trim();
    let words = words(line);
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    Ok(Some(match words.as_slice() {
        [] => return Ok(None),
        [word, ..] if word.starts_with('#') => return Ok(None),
        ["help" | "?"] => Command::Help,
        ["status"] => Command::Status,
        ["quit" | "exit"] => Command::Quit,
        ["get", object] => Command::Get((*object).to_owned()),
        ["set", object, value] => Command::Set((*object).to_owned(), (*value).to_owned()),
        ["emcy", "clear"] => Command::EmcyClear,
        ["emcy", code] => emcy(code, "01", &[])?,
        ["emcy", code, register, msef @ ..] => emcy(code, register, msef)?,
        ["power", "on"] => Command::Power(Power::On),
        ["power", "off"] => Command::Power(Power::Off),
        ["power", "cycle"] => Command::Power(Power::Cycle),
        _ if line.split_once('=').is_some_and(|(key, _)| is_key(key.trim())) => Command::Input(line.to_owned()),
        ["get"] => return Err("get what? For example: get 6041".to_owned()),
        ["set", ..] => return Err("set what? For example: set 6064 1000".to_owned()),
        ["emcy"] => return Err("which code? For example: emcy 3120 04".to_owned()),
        ["power", ..] => return Err("power on, off or cycle".to_owned()),
        [word, ..] => return Err(format!("{word:?} is no command; help lists them")),
    }))
}

fn is_key(text: &str) -> bool {
    text.starts_with(|first: char| first.is_ascii_lowercase())
        && text.bytes().all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_')
}

fn emcy(code: &str, register: &str, msef: &[&str]) -> Result<Command, String> {
    let (code, register) = (hex(code, 4)?, hex(register, 2)? as u8);
    if msef.len() > 5 {
        return Err("an EMCY has five bytes of the manufacturer".to_owned());
    }
    let mut bytes = [0; 5];
    for (byte, text) in bytes.iter_mut().zip(msef) {
        *byte = hex(text, 2)? as u8;
    }
    Ok(Command::Emcy { code, register, msef: bytes })
}

fn hex(text: &str, most: usize) -> Result<u16, String> {
    parse_hex(text, most).ok_or_else(|| format!("{text:?} is not a number of up to {most} hexadecimal digits"))
}

/// Splits into words; those in quotes may have spaces.
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
        check("help", Command::Help);
        check("  get 6041 ", Command::Get("6041".to_owned()));
        check("get \"Position Actual Value\"", Command::Get("Position Actual Value".to_owned()));
        check("set 241B:01 \"17.5 V\"", Command::Set("241B:01".to_owned(), "17.5 V".to_owned()));
        check("set 2410:05 -5", Command::Set("2410:05".to_owned(), "-5".to_owned()));
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
        let five = NodeId::new(5);
        assert!(means("5", five, None) && means("0x5", five, None) && means("feeder", None, Some("feeder")));
        assert!(!means("6", five, None) && !means("x", five, Some("feeder")) && !means("x", None, None));
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
            assert!(error.contains(words), "{line}: {error}");
        }
    }
}
