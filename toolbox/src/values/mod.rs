//! Values of entries: as bytes ([`wire`]), as text, and as typed by people ([`text`]); whether they may be written ([`permission`]).

pub mod permission;
pub mod report;
pub mod text;
pub mod wire;

use std::cmp::Ordering;
use std::collections::BTreeMap;

use lexican_eds::model::{BitField, Condition, ConditionalRange, Device, Entry, Meaning, Unit, Value};
use lexican_eds::types::{Class, DataType};
use lexican_runtime::object::Address;
use lexican_runtime::profile::cia402::{Command, State};
use lexican_runtime::{NodeId, cia301};

/// A data sheet, and the values that were seen on the bus. Units and names of values depend on other values.
pub struct DeviceValues<'a> {
    /// The data sheet.
    pub device: &'a Device,
    seen: BTreeMap<Address, i128>,
}

impl<'a> DeviceValues<'a> {
    /// A device of which nothing was seen.
    pub fn new(device: &'a Device) -> Self {
        DeviceValues { device, seen: BTreeMap::new() }
    }

    /// The entry at an address.
    pub fn entry(&self, address: Address) -> Option<&'a Entry> {
        self.device.entry(address.index(), address.sub())
    }

    /// The name of an entry, after that of its object unless it is the only one.
    pub fn name(&self, entry: &Entry) -> String {
        name(self.device, entry)
    }

    /// Remembers a value that was seen.
    pub fn set(&mut self, address: Address, value: &Value) {
        if let Value::Integer(number) = value {
            self.seen.insert(address, *number);
        }
    }

    /// The value that was seen last.
    pub fn seen(&self, address: Address) -> Option<i128> {
        self.seen.get(&address).copied()
    }

    /// The unit of an entry; of several, the one whose condition holds.
    pub fn unit(&self, entry: &Entry) -> Option<&'a Unit> {
        let Meaning::Quantity(name) = &entry.meaning else { return None };
        let mut units = self.device.quantities.get(name)?.units.iter();
        units.find(|unit| unit.when.as_ref().is_none_or(|when| self.holds(when)))
    }

    /// Whether a condition holds, by the value that was seen or else by the data sheet.
    pub fn holds(&self, when: &Condition) -> bool {
        let address = Address::new(when.index, when.sub);
        let number = self.seen(address).or_else(|| given(self.entry(address)?)?.as_integer());
        number.is_some_and(|number| (number == when.value) == when.equal)
    }

    /// The entries on whose values the unit and the limits of an entry depend.
    pub fn conditions(&self, entry: &Entry) -> Vec<Address> {
        let quantity = match &entry.meaning {
            Meaning::Quantity(name) => self.device.quantities.get(name),
            _ => None,
        };
        let units = quantity.map(|it| it.units.as_slice()).unwrap_or_default();
        let when = units.iter().filter_map(|unit| unit.when.as_ref());
        let when = when.chain(entry.ranges.iter().map(|range| &range.when));
        let mut addresses: Vec<_> = when.map(|when| Address::new(when.index, when.sub)).collect();
        addresses.dedup();
        addresses
    }

    /// A value as text: with its unit, the name of its enumeration, or the names of its bits.
    pub fn describe(&self, entry: &Entry, value: &Value) -> String {
        let Value::Integer(number) = *value else { return plain(entry.data_type, value) };
        let text = self.special(entry, number).or_else(|| match &entry.meaning {
            Meaning::Plain if entry.first_character_high => Some(unsigned(number, entry.data_type, true)),
            Meaning::Plain => None,
            Meaning::Quantity(_) => {
                self.unit(entry).map(|unit| format!("{} {}", scaled(number, unit, is_signed(entry)), unit.symbol))
            }
            Meaning::Enumeration(_) => self.name_of(entry, number).map(|name| format!("{name} ({number})")),
            Meaning::BitField(name) => self.device.bit_fields.get(name).map(|field| bits(field, number, 0)),
        });
        text.unwrap_or_else(|| plain(entry.data_type, value))
    }

    /// The name that an entry's enumeration has for a number.
    pub fn name_of(&self, entry: &Entry, number: i128) -> Option<&'a str> {
        let Meaning::Enumeration(name) = &entry.meaning else { return None };
        let values = &self.device.enumerations.get(name)?.values;
        values.iter().find(|named| named.value == number).map(|named| named.name.as_str())
    }

    /// The text of values that CiA 301 and 402 define.
    fn special(&self, entry: &Entry, number: i128) -> Option<String> {
        let field = match &entry.meaning {
            Meaning::BitField(name) => self.device.bit_fields.get(name),
            _ => None,
        };
        match (entry.index, entry.sub) {
            (0x6040, 0) if self.is_drive() => {
                const COMMAND_BITS: u16 = 0b1000_1111;
                let rest = field.map(|field| bits(field, number, COMMAND_BITS));
                Some(join(self.command(number as u16), rest))
            }
            (0x6041, 0) if self.is_drive() => {
                const STATE_BITS: u16 = 0b0110_1111;
                let state = State::from_status_word(number as u16)?;
                Some(join(&state.to_string(), field.map(|field| bits(field, number, STATE_BITS))))
            }
            (index, 1..) if is_pdo_mapping(index) => {
                let (index, sub, bits) = ((number >> 16) as u16, (number >> 8) as u8, number as u8);
                let name = self.device.entry(index, sub).map_or("", |mapped| &mapped.name);
                Some(format!("{index:04X}:{sub:02X} {name}, {bits} bits"))
            }
            (cia301::COB_ID_SYNC | cia301::COB_ID_EMCY, 0)
            | (cia301::RPDO_1..=cia301::RPDO_512 | cia301::TPDO_1..=cia301::TPDO_512, 1)
            | (cia301::SDO_SERVER_1..=cia301::SDO_CLIENT_128, 1 | 2) => {
                let is_off = number >> 31 & 1 == 1 && entry.index != cia301::COB_ID_SYNC;
                let off = if is_off { ", switched off" } else { "" };
                Some(format!("{:03X}h{off}", number & 0x1FFF_FFFF))
            }
            _ => None,
        }
    }

    /// The command of a control word. "Switch on" and "disable operation" are the same bits; the state decides.
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

