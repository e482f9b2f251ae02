//! The device's side: the table, the bytes that a device starts with, and what the overlay says of conditions.

use lexican_eds::model::{Condition, Entry, NmtState, Value};
use lexican_eds::types::DataType;
use proc_macro2::{Literal, TokenStream};
use quote::{format_ident, quote};

use super::context::{Context, print};
use super::{docs, layout, literal};
use crate::plan::{Access, Handle, Mapping, fitting, raw};
use crate::start;

/// So many bytes are kept for a text or a string of bytes that may become longer than its default.
const TEXT_CAPACITY: usize = 32;
/// A capacity is a `u16` in the table.
const MAX_CAPACITY: usize = 0xFFFF;

pub(super) fn device(context: &Context<'_>, code: &mut String) {
    let (object, runtime) = (&context.object, &context.runtime);
    let mut image = Image::default();
    let rows: Vec<String> = context.plan.entry_handles().map(|handle| row(context, handle, &mut image)).collect();
    let configured = context.plan.device.entries().any(|entry| entry.configured.is_some());
    let values = if configured { "configured values and defaults" } else { "defaults" };
    table(context, values, &image, rows, code);
    let len = literal::decimal(image.bytes.len() as i128);
    let storage_docs = docs::lines(&[format!("A dictionary with the {values} of the data sheet for this node-ID.")]);
    let conditions = conditions(context);
    let items = quote! {
        /// The dictionary of a device: all values.
        pub type Storage = #object::Dictionary<#len>;

        #storage_docs
        pub fn storage(node: #runtime::NodeId) -> Storage {
            #object::Dictionary::new(&TABLE, node)
        }

        #conditions
    };
    print(items, code);
}

fn table(context: &Context<'_>, values: &str, image: &Image, rows: Vec<String>, code: &mut String) {
    let object = &context.path;
    let limits = image.limits.iter().map(|(low, high)| format!("Limit {{ low: 0x{low:X}, high: 0x{high:X} }}"));
    let relative = image.node_relative.iter();
    let relative = relative.map(|(offset, size)| format!("NodeRelative {{ offset: {offset}, size: {size} }}"));
    let used = [
        ("Access", !rows.is_empty()),
        ("DataType", !rows.is_empty()),
        ("Entry", !rows.is_empty()),
        ("Limit", !image.limits.is_empty()),
        ("NodeRelative", !image.node_relative.is_empty()),
        ("PdoMapping", !rows.is_empty()),
        ("Table", true),
    ];
    let used: Vec<&str> = used.into_iter().filter(|(_, used)| *used).map(|(name, _)| name).collect();
    let (entries, limits) = (layout::rows("        ", rows), layout::rows("        ", limits));
    let (image, relative) = (Literal::byte_string(&image.bytes), layout::rows("        ", relative));
    *code += &format!(
        "
/// All entries with their {values}, as the device serves them.
pub static TABLE: {object}::Table = {{
    use {object}::{{{}}};
    Table {{
        entries: {entries},
        limits: {limits},
        image: {image},
        node_relative: {relative},
    }}
}};
",
        used.join(", ")
    );
}

/// The bytes of all defaults, and what else the table holds beside its rows.
#[derive(Debug, Default)]
struct Image {
    bytes: Vec<u8>,
    limits: Vec<(u64, u64)>,
    node_relative: Vec<(usize, usize)>,
}

/// `Entry::new(0x1017, 0x00, DataType::Unsigned16, Access::Rw, PdoMapping::None).at(12, 2)`.
fn row(context: &Context<'_>, handle: &Handle<'_>, image: &mut Image) -> String {
    let entry = handle.entry;
    let data_type = literal::data_type(entry.data_type);
    let mapping = match handle.mapping {
        Mapping::Unmapped => "None",
        Mapping::Tpdo => "Tpdo",
        Mapping::Rpdo => "Rpdo",
        Mapping::Both => "Both",
    };
    let (index, sub, access) = (entry.index, entry.sub, handle.access);
    let (offset, capacity) = image.push(context, handle);
    let limited = handle.limits.map(|(low, high)| {
        let row = image.limit(raw(low, entry.data_type), raw(high, entry.data_type));
        format!(".limited({row})")
    });
    format!(
        "Entry::new(0x{index:04X}, 0x{sub:02X}, DataType::{data_type}, Access::{access:?}, PdoMapping::{mapping})\
         .at({offset}, {capacity}){}",
        limited.unwrap_or_default()
    )
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
