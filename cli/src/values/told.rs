//! A value and all that can be told of it: for people in words, for programs in fields.

use lexican_eds::model::{Entry, Meaning, Value};
use lexican_eds::types::{Class, DataType};
use lexican_runtime::AbortCode;
use lexican_runtime::object::Address;
use serde_json::{Map, Value as Json, json};

use super::wire::{fitting, parse};
use super::{Known, hex, plain};

/// An entry of a node, and perhaps a value that it had.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Told {
    pub(crate) address: Address,
    /// By the data sheet: `Motor Parameter Set, v-Pos`.
    pub(crate) name: Option<String>,
    pub(crate) data_type: Option<DataType>,
    pub(crate) value: Option<Value>,
    /// What the number counts: the unit, and the number in it.
    pub(crate) unit: Option<(String, f64)>,
    /// The value in words.
    pub(crate) text: Option<String>,
    /// The bytes on the wire.
    pub(crate) raw: Option<Vec<u8>>,
}

impl Told {
    /// An entry without a value.
    pub(crate) fn entry(known: Option<&Known<'_>>, address: Address) -> Self {
        let entry = known.and_then(|known| Some((known, known.entry(address)?)));
        Told {
            address,
            name: entry.map(|(known, entry)| known.name(entry)),
            data_type: entry.map(|(_, entry)| entry.data_type),
            value: None,
            unit: None,
            text: None,
            raw: None,
        }
    }

    /// An entry with the bytes that a transfer carried.
    pub(crate) fn transferred(known: Option<&Known<'_>>, address: Address, data: &[u8]) -> Self {
        let mut told = Told::entry(known, address);
        told.raw = Some(data.to_vec());
        let entry = known.and_then(|known| Some((known, known.entry(address)?)));
        match entry {
            Some((known, entry)) => match parse(entry.data_type, fitting(entry.data_type, data)) {
                Some(value) => told.tell(known, entry, value),
                None => told.text = Some(hex(data)),
            },
            None if is_text(data) => {
                let value = Value::Text(String::from_utf8_lossy(data).into_owned());
                told.text = Some(plain(DataType::VisibleString, &value));
                told.value = Some(value);
            }
            None => told.text = Some(hex(data)),
        }
        told
    }

    /// An entry with its value, as a PDO carries it.
    pub(crate) fn value(known: &Known<'_>, entry: &Entry, value: Value) -> Self {
        let mut told = Told::entry(Some(known), Address::new(entry.index, entry.sub));
        told.tell(known, entry, value);
        told
    }

    fn tell(&mut self, known: &Known<'_>, entry: &Entry, value: Value) {
        self.text = Some(known.describe(entry, &value));
        self.unit = match (&value, &entry.meaning) {
            (Value::Integer(number), Meaning::Quantity(_)) => known.unit(entry).map(|unit| {
                let scaled = *number as f64 * unit.num as f64 / unit.den as f64;
                (unit.symbol.clone(), scaled)
            }),
            _ => None,
        };
        self.value = Some(value);
    }

    /// The same of an entry that a node refused to give or to take.
    pub(crate) fn refusal(&self, code: AbortCode) -> Map<String, Json> {
        let mut fields = self.json();
        fields.insert("abort_code".to_owned(), json!(format!("{:08X}", code.0)));
        fields.insert("abort".to_owned(), json!(code.text()));
        fields
    }

    /// `6064:00 Position Actual Value`.
    pub(crate) fn title(&self) -> String {
        match &self.name {
            Some(name) => format!("{} {name}", self.address),
            None => self.address.to_string(),
        }
    }

    /// The value in words; nothing without a value.
    pub(crate) fn words(&self) -> &str {
        self.text.as_deref().unwrap_or_default()
    }

    /// Every field that there is something to say about.
    pub(crate) fn json(&self) -> Map<String, Json> {
        let mut fields = Map::new();
        let mut put = |key: &str, value: Json| drop(fields.insert(key.to_owned(), value));
        put("address", json!(self.address.to_string()));
        put("index", json!(format!("{:04X}", self.address.index())));
        put("sub", json!(format!("{:02X}", self.address.sub())));
        if let Some(name) = &self.name {
            put("name", json!(name));
        }
        if let Some(data_type) = self.data_type {
            put("type", json!(data_type.name()));
        }
        if let Some(text) = &self.text {
            put("value", self.value.as_ref().map_or(Json::Null, |value| number(self.data_type, value)));
            put("text", json!(text));
        }
        if let Some((unit, scaled)) = &self.unit {
            put("unit", json!(unit));
            put("scaled", json!(scaled));
        }
        if let Some(raw) = &self.raw {
            put("raw", json!(hex(raw)));
        }
        fields
    }
}

/// A value as JSON has it; `null` for bytes, and for numbers that JSON does not have.
pub(crate) fn number(data_type: Option<DataType>, value: &Value) -> Json {
    match value {
        Value::Integer(number) if data_type.is_some_and(|it| it.class() == Class::Boolean) => json!(*number != 0),
        Value::Integer(number) => i64::try_from(*number)
            .map(Json::from)
            .or_else(|_| u64::try_from(*number).map(Json::from))
            .unwrap_or(Json::Null),
        Value::Real(number) => json!(number),
        Value::Text(text) => json!(text),
        Value::Bytes(_) | Value::NodeIdPlus(_) => Json::Null,
    }
}

/// Whether bytes of unknown meaning are meant to be read.
fn is_text(data: &[u8]) -> bool {
    data.len() > 4 && data.iter().all(|byte| byte.is_ascii_graphic() || *byte == b' ')
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Loaded;

    #[test]
    fn a_value_is_told_as_count_in_its_unit_and_in_words() {
        let device = Loaded::named("siko/ag03-1").unwrap().device;
        let known = Known::new(&device);
        let check = |index, sub, data: &[u8], fields: &str| {
            let told = Told::transferred(Some(&known), Address::new(index, sub), data);
            assert_eq!(Json::Object(told.json()).to_string(), fields);
        };
        check(
            0x241B,
            1,
            &[240, 0],
            r#"{"address":"241B:01","index":"241B","name":"Power Supply Voltage, Output Stage","raw":"F0 00","scaled":24.0,"sub":"01","text":"24.0 V","type":"UNSIGNED16","unit":"V","value":240}"#,
        );
    }

    #[test]
    fn what_is_unknown_is_told_in_bytes_or_letters() {
        let check = |data: &[u8], text: &str, value: Option<Value>| {
            let told = Told::transferred(None, Address::new(0x2000, 0), data);
            assert_eq!((told.words(), told.value.as_ref()), (text, value.as_ref()));
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
