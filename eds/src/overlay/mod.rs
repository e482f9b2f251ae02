//! Overlays: TOML files beside a data sheet, which itself is never edited. They hold what the data sheet lacks or has
//! wrong: corrections, units, enumerations, bit fields, conditional limits and PDOs.
//!
//! ```toml
//! [overlay]
//! format = 1                       # this format
//! names = ["OTHER.EDS"]            # other names that the device library answers to
//! profile = 402                    # where 1000h does not say it
//! sdo_writes_four_bytes = true     # also of shorter types
//!
//! [object."6060"]                  # an object, or "2410:05" an entry
//! reason = "the manual, table 12"  # required with data_type, access, pdo_mapping, default, low and high
//! name = "Modes of operation"
//! data_type = "INTEGER8"           # a name of CiA 301, or its number
//! access = "rw"                    # ro, wo, rw, rwr, rww, const
//! pdo_mapping = true
//! default = 100                    # a number, a text, or "$NODEID+0x180"
//! low = 1
//! high = 500
//! description = "one sentence"
//! quantity = "Position"            # at most one of quantity, enumeration and bit_field
//! ranges = [ { when = "2102:00 == 2", low = 1, high = 200 } ]
//! first_character_high = true      # of a number that holds characters
//! persistent = true
//! writable_in = ["pre-operational", "operational"]
//! simulated = false                # a simulated device holds it, but does not do what it is for; takes a reason as well
//! accept = ["cia301::data-type"]   # findings that are as they should be; takes a reason as well
//!
//! [enumeration.OperatingMode]
//! description = "one sentence"
//! values = [ { value = 1, name = "profile position", description = "one sentence" } ]
//!
//! [bit_field.Statusword]
//! fields = [ { bits = 0, name = "ready to switch on" }, { bits = "4..7", name = "mode", simulated = false, reason = "ours" } ]
//!
//! [quantity.Position]
//! units = [ { symbol = "mm", method = "millimetres", scale = "1/100", when = "2412:00 != 0" } ]
//!
//! [[pdo]]
//! direction = "transmit"           # as the device sees it
//! number = 2
//! cob_id = "$NODEID+0x280"
//! transmission_type = 255
//! mapping = ["6041:00", "6064:00"]
//!
//! [interface.serial]               # another interface, whose parameters mostly are objects under other numbers
//! description = "one sentence"
//! parameters = [                   # a row each: a number or a text, the object, and what differs from it
//!     { number = "E1/F1", object = "607D:02", name = "Upper limit" },
//!     { number = 930, object = "6060", values = [ { value = 2, name = "profile position" } ] },
//!     { number = 952, object = "1003:00", access = "ro", data_type = "UNSIGNED16", low = 0, high = 5 },
//!     { number = 24, object = "607A", when = "6060:00 == 1" },
//!     { number = 25, name = "Stop", access = "rw", data_type = "UNSIGNED8", enumeration = "InchingStop" },
//! ]
//! ```
//!
//! The keys of `[object."2410"]` about the object itself apply to it; those about entries apply to sub-index 0 of a
//! VAR, or to each sub-index but 0 of an ARRAY, with separate findings for each. A parameter that equals an ARRAY as a
//! whole, `object = "1003"`, has its elements from sub-index 1 on. All users of a quantity, enumeration or bit field
//! have the same data type. `[object."3400..36FF"]` takes `simulated` and `reason` for all entries in the range.
//! Several overlays are applied in order; later ones win.

mod interface;
mod keys;
mod meaning;
mod object;
pub(crate) mod pdo;
mod value;

pub(crate) use meaning::rational;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

pub use keys::keys_of;

use crate::finding::{Findings, Kind};
use crate::model::keys::Key;
use crate::model::{Condition, Device, Meaning, Pdo};
use crate::text::{Source, Span};
use lexican_cia::cia301;

/// The newest known version of the overlay format.
const FORMAT: i128 = 1;

/// What overlays have changed, with the places that say so.
#[derive(Clone, Debug, Default)]
pub(crate) struct Changes {
    /// Corrected keys of entries.
    pub(crate) corrections: Vec<Correction>,
    /// Uses of quantities, enumerations and bit fields.
    pub(crate) uses: Vec<Use>,
    /// Conditions of units and ranges.
    pub(crate) conditions: Vec<(Condition, Span)>,
    pub(crate) pdos: Vec<Extra>,
    pub(crate) profile: Option<(u16, Span)>,
    pub(crate) accepted: Vec<Accepted>,
}

/// A finding that an overlay accepts.
#[derive(Clone, Debug)]
pub(crate) struct Accepted {
    pub(crate) index: u16,
    /// The sub-index; `None` for the object with all its entries.
    pub(crate) sub: Option<u8>,
    pub(crate) code: String,
    pub(crate) span: Span,
}

/// A key of an entry that an overlay corrects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Correction {
    pub(crate) index: u16,
    pub(crate) sub: u8,
    pub(crate) key: Key,
    pub(crate) span: Span,
}

