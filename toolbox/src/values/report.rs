//! An entry and its value in output: as text for people, as fields for programs.

use std::sync::Arc;

use lexican_eds::model::{Entry, Meaning, Value};
use lexican_eds::types::{Class, DataType};
use lexican_runtime::AbortCode;
use lexican_runtime::object::Address;
use serde::ser::{Serialize, SerializeMap, Serializer};
use serde_json::{Map, Value as Json};

use super::wire::parse_padded;
use super::{DeviceValues, hex, hex_digits, plain};
use crate::text::json::{add_some, fields_of};

/// An entry, with its value if known.
#[derive(Clone, Debug, PartialEq)]
pub struct ValueReport {
    /// The entry.
    pub address: Address,
    /// From the data sheet: `Motor Parameter Set, v-Pos`.
    pub name: Option<Arc<str>>,
    /// Without the name of its object: `v-Pos`.
    pub entry: Option<Arc<str>>,
    /// From the data sheet.
    pub data_type: Option<DataType>,
    /// `None` if unknown, or not of the data type.
    pub value: Option<Value>,
    /// The unit, and the value in it.
    pub unit: Option<(String, f64)>,
    /// The value with its unit, or as names of its enumeration or bits.
    pub text: Option<String>,
    /// The bytes in an SDO transfer.
    pub raw: Option<Vec<u8>>,
}

impl ValueReport {
    /// An entry without its value.
    pub fn without_value(device: Option<&DeviceValues<'_>>, address: Address) -> Self {
        Self::new(address, device.and_then(|device| Some((device, device.entry(address)?))))
    }

    fn new(address: Address, entry: Option<(&DeviceValues<'_>, &Entry)>) -> Self {
        ValueReport {
            address,
            name: entry.map(|(device, entry)| device.name(entry).into()),
            entry: entry.map(|(_, entry)| entry.name.as_str().into()),
            data_type: entry.map(|(_, entry)| entry.data_type),
            value: None,
            unit: None,
            text: None,
            raw: None,
        }
    }

    /// An entry with the bytes of an SDO transfer, which may be padded.
    pub fn of_bytes(device: Option<&DeviceValues<'_>>, address: Address, data: &[u8]) -> Self {
        let entry = device.and_then(|device| Some((device, device.entry(address)?)));
        let mut report = ValueReport { raw: Some(data.to_vec()), ..ValueReport::new(address, entry) };
        match entry {
            Some((device, entry)) => match parse_padded(entry.data_type, data) {
                Some(value) => report.set_value(device, entry, value),
                None => report.text = Some(hex(data)),
            },
            None if is_text(data) => {
                let value = Value::Text(String::from_utf8_lossy(data).into_owned());
                report.text = Some(plain(DataType::VisibleString, &value));
                report.value = Some(value);
            }
            None => report.text = Some(hex(data)),
        }
        report
    }

    /// An entry with its value from a PDO.
    pub fn of_value(device: &DeviceValues<'_>, entry: &Entry, value: Value) -> Self {
        let mut report = ValueReport::new(super::address(entry), Some((device, entry)));
        report.set_value(device, entry, value);
        report
    }

    pub(crate) fn set_value(&mut self, device: &DeviceValues<'_>, entry: &Entry, value: Value) {
        self.text = Some(device.describe(entry, &value));
        self.unit = match (&value, &entry.meaning) {
            (Value::Integer(number), Meaning::Quantity(_)) => {
                device.unit(entry).map(|unit| (unit.symbol.clone(), *number as f64 * unit.num as f64 / unit.den as f64))
            }
            _ => None,
        };
        self.value = Some(value);
    }

    /// The JSON fields of an entry whose access was aborted.
    pub fn refusal(&self, code: AbortCode) -> Map<String, Json> {
        let mut fields = self.json();
        fields.insert("abort_code".to_owned(), format!("{:08X}", code.0).into());
        fields.insert("abort".to_owned(), code.text().into());
        fields
    }

    /// `6064:00 Position Actual Value`.
    pub fn title(&self) -> String {
        match &self.name {
            Some(name) => format!("{} {name}", self.address),
            None => self.address.to_string(),
        }
    }

    /// The value as text; empty if unknown.
    pub fn text(&self) -> &str {
        self.text.as_deref().unwrap_or_default()
    }

    /// `6064:00 Position Actual Value = 0 increments`.
    pub fn equation(&self) -> String {
        format!("{} = {}", self.title(), self.text())
    }

    /// `Statusword = OPERATION ENABLED`, without the name of the object: for short lines.
    #[must_use]
    pub fn brief(&self) -> String {
        let mut line = String::new();
        self.add_brief(&mut line);
        line
    }

    /// Appends [`brief`](Self::brief) to a line.
    pub(crate) fn add_brief(&self, line: &mut String) {
        match &self.entry {
            Some(name) => line.push_str(name),
            None => line.push_str(&self.address.to_string()),
        }
        line.push_str(" = ");
        line.push_str(self.text());
    }

    /// The JSON fields; unknown ones are left out.
    pub fn json(&self) -> Map<String, Json> {
        fields_of(self)
    }
}

/// Leaves out unknown fields.
impl Serialize for ValueReport {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        let ([a, b, c, d], [e, f]) = (hex_digits(self.address.index().into()), hex_digits(self.address.sub().into()));
        let address = [a, b, c, d, b':', e, f];
        let address = str::from_utf8(&address).expect("digits are UTF-8");
        map.serialize_entry("address", address)?;
        map.serialize_entry("index", &address[..4])?;
        add_some(&mut map, "name", self.name.as_deref())?;
        add_some(&mut map, "raw", self.raw.as_deref().map(hex))?;
        add_some(&mut map, "scaled", self.unit.as_ref().map(|(_, scaled)| scaled))?;
        map.serialize_entry("sub", &address[5..])?;
        add_some(&mut map, "text", self.text.as_ref())?;
        add_some(&mut map, "type", self.data_type.map(DataType::name))?;
        add_some(&mut map, "unit", self.unit.as_ref().map(|(symbol, _)| symbol))?;
        if self.text.is_some() {
            map.serialize_entry("value", &self.value.as_ref().map(|value| number(self.data_type, value)))?;
        }
        map.end()
    }
}