/// The address of an entry.
pub fn address(entry: &Entry) -> Address {
    Address::new(entry.index, entry.sub)
}

/// The value that the data sheet gives an entry: configured in a DCF, else its default.
pub fn given(entry: &Entry) -> Option<&Value> {
    entry.configured.as_ref().or(entry.default.as_ref())
}

/// Whether an object is the mapping of a PDO.
pub fn is_pdo_mapping(index: u16) -> bool {
    use cia301::{RPDO_MAPPING_1, RPDO_MAPPING_512, TPDO_MAPPING_1, TPDO_MAPPING_512};
    matches!(index, RPDO_MAPPING_1..=RPDO_MAPPING_512 | TPDO_MAPPING_1..=TPDO_MAPPING_512)
}

/// The name of an entry, after that of its object unless it is the only one: `Motor Parameter Set, v-Pos`.
pub fn name(device: &Device, entry: &Entry) -> String {
    match device.object(entry.index) {
        Some(object) if object.entries.len() > 1 => format!("{}, {}", object.name, entry.name),
        _ => entry.name.clone(),
    }
}

/// A value with `$NODEID` replaced.
pub fn resolved(value: &Value, node: NodeId) -> Value {
    match value {
        Value::NodeIdPlus(offset) => Value::Integer(i128::from(*offset) + i128::from(node.get())),
        other => other.clone(),
    }
}

/// The lowest and the highest value of an entry.
pub struct Limits {
    /// The lowest value that is allowed.
    pub low: Option<Value>,
    /// The highest value that is allowed.
    pub high: Option<Value>,
}

