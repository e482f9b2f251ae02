//! Parameters of other interfaces: one module per interface, with a handle for each parameter and a table of all.

use lexican_eds::model::ParameterNumber;
use lexican_eds::model::number::Number;
use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use super::context::Context;
use super::layout::{self, Chain, Generic, line};
use super::{docs, literal, object};
use crate::plan::{InterfaceItem, ParameterItem};

/// Writes a separate module, since parameters have the same names as objects.
pub(super) fn interface(context: &Context<'_>, item: &InterfaceItem<'_>, code: &mut String) {
    let by_text = item.parameters.first().is_some_and(|it| matches!(it.parameter.number, ParameterNumber::Text(_)));
    let number = if by_text { quote!(&str) } else { quote!(u16) };
    let mut body = String::new();
    for parameter in &item.parameters {
        body += &docs::parameter(context, parameter);
        let (path, handle) = (context.object("Parameter"), &parameter.handle);
        let parameters = vec![context.r#type(handle.r#type), object::marker(context, handle.access), number.clone()];
        layout::constant(&mut body, &handle.ident, &Generic { path, parameters }, &value(context, parameter));
        body.push('\n');
    }
    let rows = item.parameters.iter().map(|parameter| format!("{}.row()", parameter.handle.ident));
    let row = line(&context.object("ParameterRow"));
    body += &format!(
        "/// All parameters, in the order of the overlay.\npub static TABLE: &[{row}<{}>] = {};\n",
        line(&number),
        layout::rows("", rows)
    );
    let doc = docs::sentence(item.interface.description.as_deref().unwrap_or_default(), item.name);
    *code += &format!("\n/// {doc}\npub mod {} {{\n    use super::*;\n\n", item.ident);
    for line in body.lines() {
        code.extend([if line.is_empty() { "" } else { "    " }, line, "\n"]);
    }
    *code += "}\n";
}

/// `Parameter::new(1016, "Limit 1", Access::Rw).equals(0x607D, 0x02)`.
fn value(context: &Context<'_>, item: &ParameterItem<'_>) -> Chain {
    let (parameter, handle) = (item.parameter, &item.handle);
    let [path, types, accesses] = ["Parameter", "DataType", "Access"].map(|name| context.object(name));
    let number = match &parameter.number {
        ParameterNumber::Number(number) => literal::spelled((*number).into(), false),
        ParameterNumber::Text(text) => quote!(#text),
    };
    let carried = (parameter.data_type != parameter.entry.data_type).then(|| {
        let data_type = literal::data_type(parameter.data_type);
        quote!(.carried_as(#types::#data_type))
    });
    let name = &parameter.entry.name;
    let access = format_ident!("{}", format!("{:?}", handle.access));
    let object = parameter.object().map(|(index, sub)| {
        let address = literal::address(index, sub);
        quote!(.equals(#address))
    });
    let elements = (parameter.elements > 1).then(|| {
        let elements = literal::spelled(parameter.elements.into(), false);
        quote!(.elements(#elements))
    });
    let range = handle.limits.and_then(|(low, high)| {
        let [low, high] = [integer(low)?, integer(high)?];
        Some(quote!(.within(#low, #high)))
    });
    let codes = item.codes.iter().map(|(here, there)| {
        let [here, there] = [*here, *there].map(|number| literal::spelled(number, context.is_hex(&parameter.entry)));
        quote!((#here, #there))
    });
    let codes = (!item.codes.is_empty()).then(|| quote!(.coded(&[#(#codes),*])));
    let when = parameter.when.as_ref().map(|when| {
        let when = literal::condition(context, when);
        quote!(.when(#when))
    });
    Chain {
        first: quote!(#path::new(#number, #name, #accesses::#access)),
        methods: [object, elements, carried, range, codes, when].into_iter().flatten().collect(),
    }
}

/// A limit as an integer of the row; larger ones are left out, as the data type then limits.
fn integer(number: Number) -> Option<TokenStream> {
    match number {
        Number::Integer(integer) => Some(literal::spelled(i64::try_from(integer).ok()?.into(), false)),
        Number::Real(_) => None,
    }
}