/// The value in JSON; `null` for bytes, and for numbers that JSON cannot hold.
fn number(data_type: Option<DataType>, value: &Value) -> Json {
    match value {
        Value::Integer(number) if data_type.is_some_and(|it| it.class() == Class::Boolean) => Json::from(*number != 0),
        Value::Integer(number) => i64::try_from(*number)
            .map(Json::from)
            .or_else(|_| u64::try_from(*number).map(Json::from))
            .unwrap_or(Json::Null),
        Value::Real(number) => Json::from(*number),
        Value::Text(text) => Json::from(text.as_str()),
        Value::Bytes(_) | Value::NodeIdPlus(_) => Json::Null,
    }
}

/// Whether bytes of an unknown type look like text.
fn is_text(data: &[u8]) -> bool {
    data.len() > 4 && data.iter().all(|byte| byte.is_ascii_graphic() || *byte == b' ')
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;
    use serde_json::json;

    #[test]
    fn a_value_has_a_number_a_unit_and_a_text() {
        let device = samples::drive();
        let report = ValueReport::of_bytes(Some(&DeviceValues::new(&device)), Address::new(0x241B, 1), &[240, 0]);
        assert_eq!(
            Json::Object(report.json()).to_string(),
            r#"{"address":"241B:01","index":"241B","name":"Power Supply Voltage, Output Stage","raw":"F0 00","scaled":24.0,"sub":"01","text":"24.0 V","type":"UNSIGNED16","unit":"V","value":240}"#,
        );
    }

    #[test]
    fn a_value_of_unknown_type_is_bytes_or_a_text() {
        let check = |data: &[u8], text: &str, value: Option<Value>| {
            let report = ValueReport::of_bytes(None, Address::new(0x2000, 0), data);
            assert_eq!((report.text(), report.value.as_ref()), (text, value.as_ref()));
        };
        check(&[1, 2], "01 02", None);
        check(b"AG03-1", "\"AG03-1\"", Some(Value::Text("AG03-1".to_owned())));
        check(b"AG03", "41 47 30 33", None);
    }

    #[test]
    fn json_gets_the_numbers_that_it_can_hold() {
        assert_eq!(number(None, &Value::Integer(i128::from(u64::MAX))), json!(u64::MAX));
        assert_eq!(number(None, &Value::Integer(-5)), json!(-5));
        assert_eq!(number(Some(DataType::Boolean), &Value::Integer(1)), json!(true));
        assert_eq!(number(None, &Value::Real(f64::NAN)), Json::Null);
    }
}
