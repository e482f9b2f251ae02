//! The differences between two devices, object by object. Order and spelling of their files do not matter.

use std::fmt;

use serde_json::json;

use crate::dump::value_text;
use crate::model::{Device, Entry, Object, Value};

/// One difference.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// `6040` for an object, `2410:05` for an entry, `DeviceInfo` for the rest.
    pub place: String,
    /// The name in the second device, or in the first if only that has it.
    pub name: String,
    /// Added, removed or changed.
    pub kind: ChangeKind,
}

/// What happened to an object, an entry or one of its attributes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ChangeKind {
    /// Only the second device has it.
    Added,
    /// Only the first device has it.
    Removed,
    /// Both have it, with another attribute.
    Changed {
        /// A column of [`dump`](crate::dump), such as `data_type` or `default`.
        attribute: &'static str,
        /// The value in the first device; empty if there is none.
        from: String,
        /// The value in the second device; empty if there is none.
        to: String,
    },
}

/// All differences, by index and sub-index.
#[must_use]
pub fn diff(a: &Device, b: &Device) -> Vec<Change> {
    let mut changes = Vec::new();
    info(a, b, &mut changes);
    let both = merged(&a.objects, &b.objects, |object| object.index);
    for pair in both {
        match pair {
            (Some(a), Some(b)) => object(a, b, &mut changes),
            (Some(only), None) => changes.push(of_object(only, ChangeKind::Removed)),
            (None, Some(only)) => changes.push(of_object(only, ChangeKind::Added)),
            (None, None) => {}
        }
    }
    changes
}

/// The differences as JSON: an array of objects with `place`, `name`, `change` and, for a changed attribute,
/// `attribute`, `from` and `to`.
#[must_use]
pub fn json(changes: &[Change]) -> serde_json::Value {
    let change = |change: &Change| {
        let (kind, attribute, from, to) = match &change.kind {
            ChangeKind::Added => ("added", None, None, None),
            ChangeKind::Removed => ("removed", None, None, None),
            ChangeKind::Changed { attribute, from, to } => ("changed", Some(attribute), Some(from), Some(to)),
        };
        json!({
            "place": change.place,
            "name": change.name,
            "change": kind,
            "attribute": attribute,
            "from": from,
            "to": to,
        })
    };
    changes.iter().map(change).collect()
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { place, name, kind } = self;
        match kind {
            ChangeKind::Added => write!(f, "+ {place} {name}"),
            ChangeKind::Removed => write!(f, "- {place} {name}"),
            ChangeKind::Changed { attribute, from, to } => {
                write!(f, "~ {place} {name}: {attribute} {} -> {}", shown(from), shown(to))
            }
        }
    }
}

fn shown(text: &str) -> &str {
    if text.is_empty() { "(none)" } else { text }
}

fn info(a: &Device, b: &Device, changes: &mut Vec<Change>) {
    let number = |number: Option<u32>| number.map(|number| format!("0x{number:X}")).unwrap_or_default();
    let text = |text: &Option<String>| text.clone().unwrap_or_default();
    let rates = |device: &Device| device.info.bit_rates_kbit.iter().map(u16::to_string).collect::<Vec<_>>().join(" ");
    let (x, y) = (&a.info, &b.info);
    let attributes = [
        ("vendor_name", text(&x.vendor_name), text(&y.vendor_name)),
        ("vendor_number", number(x.vendor_number), number(y.vendor_number)),
        ("product_name", text(&x.product_name), text(&y.product_name)),
        ("product_number", number(x.product_number), number(y.product_number)),
        ("revision_number", number(x.revision_number), number(y.revision_number)),
        ("order_code", text(&x.order_code), text(&y.order_code)),
        ("bit_rates_kbit", rates(a), rates(b)),
        ("granularity", number(x.granularity.map(u32::from)), number(y.granularity.map(u32::from))),
        ("lss", x.lss.to_string(), y.lss.to_string()),
    ];
    changed("DeviceInfo", "", attributes, changes);
}

fn object(a: &Object, b: &Object, changes: &mut Vec<Change>) {
    let attributes = [
        ("name", a.name.clone(), b.name.clone()),
        ("object_type", a.kind.name().to_owned(), b.kind.name().to_owned()),
        ("list", format!("{:?}", a.list).to_lowercase(), format!("{:?}", b.list).to_lowercase()),
        ("flags", a.flags.to_string(), b.flags.to_string()),
    ];
    changed(&format!("{:04X}", b.index), &b.name, attributes, changes);
    for pair in merged(&a.entries, &b.entries, |entry| entry.sub) {
        match pair {
            (Some(x), Some(y)) => entry(x, y, a.kind.has_subs() || b.kind.has_subs(), changes),
            (Some(only), None) => changes.push(of_entry(only, ChangeKind::Removed)),
            (None, Some(only)) => changes.push(of_entry(only, ChangeKind::Added)),
            (None, None) => {}
        }
    }
}

