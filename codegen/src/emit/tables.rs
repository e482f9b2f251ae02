//! The device's side (the table of all entries, the initial bytes, the conditions of the overlay), and the table of
//! names.

use lexican_eds::model::number::fitting;
use lexican_eds::model::{Entry, NmtState, Object, Value};
use lexican_eds::types::DataType;
use proc_macro2::{Literal, TokenStream};
use quote::{format_ident, quote};

use super::context::Context;
use super::layout::line;
use super::{layout, literal};
use crate::plan::{Access, Handle, Mapping, Newtype, NewtypeKind};
use lexican_eds::start;

/// The smallest capacity, in bytes, of a string that may become longer than its default.
const TEXT_CAPACITY: usize = 32;
/// The table stores a capacity as `u16`.
const MAX_CAPACITY: usize = 0xFFFF;

pub(super) fn device(context: &Context<'_>, code: &mut String) {
    let mut image = Image::default();
    let rows = rows(context, &mut image);
    let configured = context.plan.device.entries().any(|entry| entry.configured.is_some());
    let values = if configured { "configured values and defaults" } else { "defaults" };
    let indent = "    ";
    *code += &format!(
        "
/// All entries with their {values}, as the device serves them.
pub static TABLE: {table} = {table} {{
    rows: {},
    limits: {},
    image: {},
}};

/// The dictionary of a device: all values.
pub type Storage = {}<{}>;

/// A dictionary with the {values} of the data sheet for this node-ID.
pub fn storage(node: {runtime}::NodeId) -> Storage {{
    Storage::new(&TABLE, node)
}}
",
        layout::rows(indent, rows),
        layout::rows(indent, image.limits.iter().cloned()),
        layout::bytes(&image.bytes, &format!("{indent}    ")),
        line(&context.object("Dictionary")),
        image.bytes.len(),
        runtime = line(&context.runtime),
        table = line(&context.object("Table")),
    );
    conditions(context, code);
}

/// The bytes of all defaults, and the limits that rows refer to.
#[derive(Debug, Default)]
struct Image {
    bytes: Vec<u8>,
    limits: Vec<String>,
}

/// A row of the table, for one entry or for several alike.
#[derive(Debug)]
struct Row<'a> {
    first: &'a Entry,
    last: u8,
    /// The offset behind the value of the last entry.
    end: usize,
    place: Place,
    /// The code that entries of one row have in common: type and rights before the place, and what follows it.
    facts: [String; 2],
}

/// Where the value of an entry is, and whether the node-ID is added to its default.
#[derive(Clone, Copy, Debug)]
struct Place {
    offset: usize,
    capacity: usize,
    plus_node: bool,
}

fn rows(context: &Context<'_>, image: &mut Image) -> Vec<String> {
    let mut rows: Vec<Row<'_>> = Vec::new();
    for handle in context.plan.entry_handles() {
        let row = row(context, handle, image);
        match rows.last_mut() {
            Some(before) if before.goes_on_with(&row) => (before.last, before.end) = (row.last, row.end),
            _ => rows.push(row),
        }
    }
    rows.iter().map(|row| row.code(context)).collect()
}

impl Row<'_> {
    /// Whether `next` is alike, so that this row can stand for it, too.
    fn goes_on_with(&self, next: &Row<'_>) -> bool {
        let is_number = self.first.data_type.bits().is_some();
        let follows = self.first.index == next.first.index
            && self.last.checked_add(1) == Some(next.last)
            && self.end == next.place.offset;
        is_number && follows && self.facts == next.facts
    }

    /// `Row::new(0x1017, 0x00, DataType::Unsigned16, Access::Rw, PdoMapping::None).at(12, 2)`.
    fn code(&self, context: &Context<'_>) -> String {
        let (new, [kind, rest]) = (line(&context.object("Row")), &self.facts);
        let address = line(&literal::address(self.first.index, self.first.sub));
        let up_to = if self.last > self.first.sub { format!(".up_to(0x{:02X})", self.last) } else { String::new() };
        let Place { offset, capacity, .. } = self.place;
        format!("{new}::new({address}, {kind}){up_to}.at({offset}, {capacity}){rest}")
    }
}

