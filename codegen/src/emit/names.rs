//! The table that tools show entries by.

use lexican_eds::model::Object;
use proc_macro2::Literal;

use super::context::Context;
use super::{layout, literal};
use crate::plan::{Newtype, NewtypeKind};

pub(super) fn names(context: &Context<'_>, code: &mut String) {
    let object = &context.path;
    let rows = context.plan.device.objects.iter().flat_map(|described| {
        described.entries.iter().map(move |entry| {
            let name = Literal::string(&full_name(described, &entry.name));
            let data_type = literal::data_type(entry.data_type);
            let meaning = context.plan.newtype_of(entry).map_or_else(|| "Plain".to_owned(), |it| meaning(it));
            let (index, sub) = (entry.index, entry.sub);
            format!(
                "object::Name::new(0x{index:04X}, 0x{sub:02X}, {name}, object::DataType::{data_type}, \
                 object::Meaning::{meaning})"
            )
        })
    });
    // The module and not what is in it: a type of the data sheet may be called as that is.
    *code += &format!(
        "
/// The names of all entries, ascending by address.
pub static NAMES: &[{object}::Name] = {{
    use {object};
    {}
}};
",
        layout::rows("    ", rows)
    );
}

fn full_name(object: &Object, name: &str) -> String {
    match object.entries.as_slice() {
        [only] if only.sub == 0 => object.name.clone(),
        _ => format!("{}: {name}", object.name),
    }
}

fn meaning(newtype: &Newtype<'_>) -> String {
    let (variant, constant) = match newtype.kind {
        NewtypeKind::Enumeration { .. } => ("Enumeration", "NAMES"),
        NewtypeKind::BitField { .. } => ("BitField", "BITS"),
        NewtypeKind::Quantity { .. } => ("Quantity", "UNITS"),
    };
    format!("{variant}(<{} as object::{variant}>::{constant})", newtype.ident)
}
