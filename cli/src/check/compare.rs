//! What a data sheet says of an entry, and what its device does: where they differ.

use lexican_eds::model::{AccessType, DeviceInfo, Entry, ObjectList, Value};
use lexican_eds::types::DataType;
use lexican_runtime::object::Address;
use lexican_runtime::{AbortCode, NodeId};

use crate::values::wire::{fitting, parse};
use crate::values::{Known, Limits, hex, plain, resolved};

/// How a device answered when an entry was read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Answer {
    Value(Vec<u8>),
    Refused(AbortCode),
    /// Not at all, or not as SDO has it; in words.
    Failed(String),
    /// It was not asked; why.
    Unasked(&'static str),
}

/// Where device and data sheet differ, or why nobody can tell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Finding {
    pub(super) kind: Kind,
    pub(super) text: String,
}

/// What differs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    /// The device has no such entry.
    Missing,
    /// The data have another length than the type.
    Type,
    /// Reading or writing is allowed where the data sheet forbids it, or the other way round.
    Access,
    /// The value is beyond the limits.
    Limit,
    /// A constant has another value.
    Constant,
    /// Another number of sub-indices.
    Count,
    /// It is another device.
    Identity,
    /// The device did not answer as a device does.
    Failed,
    /// The data sheet contradicts itself, and the device is as one half of it says.
    Sheet,
    /// A value that may change is not the default.
    Default,
    /// It could not be found out.
    Unchecked,
}

impl Kind {
    pub(super) const fn name(self) -> &'static str {
        match self {
            Kind::Missing => "missing",
            Kind::Type => "type",
            Kind::Access => "access",
            Kind::Limit => "limit",
            Kind::Constant => "constant",
            Kind::Count => "count",
            Kind::Identity => "identity",
            Kind::Failed => "failed",
            Kind::Sheet => "sheet",
            Kind::Default => "default",
            Kind::Unchecked => "unchecked",
        }
    }

    /// Whether the data sheet is not that of the device.
    pub(super) const fn is_difference(self) -> bool {
        !matches!(self, Kind::Sheet | Kind::Default | Kind::Unchecked)
    }
}

/// Compares entries of one device.
pub(super) struct Comparison<'a> {
    pub(super) known: &'a Known<'a>,
    pub(super) node: NodeId,
    /// Whether values are compared with their defaults, too.
    pub(super) defaults: bool,
}

