//! PDOs as structs.

use lexican_eds::model::{Direction, Pdo, Value};
use lexican_eds::types::{Class, DataType};
use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use super::context::Context;
use super::{docs, literal};
use crate::plan::{Field, PdoItem, fits_every_node};

pub(super) fn pdo(context: &Context<'_>, item: &PdoItem<'_>) -> TokenStream {
    let (object, pdo) = (&context.object, item.pdo);
    let ident = format_ident!("{}", item.ident);
    let (title, direction, index) = match pdo.direction {
        Direction::Receive => ("Receive", quote!(Receive), 0x1600),
        Direction::Transmit => ("Transmit", quote!(Transmit), 0x1A00),
    };
    let bits: u32 = pdo.mapping.iter().map(|mapped| u32::from(mapped.bits)).sum();
    let docs = docs::lines(&[
        format!("{title} PDO {}, as mapped by default in {:04X}.", pdo.number, index + u32::from(pdo.number) - 1),
        String::new(),
        facts(pdo, bits.div_ceil(8)),
        String::new(),
        format!("Directions are the device's: it {}s this PDO.", title.to_lowercase()),
    ]);
    let fields = item.fields.iter().map(|field| self::field(context, field));
    let number = literal::decimal(pdo.number.into());
    let mapping = pdo.mapping.iter().map(|mapped| {
        let (index, sub, bits) =
            (literal::hex(mapped.index, 4), literal::hex(mapped.sub, 2), literal::decimal(mapped.bits.into()));
        quote!(#object::Mapped::new(#index, #sub, #bits))
    });
    let len = literal::decimal(bits.div_ceil(8).into());
    let transmission_type = pdo.transmission_type.iter().map(|&value| {
        let value = literal::decimal(value.into());
        quote! {
            /// The default of the transmission type.
            pub const TRANSMISSION_TYPE: u8 = #value;
        }
    });
    let cob_id = cob_id(context, pdo).into_iter();
    let raw = if item.fields.is_empty() { format_ident!("_raw") } else { format_ident!("raw") };
    let to_raw = to_raw(context, item);
    let from_raw = item.fields.iter().map(|field| {
        let (ident, low, bits) = place(field);
        let take = if is_cut(context, field) { quote!(take_signed) } else { quote!(take) };
        quote!(#ident: #object::Value::from_raw(#object::#take(raw, #low, #bits)))
    });
    quote! {
        #docs
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct #ident {
            #(#fields),*
        }

        impl #ident {
            /// What is mapped, in order.
            pub const MAPPING: &'static [#object::Mapped] = &[#(#mapping),*];
            #(#transmission_type)*
            #(#cob_id)*

            /// The data of a frame.
            pub fn pack(self) -> [u8; #len] {
                #object::pack(self)
            }

            /// The values of a frame's data; bytes beyond the mapped ones are ignored.
            ///
            /// # Errors
            ///
            /// When there are fewer bytes than mapped.
            pub fn unpack(data: &[u8]) -> ::core::result::Result<Self, #object::MappedLengthMismatch> {
                #object::Pdo::from_data(data)
            }
        }

        impl #object::Pdo for #ident {
            const DIRECTION: #object::Direction = #object::Direction::#direction;
            const NUMBER: u16 = #number;
            const MAPPING: &'static [#object::Mapped] = #ident::MAPPING;
            fn to_raw(self) -> u64 {
                #to_raw
            }
            fn from_raw(#raw: u64) -> Self {
                Self { #(#from_raw),* }
            }
        }
    }
}

/// `COB-ID 0x180 + node-ID · transmission type 255 · 2 bytes`.
fn facts(pdo: &Pdo, bytes: u32) -> String {
    let mut facts: Vec<String> = Vec::new();
    if let Some(id @ (CobId::NodeIdPlus(word) | CobId::Fixed(word))) = default_cob_id(pdo) {
        let plus = if matches!(id, CobId::NodeIdPlus(_)) { " + node-ID" } else { "" };
        match (word & IDENTIFIER, word & INVALID) {
            (0, INVALID) => facts.push("switched off".into()),
            (id, INVALID) => facts.push(format!("COB-ID 0x{id:X}{plus}, switched off")),
            (id, _) => facts.push(format!("COB-ID 0x{id:X}{plus}")),
        }
    }
    facts.extend(pdo.transmission_type.map(|value| format!("transmission type {value}")));
    facts.push(if bytes == 1 { "1 byte".into() } else { format!("{bytes} bytes") });
    facts.join(" · ")
}

