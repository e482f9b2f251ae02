//! How each object is generated: as a constant, an array, or a record with one function per member.

use lexican_eds::Diagnostics;
use lexican_eds::model::number::{Number, fits_every_node, fitting};
use lexican_eds::model::{AccessType, Device, Entry, Object, ObjectKind, Value};
use lexican_eds::types::{Class, DataType};

use super::value::{Type, Types, has_values, type_of};
use crate::findings::warning;
use crate::name::{Case, address_suffix};
use crate::scope::{self, Claim};

/// Names that members of a record must not take: methods of the array handle, and names that clippy expects to be
/// methods of traits in `core` (`should_implement_trait`).
const RESERVED: &[&str] = &["at", "into_iter", "iter", "neg", "new", "not"];

#[derive(Debug)]
pub(crate) struct Item<'a> {
    pub(crate) object: &'a Object,
    pub(crate) ident: String,
    pub(crate) shape: Shape<'a>,
}

#[derive(Debug)]
pub(crate) enum Shape<'a> {
    Variable(Handle<'a>),
    /// Elements that differ only in sub-index and configured value.
    Array {
        count: Handle<'a>,
        elements: Vec<Handle<'a>>,
    },
    /// Members by sub-index; `ident` is the name of the record's type.
    Record {
        ident: String,
        members: Vec<Handle<'a>>,
    },
}

/// One entry.
#[derive(Clone, Debug)]
pub(crate) struct Handle<'a> {
    /// The name of a record's member; empty otherwise.
    pub(crate) ident: String,
    pub(crate) entry: &'a Entry,
    pub(crate) r#type: Type,
    pub(crate) access: Access,
    pub(crate) mapping: Mapping,
    /// The default; `None` if the type is none with values.
    pub(crate) default: Option<Default>,
    /// The value that a DCF configures instead of the default.
    pub(crate) configured: Option<Default>,
    /// The limits; `None` if they are those of the data type.
    pub(crate) limits: Option<(Number, Number)>,
}

/// The initial value of an entry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Default {
    Number(Number),
    NodeIdPlus(i64),
}

/// The runtime's access markers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Access {
    Ro,
    Wo,
    Rw,
    Const,
}

/// The runtime's mapping markers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mapping {
    Unmapped,
    Tpdo,
    Rpdo,
    Both,
}

impl Item<'_> {
    pub(crate) fn claim(&self) -> Claim {
        Claim::new(&self.object.name, Case::Shouty, address_suffix(self.object, None), self.object.span)
    }

    /// A record's type is seldom named by users, so its name ends in `Record` and leaves plain names to types of the
    /// overlay.
    pub(crate) fn record_claim(&self) -> Option<Claim> {
        let Shape::Record { .. } = self.shape else { return None };
        let suffix = address_suffix(self.object, None);
        let name = match self.object.name.chars().any(char::is_alphanumeric) {
            true => format!("{} record", self.object.name),
            false => format!("object {suffix} record"),
        };
        Some(Claim::new(&name, Case::Pascal, suffix, self.object.span))
    }
}

pub(crate) fn items<'a>(device: &'a Device, types: &Types, findings: &mut Diagnostics) -> Vec<Item<'a>> {
    let objects = device.objects.iter().filter(|object| !object.entries.is_empty());
    objects.map(|object| item(object, types, findings)).collect()
}

fn item<'a>(object: &'a Object, types: &Types, findings: &mut Diagnostics) -> Item<'a> {
    let mut handles: Vec<Handle<'a>> = object.entries.iter().map(|entry| handle(entry, types, findings)).collect();
    let shape = match (object.kind, handles.as_slice()) {
        (ObjectKind::Variable | ObjectKind::Domain | ObjectKind::DefType, [only]) if only.entry.sub == 0 => {
            Shape::Variable(handles.remove(0))
        }
        (ObjectKind::Array, [count, elements @ ..]) if are_alike(count, elements) => {
            let count = handles.remove(0);
            Shape::Array { count, elements: handles }
        }
        _ => {
            name_members(object, &mut handles, findings);
            Shape::Record { ident: String::new(), members: handles }
        }
    };
    Item { object, ident: String::new(), shape }
}

fn name_members(object: &Object, members: &mut [Handle<'_>], findings: &mut Diagnostics) {
    let claim = |member: &Handle<'_>| {
        let suffix = address_suffix(object, Some(member.entry.sub));
        Claim::new(&member.entry.name, Case::Snake, suffix, member.entry.span)
    };
    let claims: Vec<Claim> = members.iter().map(claim).collect();
    let names = scope::resolve("member", RESERVED, &claims, findings);
    members.iter_mut().zip(names).for_each(|(member, name)| member.ident = name);
}

pub(super) fn handle<'a>(entry: &'a Entry, types: &Types, findings: &mut Diagnostics) -> Handle<'a> {
    let (access, mapping) = rights(entry);
    if entry.data_type.class() == Class::Other {
        let message = format!("{} is not a data type of CiA 301, and of no known length", entry.data_type);
        findings.push(warning("od::unknown-type", message).at(entry.span, "read and written as bytes"));
    }
    Handle {
        ident: String::new(),
        entry,
        r#type: type_of(entry, types),
        access,
        mapping,
        default: initial(entry, entry.default.as_ref(), "default", findings),
        configured: initial(entry, entry.configured.as_ref(), "configured value", findings),
        limits: limits(entry, findings),
    }
}

