//! Values with a format in CiA 301 or 402, to text and back: control word, states, COB-IDs, mapping entries.

use std::fmt::Display;

use lexican_eds::model::{Entry, Meaning};
use lexican_runtime::cia301::{self, is_pdo_mapping};
use lexican_runtime::object::{self, Address};
use lexican_runtime::profile::cia402::{Command, State};

use super::{DeviceValues, bits};

const COMMAND_BITS: u16 = 0b1000_1111;
const STATE_BITS: u16 = 0b0110_1111;

/// The commands of CiA 402 as shown, and the bits to write for each.
const COMMANDS: [(&str, u16); 7] = [
    ("shutdown", 0x06),
    ("switch on", 0x07),
    ("disable operation", 0x07),
    ("disable voltage", 0x00),
    ("quick stop", 0x02),
    ("enable operation", 0x0F),
    ("fault reset", 0x80),
];

impl DeviceValues<'_> {
    /// The text of a value with such a format. If the text leaves out bits, the number follows, except for a status
    /// word, which is shown often and never written.
    pub(super) fn special(&self, entry: &Entry, number: i128) -> Option<String> {
        let text = self.defined(entry, number)?;
        if entry.index != 0x6041 && self.special_number(entry, &text) != Ok(Some(number)) {
            let digits = usize::from(entry.data_type.bits().unwrap_or(32) / 4);
            return Some(format!("{text} ({number:0digits$X}h)"));
        }
        Some(text)
    }

    fn defined(&self, entry: &Entry, number: i128) -> Option<String> {
        match (entry.index, entry.sub) {
            (0x6040, 0) if self.is_drive() => {
                Some(self.joined(self.command(number as u16), entry, number, COMMAND_BITS))
            }
            (0x6041, 0) if self.is_drive() => {
                let state = State::from_status_word(number as u16)?;
                Some(self.joined(state, entry, number, STATE_BITS))
            }
            (index, 1..) if is_pdo_mapping(index) && number != 0 => {
                let (index, sub, bits) = ((number >> 16) as u16, (number >> 8) as u8, number as u8);
                let name = self.device.entry(index, sub).map_or("", |mapped| &mapped.name);
                Some(format!("{index:04X}:{sub:02X} {name}, {bits} bits"))
            }
            _ if is_cob_id(entry) => {
                let is_off = number >> 31 & 1 == 1 && entry.index != cia301::COB_ID_SYNC;
                let off = if is_off { OFF } else { "" };
                Some(format!("{:03X}h{off}", number & 0x1FFF_FFFF))
            }
            _ => None,
        }
    }

    /// Parses a text in such a format; `None` if it has another one.
    pub(super) fn special_number(&self, entry: &Entry, text: &str) -> Result<Option<i128>, String> {
        let (first, rest) = text.split_once(" + ").map_or((text, None), |(first, rest)| (first, Some(rest)));
        Ok(match (entry.index, entry.sub) {
            (0x6040, 0) if self.is_drive() => {
                let command = COMMANDS.iter().find(|(name, _)| name.eq_ignore_ascii_case(first));
                command.and_then(|(_, command)| Some(i128::from(*command) | self.other_bits(entry, rest)?))
            }
            (0x6041, 0)
                if self.is_drive() && State::ALL.iter().any(|it| it.to_string().eq_ignore_ascii_case(first)) =>
            {
                return Err(format!("{text:?} does not say all bits: write the number, such as 0x0237"));
            }
            (index, 1..) if is_pdo_mapping(index) => mapping(text),
            _ if is_cob_id(entry) => {
                let (digits, off) = text.strip_suffix(OFF).map_or((text, 0), |digits| (digits, 1 << 31));
                let digits = digits.strip_suffix('h').filter(|digits| digits.bytes().all(|it| it.is_ascii_hexdigit()));
                digits.and_then(|digits| i128::from_str_radix(digits, 16).ok()).map(|id| id | off)
            }
            _ => None,
        })
    }

    /// A command or state, followed by the names of all other set bits.
    fn joined(&self, first: impl Display, entry: &Entry, number: i128, without: u16) -> String {
        let rest = number as u64 & !u64::from(without);
        let field = match &entry.meaning {
            Meaning::BitField(name) => self.device.bit_fields.get(name),
            _ => None,
        };
        match field {
            Some(field) if rest != 0 => {
                let bits = bits(&field.fields, without);
                format!("{first} + {}", object::Meaning::BitField(&bits).show(object::DataType::Unsigned64, rest))
            }
            _ => first.to_string(),
        }
    }

    /// The named bits after a command; `None` if one of them belongs to a command, since the text is then a list of
    /// bits.
    fn other_bits(&self, entry: &Entry, text: Option<&str>) -> Option<i128> {
        let Some(text) = text else { return Some(0) };
        let Meaning::BitField(name) = &entry.meaning else { return None };
        let bits = bits(&self.device.bit_fields.get(name)?.fields, COMMAND_BITS);
        object::Meaning::BitField(&bits).parse(object::DataType::Unsigned16, text).ok().map(i128::from)
    }

    /// The command in a control word. "Switch on" and "disable operation" have the same bits; the state of the drive
    /// tells them apart.
    fn command(&self, control_word: u16) -> &'static str {
        let word = |index| self.seen(Address::new(index, 0)).map(|seen| seen as u16);
        let enabled = word(0x6041).and_then(State::from_status_word) == Some(State::OperationEnabled);
        match Command::parse(word(0x6040).unwrap_or(0), control_word) {
            Command::Shutdown => "shutdown",
            Command::SwitchOn if enabled => "disable operation",
            Command::SwitchOn => "switch on",
            Command::DisableVoltage => "disable voltage",
            Command::QuickStop => "quick stop",
            Command::EnableOperation => "enable operation",
            Command::FaultReset => "fault reset",
        }
    }

    fn is_drive(&self) -> bool {
        self.device.profile == Some(402)
    }
}

const OFF: &str = ", switched off";

fn is_cob_id(entry: &Entry) -> bool {
    matches!(
        (entry.index, entry.sub),
        (cia301::COB_ID_SYNC | cia301::COB_ID_EMCY, 0)
            | (cia301::RPDO_1..=cia301::RPDO_512 | cia301::TPDO_1..=cia301::TPDO_512, 1)
            | (cia301::SDO_SERVER_1..=cia301::SDO_CLIENT_128, 1 | 2)
    )
}

/// `6040:00 Controlword, 16 bits`; the name is ignored.
fn mapping(text: &str) -> Option<i128> {
    let (address, rest) = text.split_once(' ')?;
    let (index, sub) = address.split_once(':').filter(|(index, sub)| index.len() == 4 && sub.len() == 2)?;
    let bits: u8 = rest.rsplit_once(", ").map_or(rest, |(_, bits)| bits).strip_suffix(" bits")?.parse().ok()?;
    let (index, sub) = (u16::from_str_radix(index, 16).ok()?, u8::from_str_radix(sub, 16).ok()?);
    Some(i128::from(index) << 16 | i128::from(sub) << 8 | i128::from(bits))
}