fn field(context: &Context<'_>, field: &Field<'_>) -> TokenStream {
    let (ident, _, _) = place(field);
    let r#type = field.r#type.map_or_else(|| quote!(u64), |r#type| literal::tokens(&context.r#type(r#type)));
    let mapped = &field.mapped;
    let at = format!("{:04X}:{:02X}", mapped.index, mapped.sub);
    let name = docs::sentence(field.name.unwrap_or_default(), &at);
    let bits = if mapped.bits == 1 { "1 bit".into() } else { format!("{} bits", mapped.bits) };
    let docs = docs::lines(&[name, String::new(), format!("Address 0x{at} · {bits}, from bit {}", field.low)]);
    quote!(#docs pub #ident: #r#type)
}

fn to_raw(context: &Context<'_>, item: &PdoItem<'_>) -> TokenStream {
    let object = &context.object;
    let values = item.fields.iter().map(|field| {
        let (ident, low, bits) = place(field);
        quote!(#object::place(#object::Value::to_raw(self.#ident), #low, #bits))
    });
    if item.fields.is_empty() { quote!(0) } else { quote!(#(#values)|*) }
}

/// Whether the mapping has room for fewer bits than a signed type has, so that its highest bit is the sign.
fn is_cut(context: &Context<'_>, field: &Field<'_>) -> bool {
    let data_type = field.r#type.map(|r#type| context.plan.data_type(r#type));
    data_type.is_some_and(|data_type| {
        data_type.class() == Class::Signed && data_type.bits().is_some_and(|bits| field.mapped.bits < bits)
    })
}

fn place(field: &Field<'_>) -> (proc_macro2::Ident, TokenStream, TokenStream) {
    let ident = format_ident!("{}", field.ident);
    (ident, literal::decimal(field.low.into()), literal::decimal(field.mapped.bits.into()))
}

/// The bits of a COB-ID parameter (CiA 301, 7.5.2.35): the identifier, and whether the PDO is switched off.
const IDENTIFIER: u32 = 0x1FFF_FFFF;
const INVALID: u32 = 0x8000_0000;

#[derive(Clone, Copy)]
enum CobId {
    NodeIdPlus(u32),
    /// The same for every node.
    Fixed(u32),
}

/// The default COB-ID; of the first four as the predefined connection set has it (CiA 301, 7.3.3) where the
/// data sheet says nothing.
fn default_cob_id(pdo: &Pdo) -> Option<CobId> {
    match (&pdo.cob_id, pdo.number) {
        (&Some(Value::NodeIdPlus(base)), _) => {
            let fits = fits_every_node(base, DataType::Unsigned32);
            fits.then(|| u32::try_from(base).ok().map(CobId::NodeIdPlus))?
        }
        (Some(Value::Integer(value)), _) => u32::try_from(*value).ok().map(CobId::Fixed),
        (None, 1..=4) => {
            let first = if pdo.direction == Direction::Receive { 0x200 } else { 0x180 };
            Some(CobId::NodeIdPlus(first + 0x100 * (u32::from(pdo.number) - 1)))
        }
        _ => None,
    }
}

fn cob_id(context: &Context<'_>, pdo: &Pdo) -> Option<TokenStream> {
    let runtime = &context.runtime;
    Some(match default_cob_id(pdo)? {
        CobId::Fixed(value) => {
            let value = literal::hex(value, 3);
            quote! {
                /// The default COB-ID; the same for every node.
                pub const fn cob_id(_node: #runtime::NodeId) -> #runtime::CobId {
                    #runtime::CobId::from_parameter(#value)
                }
            }
        }
        CobId::NodeIdPlus(base) => {
            let base = literal::hex(base, 3);
            quote! {
                /// The default COB-ID of a node.
                pub const fn cob_id(node: #runtime::NodeId) -> #runtime::CobId {
                    #runtime::CobId::from_parameter(#base + node.get() as u32)
                }
            }
        }
    })
}
