//! Objects: constants, arrays, records.

use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use super::{Context, docs, literal};
use crate::plan::{Access, Default, Handle, Item, Mapping, Shape};

pub(super) fn item(context: &Context<'_>, item: &Item<'_>) -> TokenStream {
    match &item.shape {
        Shape::Variable(handle) => variable(context, item, handle),
        Shape::Array { count, elements } => array(context, item, count, elements),
        Shape::Record { ident, members } => record(context, item, ident, members),
    }
}

fn variable(context: &Context<'_>, item: &Item<'_>, handle: &Handle<'_>) -> TokenStream {
    let docs = docs::handle(context, &item.object.name, item.object.description.as_deref(), handle);
    let ident = format_ident!("{}", item.ident);
    let r#type = handle_type(context, handle);
    let value = handle_value(context, handle);
    quote! {
        #docs
        pub const #ident: #r#type = #value;
    }
}

fn array(context: &Context<'_>, item: &Item<'_>, count: &Handle<'_>, elements: &[Handle<'_>]) -> TokenStream {
    let first = elements.first().expect("an array has elements");
    let docs = docs::whole(context, item, Some(first));
    let ident = format_ident!("{}", item.ident);
    let object = &context.object;
    let parameters = parameters(context, first, count.access != Access::Ro);
    // The access right of sub-index 0 is left out where it is `ro`.
    let count = (count.access != Access::Ro).then(|| marker(context, count.access)).into_iter();
    let value = handle_value(context, first);
    let len = literal::decimal(elements.len() as i128);
    quote! {
        #docs
        pub const #ident: #object::Array<#parameters #(, #count)*> = #object::Array::new(#len, #value);
    }
}

/// The type derives nothing: it is a name and no value, and every `derive` costs each build of each user.
fn record(context: &Context<'_>, item: &Item<'_>, type_ident: &str, members: &[Handle<'_>]) -> TokenStream {
    let docs = docs::whole(context, item, None);
    let type_docs = docs::lines(&[format!("The members of [`{}`].", item.ident)]);
    let ident = format_ident!("{}", item.ident);
    let type_ident = format_ident!("{type_ident}");
    let members = members.iter().map(|member| {
        let docs = docs::handle(context, &member.entry.name, None, member);
        let ident = format_ident!("{}", member.ident);
        let r#type = handle_type(context, member);
        let value = handle_value(context, member);
        quote! {
            #docs
            pub const fn #ident(&self) -> #r#type {
                #value
            }
        }
    });
    quote! {
        #docs
        pub const #ident: #type_ident = #type_ident;

        #type_docs
        pub struct #type_ident;

        impl #type_ident {
            #(#members)*
        }
    }
}

fn handle_type(context: &Context<'_>, handle: &Handle<'_>) -> TokenStream {
    let object = &context.object;
    let parameters = parameters(context, handle, false);
    quote!(#object::Object<#parameters>)
}

/// Type, access and mapping; the mapping is left out where it is none.
fn parameters(context: &Context<'_>, handle: &Handle<'_>, whole: bool) -> TokenStream {
    let object = &context.object;
    let r#type = context.r#type(handle.r#type);
    let access = marker(context, handle.access);
    let mapping = match handle.mapping {
        Mapping::Unmapped if whole => Some(quote!(#object::Unmapped)),
        Mapping::Unmapped => None,
        Mapping::Tpdo => Some(quote!(#object::Tpdo)),
        Mapping::Rpdo => Some(quote!(#object::Rpdo)),
        Mapping::Both => Some(quote!(#object::Mappable)),
    };
    let mapping = mapping.iter();
    quote!(#r#type, #access #(, #mapping)*)
}

fn marker(context: &Context<'_>, access: Access) -> TokenStream {
    let object = &context.object;
    match access {
        Access::Ro => quote!(#object::Ro),
        Access::Wo => quote!(#object::Wo),
        Access::Rw => quote!(#object::Rw),
        Access::Const => quote!(#object::Const),
    }
}

fn handle_value(context: &Context<'_>, handle: &Handle<'_>) -> TokenStream {
    let object = &context.object;
    let index = literal::hex(handle.entry.index, 4);
    let sub = literal::hex(handle.entry.sub, 2);
    let in_hex = docs::is_hex(handle.entry);
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
            let base = literal::hex(base as u64, 1);
            quote!(.with_default_node_id_plus(#base))
        }
    });
    quote!(#object::Object::new(#index, #sub) #(#limits)* #(#default)*)
}
