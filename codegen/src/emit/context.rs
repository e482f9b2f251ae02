//! What all emitters share.

use std::collections::BTreeSet;

use lexican_eds::model::{Entry, Meaning};
use lexican_eds::standard;
use lexican_eds::types::Class;
use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use crate::plan::{Plan, Shape};

pub(super) struct Context<'a> {
    pub(super) plan: &'a Plan<'a>,
    /// The path of the runtime.
    pub(super) runtime: TokenStream,
    /// Whether the device's side is generated as well; it may write objects that are read-only on the bus.
    pub(super) is_device: bool,
    /// The names of the types in the generated code.
    own: BTreeSet<&'a str>,
}

impl<'a> Context<'a> {
    pub(super) fn new(plan: &'a Plan<'a>, runtime: &str, is_device: bool) -> Self {
        let records = plan.items.iter().filter_map(|item| match &item.shape {
            Shape::Record { ident, .. } => Some(ident.as_str()),
            _ => None,
        });
        let newtypes = plan.newtypes.iter().map(|newtype| newtype.ident.as_str());
        let own = records.chain(newtypes).collect();
        let runtime = runtime.parse().expect("the path of the runtime is checked before");
        Context { plan, runtime, is_device, own }
    }

    /// Whether an entry is written in hexadecimal: a code, an identifier or a word of bits, and no quantity.
    pub(super) fn is_hex(&self, entry: &Entry) -> bool {
        let is_code = || self.plan.newtype_of(entry).is_some_and(|newtype| newtype.is_hex);
        let is_word = || matches!(entry.meaning, Meaning::BitField(_));
        let is_unsigned = entry.data_type.class() == Class::Unsigned;
        is_unsigned && (standard::is_hex(entry.index, entry.sub) || is_word() || is_code())
    }

    /// A type of the runtime's module `object`, by its bare name, or by its path if the data sheet has a type of that
    /// name, which takes precedence over the glob import.
    pub(super) fn object(&self, name: &str) -> TokenStream {
        let (runtime, ident) = (&self.runtime, format_ident!("{name}"));
        match name {
            name if !self.own.contains(name) => quote!(#ident),
            // The aliases with the device as type parameter.
            "Object" | "Array" => quote!(marked::#ident),
            _ => quote!(#runtime::object::#ident),
        }
    }
}
