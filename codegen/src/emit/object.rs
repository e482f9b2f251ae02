//! Constants, arrays and records.

use lexican_eds::model::number::Number;
use proc_macro2::{Literal, TokenStream};
use quote::quote;

use super::context::Context;
use super::docs;
use super::layout::{self, Chain, Generic};
use super::literal;
use crate::plan::{Access, Default, Handle, Item, Mapping, Shape};

pub(super) fn item(context: &Context<'_>, item: &Item<'_>, code: &mut String) {
    code.push('\n');
    match &item.shape {
        Shape::Variable(handle) => variable(context, item, handle, code),
        Shape::Array { count, elements } => array(context, item, count, elements, code),
        Shape::Record { ident, members } => record(context, item, ident, members, code),
    }
}

fn variable(context: &Context<'_>, item: &Item<'_>, handle: &Handle<'_>, code: &mut String) {
    *code += &docs::handle(context, &item.object.name, item.object.description.as_deref(), handle, "");
    *code += &allowed(handle, "");
    layout::constant(code, &item.ident, &handle_type(context, handle), &handle_value(context, handle));
}

fn array(context: &Context<'_>, item: &Item<'_>, count: &Handle<'_>, elements: &[Handle<'_>], code: &mut String) {
    let first = elements.first().expect("an array has elements");
    *code += &docs::whole(context, item, Some(first));
    *code += &allowed(first, "");
    let mut parameters = parameters(context, first, count.access != Access::Ro);
    // Access of sub-index 0 is left out if it is `ro`, the default.
    parameters.extend((count.access != Access::Ro).then(|| marker(context, count.access)));
    let path = context.object("Array");
    let (count, Chain { first, methods }) = (Literal::usize_unsuffixed(elements.len()), handle_value(context, first));
    let value = quote!(#path::new(#count, #first #(#methods)*));
    layout::constant(code, &item.ident, &Generic { path, parameters }, &Chain { first: value, methods: Vec::new() });
}

/// The type derives nothing: it has no values, and every `derive` slows down each user's build.
fn record(context: &Context<'_>, item: &Item<'_>, type_ident: &str, members: &[Handle<'_>], code: &mut String) {
    let ident = &item.ident;
    *code += &docs::whole(context, item, None);
    *code += &format!("pub const {ident}: {type_ident} = {type_ident};\n");
    *code += &format!("\n/// The members of [`{ident}`].\npub struct {type_ident};\n\nimpl {type_ident} {{\n");
    for (number, member) in members.iter().enumerate() {
        if number > 0 {
            code.push('\n');
        }
        *code += &docs::handle(context, &member.entry.name, None, member, "    ");
        *code += &allowed(member, "    ");
        layout::member(code, &member.ident, &handle_type(context, member), &handle_value(context, member));
    }
    *code += "}\n";
}

/// Clippy suggests constants of `std` for numbers close to them.
fn allowed(handle: &Handle<'_>, indent: &str) -> String {
    let is_fraction = |number: Number| matches!(number, Number::Real(real) if (real * 10.0).fract() != 0.0);
    let has_fraction = handle.limits.is_some_and(|(low, high)| is_fraction(low) || is_fraction(high))
        || matches!(handle.default, Some(Default::Number(number)) if is_fraction(number));
    if has_fraction { format!("{indent}#[allow(clippy::approx_constant)]\n") } else { String::new() }
}

fn handle_type(context: &Context<'_>, handle: &Handle<'_>) -> Generic {
    Generic { path: context.object("Object"), parameters: parameters(context, handle, false) }
}

/// Type, access and mapping; no mapping if the entry cannot be mapped.
fn parameters(context: &Context<'_>, handle: &Handle<'_>, whole: bool) -> Vec<TokenStream> {
    let mapping = match handle.mapping {
        Mapping::Unmapped if whole => Some("Unmapped"),
        Mapping::Unmapped => None,
        Mapping::Tpdo => Some("Tpdo"),
        Mapping::Rpdo => Some("Rpdo"),
        Mapping::Both => Some("Mappable"),
    };
    let mapping = mapping.map(|mapping| context.object(mapping));
    [context.r#type(handle.r#type), marker(context, handle.access)].into_iter().chain(mapping).collect()
}

pub(super) fn marker(context: &Context<'_>, access: Access) -> TokenStream {
    context.object(&format!("{access:?}"))
}

fn handle_value(context: &Context<'_>, handle: &Handle<'_>) -> Chain {
    let entry = handle.entry;
    let in_hex = context.is_hex(entry);
    let limits = handle.limits.iter().map(|&(low, high)| {
        let [low, high] = [low, high].map(|number| context.value(handle.r#type, number, in_hex));
        quote!(.with_limits(#low, #high))
    });
    let default = handle.default.iter().map(|default| match *default {
        Default::Number(number) => {
            let value = context.value(handle.r#type, number, in_hex);
            quote!(.with_default(#value))
        }
        Default::NodeIdPlus(base) => {
            let base = literal::number(&format!("0x{base:X}"));
            quote!(.with_default_node_id_plus(#base))
        }
    });
    let (path, address) = (context.object("Object"), literal::address(entry.index, entry.sub));
    Chain { first: quote!(#path::new(#address)), methods: limits.chain(default).collect() }
}
