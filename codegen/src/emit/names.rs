//! The table that tools show entries by.

use lexican_eds::model::Object;
use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use super::{Context, literal};
use crate::plan::{Newtype, NewtypeKind};

pub(super) fn names(context: &Context<'_>) -> TokenStream {
    let object = &context.object;
    let rows = context.plan.device.objects.iter().flat_map(|described| {
        described.entries.iter().map(move |entry| {
            let (index, sub) = (literal::hex(entry.index, 4), literal::hex(entry.sub, 2));
            let name = full_name(described, &entry.name);
            let data_type = literal::data_type(object, entry.data_type);
            let meaning =
                context.plan.newtype_of(entry).map_or_else(|| quote!(Plain), |newtype| meaning(context, newtype));
            quote!(#object::Name::new(#index, #sub, #name, #data_type, #object::Meaning::#meaning))
        })
    });
    quote! {
        /// The names of all entries, ascending by address.
        pub static NAMES: &[#object::Name] = &[#(#rows),*];
    }
}

fn full_name(object: &Object, name: &str) -> String {
    match object.entries.as_slice() {
        [only] if only.sub == 0 => object.name.clone(),
        _ => format!("{}: {name}", object.name),
    }
}

fn meaning(context: &Context<'_>, newtype: &Newtype<'_>) -> TokenStream {
    let object = &context.object;
    let ident = format_ident!("{}", newtype.ident);
    match newtype.kind {
        NewtypeKind::Enumeration { .. } => quote!(Enumeration(<#ident as #object::Enumeration>::NAMES)),
        NewtypeKind::BitField { .. } => quote!(BitField(<#ident as #object::BitField>::BITS)),
        NewtypeKind::Quantity { .. } => quote!(Quantity(<#ident as #object::Quantity>::UNITS)),
    }
}