impl Comparison<'_> {
    /// What is found when an entry was read.
    pub(super) fn read(&self, entry: &Entry, answer: &Answer) -> Vec<Finding> {
        match answer {
            Answer::Value(_) if entry.access == AccessType::Wo => {
                vec![finding(Kind::Access, "the data sheet says wo, but the device lets it be read")]
            }
            Answer::Value(data) => self.value(entry, data),
            Answer::Refused(code) => refused(self.list(entry), entry, *code).into_iter().collect(),
            Answer::Failed(text) => vec![finding(Kind::Failed, text)],
            Answer::Unasked(why) => vec![finding(Kind::Unchecked, why)],
        }
    }

    fn list(&self, entry: &Entry) -> ObjectList {
        self.known.device.object(entry.index).map_or(ObjectList::Optional, |object| object.list)
    }

    fn value(&self, entry: &Entry, data: &[u8]) -> Vec<Finding> {
        let data = fitting(entry.data_type, data);
        let Some(value) = parse(entry.data_type, data) else {
            let text = format!("{} bytes ({}) are no {}", data.len(), hex(data), entry.data_type);
            return vec![finding(Kind::Type, &text)];
        };
        let initial = lexican_codegen::initial(self.known.device, entry);
        let stated = initial.of_node(self.node.get());
        let found = [
            self.limit(entry, &value),
            initial.is_given.then(|| self.constant(entry, &value, &stated)).flatten(),
            self.count(entry, &value),
            identity(&self.known.device.info, entry, &value),
        ];
        let mut found: Vec<Finding> = found.into_iter().flatten().collect();
        if data == stated {
            // The device has the value that its data sheet gives it: the contradiction is not the device's.
            for finding in &mut found {
                finding.kind = Kind::Sheet;
                finding.text.push_str("; so the data sheet has it itself");
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
        let bound = |bound: &Option<Value>| bound.as_ref().map(|bound| resolved(bound, self.node));
        let own = Limits { low: bound(&entry.low), high: bound(&entry.high) };
        let ranges = entry.ranges.iter().filter(|range| self.known.holds(&range.when)).map(Limits::from);
        let beyond = ranges.chain([own]).find(|limits| limits.compare(value).is_ne())?;
        let show = |bound: Option<&Value>| bound.map_or_else(|| "any".to_owned(), |bound| plain_number(entry, bound));
        let (low, high) = (show(beyond.low.as_ref()), show(beyond.high.as_ref()));
        Some(finding(Kind::Limit, &format!("{} is not within {low} to {high}", plain_number(entry, value))))
    }

    /// A constant, and what CiA 301 has as one, is as the data sheet says. Other values are compared when asked for.
    fn constant(&self, entry: &Entry, value: &Value, stated: &[u8]) -> Option<Finding> {
        let expected = parse(entry.data_type, stated).filter(|expected| expected != value)?;
        // 1018h:04 is the number of one specimen, and 1001h says what is wrong with it now.
        let is_constant = entry.access == AccessType::Const || (entry.index, entry.sub) == (0x1000, 0);
        let kind = match is_constant {
            true => Kind::Constant,
            false if self.defaults && !matches!(entry.index, 0x1001 | 0x1018) => Kind::Default,
            false => return None,
        };
        let describe = |value: &Value| self.known.describe(entry, value);
        Some(finding(kind, &format!("it is {}, by the data sheet {}", describe(value), describe(&expected))))
    }

    /// Sub-index 0 of a record or an array is the highest sub-index (CiA 301, 7.4.4).
    fn count(&self, entry: &Entry, value: &Value) -> Option<Finding> {
        let object =
            self.known.device.object(entry.index).filter(|object| entry.sub == 0 && object.entries.len() > 1)?;
        let counts_itself = matches!(entry.index, 0x1003 | 0x1600..=0x17FF | 0x1A00..=0x1BFF);
        let highest = object.entries.iter().map(|entry| entry.sub).filter(|sub| *sub < 0xFF).max()?;
        let there = value.as_integer()?;
        let more = there > i128::from(highest) && !counts_itself;
        more.then(|| {
            let text = format!("the device has sub-indices up to {there:02X}h, the data sheet up to {highest:02X}h");
            finding(Kind::Count, &text)
        })
    }
}

/// What the data sheet says that the entry holds.
fn given(entry: &Entry) -> Option<&Value> {
    entry.configured.as_ref().or(entry.default.as_ref())
}

/// In decimal, as limits are given.
fn plain_number(entry: &Entry, value: &Value) -> String {
    value.as_integer().map_or_else(|| plain(entry.data_type, value), |number| number.to_string())
}

fn finding(kind: Kind, text: &str) -> Finding {
    Finding { kind, text: text.to_owned() }
}

/// What a refusal to be read means.
fn refused(list: ObjectList, entry: &Entry, code: AbortCode) -> Option<Finding> {
    let is_history = entry.index == 0x1003 && entry.sub > 0;
    match code {
        AbortCode::WRITE_ONLY if entry.access == AccessType::Wo => None,
        // Some devices have one code for every refusal.
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

/// What is found when the value of an entry that may be written was written back.
pub(super) fn written_back(code: AbortCode) -> Finding {
    match code {
        AbortCode::READ_ONLY | AbortCode::UNSUPPORTED_ACCESS => {
            finding(Kind::Access, "the data sheet says rw, but the device does not let it be written")
        }
        code => finding(Kind::Unchecked, &format!("its own value could not be written back: {code}")),
    }
}

/// Whether an entry may be written back without anything happening but that: what commands the device is left alone.
pub(super) fn may_be_written_back(entry: &Entry) -> bool {
    let writable = matches!(entry.access, AccessType::Rw | AccessType::Rwr | AccessType::Rww);
    let commands = matches!(entry.index, 0x1003 | 0x1010 | 0x1011 | 0x1F50..=0x1F5F | 0x1F80..=0x1F8F | 0x6040);
    writable && !commands && entry.data_type != DataType::Domain
}

/// Whether it is the device that the data sheet is about.
fn identity(info: &DeviceInfo, entry: &Entry, value: &Value) -> Option<Finding> {
    let (what, expected) = match (entry.index, entry.sub) {
        (0x1018, 1) => ("vendor", info.vendor_number?),
        (0x1018, 2) => ("product", info.product_number?),
        _ => return None,
    };
    let found = value.as_integer()?;
    (found != i128::from(expected))
        .then(|| finding(Kind::Identity, &format!("another {what}: {found:X}h, by the data sheet {expected:X}h")))
}

/// The address of an entry.
pub(super) fn address(entry: &Entry) -> Address {
    Address::new(entry.index, entry.sub)
}

#[cfg(test)]
mod tests {
    use super::*;
    use lexican_eds::model::Device;
    use lexican_eds::{Input, Source};

    fn sensor() -> Device {
        lexican_eds::load(&Input::new(Source::new("sensor.eds", include_str!("../../tests/sensor.eds")))).0
    }

    /// What is found of an entry with this answer.
    #[track_caller]
    fn check(entry: (u16, u8), answer: Answer, expected: &[(Kind, &str)]) {
        let device = sensor();
        let known = Known::new(&device);
        let comparison = Comparison { known: &known, node: NodeId::literal(7), defaults: true };
        let found = comparison.read(device.entry(entry.0, entry.1).unwrap(), &answer);
        let found: Vec<_> = found.iter().map(|finding| (finding.kind, finding.text.as_str())).collect();
        assert_eq!(found, expected, "{entry:04X?} {answer:?}");
    }

    fn value(bytes: &[u8]) -> Answer {
        Answer::Value(bytes.to_vec())
    }

    #[test]
    fn what_is_as_described_is_not_found() {
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
    fn what_nobody_can_tell_is_no_difference() {
        let refused = Answer::Refused(AbortCode::DEVICE_STATE);
        let device = sensor();
        let known = Known::new(&device);
        let comparison = Comparison { known: &known, node: NodeId::literal(7), defaults: false };
        let found = comparison.read(device.entry(0x2000, 0).unwrap(), &refused);
        assert!(found.len() == 1 && !found[0].kind.is_difference(), "{found:?}");
        assert!(!written_back(AbortCode::DEVICE_STATE).kind.is_difference());
        assert!(written_back(AbortCode::READ_ONLY).kind.is_difference());
    }

    #[test]
    fn what_commands_the_device_is_not_written_back() {
        let device = sensor();
        let written = |index, sub| may_be_written_back(device.entry(index, sub).unwrap());
        assert!(written(0x1017, 0) && written(0x2001, 0));
        assert!(!written(0x1010, 1) && !written(0x2000, 0) && !written(0x2003, 0));
    }
}
