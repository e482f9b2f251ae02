//! Compares a device with its data sheet.

use std::fmt;

use lexican_eds::model::{AccessType, Device, DeviceInfo, Entry, ObjectList, Value};
use lexican_eds::standard::{Role, role};
use lexican_eds::types::DataType;
use lexican_runtime::{AbortCode, NodeId, cia301};

use crate::node::remote::Refusal;
use crate::values::wire::{fitting, parse};
use crate::values::{DeviceValues, Limits, given, hex, plain};

/// The result of reading an entry.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// The bytes read.
    Value(Vec<u8>),
    /// The device has aborted the transfer.
    Refused(AbortCode),
    /// Why there was no valid response.
    Failed(String),
    /// Why the entry was not read.
    NotRead(&'static str),
}

impl From<Result<Vec<u8>, Refusal>> for Answer {
    fn from(result: Result<Vec<u8>, Refusal>) -> Self {
        match result {
            Ok(data) => Answer::Value(data),
            Err(Refusal::Aborted(code)) => Answer::Refused(code),
            Err(Refusal::Failed(text)) => Answer::Failed(text),
        }
    }
}

/// A difference between device and data sheet, or why the entry could not be checked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// What it is about.
    pub kind: Kind,
    /// The finding as text.
    pub text: String,
}

/// The kind of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// The device lacks the entry.
    Missing,
    /// The length of the value is not that of the data type.
    Type,
    /// The device allows an access that the data sheet forbids, or the reverse.
    Access,
    /// The value is outside the limits.
    Limit,
    /// A constant has another value than in the data sheet.
    Constant,
    /// The number of sub-indices differs.
    Count,
    /// The vendor-ID or product code differs: it is another device.
    Identity,
    /// The device did not respond, or violated the protocol.
    Failed,
    /// The data sheet contradicts itself, and the device agrees with one of its statements.
    Sheet,
    /// The value of a variable is not the default.
    Default,
    /// The entry could not be checked.
    Unchecked,
}

/// The name of the variant in lower case.
impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&format!("{self:?}").to_lowercase())
    }
}

impl Kind {
    /// Whether the device differs from its data sheet.
    #[must_use]
    pub const fn is_difference(self) -> bool {
        !matches!(self, Kind::Sheet | Kind::Default | Kind::Unchecked)
    }
}

/// Compares the answers of a device with its data sheet.
pub struct Comparison<'a> {
    /// The data sheet, with the values on which meanings and limits depend.
    pub values: &'a DeviceValues<'a>,
    /// The node-ID of the device.
    pub node: NodeId,
}

