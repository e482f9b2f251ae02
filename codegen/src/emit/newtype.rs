//! Enumerations, bit fields and quantities.

use lexican_eds::model::{BitField, Entry, Enumeration, Quantity, Unit};
use lexican_eds::types::{Class, DataType};
use proc_macro2::{Literal, TokenStream};
use quote::{format_ident, quote};

use super::context::Context;
use super::{docs, literal};
use crate::plan::{Newtype, NewtypeKind, Number, companion, raw};

pub(super) fn newtype(context: &Context<'_>, newtype: &Newtype<'_>) -> TokenStream {
    let (what, members) = match &newtype.kind {
        NewtypeKind::Enumeration { enumeration, values } => {
            ("enumeration", enumeration_members(context, newtype, enumeration, values))
        }
        NewtypeKind::BitField { field, fields } => ("bit_field", bit_field_members(context, newtype, field, fields)),
        NewtypeKind::Quantity { quantity, methods } => {
            ("quantity", quantity_members(context, newtype, quantity, methods))
        }
    };
    let base = base(context, newtype, what);
    quote!(#base #members)
}

/// The struct, and by a macro of the runtime the traits that it has for being what it is.
fn base(context: &Context<'_>, newtype: &Newtype<'_>, what: &str) -> TokenStream {
    let runtime = &context.runtime;
    let ident = format_ident!("{}", newtype.ident);
    let inner = literal::tokens(&literal::rust_type(&context.path, newtype.data_type));
    let data_type = format_ident!("{}", format!("{:?}", newtype.data_type));
    // The name says no more than the type's own.
    let mut text = vec![docs::sentence(newtype.description.unwrap_or(newtype.name), what)];
    let what = format_ident!("{what}");
    if let NewtypeKind::Quantity { quantity, .. } = newtype.kind {
        let units: Vec<String> =
            quantity.units.iter().map(|unit| format!("Unit: {}.", docs::unit(context, unit))).collect();
        text.extend([String::new(), units.join(" ")]);
    }
    let docs = docs::lines(&text);
    let total = match newtype.data_type.class() {
        Class::Real => quote!(),
        _ => quote!(, Eq, Ord, Hash),
    };
    quote! {
        #docs
        #[derive(Clone, Copy, Default, PartialEq, PartialOrd #total)]
        pub struct #ident(
            /// The number on the wire.
            pub #inner,
        );

        #runtime::#what!(#ident(#inner), #data_type);
    }
}

fn enumeration_members(
    context: &Context<'_>,
    newtype: &Newtype<'_>,
    enumeration: &Enumeration,
    values: &[(String, usize, i128)],
) -> TokenStream {
    let object = &context.object;
    let ident = format_ident!("{}", newtype.ident);
    let is_used_by = |entry: &Entry| context.plan.newtype_of(entry).is_some_and(|other| other.ident == newtype.ident);
    let in_hex = context.plan.device.entries().any(|entry| docs::is_hex(entry) && is_used_by(entry));
    let constants = values.iter().map(|(constant, row, number)| {
        let named = &enumeration.values[*row];
        let mut text = vec![docs::sentence(&named.name, "A value.")];
        text.extend(docs::paragraph(named.description.as_deref()));
        let docs = docs::lines(&text);
        let constant = format_ident!("{constant}");
        let value = literal::tokens(&context.plain_value(newtype.data_type, Number::Integer(*number), in_hex));
        quote!(#docs pub const #constant: Self = Self(#value);)
    });
    let mut rows: Vec<(u64, &str)> = values
        .iter()
        .map(|(_, row, number)| (raw(Number::Integer(*number), newtype.data_type), &*enumeration.values[*row].name))
        .collect();
    rows.sort_unstable();
    let rows = rows.into_iter().map(|(raw, name)| {
        let raw = literal::hex(raw, 2);
        quote!(#object::ValueName::new(#raw, #name))
    });
    quote! {
        impl #ident {
            #(#constants)*
        }

        impl #object::Enumeration for #ident {
            const NAMES: &'static [#object::ValueName] = &[#(#rows),*];
        }
    }
}

fn bit_field_members(
    context: &Context<'_>,
    newtype: &Newtype<'_>,
    field: &BitField,
    fields: &[(String, usize)],
) -> TokenStream {
    let object = &context.object;
    let ident = format_ident!("{}", newtype.ident);
    let accessors =
        fields.iter().map(|(accessor, row)| bit_accessors(newtype.data_type, field, accessor, *row, context));
    let rows = fields.iter().map(|(_, row)| {
        let named = &field.fields[*row];
        let (low, width) = (named.value.low, named.value.high - named.value.low + 1);
        let (low, width, name) = (literal::decimal(low.into()), literal::decimal(width.into()), &named.name);
        quote!(#object::BitName::new(#low, #width, #name))
    });
    quote! {
        impl #ident {
            #(#accessors)*
        }

        impl #object::BitField for #ident {
            const BITS: &'static [#object::BitName] = &[#(#rows),*];
        }
    }
}