impl Limits {
    /// The limits that a value violates, and whether it is below (`Less`) or above them. Some limits hold only while
    /// another entry has a certain value.
    pub fn violated(
        entry: &Entry,
        node: NodeId,
        holds: impl Fn(&Condition) -> bool,
        value: &Value,
    ) -> Option<(Ordering, Limits)> {
        let bound = |bound: &Option<Value>| bound.as_ref().map(|bound| resolved(bound, node));
        let own = Limits { low: bound(&entry.low), high: bound(&entry.high) };
        let conditional = entry.ranges.iter().filter(|range| holds(&range.when));
        let mut all = conditional.map(Limits::from).chain([own]);
        all.find_map(|limits| Some(limits.compare(value)).filter(|side| side.is_ne()).map(|side| (side, limits)))
    }

    /// Whether a value is below the limits (`Less`), above them (`Greater`), or neither.
    fn compare(&self, value: &Value) -> Ordering {
        if self.low.as_ref().is_some_and(|low| is_below(value, low)) {
            Ordering::Less
        } else if self.high.as_ref().is_some_and(|high| is_below(high, value)) {
            Ordering::Greater
        } else {
            Ordering::Equal
        }
    }
}

impl From<&ConditionalRange> for Limits {
    fn from(range: &ConditionalRange) -> Self {
        Limits { low: Some(Value::Integer(range.low)), high: Some(Value::Integer(range.high)) }
    }
}

fn is_below(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Integer(a), Value::Integer(b)) => a < b,
        (Value::Real(a), Value::Real(b)) => a < b,
        (Value::Real(a), Value::Integer(b)) => *a < *b as f64,
        (Value::Integer(a), Value::Real(b)) => (*a as f64) < *b,
        _ => false,
    }
}

fn join(first: &str, rest: Option<String>) -> String {
    match rest {
        Some(rest) if rest != NO_BITS => format!("{first} + {rest}"),
        _ => first.to_owned(),
    }
}

const NO_BITS: &str = "0";

/// The names of the fields that are not zero, except for those in the mask `without`.
fn bits(field: &BitField, number: i128, without: u16) -> String {
    let mut rest = number & !i128::from(without);
    let mut names = Vec::new();
    for named in &field.fields {
        let width = named.value.high.saturating_sub(named.value.low) + 1;
        let mask = ((1_i128 << width.min(64)) - 1) << named.value.low.min(63);
        match (rest & mask) >> named.value.low.min(63) {
            0 => {}
            _ if width == 1 => names.push(named.name.clone()),
            value => names.push(format!("{} {value}", named.name)),
        }
        rest &= !mask;
    }
    names.extend((0..64).filter(|bit| rest >> bit & 1 == 1).map(|bit| format!("bit {bit}")));
    if names.is_empty() { NO_BITS.to_owned() } else { names.join(" + ") }
}

fn is_signed(entry: &Entry) -> bool {
    entry.data_type.class() == Class::Signed
}

/// A count in its unit: exact if the unit is a decimal fraction.
fn scaled(number: i128, unit: &Unit, signed: bool) -> String {
    let plus = if signed && number > 0 { "+" } else { "" };
    let decimals = (0..=9).find(|&decimals| 10_i64.pow(decimals) == unit.den);
    match decimals {
        Some(0) => format!("{plus}{}", number * i128::from(unit.num)),
        Some(decimals) => {
            let (scaled, den) = (number * i128::from(unit.num), i128::from(unit.den));
            let minus = if scaled < 0 { "-" } else { "" };
            let (whole, rest) = (scaled.abs() / den, scaled.abs() % den);
            format!("{plus}{minus}{whole}.{rest:0width$}", width = decimals as usize)
        }
        None => format!("{plus}{:.4}", number as f64 * unit.num as f64 / unit.den as f64),
    }
}

/// A value as text, by its type alone.
pub fn plain(data_type: DataType, value: &Value) -> String {
    match value {
        Value::Integer(number) => match (data_type.class(), data_type.bits()) {
            (Class::Boolean, _) => (*number != 0).to_string(),
            (Class::Unsigned, _) => unsigned(*number, data_type, false),
            _ => number.to_string(),
        },
        Value::Real(number) => real(data_type, *number),
        Value::Text(text) => format!("{text:?}"),
        Value::Bytes(bytes) if bytes.len() > 64 => format!("{} bytes", bytes.len()),
        Value::Bytes(bytes) => hex(bytes),
        Value::NodeIdPlus(offset) => format!("$NODEID+{offset:X}h"),
    }
}