impl Comparison<'_> {
    /// The findings about an entry, given the result of reading it.
    #[must_use]
    pub fn read(&self, entry: &Entry, answer: &Answer) -> Vec<Finding> {
        match answer {
            Answer::Value(_) if entry.access == AccessType::Wo => {
                vec![finding(Kind::Access, "the data sheet says wo, but the device lets it be read")]
            }
            Answer::Value(data) => self.value(entry, data),
            Answer::Refused(code) => refused(self.list(entry), entry, *code).into_iter().collect(),
            Answer::Failed(text) => vec![finding(Kind::Failed, text)],
            Answer::NotRead(why) => vec![finding(Kind::Unchecked, why)],
        }
    }

    fn list(&self, entry: &Entry) -> ObjectList {
        self.values.device.object(entry.index).map_or(ObjectList::Optional, |object| object.list)
    }

    fn value(&self, entry: &Entry, data: &[u8]) -> Vec<Finding> {
        let data = fitting(entry.data_type, data);
        let Some(value) = parse(entry.data_type, data) else {
            let text = format!("{} bytes ({}) are no {}", data.len(), hex(data), entry.data_type);
            return vec![finding(Kind::Type, &text)];
        };
        let initial = lexican_eds::start::initial(self.values.device, entry);
        let stated = initial.of_node(self.node.get());
        let found = [
            self.limit(entry, &value),
            initial.is_given.then(|| self.constant(entry, &value, &stated)).flatten(),
            self.count(entry, &value),
            identity(&self.values.device.info, entry, &value),
        ];
        let mut found: Vec<Finding> = found.into_iter().flatten().collect();
        if data == stated {
            // The device has the value of the data sheet, so the data sheet contradicts itself.
            for finding in &mut found {
                finding.kind = Kind::Sheet;
                finding.text.push_str("; the data sheet itself has this value");
            }
        }
        if let Some(given) = given(entry).filter(|_| !initial.is_given) {
            let given = plain(entry.data_type, given);
            found.push(finding(
                Kind::Sheet,
                &format!("the data sheet gives it {given}, which is no {}", entry.data_type),
            ));
        }
        found
    }

    fn limit(&self, entry: &Entry, value: &Value) -> Option<Finding> {
        let (_, limits) = Limits::violated(entry, self.node, |when| self.values.holds(when), value)?;
        let show = |bound: Option<&Value>| bound.map_or_else(|| "any".to_owned(), |bound| plain_number(entry, bound));
        let (low, high) = (show(limits.low.as_ref()), show(limits.high.as_ref()));
        Some(finding(Kind::Limit, &format!("{} is not within {low} to {high}", plain_number(entry, value))))
    }

    /// Compares a value with that of the data sheet. A constant, by the data sheet or by CiA 301, must have it. Another
    /// value of a writable entry is only noted, and any other entry may be measured.
    fn constant(&self, entry: &Entry, value: &Value, stated: &[u8]) -> Option<Finding> {
        let expected = parse(entry.data_type, stated).filter(|expected| expected != value)?;
        let is_constant = entry.access == AccessType::Const || (entry.index, entry.sub) == (cia301::DEVICE_TYPE, 0);
        let kind = match is_constant {
            true => Kind::Constant,
            false if entry.access.writable() => Kind::Default,
            false => return None,
        };
        let describe = |value: &Value| self.values.describe(entry, value);
        Some(finding(kind, &format!("it is {}, by the data sheet {}", describe(value), describe(&expected))))
    }

    /// Sub-index 0 of a record or array must be the highest sub-index (CiA 301, 7.4.4).
    fn count(&self, entry: &Entry, value: &Value) -> Option<Finding> {
        let object =
            self.values.device.object(entry.index).filter(|object| entry.sub == 0 && object.entries.len() > 1)?;
        let counts_itself = cia301::counts_entries(entry.index);
        let highest = object.entries.iter().map(|entry| entry.sub).filter(|sub| *sub < 0xFF).max()?;
        let there = value.as_integer()?;
        let more = there > i128::from(highest) && !counts_itself;
        more.then(|| {
            let text = format!("the device has sub-indices up to {there:02X}h, the data sheet up to {highest:02X}h");
            finding(Kind::Count, &text)
        })
    }
}

/// A number in decimal, as data sheets give limits.
fn plain_number(entry: &Entry, value: &Value) -> String {
    value.as_integer().map_or_else(|| plain(entry.data_type, value), |number| number.to_string())
}

fn finding(kind: Kind, text: &str) -> Finding {
    Finding { kind, text: text.to_owned() }
}

/// The finding about an entry that could not be read.
fn refused(list: ObjectList, entry: &Entry, code: AbortCode) -> Option<Finding> {
    let is_history = entry.index == cia301::PREDEFINED_ERROR_FIELD && entry.sub > 0;
    match code {
        AbortCode::WRITE_ONLY if entry.access == AccessType::Wo => None,
        // Some devices use one abort code for every refusal.
        AbortCode::UNSUPPORTED_ACCESS if entry.access == AccessType::Wo => None,
        AbortCode::NO_DATA | AbortCode::NO_SUCH_SUB_INDEX if is_history => None,
        AbortCode::NO_SUCH_OBJECT | AbortCode::NO_SUCH_SUB_INDEX => {
            let mandatory = if list == ObjectList::Mandatory { "; the object is mandatory" } else { "" };
            Some(finding(Kind::Missing, &format!("the device has no such entry{mandatory}")))
        }
        AbortCode::WRITE_ONLY | AbortCode::UNSUPPORTED_ACCESS => {
            let text = format!("the data sheet says {}, but the device does not let it be read", entry.access.name());
            Some(finding(Kind::Access, &text))
        }
        code => Some(finding(Kind::Unchecked, &format!("it could not be read: {code}"))),
    }
}

/// The finding about an entry that refuses to be written with its own value.
#[must_use]
pub fn refused_write(code: AbortCode) -> Finding {
    match code {
        AbortCode::READ_ONLY | AbortCode::UNSUPPORTED_ACCESS => {
            finding(Kind::Access, "the data sheet says rw, but the device does not let it be written")
        }
        code => finding(Kind::Unchecked, &format!("its own value could not be written back: {code}")),
    }
}

/// Whether writing an entry with its own value has no other effect. Commands are excluded.
#[must_use]
pub fn may_be_written_back(device: &Device, entry: &Entry) -> bool {
    let both = entry.access.readable() && entry.access.writable();
    let is_command = role(device, entry.index, entry.sub) == Some(Role::Command);
    both && !is_command && entry.data_type != DataType::Domain
}

