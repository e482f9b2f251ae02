//! The initial values of a device: the bytes of each entry before it is first written.

use crate::model::number::{Number, fits_every_node, fitting, raw};
use crate::model::{AccessType, Condition, Device, Entry, Value};
use crate::types::DataType;
use lexican_cia::cia301;

/// The initial value of an entry, in wire form.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Initial {
    /// Little-endian, with the length of the data type.
    pub bytes: Vec<u8>,
    /// Whether the node-ID has to be added.
    pub node_relative: bool,
    /// Whether the data sheet states the value, as a default or as `ParameterValue` of a DCF.
    pub is_given: bool,
}

impl Initial {
    /// The bytes for the device with this node-ID.
    #[must_use]
    pub fn of_node(&self, node: u8) -> Vec<u8> {
        let mut carry = if self.node_relative { u16::from(node) } else { 0 };
        let add = |byte: &u8| {
            let sum = u16::from(*byte) + carry;
            carry = sum >> 8;
            sum as u8
        };
        self.bytes.iter().map(add).collect()
    }
}

/// The initial value of an entry: as configured by a DCF, else the default.
///
/// If neither is given or valid: 1018h has the identity of `[DeviceInfo]`, sub-index 0 of a PDO mapping the number of
/// mapped objects, a read-only sub-index 0 of other objects the highest sub-index (CiA 301, 7.4.3), and 1010h and 1011h
/// the value 1, as parameters are stored and restored on command. Any other entry has the value nearest to zero within
/// its limits.
///
/// 1003h:00 is 0, as no error has occurred, even if an editor wrote the number of fields or FEh as its default.
#[must_use]
pub fn initial(device: &Device, entry: &Entry) -> Initial {
    let given = given(entry);
    let fixed = |bytes| Initial { bytes, node_relative: false, is_given: given.is_some() };
    let Some(bits) = entry.data_type.bits() else {
        return fixed(given.and_then(|value| text_or_bytes(value, entry.data_type)).unwrap_or_default());
    };
    let bytes = |number| raw(number, entry.data_type).to_le_bytes()[..usize::from(bits).div_ceil(8)].to_vec();
    match given {
        Some(&Value::NodeIdPlus(base)) => {
            Initial { bytes: bytes(Number::Integer(base.into())), node_relative: true, is_given: true }
        }
        _ => fixed(bytes(number(device, entry))),
    }
}

/// The value that the data sheet gives the entry, if it fits the data type for every node-ID.
fn given(entry: &Entry) -> Option<&Value> {
    let is_value = |value: &&Value| match *value {
        &Value::NodeIdPlus(base) => fits_every_node(base, entry.data_type),
        value if entry.data_type.bits().is_some() => fitting(value, entry.data_type).is_some(),
        value => matches!(value, Value::Text(_) | Value::Bytes(_)),
    };
    [&entry.configured, &entry.default].into_iter().flatten().find(is_value)
}

/// The initial value of an entry that is the same for every node-ID.
fn number(device: &Device, entry: &Entry) -> Number {
    let stated = stated(device, entry);
    stated.unwrap_or_else(|| nearest_to_zero(entry.data_type, limits(device, entry)))
}

/// The value that the data sheet gives, directly or elsewhere.
fn stated(device: &Device, entry: &Entry) -> Option<Number> {
    if (entry.index, entry.sub) == (cia301::PREDEFINED_ERROR_FIELD, 0) {
        return Some(Number::Integer(0));
    }
    let given = given(entry).and_then(|value| fitting(value, entry.data_type));
    let info = &device.info;
    let elsewhere = || match (entry.index, entry.sub) {
        (cia301::IDENTITY, 1) => info.vendor_number,
        (cia301::IDENTITY, 2) => info.product_number,
        (cia301::IDENTITY, 3) => info.revision_number,
        // Bit 0: stores, or restores, on command (CiA 301, 7.5.2.13 and 7.5.2.14).
        (cia301::STORE_PARAMETERS | cia301::RESTORE_DEFAULT_PARAMETERS, 1..) => Some(1),
        (index, 0) if cia301::is_pdo_mapping(index) => mapped(device, index).map(u32::from),
        // A writable sub-index 0 counts something else, such as errors.
        (index, 0) if matches!(entry.access, AccessType::Ro | AccessType::Const) => {
            highest_sub(device, index).map(u32::from)
        }
        _ => None,
    };
    given.or_else(|| fitting(&Value::Integer(elsewhere()?.into()), entry.data_type))
}

