//! PDOs as structs.

use lexican_eds::model::{Direction, Pdo, Value};
use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use super::{Context, docs, literal};
use crate::plan::{Field, PdoItem};

pub(super) fn pdo(context: &Context<'_>, item: &PdoItem<'_>) -> TokenStream {
    let (object, pdo) = (&context.object, item.pdo);
    let ident = format_ident!("{}", item.ident);
    let (title, direction, index) = match pdo.direction {
        Direction::Receive => ("Receive", quote!(Receive), 0x1600),
        Direction::Transmit => ("Transmit", quote!(Transmit), 0x1A00),
    };
    let docs = docs::lines(&[
        format!("{title} PDO {}, as mapped by default in {:04X}.", pdo.number, index + u32::from(pdo.number) - 1),
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
    let bits: u32 = pdo.mapping.iter().map(|mapped| u32::from(mapped.bits)).sum();
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
        quote!(#ident: #object::Value::from_raw(#object::take(raw, #low, #bits)))
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

fn field(context: &Context<'_>, field: &Field<'_>) -> TokenStream {
    let (ident, _, _) = place(field);
    let r#type = field.r#type.map_or_else(|| quote!(u64), |r#type| context.r#type(r#type));
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

fn place(field: &Field<'_>) -> (proc_macro2::Ident, TokenStream, TokenStream) {
    let ident = format_ident!("{}", field.ident);
    (ident, literal::decimal(field.low.into()), literal::decimal(field.mapped.bits.into()))
}

/// The default COB-ID; of the first four as the predefined connection set has it (CiA 301, 7.3.3) where the
/// data sheet says nothing.
fn cob_id(context: &Context<'_>, pdo: &Pdo) -> Option<TokenStream> {
    let runtime = &context.runtime;
    let base = match (&pdo.cob_id, pdo.number) {
        (Some(Value::NodeIdPlus(base)), _) => Some(u32::try_from(*base).ok()?),
        (Some(Value::Integer(value)), _) => {
            let value = literal::hex(u32::try_from(*value).ok()?, 3);
            return Some(quote! {
                /// The default COB-ID; the same for every node.
                pub const fn cob_id(_node: #runtime::NodeId) -> #runtime::CobId {
                    #runtime::CobId::from_parameter(#value)
                }
            });
        }
        (None, 1..=4) => {
            let first = if pdo.direction == Direction::Receive { 0x200 } else { 0x180 };
            Some(first + 0x100 * (u32::from(pdo.number) - 1))
        }
        _ => None,
    };
    let base = literal::hex(base?, 3);
    Some(quote! {
        /// The default COB-ID of a node.
        pub const fn cob_id(node: #runtime::NodeId) -> #runtime::CobId {
            #runtime::CobId::from_parameter(#base + node.get() as u32)
        }
    })
}