/// A number with its hexadecimal digits, and the characters that it may hold.
fn unsigned(number: i128, data_type: DataType, first_character_high: bool) -> String {
    let Some(bits) = data_type.bits().filter(|_| number > 9) else { return number.to_string() };
    let digits = usize::from(bits / 4);
    let text = ascii(number, bits, first_character_high).map(|text| format!(" {text:?}")).unwrap_or_default();
    format!("{number} ({number:0digits$X}h{text})")
}

/// The fewest digits that parse to the same number; very large and very small numbers with an exponent.
fn real(data_type: DataType, number: f64) -> String {
    let is_long = number.is_finite() && number != 0.0 && !(1e-5..1e16).contains(&number.abs());
    match (data_type == DataType::Real32, is_long) {
        (true, true) => format!("{:e}", number as f32),
        (true, false) => (number as f32).to_string(),
        (false, true) => format!("{number:e}"),
        (false, false) => number.to_string(),
    }
}

/// The four letters that some devices keep in a number: `AG03`, `load`, `1.00`.
fn ascii(number: i128, bits: u8, first_is_high: bool) -> Option<String> {
    let mut bytes = (number as u128).to_le_bytes();
    let text = bytes.get_mut(..usize::from(bits / 8)).filter(|text| text.len() == 4)?;
    if first_is_high {
        text.reverse();
    }
    let printable = text.iter().all(|byte| byte.is_ascii_alphanumeric() || *byte == b'.');
    printable.then(|| text.iter().copied().map(char::from).collect())
}

/// `1F 00 88`.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit(num: i64, den: i64) -> Unit {
        Unit { symbol: "x".to_owned(), method: "x".to_owned(), num, den, when: None }
    }

    #[test]
    fn counts_are_exact_in_their_unit() {
        let check = |number, num, den, signed, text: &str| assert_eq!(scaled(number, &unit(num, den), signed), text);
        check(5000, 1, 1, true, "+5000");
        check(-5000, 1, 1, true, "-5000");
        check(0, 1, 1, true, "0");
        check(240, 1, 10, false, "24.0");
        check(-5, 1, 100, true, "-0.05");
        check(7, 5, 1, false, "35");
        check(1, 1, 3, false, "0.3333");
        check(i128::from(i64::MIN), 1, 10, true, "-922337203685477580.8");
    }

    #[test]
    fn reals_are_printed_shortly() {
        let check = |data_type, number, text: &str| assert_eq!(plain(data_type, &Value::Real(number)), text);
        check(DataType::Real64, 5e-324, "5e-324");
        check(DataType::Real64, -1.5e300, "-1.5e300");
        check(DataType::Real64, 0.1, "0.1");
        check(DataType::Real64, -0.0, "-0");
        check(DataType::Real64, f64::NAN, "NaN");
        check(DataType::Real64, f64::INFINITY, "inf");
        check(DataType::Real64, 9_007_199_254_740_993.0, "9007199254740992");
        check(DataType::Real32, f32::from_bits(1).into(), "1e-45");
        check(DataType::Real32, 0.1_f32.into(), "0.1");
        check(DataType::Real32, f32::MAX.into(), "3.4028235e38");
        check(DataType::Real32, 1.5, "1.5");
    }

    #[test]
    fn plain_numbers_show_hex_and_the_letters_in_them() {
        let check = |data_type, number, text: &str| assert_eq!(plain(data_type, &Value::Integer(number)), text);
        check(DataType::Unsigned8, 9, "9");
        check(DataType::Unsigned16, 405, "405 (0195h)");
        check(DataType::Unsigned32, 0x6461_6F6C, "1684107116 (64616F6Ch \"load\")");
        check(DataType::Integer16, 405, "405");
        check(DataType::Boolean, 1, "true");
        assert_eq!(unsigned(0x322E_3030, DataType::Unsigned32, true), "841887792 (322E3030h \"2.00\")");
    }
}