fn rights(entry: &Entry) -> (Access, Mapping) {
    let (access, mapping) = match entry.access {
        AccessType::Ro => (Access::Ro, Mapping::Tpdo),
        AccessType::Wo => (Access::Wo, Mapping::Rpdo),
        AccessType::Rw => (Access::Rw, Mapping::Both),
        AccessType::Rwr => (Access::Rw, Mapping::Tpdo),
        AccessType::Rww => (Access::Rw, Mapping::Rpdo),
        AccessType::Const => (Access::Const, Mapping::Tpdo),
    };
    (access, if entry.pdo_mapping { mapping } else { Mapping::Unmapped })
}

fn initial(entry: &Entry, value: Option<&Value>, what: &str, findings: &mut Diagnostics) -> Option<Default> {
    let value = value.filter(|_| has_values(entry.data_type))?;
    match (value, entry.data_type.class()) {
        (&Value::NodeIdPlus(base), Class::Signed | Class::Unsigned) if fits_every_node(base, entry.data_type) => {
            Some(Default::NodeIdPlus(base))
        }
        (value, _) => number(entry, value, what, findings).map(Default::Number),
    }
}

fn limits(entry: &Entry, findings: &mut Diagnostics) -> Option<(Number, Number)> {
    if !has_values(entry.data_type) || (entry.low.is_none() && entry.high.is_none()) {
        return None;
    }
    let (lowest, highest) = extremes(entry.data_type);
    let mut limit = |value: &Option<Value>, what, extreme| {
        let value = value.as_ref().and_then(|value| number(entry, value, what, findings));
        value.unwrap_or(extreme)
    };
    let low = limit(&entry.low, "low limit", lowest);
    let high = limit(&entry.high, "high limit", highest);
    let ordered = match (low, high) {
        (Number::Integer(low), Number::Integer(high)) => low <= high,
        (Number::Real(low), Number::Real(high)) => low <= high,
        _ => false,
    };
    (ordered && (low, high) != (lowest, highest)).then_some((low, high))
}

fn number(entry: &Entry, value: &Value, what: &str, findings: &mut Diagnostics) -> Option<Number> {
    let number = fitting(value, entry.data_type);
    if number.is_none() {
        let why = match value {
            &Value::NodeIdPlus(base) if fits_every_node(base, entry.data_type) => {
                "depends on the node-ID, which no handle knows".to_owned()
            }
            _ => format!("is not a value of {}", entry.data_type),
        };
        let message = format!("the {what} of {:04X}:{:02X} {why}", entry.index, entry.sub);
        findings.push(warning("od::value-out-of-type", message).at(entry.span, "left out"));
    }
    number
}

fn extremes(data_type: DataType) -> (Number, Number) {
    match data_type.range() {
        Some((low, high)) => (Number::Integer(low), Number::Integer(high)),
        None if data_type == DataType::Real32 => (Number::Real(f32::MIN.into()), Number::Real(f32::MAX.into())),
        None => (Number::Real(f64::MIN), Number::Real(f64::MAX)),
    }
}

/// Whether the elements differ only in number, value and description. Elements with individual names become members of
/// a record.
fn are_alike(count: &Handle<'_>, elements: &[Handle<'_>]) -> bool {
    let Some(first) = elements.first() else { return false };
    let is_counter = count.entry.sub == 0 && count.entry.data_type == DataType::Unsigned8;
    let subs = elements.iter().map(|element| element.entry.sub);
    let alike = |element: &Handle<'_>| {
        element.r#type == first.r#type
            && (element.access, element.mapping) == (first.access, first.mapping)
            && (element.default, element.limits) == (first.default, first.limits)
            && has_same_words(element.entry, first.entry)
            && element.entry.default == first.entry.default
            && element.entry.ranges == first.entry.ranges
            && element.entry.persistent == first.entry.persistent
            && element.entry.writable_in == first.entry.writable_in
    };
    is_counter && subs.eq(1..=elements.len() as u8) && elements.iter().all(alike)
}

/// Whether two names differ only in numbers (`Entry 3`, `Entry 0A`).
fn has_same_words(a: &Entry, b: &Entry) -> bool {
    fn words(entry: &Entry) -> impl Iterator<Item = &str> {
        let numbers = [format!("{:x}", entry.sub), format!("{:02x}", entry.sub)];
        let is_number = move |word: &str| {
            word.chars().all(|c| c.is_ascii_digit()) || numbers.iter().any(|number| word.eq_ignore_ascii_case(number))
        };
        let words = entry.name.split(|c: char| !c.is_alphanumeric()).filter(move |word| !is_number(word));
        words.map(|word| word.trim_end_matches(|c: char| c.is_ascii_digit()))
    }
    words(a).eq(words(b))
}
