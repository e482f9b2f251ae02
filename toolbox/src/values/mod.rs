//! Values of entries: as bytes ([`wire`]), as text and typed by users ([`text`]); and whether they may be written
//! ([`permission`]).

pub mod lookup;
pub mod permission;
pub mod report;
mod special;
pub mod text;
pub mod wire;

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::fmt::Write;

use lexican_eds::model::{Bits, Condition, ConditionalRange, Device, Entry, Meaning, Named, Unit, Value};
use lexican_eds::types::{Class, DataType};
use lexican_runtime::object::{self, Address};
use lexican_runtime::{NodeId, cia301};

/// A data sheet with the values seen so far, on which units and meanings of other values depend.
pub struct DeviceValues<'a> {
    /// The data sheet.
    pub device: &'a Device,
    seen: BTreeMap<Address, i128>,
    pdos_have_changed: bool,
}

impl<'a> DeviceValues<'a> {
    /// A device of which nothing was seen.
    pub fn new(device: &'a Device) -> Self {
        DeviceValues { device, seen: BTreeMap::new(), pdos_have_changed: false }
    }

    /// The entry at an address.
    pub fn entry(&self, address: Address) -> Option<&'a Entry> {
        self.device.entry(address.index(), address.sub())
    }

    /// The name of an entry, preceded by that of its object unless it is a single value.
    pub fn name(&self, entry: &Entry) -> String {
        name(self.device, entry)
    }

    /// Remembers a value.
    pub fn set(&mut self, address: Address, value: &Value) {
        if let Value::Integer(number) = value {
            let before = self.seen.insert(address, *number);
            let index = address.index();
            let is_of_pdo = cia301::is_pdo_communication(index) || cia301::is_pdo_mapping(index);
            self.pdos_have_changed |= is_of_pdo && before != Some(*number);
        }
    }

    /// Whether a PDO parameter has changed since the last call.
    pub(crate) fn pdos_have_changed(&mut self) -> bool {
        std::mem::take(&mut self.pdos_have_changed)
    }

    /// The last value seen of an entry.
    pub fn seen(&self, address: Address) -> Option<i128> {
        self.seen.get(&address).copied()
    }

    /// The last values seen of all entries.
    pub fn all_seen(&self) -> impl Iterator<Item = (Address, i128)> {
        self.seen.iter().map(|(address, number)| (*address, *number))
    }

    /// The unit of an entry; if there are several, the one whose condition holds.
    pub fn unit(&self, entry: &Entry) -> Option<&'a Unit> {
        let Meaning::Quantity(name) = &entry.meaning else { return None };
        let mut units = self.device.quantities.get(name)?.units.iter();
        units.find(|unit| unit.when.as_ref().is_none_or(|when| self.holds(when)))
    }

    /// Whether a condition holds, by the value seen, else by the data sheet.
    pub fn holds(&self, when: &Condition) -> bool {
        let address = Address::new(when.index, when.sub);
        let number = self.seen(address).or_else(|| given(self.entry(address)?)?.as_integer());
        number.is_some_and(|number| (number == when.value) == when.equal)
    }

    /// The entries on which unit and limits of an entry depend.
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

    /// A value as text: with unit, or as names of its enumeration or bits. [`parse`](Self::parse) reads it.
    pub fn describe(&self, entry: &Entry, value: &Value) -> String {
        let number = match *value {
            Value::Integer(number) => number,
            Value::Real(_) => return self.by_meaning(entry, value).unwrap_or_else(|| plain(entry.data_type, value)),
            _ => return plain(entry.data_type, value),
        };
        let text = self.special(entry, number).or_else(|| match &entry.meaning {
            Meaning::Plain if entry.first_character_high => Some(unsigned(number, entry.data_type, true)),
            Meaning::Enumeration(_) => self.name_of(entry, number).and_then(|_| self.by_meaning(entry, value)),
            Meaning::Quantity(_) => self.unit(entry).and_then(|_| self.by_meaning(entry, value)),
            Meaning::BitField(_) => self.by_meaning(entry, value),
            Meaning::Plain => None,
        });
        text.unwrap_or_else(|| plain(entry.data_type, value))
    }

    /// A number as the runtime formats it; `None` if its type cannot hold it.
    fn by_meaning(&self, entry: &Entry, value: &Value) -> Option<String> {
        let mut raw = [0; 8];
        let bytes = wire::encode(entry.data_type, value)?;
        raw.get_mut(..bytes.len())?.copy_from_slice(&bytes);
        let (data_type, number) = (entry.data_type.known()?, value.as_integer());
        let mut text = String::with_capacity(24);
        // Writing to a string cannot fail.
        let _ = self.with_meaning(entry, number, |it| write!(text, "{}", it.show(data_type, u64::from_le_bytes(raw))));
        Some(text)
    }

    /// Calls `then` with the entry's meaning in the runtime's form. With `number`, it has the name of that value only.
    fn with_meaning<T>(
        &self,
        entry: &Entry,
        number: Option<i128>,
        then: impl for<'m> FnOnce(object::Meaning<'m>) -> T,
    ) -> T {
        let Some(data_type) = entry.data_type.known() else { return then(object::Meaning::Plain) };
        match &entry.meaning {
            Meaning::Plain => then(object::Meaning::Plain),
            Meaning::Quantity(name) => {
                let all = self.device.quantities.get(name).map(|it| it.units.as_slice()).unwrap_or_default();
                let known = self.unit(entry).map_or(all, std::slice::from_ref);
                let units: Vec<_> = known.iter().map(|it| object::Unit::new(&it.symbol, it.num, it.den)).collect();
                then(object::Meaning::Quantity(&units))
            }
            Meaning::Enumeration(name) => {
                let all = self.device.enumerations.get(name).map(|it| it.values.as_slice()).unwrap_or_default();
                let wanted = all.iter().filter(|it| number.is_none_or(|number| it.value == number));
                let wire = |value| object::wire_form(data_type, value);
                let values: Vec<_> = wanted.map(|it| object::ValueName::new(wire(it.value), &it.name)).collect();
                then(object::Meaning::Enumeration(&values))
            }
            Meaning::BitField(name) => {
                let all = self.device.bit_fields.get(name).map(|it| it.fields.as_slice()).unwrap_or_default();
                then(object::Meaning::BitField(&bits(all, 0)))
            }
        }
    }

    /// The name of a value in the entry's enumeration.
    pub fn name_of(&self, entry: &Entry, number: i128) -> Option<&'a str> {
        let Meaning::Enumeration(name) = &entry.meaning else { return None };
        let values = &self.device.enumerations.get(name)?.values;
        values.iter().find(|named| named.value == number).map(|named| named.name.as_str())
    }
}