/// The row of an entry.
fn row<'a>(context: &Context<'_>, handle: &Handle<'a>, image: &mut Image) -> Row<'a> {
    let entry = handle.entry;
    let mapping = match handle.mapping {
        Mapping::Unmapped => "None",
        Mapping::Tpdo => "Tpdo",
        Mapping::Rpdo => "Rpdo",
        Mapping::Both => "Both",
    };
    let place = image.push(context, handle);
    let [types, accesses, mappings] = ["DataType", "Access", "PdoMapping"].map(|name| context.object(name));
    let data_type = literal::data_type(entry.data_type);
    let (access, mapping) = (format_ident!("{}", format!("{:?}", handle.access)), format_ident!("{mapping}"));
    let limited = handle.limits.map(|(low, high)| {
        let [low, high] = [low, high].map(|number| literal::wire_form(context, entry, number));
        let limit = context.object("Limit");
        let row = Literal::usize_unsuffixed(image.limit(line(&quote!(#limit { low: #low, high: #high }))));
        quote!(.limited(#row))
    });
    let plus_node = place.plus_node.then(|| quote!(.plus_node()));
    let facts = [quote!(#types::#data_type, #accesses::#access, #mappings::#mapping), quote!(#limited #plus_node)];
    Row { first: entry, last: entry.sub, end: place.offset + place.capacity, place, facts: facts.each_ref().map(line) }
}

impl Image {
    fn push(&mut self, context: &Context<'_>, handle: &Handle<'_>) -> Place {
        let entry = handle.entry;
        if entry.data_type == DataType::Domain {
            return Place { offset: 0, capacity: 0, plus_node: false };
        }
        let mut initial = start::initial(context.plan.device, entry);
        if entry.data_type.bits().is_some() {
            let (offset, size) = (self.bytes.len(), initial.bytes.len());
            self.bytes.append(&mut initial.bytes);
            return Place { offset, capacity: size, plus_node: initial.node_relative };
        }
        let mut bytes = initial.bytes;
        bytes.truncate(MAX_CAPACITY);
        let grows = matches!(handle.access, Access::Rw | Access::Wo) || bytes.is_empty();
        let capacity = if grows { bytes.len().max(TEXT_CAPACITY) } else { bytes.len() };
        self.bytes.extend_from_slice(&(bytes.len() as u16).to_le_bytes());
        let offset = self.bytes.len();
        self.bytes.extend_from_slice(&bytes);
        self.bytes.resize(offset + capacity, 0);
        Place { offset, capacity, plus_node: false }
    }

    /// The position of these limits in the list; equal limits are stored once.
    fn limit(&mut self, limit: String) -> usize {
        let found = self.limits.iter().position(|known| *known == limit);
        found.unwrap_or_else(|| {
            self.limits.push(limit);
            self.limits.len() - 1
        })
    }
}

fn conditions(context: &Context<'_>, code: &mut String) {
    let entries = || context.plan.device.entries();
    let at = |entry: &Entry| literal::address(entry.index, entry.sub);
    let ranges = entries().flat_map(|entry| entry.ranges.iter().map(move |range| (entry, range))).filter_map(
        |(entry, range)| {
            let [low, high] = [range.low, range.high].map(|limit| {
                fitting(&Value::Integer(limit), entry.data_type).map(|limit| literal::wire_form(context, entry, limit))
            });
            let when = literal::condition(context, &range.when);
            let (path, at, low, high) = (context.object("ConditionalLimit"), at(entry), low?, high?);
            Some(line(&quote!(#path::new(#at, #when, #low, #high))))
        },
    );
    let writable = entries().filter_map(|entry| {
        let states = entry.writable_in.as_ref()?;
        let [pre_operational, operational] =
            [NmtState::PreOperational, NmtState::Operational].map(|state| states.contains(&state));
        let (path, at) = (context.object("WritableIn"), at(entry));
        Some(line(&quote!(#path::new(#at, #pre_operational, #operational))))
    });
    let persistent = entries().filter(|entry| entry.persistent).map(|entry| {
        let (path, at) = (context.object("Address"), at(entry));
        line(&quote!(#path::new(#at)))
    });
    *code += &format!(
        "
/// Limits that depend on other entries, ascending by address.
pub static RANGES: &[{}] = {};

/// Entries that may be written in some NMT states only, ascending by address. The dictionary does not know the
/// state: what serves it asks here, and refuses a write with 0800 0022h.
pub static WRITABLE_IN: &[{}] = {};

/// Entries that the device keeps without power, ascending.
pub static PERSISTENT: &[{}] = {};
",
        line(&context.object("ConditionalLimit")),
        layout::rows("", ranges),
        line(&context.object("WritableIn")),
        layout::rows("", writable),
        line(&context.object("Address")),
        layout::rows("", persistent),
    );
}

/// Writes the table by which tools show entries.
pub(super) fn names(context: &Context<'_>, code: &mut String) {
    let [path, types, meanings] = ["Name", "DataType", "Meaning"].map(|name| context.object(name));
    let rows = context.plan.device.objects.iter().flat_map(|described| {
        described.entries.iter().map(|entry| {
            let meaning = context.plan.newtype_of(entry).map_or_else(|| quote!(Plain), |it| meaning(context, it));
            let (address, name) = (literal::address(entry.index, entry.sub), full_name(described, &entry.name));
            let data_type = literal::data_type(entry.data_type);
            line(&quote!(#path::new(#address, #name, #types::#data_type, #meanings::#meaning)))
        })
    });
    *code += &format!(
        "\n/// The names of all entries, ascending by address.\npub static NAMES: &[{}] = {};\n",
        line(&path),
        layout::rows("", rows)
    );
}

fn full_name(object: &Object, name: &str) -> String {
    match object.entries.as_slice() {
        [only] if only.sub == 0 => object.name.clone(),
        _ => format!("{}: {name}", object.name),
    }
}

fn meaning(context: &Context<'_>, newtype: &Newtype<'_>) -> TokenStream {
    let (variant, constant) = match newtype.kind {
        NewtypeKind::Enumeration { .. } => ("Enumeration", "NAMES"),
        NewtypeKind::BitField { .. } => ("BitField", "BITS"),
        NewtypeKind::Quantity { .. } => ("Quantity", "UNITS"),
    };
    let (ident, path) = (format_ident!("{}", newtype.ident), context.object(variant));
    let (variant, constant) = (format_ident!("{variant}"), format_ident!("{constant}"));
    quote!(#variant(<#ident as #path>::#constant))
}