/// Checks vendor-ID and product code.
fn identity(info: &DeviceInfo, entry: &Entry, value: &Value) -> Option<Finding> {
    let (what, expected) = match (entry.index, entry.sub) {
        (cia301::IDENTITY, 1) => ("vendor", info.vendor_number?),
        (cia301::IDENTITY, 2) => ("product", info.product_number?),
        _ => return None,
    };
    let found = value.as_integer()?;
    (found != i128::from(expected))
        .then(|| finding(Kind::Identity, &format!("another {what}: {found:X}h, by the data sheet {expected:X}h")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::sensor;

    /// Checks the findings about an entry with this answer.
    #[track_caller]
    fn check(entry: (u16, u8), answer: Answer, expected: &[(Kind, &str)]) {
        let device = sensor();
        let values = DeviceValues::new(&device);
        let comparison = Comparison { values: &values, node: NodeId::literal(7) };
        let found = comparison.read(device.entry(entry.0, entry.1).unwrap(), &answer);
        let found: Vec<_> = found.iter().map(|finding| (finding.kind, finding.text.as_str())).collect();
        assert_eq!(found, expected, "{entry:04X?} {answer:?}");
    }

    fn value(bytes: &[u8]) -> Answer {
        Answer::Value(bytes.to_vec())
    }

    #[test]
    fn a_device_like_its_data_sheet_has_no_findings() {
        check((0x1000, 0), value(&[0; 4]), &[]);
        check((0x1014, 0), value(&0x87_u32.to_le_bytes()), &[]);
        check((0x2000, 0), value(&[0, 0]), &[]);
        check((0x2003, 0), Answer::Refused(AbortCode::WRITE_ONLY), &[]);
    }

    #[test]
    fn differences_are_found() {
        check((0x1000, 0), value(&[1, 0, 0, 0]), &[(Kind::Constant, "it is 1, by the data sheet 0")]);
        check((0x2000, 0), value(&[0; 3]), &[(Kind::Type, "3 bytes (00 00 00) are no INTEGER16")]);
        check(
            (0x2001, 0),
            value(&[0, 1]),
            &[(Kind::Limit, "256 is not within 1 to 100"), (Kind::Default, "it is 256 (0100h), by the data sheet 5")],
        );
        check((0x2003, 0), value(&[0, 0]), &[(Kind::Access, "the data sheet says wo, but the device lets it be read")]);
        check(
            (0x1018, 0),
            value(&[6]),
            &[
                (Kind::Constant, "it is 6, by the data sheet 4"),
                (Kind::Count, "the device has sub-indices up to 06h, the data sheet up to 04h"),
            ],
        );
        check((0x1018, 1), value(&[5, 0, 0, 0]), &[(Kind::Identity, "another vendor: 5h, by the data sheet 0h")]);
        let missing = Answer::Refused(AbortCode::NO_SUCH_OBJECT);
        check((0x2000, 0), missing.clone(), &[(Kind::Missing, "the device has no such entry")]);
        check((0x1000, 0), missing, &[(Kind::Missing, "the device has no such entry; the object is mandatory")]);
        let refused = Answer::Refused(AbortCode::WRITE_ONLY);
        check(
            (0x2000, 0),
            refused,
            &[(Kind::Access, "the data sheet says ro, but the device does not let it be read")],
        );
    }

    #[test]
    fn what_could_not_be_checked_is_no_difference() {
        let refused = Answer::Refused(AbortCode::DEVICE_STATE);
        let device = sensor();
        let values = DeviceValues::new(&device);
        let comparison = Comparison { values: &values, node: NodeId::literal(7) };
        let found = comparison.read(device.entry(0x2000, 0).unwrap(), &refused);
        assert!(found.len() == 1 && !found[0].kind.is_difference(), "{found:?}");
        assert!(!refused_write(AbortCode::DEVICE_STATE).kind.is_difference());
        assert!(refused_write(AbortCode::READ_ONLY).kind.is_difference());
    }

    #[test]
    fn entries_that_command_the_device_are_not_written_back() {
        let device = sensor();
        let written = |index, sub| may_be_written_back(&device, device.entry(index, sub).unwrap());
        assert!(written(0x1017, 0) && written(0x2001, 0));
        assert!(!written(0x1010, 1) && !written(0x2000, 0) && !written(0x2003, 0));
    }
}