/// The address of an entry.
pub fn address(entry: &Entry) -> Address {
    Address::new(entry.index, entry.sub)
}

/// The value in the data sheet: as configured by a DCF, else the default.
pub fn given(entry: &Entry) -> Option<&Value> {
    entry.configured.as_ref().or(entry.default.as_ref())
}

/// The name of an entry, preceded by that of its object unless it is a single value: `Motor Parameter Set, v-Pos`.
pub fn name(device: &Device, entry: &Entry) -> String {
    match device.object(entry.index) {
        Some(object) if object.entries.len() > 1 => format!("{}, {}", object.name, entry.name),
        _ => entry.name.clone(),
    }
}

/// The names that can be written to an entry: of its values, or of its bits.
pub fn choices(device: &Device, entry: &Entry) -> Vec<String> {
    match &entry.meaning {
        Meaning::Enumeration(name) => {
            let named = device.enumerations.get(name).map(|it| it.values.as_slice()).unwrap_or_default();
            named.iter().map(|named| named.name.clone()).collect()
        }
        Meaning::BitField(name) => {
            let named = device.bit_fields.get(name).map(|it| it.fields.as_slice()).unwrap_or_default();
            named.iter().map(|named| named.name.clone()).collect()
        }
        Meaning::Plain | Meaning::Quantity(_) => Vec::new(),
    }
}

