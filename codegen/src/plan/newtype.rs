//! Types for enumerations, bit fields and quantities of the overlay.

use std::collections::{BTreeMap, BTreeSet};

use lexican_eds::model::number::{Number, fitting};
use lexican_eds::model::{BitField, Bits, Device, Enumeration, Meaning, Named, Quantity, Value};
use lexican_eds::standard;
use lexican_eds::types::{Class, DataType};
use lexican_eds::{Diagnostics, Span};

use super::value::{Type, Types};
use crate::name::{self, Case};
use crate::scope::{self, Claim};

/// A newtype over a plain data type.
#[derive(Debug)]
pub(crate) struct Newtype<'a> {
    pub(crate) ident: String,
    pub(crate) claim: Claim,
    /// The name in the overlay.
    pub(crate) name: &'a str,
    pub(crate) data_type: DataType,
    pub(crate) description: Option<&'a str>,
    /// Whether its values are codes, to be written in hexadecimal.
    pub(crate) is_hex: bool,
    pub(crate) kind: NewtypeKind<'a>,
}

/// The kind of a newtype, with the names of its members in order.
#[derive(Debug)]
pub(crate) enum NewtypeKind<'a> {
    Enumeration { enumeration: &'a Enumeration, values: Vec<(String, usize, i128)> },
    BitField { field: &'a BitField, fields: Vec<(String, usize)> },
    Quantity { quantity: &'a Quantity, methods: Vec<String> },
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Sort {
    Enumeration,
    BitField,
    Quantity,
}

type Key<'a> = (Sort, &'a str, DataType);

/// Names that members of a newtype must not take.
const RESERVED: &[&str] =
    &["BITS", "NAMES", "UNITS", "as_ref", "deref", "hash", "index", "len", "name", "neg", "new", "not"];

/// The types that entries use, and the type of each entry.
pub(crate) fn collect<'a>(device: &'a Device, findings: &mut Diagnostics) -> (Vec<Newtype<'a>>, Types) {
    let used = uses(device);
    let keys: BTreeSet<Key<'a>> = used.values().copied().collect();
    let mut first: BTreeMap<(Sort, &str), DataType> = BTreeMap::new();
    for &(sort, name, data_type) in used.values() {
        first.entry((sort, name)).or_insert(data_type);
    }
    let is_first = |&(sort, name, data_type): &Key<'a>| first.get(&(sort, name)) == Some(&data_type);
    let newtypes = keys.iter().filter_map(|key| {
        let mut newtype = newtype(device, *key, is_first(key), findings)?;
        newtype.is_hex |= used.iter().any(|(&(index, sub), used)| used == key && standard::is_hex(index, sub));
        Some(newtype)
    });
    let newtypes = newtypes.collect();
    let rows: BTreeMap<Key<'a>, usize> = keys.iter().copied().zip(0..).collect();
    let types = used.into_iter().map(|(address, key)| (address, Type::Newtype(rows[&key]))).collect();
    (newtypes, types)
}

/// Uses on a data type that cannot carry the meaning were reported by the reader.
fn uses(device: &Device) -> BTreeMap<(u16, u8), Key<'_>> {
    let mut uses = BTreeMap::new();
    // A parameter of another interface has the meaning of its object; without an object (index 0), it has its own.
    let without_object = device.parameters().filter(|parameter| parameter.object().is_none());
    for entry in device.entries().chain(without_object.map(|parameter| &parameter.entry)) {
        let (sort, name, known) = match &entry.meaning {
            Meaning::Plain => continue,
            Meaning::Enumeration(name) => (Sort::Enumeration, name, device.enumerations.contains_key(name)),
            Meaning::BitField(name) => (Sort::BitField, name, device.bit_fields.contains_key(name)),
            Meaning::Quantity(name) => (Sort::Quantity, name, device.quantities.contains_key(name)),
        };
        let carries = match (sort, entry.data_type.class()) {
            (_, Class::Signed | Class::Unsigned) => true,
            (Sort::Quantity, class) => class == Class::Real,
            (Sort::Enumeration, class) => class == Class::Boolean,
            (Sort::BitField, _) => false,
        };
        if carries && known {
            uses.insert((entry.index, entry.sub), (sort, name.as_str(), entry.data_type));
        }
    }
    uses
}