/// A getter and a setter. Constant functions cannot use the runtime's trait, so that the bits are moved here.
fn bit_accessors(
    data_type: DataType,
    field: &BitField,
    accessor: &str,
    row: usize,
    context: &Context<'_>,
) -> TokenStream {
    let named = &field.fields[row];
    let (low, width) = (named.value.low, named.value.high - named.value.low + 1);
    let getter = format_ident!("{accessor}");
    let setter = format_ident!("{}", companion("with", accessor));
    let range = if width == 1 { format!("Bit {low}") } else { format!("Bits {low} to {}", named.value.high) };
    let text = docs::sentence(named.description.as_deref().unwrap_or(&named.name), &named.name);
    let get_docs = docs::lines(&[format!("{range}: {text}")]);
    let set_docs = docs::lines(&[format!("With {} changed: {}", range.to_lowercase(), docs::escape(&named.name))]);
    let (r#type, to, from) = match width {
        1 => ("bool", quote!(!= 0), quote!(as u64)),
        2..=8 => ("u8", quote!(as u8), quote!(as u64)),
        9..=16 => ("u16", quote!(as u16), quote!(as u64)),
        17..=32 => ("u32", quote!(as u32), quote!(as u64)),
        _ => ("u64", quote!(), quote!()),
    };
    let r#type = format_ident!("{}", r#type);
    let (low, width) = (literal::decimal(low.into()), literal::decimal(width.into()));
    let object = &context.object;
    let bits = word(data_type);
    let back = from_word(context, data_type, quote!(#object::replace(#bits, #low, #width, value #from)));
    quote! {
        #get_docs
        pub const fn #getter(self) -> #r#type {
            #object::take(#bits, #low, #width) #to
        }
        #set_docs
        #[must_use]
        pub const fn #setter(self, value: #r#type) -> Self {
            Self(#back)
        }
    }
}

/// The bits of `self` as `u64`; upper ones may be copies of the sign.
fn word(data_type: DataType) -> TokenStream {
    match data_type {
        DataType::Unsigned64 => quote!(self.0),
        _ if !literal::is_wrapped(data_type) => quote!(self.0 as u64),
        DataType::Unsigned40 | DataType::Unsigned48 | DataType::Unsigned56 => quote!(self.0.get()),
        _ => quote!(self.0.get() as u64),
    }
}

fn from_word(context: &Context<'_>, data_type: DataType, word: TokenStream) -> TokenStream {
    let inner = literal::tokens(&literal::rust_type(&context.path, data_type));
    match data_type {
        DataType::Unsigned64 => word,
        _ if literal::is_wrapped(data_type) => quote!(#inner::from_low_bits(#word)),
        _ => quote!(#word as #inner),
    }
}

fn quantity_members(
    context: &Context<'_>,
    newtype: &Newtype<'_>,
    quantity: &Quantity,
    methods: &[String],
) -> TokenStream {
    let object = &context.object;
    let ident = format_ident!("{}", newtype.ident);
    let counts = match newtype.data_type {
        DataType::Real64 => quote!(self.0),
        data_type if literal::is_wrapped(data_type) => quote!(self.0.get() as f64),
        _ => quote!(self.0 as f64),
    };
    let conversions = quantity.units.iter().zip(methods).map(|(unit, method)| {
        let getter = format_ident!("{method}");
        let constructor = format_ident!("{}", companion("from", method));
        let unit_text = docs::unit(context, unit);
        let get_docs = docs::lines(&[format!("In {unit_text}.")]);
        let from_docs = docs::lines(&[format!(
            "The nearest value to so many {}; `None` when the data type does not reach so far.",
            docs::escape(&unit.symbol)
        )]);
        let (times_num, over_den) = (factor(unit.num, quote!(*)), factor(unit.den, quote!(/)));
        let (times_den, over_num) = (factor(unit.den, quote!(*)), factor(unit.num, quote!(/)));
        quote! {
            #get_docs
            pub const fn #getter(self) -> f64 {
                #counts #times_num #over_den
            }
            #from_docs
            pub fn #constructor(value: f64) -> ::core::option::Option<Self> {
                #object::nearest(value #times_den #over_num)
            }
        }
    });
    let units = quantity.units.iter().map(|unit| self::unit(context, unit));
    quote! {
        impl #ident {
            #(#conversions)*
        }

        impl #object::Quantity for #ident {
            const UNITS: &'static [#object::Unit] = &[#(#units),*];
        }
    }
}

/// `* 10.0`, or nothing for 1.
fn factor(number: i64, operator: TokenStream) -> TokenStream {
    if number == 1 {
        return quote!();
    }
    let digits: Literal = format!("{}.0", number.unsigned_abs()).parse().expect("digits are a literal");
    if number < 0 { quote!(#operator -#digits) } else { quote!(#operator #digits) }
}

pub(super) fn unit(context: &Context<'_>, unit: &Unit) -> TokenStream {
    let object = &context.object;
    let (symbol, num, den) = (&unit.symbol, literal::decimal(unit.num.into()), literal::decimal(unit.den.into()));
    let when = unit.when.iter().map(|when| {
        let condition = super::device::condition(context, when);
        quote!(.when(#condition))
    });
    quote!(#object::Unit::new(#symbol, #num, #den) #(#when)*)
}