/// A value with `$NODEID` replaced.
pub fn resolved(value: &Value, node: NodeId) -> Value {
    match value {
        Value::NodeIdPlus(offset) => Value::Integer(i128::from(*offset) + i128::from(node.get())),
        other => other.clone(),
    }
}

/// The limits of an entry.
pub struct Limits {
    /// The lowest value that is allowed.
    pub low: Option<Value>,
    /// The highest value that is allowed.
    pub high: Option<Value>,
}

impl Limits {
    /// The limits that a value violates, and whether it is below (`Less`) or above them. `holds` decides about
    /// conditional limits.
    pub fn violated(
        entry: &Entry,
        node: NodeId,
        holds: impl Fn(&Condition) -> bool,
        value: &Value,
    ) -> Option<(Ordering, Limits)> {
        let at_node = |bound: Option<Value>| bound.map(|bound| resolved(&bound, node));
        Limits::all(entry, holds)
            .map(|Limits { low, high }| Limits { low: at_node(low), high: at_node(high) })
            .find_map(|limits| Some(limits.compare(value)).filter(|side| side.is_ne()).map(|side| (side, limits)))
    }

    /// The conditional limits that hold, then the entry's own.
    fn all(entry: &Entry, holds: impl Fn(&Condition) -> bool) -> impl Iterator<Item = Limits> {
        let own = Limits { low: entry.low.clone(), high: entry.high.clone() };
        entry.ranges.iter().filter(move |range| holds(&range.when)).map(Limits::from).chain([own])
    }

    /// Whether a value is below (`Less`), above (`Greater`), or within the limits (`Equal`).
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

/// The named bits of a word in the runtime's form, without those in the mask `without`.
fn bits(fields: &[Named<Bits>], without: u16) -> Vec<object::BitName<'_>> {
    let name = |it: &'_ Named<Bits>| (it.value.low, it.value.high.saturating_sub(it.value.low) + 1);
    let kept = fields.iter().filter(|it| u64::from(without) >> it.value.low.min(63) & 1 == 0);
    kept.map(|it| object::BitName::new(name(it).0, name(it).1, &it.name)).collect()
}

/// A value as text by its data type alone.
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

/// A number with its hexadecimal digits, and with its characters if it may hold some.
fn unsigned(number: i128, data_type: DataType, first_character_high: bool) -> String {
    let Some(bits) = data_type.bits().filter(|_| number > 9) else { return number.to_string() };
    let digits = usize::from(bits / 4);
    let text = ascii(number, bits, first_character_high).map(|text| format!(" {text:?}")).unwrap_or_default();
    format!("{number} ({number:0digits$X}h{text})")
}

fn real(data_type: DataType, number: f64) -> String {
    let (known, raw) = match data_type {
        DataType::Real32 => (object::DataType::Real32, u64::from((number as f32).to_bits())),
        _ => (object::DataType::Real64, number.to_bits()),
    };
    object::Meaning::Plain.show(known, raw).to_string()
}

/// The four characters that some devices pack into a number: `AG03`, `load`, `1.00`.
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
    let mut text = String::with_capacity(3 * bytes.len());
    for (at, byte) in bytes.iter().enumerate() {
        text.extend((at > 0).then_some(' '));
        text.extend(hex_digits::<2>((*byte).into()).map(char::from));
    }
    text
}

/// The last `N` hexadecimal digits of a number; ten times as fast as `format!`, which matters for many frames.
pub(crate) fn hex_digits<const N: usize>(number: u32) -> [u8; N] {
    std::array::from_fn(|at| b"0123456789ABCDEF"[(number >> (4 * (N - 1 - at))) as usize & 0xF])
}

#[cfg(test)]
mod tests {
    use super::*;

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
