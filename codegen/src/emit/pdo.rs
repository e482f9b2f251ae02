//! PDOs as structs.

use lexican_eds::cia301;
use lexican_eds::model::number::fits_every_node;
use lexican_eds::model::{Direction, Pdo, Value};
use lexican_eds::types::DataType;
use quote::{format_ident, quote};

use super::context::Context;
use super::layout::line;
use super::{docs, literal};
use crate::plan::{Field, PdoItem};

pub(super) fn pdo(context: &Context<'_>, item: &PdoItem<'_>, mapped: &str, code: &mut String) {
    let pdo = item.pdo;
    let direction = if pdo.direction == Direction::Receive { "Receive" } else { "Transmit" };
    let (ident, number) = (&item.ident, pdo.number);
    let mapping: Vec<String> = pdo
        .mapping
        .iter()
        .map(|mapped| format!("0x{:04X}{:02X}{:02X}", mapped.index, mapped.sub, mapped.bits))
        .collect();
    let cob_id = default_cob_id(pdo);
    *code += &format!(
        "
pdo! {{
    /// {direction} PDO {number}, as {mapped} in {:04X}.
    ///
    /// {}
    ///
    /// Directions are the device's: it {}s this PDO.
    pub struct {ident}: {direction} {number} {{
{}    }}
    mapping: {};
",
        pdo.direction.mapping_parameter(number),
        facts(pdo, cob_id),
        direction.to_lowercase(),
        item.fields.iter().map(|field| self::field(context, field)).collect::<String>(),
        mapping.join(", "),
    );
    if let Some(value) = pdo.transmission_type {
        *code += &format!("    transmission_type: {value};\n");
    }
    match cob_id {
        Some(CobId::NodeIdPlus(base)) => *code += &format!("    cob_id(node): 0x{base:X} + node;\n"),
        Some(CobId::Fixed(value)) => *code += &format!("    cob_id(_node): 0x{value:X};\n"),
        None => {}
    }
    *code += "}\n";
}

/// `COB-ID 0x180 + node-ID · transmission type 255 · 2 bytes`.
fn facts(pdo: &Pdo, cob_id: Option<CobId>) -> String {
    let mut facts: Vec<String> = Vec::new();
    if let Some(id @ (CobId::NodeIdPlus(word) | CobId::Fixed(word))) = cob_id {
        let plus = if matches!(id, CobId::NodeIdPlus(_)) { " + node-ID" } else { "" };
        match (word & cia301::IDENTIFIER, word & cia301::INVALID) {
            (0, cia301::INVALID) => facts.push("switched off".into()),
            (id, cia301::INVALID) => facts.push(format!("COB-ID 0x{id:X}{plus}, switched off")),
            (id, _) => facts.push(format!("COB-ID 0x{id:X}{plus}")),
        }
    }
    facts.extend(pdo.transmission_type.map(|value| format!("transmission type {value}")));
    let bits: u32 = pdo.mapping.iter().map(|mapped| u32::from(mapped.bits)).sum();
    facts.push(if bits.div_ceil(8) == 1 { "1 byte".into() } else { format!("{} bytes", bits.div_ceil(8)) });
    facts.join(" · ")
}

/// `statusword: Statusword = 0..=15;`
fn field(context: &Context<'_>, field: &Field<'_>) -> String {
    let mapped = &field.mapped;
    let kind = field.r#type.map_or_else(|| quote!(u64), |r#type| context.r#type(r#type));
    let at = format!("{:04X}:{:02X}", mapped.index, mapped.sub);
    let doc = match docs::escape(field.name.unwrap_or_default()) {
        none if none.is_empty() => at,
        name => format!("{name} ({at})"),
    };
    // A field without bits has no bit range.
    let bits = match mapped.bits {
        0 => literal::bits(64, 64),
        bits => literal::bits(field.low, field.low + bits - 1),
    };
    let ident = format_ident!("{}", field.ident);
    format!("        /// {doc}\n        {}\n", line(&quote!(#ident: #kind = #bits;)))
}

#[derive(Clone, Copy)]
enum CobId {
    NodeIdPlus(u32),
    /// The same identifier for every node.
    Fixed(u32),
}

/// The default COB-ID; without one, the first four PDOs have that of the predefined connection set (CiA 301, 7.3.3).
fn default_cob_id(pdo: &Pdo) -> Option<CobId> {
    match (&pdo.cob_id, pdo.number) {
        (&Some(Value::NodeIdPlus(base)), _) => {
            let fits = fits_every_node(base, DataType::Unsigned32);
            fits.then(|| u32::try_from(base).ok().map(CobId::NodeIdPlus))?
        }
        (Some(Value::Integer(value)), _) => u32::try_from(*value).ok().map(CobId::Fixed),
        (None, number) => pdo.direction.predefined_cob_id(number).map(|id| CobId::NodeIdPlus(id.into())),
        _ => None,
    }
}