fn entry(a: &Entry, b: &Entry, with_name: bool, changes: &mut Vec<Change>) {
    let text = |value: &Option<Value>| value.as_ref().map(value_text).unwrap_or_default();
    let name = |entry: &Entry| if with_name { entry.name.clone() } else { String::new() };
    let attributes = [
        // A single value has the name of its object, which is compared already.
        ("name", name(a), name(b)),
        ("data_type", a.data_type.to_string(), b.data_type.to_string()),
        ("access", a.access.name().to_owned(), b.access.name().to_owned()),
        ("pdo_mapping", u8::from(a.pdo_mapping).to_string(), u8::from(b.pdo_mapping).to_string()),
        ("default", text(&a.default), text(&b.default)),
        ("low_limit", text(&a.low), text(&b.low)),
        ("high_limit", text(&a.high), text(&b.high)),
        ("configured", text(&a.configured), text(&b.configured)),
    ];
    changed(&format!("{:04X}:{:02X}", b.index, b.sub), &b.name, attributes, changes);
}

fn changed<const N: usize>(
    place: &str,
    name: &str,
    attributes: [(&'static str, String, String); N],
    changes: &mut Vec<Change>,
) {
    for (attribute, from, to) in attributes {
        if from != to {
            let kind = ChangeKind::Changed { attribute, from, to };
            changes.push(Change { place: place.to_owned(), name: name.to_owned(), kind });
        }
    }
}

fn of_object(object: &Object, kind: ChangeKind) -> Change {
    Change { place: format!("{:04X}", object.index), name: object.name.clone(), kind }
}

fn of_entry(entry: &Entry, kind: ChangeKind) -> Change {
    Change { place: format!("{:04X}:{:02X}", entry.index, entry.sub), name: entry.name.clone(), kind }
}

/// Pairs the elements of two ascending lists that have the same key.
fn merged<'a, T, K: Ord>(a: &'a [T], b: &'a [T], key: impl Fn(&T) -> K) -> Vec<(Option<&'a T>, Option<&'a T>)> {
    let (mut a, mut b) = (a.iter().peekable(), b.iter().peekable());
    let mut pairs = Vec::new();
    loop {
        let order = match (a.peek(), b.peek()) {
            (None, None) => return pairs,
            (Some(_), None) => std::cmp::Ordering::Less,
            (None, Some(_)) => std::cmp::Ordering::Greater,
            (Some(x), Some(y)) => key(x).cmp(&key(y)),
        };
        pairs.push(match order {
            std::cmp::Ordering::Less => (a.next(), None),
            std::cmp::Ordering::Greater => (None, b.next()),
            std::cmp::Ordering::Equal => (a.next(), b.next()),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Input, Source, load};

    #[test]
    fn differences_are_told_by_object_and_not_by_line() {
        let read = |text: &str| load(&Input::new(Source::new("x.eds", text))).0;
        let a = read(
            "[2000]\nParameterName=Speed\nObjectType=7\nDataType=6\nAccessType=rw\nDefaultValue=0x10\n\
             [2002]\nParameterName=Old\nObjectType=7\nDataType=6\nAccessType=rw\n\
             [2003]\nParameterName=Set\nObjectType=9\nSubNumber=1\n[2003sub0]\nDataType=5\nAccessType=ro\n",
        );
        let b = read(
            "[2003]\nParameterName=Set\nSubNumber=2\nObjectType=9\n[2003sub1]\nParameterName=One\nDataType=5\nAccessType=ro\n\
             [2003sub0]\nDataType=5\nAccessType=ro\n\
             [2001]\nParameterName=New\nObjectType=7\nDataType=6\nAccessType=rw\n\
             [2000]\nAccessType=ro\nDefaultValue=16\nDataType=0x0006\nObjectType=0x7\nParameterName=Speed\n",
        );
        let lines: Vec<String> = diff(&a, &b).iter().map(ToString::to_string).collect();
        assert_eq!(lines, ["~ 2000:00 Speed: access rw -> ro", "+ 2001 New", "- 2002 Old", "+ 2003:01 One"]);
        assert_eq!(diff(&a, &a), []);
    }
}