/// An entry that uses a quantity, an enumeration or a bit field.
#[derive(Clone, Debug)]
pub(crate) struct Use {
    pub(crate) index: u16,
    pub(crate) sub: u8,
    pub(crate) meaning: Meaning,
    pub(crate) span: Span,
}

/// A PDO that an overlay describes.
#[derive(Clone, Debug)]
pub(crate) struct Extra {
    pub(crate) pdo: Pdo,
    /// The `[[pdo]]` table.
    pub(crate) span: Span,
}

impl Changes {
    /// The place of the last correction of this key.
    pub(crate) fn correction(&self, index: u16, sub: u8, key: Key) -> Option<Span> {
        let of_key = |c: &&Correction| (c.index, c.sub, c.key) == (index, sub, key);
        self.corrections.iter().rev().find(of_key).map(|correction| correction.span)
    }
}

/// Applies an overlay to a device.
pub(crate) fn apply(source: &Source, number: u16, device: &mut Device, changes: &mut Changes, out: &mut Findings) {
    if let Some(refusal) = source.refusal() {
        out.push(Kind::FileSize(refusal), Span { source: number, start: 0, end: 0 });
        return;
    }
    let mut reader = Reader { number, device, changes, out };
    let (table, errors) = DeTable::parse_recoverable(source.text());
    for error in errors {
        let span = error.span().map_or(Span { source: number, start: 0, end: 0 }, |range| reader.span(range));
        reader.out.push(Kind::OverlaySyntax(error.message().into()), span);
    }
    reader.document(table.get_ref());
}

/// The device profile: from an overlay, else the low half of 1000h.
pub(crate) fn profile(device: &Device, changes: &Changes) -> Option<u16> {
    let device_type = || {
        let entry = device.entry(cia301::DEVICE_TYPE, 0)?;
        entry.configured.as_ref().or(entry.default.as_ref())?.as_integer()
    };
    let of_device_type = || device_type().map(|value| (value & 0xFFFF) as u16).filter(|&profile| profile != 0);
    changes.profile.map(|(profile, _)| profile).or_else(of_device_type)
}

/// Reads one overlay.
struct Reader<'o> {
    number: u16,
    device: &'o mut Device,
    changes: &'o mut Changes,
    out: &'o mut Findings,
}

/// A value with its place.
type Node<'i> = Spanned<DeValue<'i>>;
/// A key with its place.
type Name<'i> = Spanned<std::borrow::Cow<'i, str>>;

impl Reader<'_> {
    fn document(&mut self, table: &DeTable<'_>) {
        let mut header = false;
        for (key, node) in table {
            match key.get_ref().as_ref() {
                "overlay" => {
                    header = true;
                    self.header(node);
                }
                "object" => self.each(node, Self::object),
                "enumeration" => self.each(node, Self::enumeration),
                "bit_field" => self.each(node, Self::bit_field),
                "quantity" => self.each(node, Self::quantity),
                "pdo" | "interface" => {}
                _ => self.unknown(key, keys_of("")),
            }
        }
        // PDOs and interfaces come last, because they depend on corrections: a mapping has the length of the data type,
        // and a parameter copies its object.
        for (key, node) in table {
            match key.get_ref().as_ref() {
                "pdo" => self.pdos(node),
                "interface" => self.each(node, Self::interface),
                _ => {}
            }
        }
        if !header {
            let start = Span { source: self.number, start: 0, end: 0 };
            self.out.push(Kind::OverlayWithoutFormat, start);
        }
    }

    fn header(&mut self, node: &Node<'_>) {
        let Some(table) = self.table(node) else { return };
        let mut format = None;
        for (key, node) in table {
            match key.get_ref().as_ref() {
                "format" => {
                    format = self.integer(node);
                    if let Some(found) = format.filter(|&format| format != FORMAT) {
                        self.push(Kind::OverlayFormat(found), node);
                    }
                }
                "names" => {
                    for name in self.array(node).into_iter().flatten() {
                        self.text(name);
                    }
                }
                "sdo_writes_four_bytes" => {
                    self.device.sdo_writes_four_bytes = self.flag(node).unwrap_or(false);
                }
                "profile" => self.changes.profile = self.number(node).map(|profile| (profile, self.span(node.span()))),
                _ => self.unknown(key, keys_of("overlay")),
            }
        }
        if format.is_none() {
            self.push(Kind::OverlayWithoutFormat, node);
        }
    }

    fn each(&mut self, node: &Node<'_>, read: impl Fn(&mut Self, &Name<'_>, &Node<'_>)) {
        for (key, node) in self.table(node).into_iter().flatten() {
            read(self, key, node);
        }
    }

    fn unknown(&mut self, key: &Name<'_>, known: &[&str]) {
        let known: Vec<String> = known.iter().map(|key| format!("`{key}`")).collect();
        let known = known.join(", ").into();
        self.push(Kind::OverlayKey { key: key.get_ref().as_ref().into(), known }, key);
    }

    fn span(&self, range: std::ops::Range<usize>) -> Span {
        Span { source: self.number, start: range.start as u32, end: range.end as u32 }
    }
}
