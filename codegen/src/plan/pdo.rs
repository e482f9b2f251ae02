//! PDOs with a default mapping; each becomes a struct.

use lexican_eds::Diagnostics;
use lexican_eds::model::{Device, Direction, Entry, Mapped, Object, Pdo};

use super::value::{Type, Types, has_values, type_of};
use crate::findings::warning;
use crate::name::{Case, address_suffix};
use crate::scope::{self, Claim};

/// Names that fields must not take: none, because fields do not collide with methods, and `self` is a keyword.
const RESERVED: &[&str] = &[];

#[derive(Debug)]
pub(crate) struct PdoItem<'a> {
    pub(crate) ident: String,
    pub(crate) pdo: &'a Pdo,
    pub(crate) fields: Vec<Field<'a>>,
}

/// A mapped object, not a placeholder.
#[derive(Debug)]
pub(crate) struct Field<'a> {
    pub(crate) ident: String,
    /// `None` for bare bits.
    pub(crate) r#type: Option<Type>,
    pub(crate) mapped: Mapped,
    /// The lowest bit in the PDO.
    pub(crate) low: u8,
    /// The name in the data sheet, if that describes the object.
    pub(crate) name: Option<&'a str>,
}

pub(crate) fn pdos<'a>(device: &'a Device, types: &Types, findings: &mut Diagnostics) -> Vec<PdoItem<'a>> {
    let mapped = device.pdos.iter().filter(|pdo| !pdo.mapping.is_empty());
    mapped.filter_map(|pdo| item(device, pdo, types, findings)).collect()
}

fn item<'a>(device: &'a Device, pdo: &'a Pdo, types: &Types, findings: &mut Diagnostics) -> Option<PdoItem<'a>> {
    let ident = format!("{}{}", if pdo.direction == Direction::Receive { "Rpdo" } else { "Tpdo" }, pdo.number);
    let span = mapping_object(device, pdo).map(|object| object.span).unwrap_or_default();
    let bits: u32 = pdo.mapping.iter().map(|mapped| u32::from(mapped.bits)).sum();
    if bits > 64 {
        findings.push(warning("pdo::too-long", format!("{ident} maps {bits} bits, a frame has 64")).at(span, ""));
        return None;
    }
    let mut low = 0;
    let mut fields = Vec::new();
    let mut claims = Vec::new();
    for &mapped in &pdo.mapping {
        // A data type as mapped object is a placeholder (CiA 301, 7.4.7.1).
        if mapped.index >= 0x0020 {
            let found = find(device, mapped);
            let typed = found.filter(|(_, entry)| has_values(entry.data_type));
            if typed.is_none() {
                let why = if found.is_some() { "has no fixed size" } else { "is not described" };
                let message = format!("{ident} maps {:04X}:{:02X}, which {why}", mapped.index, mapped.sub);
                findings.push(warning("pdo::untyped", message).at(span, "the field has the bare bits"));
            }
            let name = found.map(|(object, entry)| if is_single(object) { &*object.name } else { &*entry.name });
            let suffix = match found {
                Some((object, _)) if is_single(object) => address_suffix(object, None),
                _ => format!("{:04x}_{:02x}", mapped.index, mapped.sub),
            };
            let times =
                pdo.mapping.iter().filter(|other| (other.index, other.sub) == (mapped.index, mapped.sub)).count();
            let suffix = if times > 1 { format!("{suffix}_bit{low}") } else { suffix };
            claims.push(Claim::new(name.unwrap_or_default(), Case::Snake, suffix, span));
            let r#type = typed.map(|(_, entry)| type_of(entry, types));
            fields.push(Field { ident: String::new(), r#type, mapped, low, name });
        }
        low += mapped.bits;
    }
    let names = scope::resolve("field", RESERVED, &claims, findings);
    fields.iter_mut().zip(names).for_each(|(field, name)| field.ident = name);
    Some(PdoItem { ident, pdo, fields })
}

fn is_single(object: &Object) -> bool {
    matches!(object.entries.as_slice(), [only] if only.sub == 0)
}

fn find(device: &Device, mapped: Mapped) -> Option<(&Object, &Entry)> {
    let object = device.object(mapped.index)?;
    Some((object, object.entry(mapped.sub)?))
}

fn mapping_object<'a>(device: &'a Device, pdo: &Pdo) -> Option<&'a Object> {
    device.object(pdo.direction.mapping_parameter(pdo.number))
}
