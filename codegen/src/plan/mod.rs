//! The plan: names, types and shapes of everything that is generated. Emitters decide nothing, they only print it.

mod interface;
mod newtype;
mod object;
mod pdo;
mod value;

use lexican_eds::Diagnostics;
use lexican_eds::model::{Device, Entry};

pub(crate) use interface::{InterfaceItem, ParameterItem};
pub(crate) use newtype::{Newtype, NewtypeKind, companion};
pub(crate) use object::{Access, Default, Handle, Item, Mapping, Shape};
pub(crate) use pdo::{Field, PdoItem};
pub(crate) use value::Type;

use value::{Types, type_of};

use crate::scope::{self, Claim};

/// Names at the top level that lexican itself uses.
const RESERVED: &[&str] = &[
    "BIT_RATES_KBIT",
    "DEVICE",
    "DEVICE_PROFILE",
    "Device",
    "NAMES",
    "ORDER_CODE",
    "PERSISTENT",
    "PRODUCT_CODE",
    "PRODUCT_NAME",
    "RANGES",
    "REVISION_NUMBER",
    "Storage",
    "TABLE",
    "VENDOR_ID",
    "VENDOR_NAME",
    "WRITABLE_IN",
];

#[derive(Debug)]
pub(crate) struct Plan<'a> {
    pub(crate) device: &'a Device,
    /// Sorted by kind and name.
    pub(crate) newtypes: Vec<Newtype<'a>>,
    /// Sorted by index.
    pub(crate) items: Vec<Item<'a>>,
    pub(crate) pdos: Vec<PdoItem<'a>>,
    /// Sorted by name.
    pub(crate) interfaces: Vec<InterfaceItem<'a>>,
    types: Types,
}

impl<'a> Plan<'a> {
    pub(crate) fn new(device: &'a Device, findings: &mut Diagnostics) -> Self {
        let (mut newtypes, types) = newtype::collect(device, findings);
        let mut items = object::items(device, &types, findings);
        let pdos = pdo::pdos(device, &types, findings);
        let interfaces = interface::interfaces(device, &types, findings);

        // All top-level names share one scope: a constant and a type of one letter would collide.
        let pdo_names: Vec<String> = pdos.iter().map(|pdo| pdo.ident.clone()).collect();
        let reserved: Vec<&str> = RESERVED.iter().copied().chain(pdo_names.iter().map(String::as_str)).collect();
        let mut claims: Vec<Claim> = newtypes.iter().map(|newtype| newtype.claim.clone()).collect();
        for item in &items {
            claims.push(item.claim());
            claims.extend(item.record_claim());
        }
        let mut names = scope::resolve("item", &reserved, &claims, findings).into_iter();
        let mut next = || names.next().expect("every claim is resolved");
        for newtype in &mut newtypes {
            newtype.ident = next();
        }
        for item in &mut items {
            item.ident = next();
            if let Shape::Record { ident, .. } = &mut item.shape {
                *ident = next();
            }
        }
        Plan { device, newtypes, items, pdos, interfaces, types }
    }

    /// Handles of all entries, ascending by address.
    pub(crate) fn entry_handles(&self) -> impl Iterator<Item = &Handle<'a>> {
        self.items.iter().flat_map(|item| {
            let (first, others) = match &item.shape {
                Shape::Variable(handle) => (std::slice::from_ref(handle), &[][..]),
                Shape::Array { count, elements } => (std::slice::from_ref(count), elements.as_slice()),
                Shape::Record { members, .. } => (members.as_slice(), &[][..]),
            };
            first.iter().chain(others)
        })
    }

    /// The entry at an address.
    pub(crate) fn entry(&self, index: u16, sub: u8) -> Option<&'a Entry> {
        self.device.entry(index, sub)
    }

    /// The name of an entry in the data sheet; for a single value, that of its object.
    pub(crate) fn name(&self, index: u16, sub: u8) -> Option<&'a str> {
        let object = self.device.object(index)?;
        let entry = object.entry(sub)?;
        Some(if object.kind.has_subs() { &entry.name } else { &object.name })
    }

    pub(crate) fn newtype_of(&self, entry: &Entry) -> Option<&Newtype<'a>> {
        match type_of(entry, &self.types) {
            Type::Newtype(row) => self.newtypes.get(row),
            Type::Plain(_) => None,
        }
    }
}