/// The number of objects that the PDO maps.
fn mapped(device: &Device, mapping: u16) -> Option<u8> {
    let mut pdos = device.pdos.iter();
    let pdo = pdos.find(|pdo| pdo.direction.mapping_parameter(pdo.number) == mapping)?;
    u8::try_from(pdo.mapping.len()).ok()
}

/// The highest sub-index, if there is more than sub-index 0. FFh is not counted (CiA 301, 7.4.4).
fn highest_sub(device: &Device, index: u16) -> Option<u8> {
    let entries = &device.object(index)?.entries;
    entries.iter().map(|entry| entry.sub).rfind(|sub| (1..0xFF).contains(sub))
}

type Range = (Option<Number>, Option<Number>);

/// The limits of an entry at start, including those that depend on other entries, unless they contradict each other.
fn limits(device: &Device, entry: &Entry) -> Range {
    let limit = |value: Option<&Value>| fitting(value?, entry.data_type);
    let own = (limit(entry.low.as_ref()), limit(entry.high.as_ref()));
    let holds = |when: &Condition| {
        let other = device.entry(when.index, when.sub);
        let value = other.map(|other| stated(device, other).unwrap_or(Number::Integer(0)));
        value.is_some_and(|value| (value == Number::Integer(when.value)) == when.equal)
    };
    let within = entry.ranges.iter().filter(|range| holds(&range.when)).fold(own, |(low, high), range| {
        let [lowest, highest] = [range.low, range.high].map(|limit| fitting(&Value::Integer(limit), entry.data_type));
        (tighter(low, lowest, Number::is_below), tighter(high, highest, |a, b| b.is_below(a)))
    });
    if is_empty(within) { own } else { within }
}

fn tighter(a: Option<Number>, b: Option<Number>, is_wider: impl Fn(Number, Number) -> bool) -> Option<Number> {
    match (a, b) {
        (Some(a), Some(b)) if is_wider(a, b) => Some(b),
        (None, b) => b,
        (a, _) => a,
    }
}

fn is_empty((low, high): Range) -> bool {
    low.zip(high).is_some_and(|(low, high)| high.is_below(low))
}

fn nearest_to_zero(data_type: DataType, range: Range) -> Number {
    let zero = fitting(&Value::Integer(0), data_type).unwrap_or(Number::Integer(0));
    match range {
        _ if is_empty(range) => zero,
        (Some(low), _) if zero.is_below(low) => low,
        (_, Some(high)) if high.is_below(zero) => high,
        _ => zero,
    }
}

