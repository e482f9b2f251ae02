//! Enumerations, bit fields and quantities.

use lexican_eds::model::{BitField, Enumeration, Named, Quantity};
use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use super::context::Context;
use super::layout::line;
use super::{docs, literal};
use crate::plan::{Access, Newtype, NewtypeKind, companion};

pub(super) fn newtype(context: &Context<'_>, newtype: &Newtype<'_>, code: &mut String) {
    let (what, rows) = match &newtype.kind {
        NewtypeKind::Enumeration { enumeration, values } => ("enumeration", value_rows(newtype, enumeration, values)),
        NewtypeKind::BitField { field, fields } => ("bit_field", bit_rows(context, newtype, field, fields)),
        NewtypeKind::Quantity { quantity, methods } => ("quantity", unit_rows(context, quantity, methods)),
    };
    let doc = docs::sentence(newtype.description.unwrap_or(newtype.name), what);
    let (ident, data_type) = (&newtype.ident, newtype.data_type);
    let inner = line(&literal::rust_type(context, data_type));
    *code += &format!(
        "\n{what}! {{\n    /// {doc}\n    pub struct {ident}({inner}): {data_type:?} {{\n{}    }}\n}}\n",
        rows.concat()
    );
}

/// `POSITION = 1, "position";`
fn value_rows(newtype: &Newtype<'_>, enumeration: &Enumeration, values: &[(String, usize, i128)]) -> Vec<String> {
    let digits = newtype.data_type.bits().map_or(1, |bits| usize::from(bits).div_ceil(4));
    let row = |(constant, row, number): &(String, usize, i128)| {
        let named = &enumeration.values[*row];
        let number = match u64::try_from(*number) {
            Ok(code) if newtype.is_hex => literal::number(&format!("0x{code:0digits$X}")),
            _ => literal::number(&number.to_string()),
        };
        let (constant, name) = (format_ident!("{constant}"), name(named));
        self::row(&above(named), &quote!(#constant = #number, #name;))
    };
    values.iter().map(row).collect()
}

/// `mode, with_mode: u8 = 4..=6, "mode";`
fn bit_rows(context: &Context<'_>, newtype: &Newtype<'_>, field: &BitField, fields: &[(String, usize)]) -> Vec<String> {
    let writable = context.is_device || is_writable(context, newtype);
    let row = |(getter, row): &(String, usize)| {
        let named = &field.fields[*row];
        let (low, high) = (named.value.low, named.value.high);
        let kind = match high - low + 1 {
            1 => quote!(bool),
            2..=8 => quote!(u8),
            9..=16 => quote!(u16),
            17..=32 => quote!(u32),
            _ => quote!(u64),
        };
        let setter = writable.then(|| format_ident!("{}", companion("with", getter))).into_iter();
        let (getter, bits, name) = (format_ident!("{getter}"), literal::bits(low, high), name(named));
        self::row(&above(named), &quote!(#getter #(, #setter)*: #kind = #bits, #name;))
    };
    fields.iter().map(row).collect()
}

/// Whether any object of this type is writable.
fn is_writable(context: &Context<'_>, newtype: &Newtype<'_>) -> bool {
    context.plan.entry_handles().any(|handle| {
        let of_this = context.plan.newtype_of(handle.entry).is_some_and(|other| other.ident == newtype.ident);
        of_this && matches!(handle.access, Access::Rw | Access::Wo)
    })
}

/// `volts, from_volts = "V", 1 / 10;`
fn unit_rows(context: &Context<'_>, quantity: &Quantity, methods: &[String]) -> Vec<String> {
    let rows = quantity.units.iter().zip(methods).map(|(unit, getter)| {
        let [getter, constructor] = [getter, &companion("from", getter)].map(|name| format_ident!("{name}"));
        let [num, den] = [unit.num.to_string(), unit.den.to_string()].map(|digits| literal::number(&digits));
        let (symbol, when) = (&unit.symbol, unit.when.iter().map(|when| literal::condition(context, when)));
        let above = format!("        /// In {}.\n", docs::unit(context, unit));
        self::row(&above, &quote!(#getter, #constructor = #symbol, #num / #den #(, #when)*;))
    });
    rows.collect()
}

/// A row after its docs.
fn row(above: &str, row: &TokenStream) -> String {
    format!("{above}        {}\n", line(row))
}

/// The description, as docs of a row.
fn above<T>(named: &Named<T>) -> String {
    match docs::escape(named.description.as_deref().unwrap_or_default()) {
        none if none.is_empty() => none,
        text => format!("        /// {text}\n"),
    }
}

/// The name, followed by the name escaped for Markdown if that differs.
fn name<T>(named: &Named<T>) -> TokenStream {
    let name = &named.name;
    match docs::sentence(name, "(no name)") {
        same if same == *name => quote!(#name),
        words => quote!(#name, #words),
    }
}