fn newtype<'a>(
    device: &'a Device,
    key @ (sort, name, data_type): Key<'a>,
    is_first: bool,
    findings: &mut Diagnostics,
) -> Option<Newtype<'a>> {
    let (description, span, kind) = match sort {
        Sort::Enumeration => {
            let enumeration = device.enumerations.get(name)?;
            let kind = NewtypeKind::Enumeration { enumeration, values: values(enumeration, data_type, findings) };
            (&enumeration.description, enumeration.span, kind)
        }
        Sort::BitField => {
            let field = device.bit_fields.get(name)?;
            (
                &field.description,
                field.span,
                NewtypeKind::BitField { field, fields: fields(field, data_type, findings) },
            )
        }
        Sort::Quantity => {
            let quantity = device.quantities.get(name)?;
            (
                &quantity.description,
                quantity.span,
                NewtypeKind::Quantity { quantity, methods: methods(quantity, findings) },
            )
        }
    };
    let is_hex = matches!(&kind, NewtypeKind::Enumeration { enumeration, .. } if enumeration.is_hex);
    let claim = claim(key, is_first, span);
    let description = description.as_deref();
    Some(Newtype { ident: String::new(), claim, name, data_type, description, is_hex, kind })
}

/// A meaning that is used on several data types becomes several types; the one with the lowest address gets the bare
/// name.
fn claim((sort, name, data_type): Key<'_>, is_first: bool, span: Span) -> Claim {
    let suffix = match sort {
        Sort::Enumeration => "values",
        Sort::BitField => "bits",
        Sort::Quantity => "quantity",
    };
    let mut claim = Claim::new(name, Case::Pascal, suffix.into(), span);
    if !is_first {
        let short = data_type.name().replace("INTEGER", "i").replace("UNSIGNED", "u").replace("REAL", "f");
        claim.wanted = name::with_suffix(&claim.wanted, &short.to_lowercase(), Case::Pascal);
    }
    claim
}

fn values(enumeration: &Enumeration, data_type: DataType, findings: &mut Diagnostics) -> Vec<(String, usize, i128)> {
    let fit: Vec<(usize, i128)> = enumeration
        .values
        .iter()
        .enumerate()
        .filter_map(|(row, value)| {
            match fitting(&Value::Integer(value.value), data_type) {
                Some(Number::Integer(number)) => Some((row, number)),
                // Reported by the reader.
                _ => None,
            }
        })
        .collect();
    let claim = |&(row, number): &(usize, i128)| {
        let suffix = if number < 0 { format!("minus {}", -number) } else { number.to_string() };
        let suffix = suffix.replace(' ', "_");
        Claim::new(&enumeration.values[row].name, Case::Shouty, suffix, enumeration.span)
    };
    let claims: Vec<Claim> = fit.iter().map(claim).collect();
    let names = scope::resolve("value", RESERVED, &claims, findings);
    names.into_iter().zip(fit).map(|(name, (row, number))| (name, row, number)).collect()
}

fn fields(field: &BitField, data_type: DataType, findings: &mut Diagnostics) -> Vec<(String, usize)> {
    // Fields that do not fit were reported by the reader.
    let fits = |&(_, bits): &(usize, &Named<Bits>)| {
        bits.value.low <= bits.value.high && Some(bits.value.high) < data_type.bits()
    };
    let fit: Vec<usize> = field.fields.iter().enumerate().filter(fits).map(|(row, _)| row).collect();
    let claim = |&row: &usize| {
        let suffix = format!("bit{}", field.fields[row].value.low);
        Claim::new(&field.fields[row].name, Case::Snake, suffix, field.span)
    };
    let claims: Vec<Claim> = fit.iter().map(claim).collect();
    resolve("bit", "with", &claims, findings).into_iter().zip(fit).collect()
}

fn methods(quantity: &Quantity, findings: &mut Diagnostics) -> Vec<String> {
    let claim = |unit: &lexican_eds::model::Unit| Claim::new(&unit.method, Case::Snake, "unit".into(), quantity.span);
    let claims: Vec<Claim> = quantity.units.iter().map(claim).collect();
    resolve("unit", "from", &claims, findings)
}

/// Resolves names that each have a companion, `with_mode` for `mode`; the companions' names are taken, too.
fn resolve(what: &str, companion: &str, claims: &[Claim], findings: &mut Diagnostics) -> Vec<String> {
    let companions: Vec<String> = claims.iter().map(|claim| self::companion(companion, &claim.wanted)).collect();
    let reserved: Vec<&str> = RESERVED.iter().copied().chain(companions.iter().map(String::as_str)).collect();
    scope::resolve(what, &reserved, claims, findings)
}

/// The companion of `name`, without underscores that were added for a keyword or a digit.
pub(crate) fn companion(prefix: &str, name: &str) -> String {
    format!("{prefix}_{}", name.trim_matches('_'))
}