fn text_or_bytes(value: &Value, data_type: DataType) -> Option<Vec<u8>> {
    match value {
        Value::Text(text) if data_type == DataType::UnicodeString => {
            Some(text.encode_utf16().flat_map(u16::to_le_bytes).collect())
        }
        Value::Text(text) => Some(Value::visible_string(text)),
        Value::Bytes(bytes) => Some(bytes.clone()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Input, Source};

    const SHEET: &str = "
[DeviceInfo]
VendorNumber=0x195
ProductNumber=7
RevisionNumber=0x10002
[MandatoryObjects]
SupportedObjects=1
1=0x1018
[1018]
ParameterName=Identity
ObjectType=9
SubNumber=5
[1018sub0]
ParameterName=Number
DataType=5
AccessType=ro
[1018sub1]
ParameterName=Vendor
DataType=7
AccessType=ro
[1018sub2]
ParameterName=Product
DataType=7
AccessType=ro
DefaultValue=8
[1018sub3]
ParameterName=Revision
DataType=7
AccessType=ro
[1018sub4]
ParameterName=Serial
DataType=7
AccessType=ro
[ManufacturerObjects]
SupportedObjects=1
1=0x2000
[2000]
ParameterName=Entry
";

    #[track_caller]
    fn check(address: (u16, u8), keys: &str, expected: &[u8]) {
        let input = Input::new(Source::new("start.dcf", format!("{SHEET}{}", keys.replace(' ', "\n"))));
        let (device, _) = crate::load(&input);
        let initial = initial(&device, device.entry(address.0, address.1).unwrap());
        assert_eq!(initial.of_node(5), expected, "{address:04X?} {keys}");
    }

    #[test]
    fn no_error_has_occurred_before_the_first() {
        let history = "ObjectType=8 SubNumber=2 [1003sub0] ParameterName=N DataType=5 AccessType=rw DefaultValue=0xFE \
                       [1003sub1] ParameterName=E DataType=7 AccessType=ro";
        let keys = format!("[OptionalObjects] SupportedObjects=1 1=0x1003 [1003] ParameterName=Errors {history}");
        check((0x1003, 0), &format!("ObjectType=7 DataType=5 AccessType=rw {keys}"), &[0]);
    }

    #[test]
    fn without_a_default_it_is_within_its_limits() {
        let check =
            |keys: &str, expected: &[u8]| check((0x2000, 0), &format!("ObjectType=7 AccessType=rw {keys}"), expected);
        check("DataType=5", &[0]);
        check("DataType=5 LowLimit=2 HighLimit=3", &[2]);
        check("DataType=5 LowLimit=2", &[2]);
        check("DataType=2 LowLimit=-5 HighLimit=-2", &[0xFE]);
        check("DataType=2 HighLimit=-2", &[0xFE]);
        check("DataType=2 LowLimit=-5 HighLimit=7", &[0]);
        check("DataType=5 LowLimit=3 HighLimit=2", &[0]);
        check("DataType=8 LowLimit=0.5", &0.5_f32.to_le_bytes());
        check("DataType=5 LowLimit=2 DefaultValue=1", &[1]);
        check("DataType=5 LowLimit=2 DefaultValue=1 ParameterValue=4", &[4]);
        check("DataType=5 LowLimit=2 DefaultValue=300", &[2]);
        check("DataType=5 LowLimit=2 DefaultValue=7 ParameterValue=300", &[7]);
        check("DataType=6 DefaultValue=$NODEID+0xFE", &[0x03, 0x01]);
        check("DataType=9 DefaultValue=Größe", b"Gr\xF6\xDFe");
        check("DataType=0xB DefaultValue=\u{20AC}", &[0xAC, 0x20]);
    }

    #[test]
    fn the_identity_is_that_of_the_device_info() {
        check((0x1018, 0), "", &[4]);
        check((cia301::IDENTITY, 1), "", &0x195_u32.to_le_bytes());
        check((cia301::IDENTITY, 2), "", &8_u32.to_le_bytes());
        check((cia301::IDENTITY, 3), "", &0x1_0002_u32.to_le_bytes());
        check((0x1018, 4), "", &[0; 4]);
    }

    #[test]
    fn a_pdo_maps_what_its_data_sheet_has() {
        let entry = |sub: u8, keys: &str| format!("[1600sub{sub}] ParameterName=Entry{sub} AccessType=rw {keys} ");
        let check = |count: &str, expected: u8| {
            let mapping = ["DataType=7 DefaultValue=0x20000008", "DataType=7 DefaultValue=0x20010008", "DataType=7"];
            let entries: String = (1..).zip(mapping).map(|(sub, keys)| entry(sub, keys)).collect();
            let count = entry(0, &format!("DataType=5 {count}"));
            let object = "ObjectType=7 AccessType=rw [OptionalObjects] SupportedObjects=1 1=0x1600 [1600] ParameterName=Mapping ObjectType=9 SubNumber=4";
            check((0x1600, 0), &format!("{object} {count}{entries}"), &[expected]);
        };
        check("", 2);
        check("DefaultValue=1", 1);
        check("DefaultValue=0", 0);
    }

    #[test]
    fn limits_that_depend_on_another_entry_hold_from_the_start() {
        let eds = format!("{SHEET}ObjectType=7\nDataType=5\nAccessType=rw\nHighLimit=9\n");
        let ranges = |when: &str, low: u8| {
            let range = format!("{{ when = \"1018:02 {when} 8\", low = {low}, high = 20 }}");
            format!("[overlay]\nformat = 1\n[object.\"2000\"]\nranges = [{range}]\n")
        };
        for (overlay, expected) in [(ranges("==", 4), 4), (ranges("!=", 4), 0), (ranges("==", 12), 0)] {
            let input = Input::new(Source::new("start.eds", &*eds)).overlay(Source::new("overlay.toml", &*overlay));
            let (device, findings) = crate::load(&input);
            assert!(!findings.has_errors(), "{}", findings.render(&input));
            assert_eq!(initial(&device, device.entry(0x2000, 0).unwrap()).bytes, [expected], "{overlay}");
        }
    }
}
