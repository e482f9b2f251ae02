//! The device's side: the table, the bytes that a device starts with, and what the overlay says of conditions.

use lexican_eds::model::{Condition, Entry, NmtState, Value};
use lexican_eds::types::DataType;
use proc_macro2::{Literal, TokenStream};
use quote::{format_ident, quote};

use super::{Context, docs, literal};
use crate::plan::{Access, Handle, Mapping, fitting, raw};
use crate::start;

/// So many bytes are kept for a text or a string of bytes that may become longer than its default.
const TEXT_CAPACITY: usize = 32;
/// A capacity is a `u16` in the table.
const MAX_CAPACITY: usize = 0xFFFF;

pub(super) fn device(context: &Context<'_>) -> TokenStream {
    let (object, runtime) = (&context.object, &context.runtime);
    let mut image = Image::default();
    let rows: Vec<TokenStream> = context.plan.entry_handles().map(|handle| row(context, handle, &mut image)).collect();
    let limits = image.limits.iter().map(|&(low, high)| {
        let (low, high) = (literal::hex(low, 1), literal::hex(high, 1));
        quote!(#object::Limit { low: #low, high: #high })
    });
    let relative = image.node_relative.iter().map(|&(offset, size)| {
        let (offset, size) = (literal::decimal(offset as i128), literal::decimal(size as i128));
        quote!(#object::NodeRelative { offset: #offset, size: #size })
    });
    let bytes = Literal::byte_string(&image.bytes);
    let len = literal::decimal(image.bytes.len() as i128);
    let conditions = conditions(context);
    let configured = context.plan.device.entries().any(|entry| entry.configured.is_some());
    let values = if configured { "configured values and defaults" } else { "defaults" };
    let table_docs = docs::lines(&[format!("All entries with their {values}, as the device serves them.")]);
    let storage_docs = docs::lines(&[format!("A dictionary with the {values} of the data sheet for this node-ID.")]);
    quote! {
        #table_docs
        pub static TABLE: #object::Table = #object::Table {
            entries: &[#(#rows),*],
            limits: &[#(#limits),*],
            image: #bytes,
            node_relative: &[#(#relative),*],
        };

        /// The dictionary of a device: all values.
        pub type Storage = #object::Dictionary<#len>;

        #storage_docs
        pub fn storage(node: #runtime::NodeId) -> Storage {
            #object::Dictionary::new(&TABLE, node)
        }

        #conditions
    }
}

/// The bytes of all defaults, and what else the table holds beside its rows.
#[derive(Debug, Default)]
struct Image {
    bytes: Vec<u8>,
    limits: Vec<(u64, u64)>,
    node_relative: Vec<(usize, usize)>,
}

fn row(context: &Context<'_>, handle: &Handle<'_>, image: &mut Image) -> TokenStream {
    let (object, entry) = (&context.object, handle.entry);
    let (index, sub) = (literal::hex(entry.index, 4), literal::hex(entry.sub, 2));
    let data_type = literal::data_type(object, entry.data_type);
    let access = match handle.access {
        Access::Ro => quote!(Ro),
        Access::Wo => quote!(Wo),
        Access::Rw => quote!(Rw),
        Access::Const => quote!(Const),
    };
    let mapping = match handle.mapping {
        Mapping::Unmapped => quote!(None),
        Mapping::Tpdo => quote!(Tpdo),
        Mapping::Rpdo => quote!(Rpdo),
        Mapping::Both => quote!(Both),
    };
    let (offset, capacity) = image.push(context, handle);
    let (offset, capacity) = (literal::decimal(offset as i128), literal::decimal(capacity as i128));
    let limited = handle.limits.iter().map(|&(low, high)| {
        let row = image.limit(raw(low, entry.data_type), raw(high, entry.data_type));
        let row = literal::decimal(row as i128);
        quote!(.limited(#row))
    });
    let limited: Vec<TokenStream> = limited.collect();
    quote! {
        #object::Entry::new(#index, #sub, #data_type, #object::Access::#access, #object::PdoMapping::#mapping)
            .at(#offset, #capacity) #(#limited)*
    }
}

impl Image {
    /// The place of an entry's value: offset and capacity.
    fn push(&mut self, context: &Context<'_>, handle: &Handle<'_>) -> (usize, usize) {
        let entry = handle.entry;
        if entry.data_type == DataType::Domain {
            return (0, 0);
        }
        let mut initial = start::initial(context.plan.device, entry);
        if entry.data_type.bits().is_some() {
            let (offset, size) = (self.bytes.len(), initial.bytes.len());
            self.bytes.append(&mut initial.bytes);
            if initial.node_relative {
                self.node_relative.push((offset, size));
            }
            return (offset, size);
        }
        let mut bytes = initial.bytes;
        bytes.truncate(MAX_CAPACITY);
        let grows = matches!(handle.access, Access::Rw | Access::Wo) || bytes.is_empty();
        let capacity = if grows { bytes.len().max(TEXT_CAPACITY) } else { bytes.len() };
        self.bytes.extend_from_slice(&(bytes.len() as u16).to_le_bytes());
        let offset = self.bytes.len();
        self.bytes.extend_from_slice(&bytes);
        self.bytes.resize(offset + capacity, 0);
        (offset, capacity)
    }

    /// The row of these limits, which may have been used before.
    fn limit(&mut self, low: u64, high: u64) -> usize {
        let found = self.limits.iter().position(|&limit| limit == (low, high));
        found.unwrap_or_else(|| {
            self.limits.push((low, high));
            self.limits.len() - 1
        })
    }
}

fn conditions(context: &Context<'_>) -> TokenStream {
    let object = &context.object;
    let entries = || context.plan.device.objects.iter().flat_map(|object| &object.entries);
    let address = |entry: &Entry| {
        let (index, sub) = (literal::hex(entry.index, 4), literal::hex(entry.sub, 2));
        quote!(#index, #sub)
    };
    let ranges = entries().flat_map(|entry| entry.ranges.iter().map(move |range| (entry, range))).filter_map(
        |(entry, range)| {
            let [low, high] = [range.low, range.high].map(|limit| {
                fitting(&Value::Integer(limit), entry.data_type)
                    .map(|limit| literal::hex(raw(limit, entry.data_type), 1))
            });
            let (low, high) = (low?, high?);
            let (address, when) = (address(entry), condition(context, &range.when));
            Some(quote!(#object::ConditionalLimit::new(#address, #when, #low, #high)))
        },
    );
    let writable = entries().filter_map(|entry| {
        let states = entry.writable_in.as_ref()?;
        let [pre_operational, operational] = [NmtState::PreOperational, NmtState::Operational]
            .map(|state| format_ident!("{}", states.contains(&state).to_string()));
        let address = address(entry);
        Some(quote!(#object::WritableIn::new(#address, #pre_operational, #operational)))
    });
    let persistent = entries().filter(|entry| entry.persistent).map(|entry| {
        let address = address(entry);
        quote!(#object::Address::new(#address))
    });
    quote! {
        /// Limits that depend on other entries, ascending by address.
        pub static RANGES: &[#object::ConditionalLimit] = &[#(#ranges),*];

        /// Entries that may be written in some NMT states only, ascending by address. The dictionary does not know the
        /// state: what serves it asks here, and refuses a write with 0800 0022h.
        pub static WRITABLE_IN: &[#object::WritableIn] = &[#(#writable),*];

        /// Entries that the device keeps without power, ascending.
        pub static PERSISTENT: &[#object::Address] = &[#(#persistent),*];
    }
}

/// A condition, with the number in the wire form of the entry that decides.
pub(super) fn condition(context: &Context<'_>, condition: &Condition) -> TokenStream {
    let object = &context.object;
    let (index, sub) = (literal::hex(condition.index, 4), literal::hex(condition.sub, 2));
    let equal = format_ident!("{}", condition.equal.to_string());
    let data_type = context.plan.entry(condition.index, condition.sub).map(|entry| entry.data_type);
    let number =
        data_type.and_then(|data_type| Some(raw(fitting(&Value::Integer(condition.value), data_type)?, data_type)));
    let value = literal::hex(number.unwrap_or(condition.value as u64), 1);
    quote!(#object::Condition::new(#index, #sub, #equal, #value))
}
