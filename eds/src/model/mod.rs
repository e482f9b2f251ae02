//! The device as data sheet and overlay describe it: the source of generated code, dumps, comparisons and simulation.
//! Nothing is text any more except names and descriptions.

mod info;
pub(crate) mod keys;
pub mod number;
pub(crate) mod pdo;
mod sparse;
pub mod types;

use std::collections::BTreeMap;
use std::ops::{Deref, DerefMut};

pub use info::{Commissioning, DeviceInfo, FileInfo, Tool};
use sparse::{Details, Sparse};

use crate::model::types::DataType;
use crate::text::Span;
use lexican_cia::cia301;

/// A device: everything a data sheet and its overlay say.
#[derive(Clone, Debug, Default, PartialEq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Device {
    pub file: FileInfo,
    pub info: DeviceInfo,
    /// `[DummyUsage]`: data types that PDOs may map as placeholders.
    pub dummies: Vec<DataType>,
    /// `[Comments]`, line by line.
    pub comments: Vec<String>,
    /// `[DeviceComissioning]` of a DCF.
    pub commissioning: Option<Commissioning>,
    /// The device profile: what the overlay says, else the low half of 1000h, as a DCF configures it or by default.
    pub profile: Option<u16>,
    /// Whether every SDO write carries four bytes, even for a shorter type (overlay).
    pub sdo_writes_four_bytes: bool,
    /// The objects, ascending by index.
    pub objects: Vec<Object>,
    /// The enumerations of the overlay, by name.
    pub enumerations: BTreeMap<String, Enumeration>,
    /// The bit fields of the overlay, by name.
    pub bit_fields: BTreeMap<String, BitField>,
    /// The quantities of the overlay, by name.
    pub quantities: BTreeMap<String, Quantity>,
    /// Interfaces other than CANopen, by name (overlay).
    pub interfaces: BTreeMap<String, Interface>,
    /// The PDOs by the defaults and the overlay: receive PDOs first, then by number.
    pub pdos: Vec<Pdo>,
    /// `[SupportedModules]` and the `[M1…]` sections of a modular device, by number.
    pub modules: Vec<Module>,
    /// `[ConnectedModules]` of a DCF: module numbers by slot.
    pub connected_modules: Vec<u16>,
    pub channels: Vec<DynamicChannel>,
    pub tools: Vec<Tool>,
}

/// One index of the dictionary. Rarely used attributes are in [`ObjectDetails`], to which it dereferences.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Object {
    pub index: u16,
    /// `ParameterName`.
    pub name: String,
    /// The list of the data sheet that names it.
    pub list: ObjectList,
    /// `ObjectType`.
    pub kind: ObjectKind,
    /// A VAR or DOMAIN has one, at sub-index 0; other objects have theirs in ascending order of sub-indices.
    pub entries: Vec<Entry>,
    /// `ObjFlags`: bit 0 refuses a write on download, bit 1 refuses a read on scan.
    pub flags: u32,
    /// Where the data sheet describes it.
    pub span: Span,
    pub(crate) details: Sparse<ObjectDetails>,
}

/// Attributes that few objects have.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ObjectDetails {
    /// From the overlay, for the documentation.
    pub description: Option<String>,
    /// `[xxxxObjectLinks]`: objects that belong to this one.
    pub links: Vec<u16>,
    /// `Denotation` of a DCF.
    pub denotation: Option<String>,
    /// `ParamRefd` of a DCF: the reference designator of the parameter.
    pub designator: Option<String>,
    /// What tools add in an XDD.
    pub properties: Option<Box<Properties>>,
}

/// The three lists of objects in a data sheet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum ObjectList {
    Mandatory,
    #[default]
    Optional,
    Manufacturer,
}

/// The object codes of CiA 301 (7.4.3, table 42).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ObjectKind {
    /// 0: no data.
    Null,
    /// 2: a block of data of any size.
    Domain,
    /// 5: the definition of a data type.
    DefType,
    /// 6: the definition of a record type.
    DefStruct,
    /// 7: a single value.
    Variable,
    /// 8: values of one type.
    Array,
    /// 9: values of several types.
    Record,
}

/// One entry, which an SDO addresses by index and sub-index. Rarely used attributes are in [`EntryDetails`], to which
/// it dereferences.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Entry {
    pub index: u16,
    /// The sub-index.
    pub sub: u8,
    /// `ParameterName`, or the name that the overlay gives.
    pub name: String,
    pub data_type: DataType,
    pub access: AccessType,
    /// `PDOMapping`.
    pub pdo_mapping: bool,
    pub default: Option<Value>,
    /// Where the data sheet describes it.
    pub span: Span,
    pub(crate) details: Sparse<EntryDetails>,
}

/// Attributes that few entries have.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EntryDetails {
    /// `ParameterValue` of a DCF.
    pub configured: Option<Value>,
    /// `LowLimit`.
    pub low: Option<Value>,
    /// `HighLimit`.
    pub high: Option<Value>,
    /// `Denotation` of a DCF.
    pub denotation: Option<String>,
    /// `ParamRefd` of a DCF: the reference designator of the parameter.
    pub designator: Option<String>,
    /// `SRDOMapping`: whether it can be mapped into an SRDO, a safety-relevant message (CiA 304).
    pub srdo_mapping: bool,
    /// `InvertedSRAD`: index and sub-index of the entry with the inverted value for an SRDO.
    pub inverted: Option<(u16, u8)>,
    /// `UploadFile` of a DCF: the file for data that is read from the device.
    pub upload_file: Option<String>,
    /// `DownloadFile` of a DCF: the file with data that is written to the device.
    pub download_file: Option<String>,
    /// The meaning of the number (overlay).
    pub meaning: Meaning,
    /// Limits that depend on other entries (overlay).
    pub ranges: Vec<ConditionalRange>,
    /// For a number that holds characters: whether the first one is in the highest byte; otherwise it is in the lowest
    /// (overlay).
    pub first_character_high: bool,
    /// Whether the device keeps it without power (overlay).
    pub persistent: bool,
    /// Why a simulated device stores it without any effect (overlay); `None` if it has its effect.
    pub not_simulated: Option<String>,
    /// The NMT states in which it may be written (overlay); `None` for all.
    pub writable_in: Option<Box<[NmtState]>>,
    /// From the overlay, for the documentation.
    pub description: Option<String>,
    /// What tools add in an XDD.
    pub properties: Option<Box<Properties>>,
}

/// What tools add to an object or an entry in an XDD: names and values.
#[derive(Clone, Debug, PartialEq)]
pub struct Properties(pub Vec<(String, String)>);

/// A value of the data sheet.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number of any integer type, a BOOLEAN, or the 48 bits of a time.
    Integer(i128),
    /// A REAL32 or REAL64.
    Real(f64),
    /// A VISIBLE_STRING or UNICODE_STRING.
    Text(String),
    /// An OCTET_STRING or DOMAIN.
    Bytes(Vec<u8>),
    /// `$NODEID` plus a number.
    NodeIdPlus(i64),
}

impl Value {
    /// The bytes of a VISIBLE_STRING. CiA 301 allows ASCII only; a text with other characters is sent in ISO 8859-1, or
    /// in UTF-8 if ISO 8859-1 lacks one of them.
    #[must_use]
    pub fn visible_string(text: &str) -> Vec<u8> {
        let single: Option<Vec<u8>> = text.chars().map(|letter| u8::try_from(letter).ok()).collect();
        single.unwrap_or_else(|| text.as_bytes().to_vec())
    }
}

/// `AccessType` (CiA 306-1, 6.5.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum AccessType {
    Ro,
    Wo,
    Rw,
    /// `rwr`: read and write, mappable into transmit PDOs (process input).
    Rwr,
    /// `rww`: read and write, mappable into receive PDOs (process output).
    Rww,
    Const,
}

/// What a number stands for.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Meaning {
    /// Just a number.
    #[default]
    Plain,
    /// A physical quantity, by its name in [`Device::quantities`].
    Quantity(String),
    /// One of the values of an enumeration, by its name in [`Device::enumerations`].
    Enumeration(String),
    /// A word of bits, by its name in [`Device::bit_fields`].
    BitField(String),
}

/// A physical quantity: what one count of a number is worth. If other objects decide between units (increments, or
/// 1/100 mm by the spindle pitch), there are several.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Quantity {
    pub description: Option<String>,
    /// The units; more than one only when each has a condition.
    pub units: Vec<Unit>,
    pub span: Span,
}

/// A physical unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Unit {
    /// As in texts: `V`, `°C`, `rev/min`.
    pub symbol: String,
    /// The method name in generated code: `volts`, `degrees_celsius`.
    pub method: String,
    /// What one count is worth: `num / den` of the unit.
    pub num: i64,
    /// See `num`.
    pub den: i64,
    /// The condition under which the unit applies; `None` for always.
    pub when: Option<Condition>,
}

/// One count: `V`, `1/10 V`, `10 ms`.
impl std::fmt::Display for Unit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (self.num, self.den) {
            (num, den) if num == den => f.write_str(&self.symbol),
            (num, 1) => write!(f, "{num} {}", self.symbol),
            (num, den) => write!(f, "{num}/{den} {}", self.symbol),
        }
    }
}

/// Limits that depend on the value of another entry.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct ConditionalRange {
    pub when: Condition,
    pub low: i128,
    pub high: i128,
}

/// `2102:00 == 2`, or `2412:00 != 0`.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Condition {
    pub index: u16,
    pub sub: u8,
    /// Whether the values must be equal; otherwise they must differ.
    pub equal: bool,
    pub value: i128,
}

/// The NMT states in which an entry may be writable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum NmtState {
    PreOperational,
    Operational,
}

/// Named values of a number.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Enumeration {
    pub description: Option<String>,
    /// The values, ascending.
    pub values: Vec<Named<i128>>,
    /// Whether the overlay writes the values in hexadecimal, as is usual for codes.
    pub is_hex: bool,
    pub span: Span,
}

/// Named bits of a word.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct BitField {
    pub description: Option<String>,
    /// The fields, ascending; they do not overlap.
    pub fields: Vec<Named<Bits>>,
    /// Why a simulated device neither shows nor obeys a field, by the lowest bit of the field.
    pub not_simulated: BTreeMap<u8, String>,
    pub span: Span,
}

/// Neighbouring bits of a word.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bits {
    /// The lowest bit.
    pub low: u8,
    /// The highest bit; `low` for a single one.
    pub high: u8,
}

/// Something with a name and a description.
#[derive(Clone, Debug, PartialEq)]
pub struct Named<T> {
    /// In the words of the data sheet: `ready to switch on`.
    pub name: String,
    /// One sentence, for the documentation.
    pub description: Option<String>,
    /// What the name stands for.
    pub value: T,
}

/// A PDO with its default mapping.
#[derive(Clone, Debug, PartialEq)]
pub struct Pdo {
    /// As the device sees it.
    pub direction: Direction,
    /// 1 to 512: 1400h and 1800h describe number 1.
    pub number: u16,
    /// The default of sub-index 1 of the communication parameter.
    pub cob_id: Option<Value>,
    /// The default of sub-index 2.
    pub transmission_type: Option<u8>,
    /// The mapped entries, in order.
    pub mapping: Vec<Mapped>,
    /// Whether the mapping is writable.
    pub dynamic: bool,
}

/// The direction of a PDO as the device sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Direction {
    /// Received by the device.
    Receive,
    /// Transmitted by the device.
    Transmit,
}

/// One entry of a PDO mapping.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Mapped {
    /// The index of an object, or of a data type for a placeholder.
    pub index: u16,
    pub sub: u8,
    pub bits: u8,
}

/// Another interface of the device. Most of its parameters are objects under other numbers.
#[derive(Clone, Debug, Default, PartialEq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Interface {
    pub description: Option<String>,
    /// The parameters, in the order of the overlay.
    pub parameters: Vec<Parameter>,
    pub span: Span,
}

/// A parameter of another interface.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// How the interface addresses it.
    pub number: ParameterNumber,
    /// The object that it equals, with what differs. Its index is 0, which no object has, if it equals none.
    pub entry: Entry,
    /// The number of elements: for an ARRAY, those from sub-index 1 on; otherwise 1.
    pub elements: u8,
    /// The data type on the interface; values mean the same as those of the object.
    pub data_type: DataType,
    /// The numbers that the interface uses for values of the enumeration, by name; empty if they are the same.
    pub values: Vec<Named<i128>>,
    /// The condition under which the number stands for this parameter, if it stands for several.
    pub when: Option<Condition>,
    /// Where the overlay describes it.
    pub span: Span,
}

/// How an interface addresses a parameter.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ParameterNumber {
    /// By a number, such as a PNU.
    Number(u16),
    /// By a text, such as the commands that read and write it.
    Text(String),
}

/// A module that can be plugged into a modular device (CiA 306-1, 6.7).
#[derive(Clone, Debug, Default, PartialEq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Module {
    /// Its number, from 1: the 1 of `[M1ModuleInfo]`.
    pub number: u16,
    pub product_name: Option<String>,
    pub product_version: Option<u8>,
    pub product_revision: Option<u8>,
    pub order_code: Option<String>,
    /// `[M1Comments]`, line by line.
    pub comments: Vec<String>,
    /// `[M1FixedObjects]`: objects that the device has once, however many of these modules are plugged in.
    pub fixed: Vec<Object>,
    /// `[M1SubExtends]`: sub-indices that each plugged module adds to objects of the device.
    pub extends: Vec<SubExtension>,
}

/// `[M1SubExt6000]`: sub-indices that each module adds to one object.
#[derive(Clone, Debug, PartialEq)]
pub struct SubExtension {
    /// A template of the added entries; its sub-index is that of the first.
    pub entry: Entry,
    /// `ObjectType`.
    pub kind: ObjectKind,
    /// `Count`: how many entries a module adds; several numbers are by slot. In `bits`, modules share a byte.
    pub count: Vec<u16>,
    /// `ObjExtend`: whether a further module uses the next index (1); otherwise it adds entries to the same one (0).
    pub next_index: bool,
}

/// A segment of `[DynamicChannels]`: indices where a programmable device puts network variables (CiA 302-4).
#[derive(Clone, Debug, PartialEq)]
pub struct DynamicChannel {
    /// `TypeN`.
    pub data_type: DataType,
    /// `DirN`.
    pub access: AccessType,
    /// `RangeN`: the first index.
    pub first: u16,
    /// `RangeN`: the last index.
    pub last: u16,
    /// `PPOffsetN`: offset in the process picture.
    pub offset: u32,
    /// Where the data sheet describes it.
    pub span: Span,
}

impl Device {
    /// The object with this index.
    #[must_use]
    pub fn object(&self, index: u16) -> Option<&Object> {
        let at = self.objects.binary_search_by_key(&index, |object| object.index).ok()?;
        self.objects.get(at)
    }

    /// The entry at this index and sub-index.
    #[must_use]
    pub fn entry(&self, index: u16, sub: u8) -> Option<&Entry> {
        self.object(index)?.entry(sub)
    }

    /// The size of a data type in bits; for a type of the device's own, what its DEFTYPE says.
    #[must_use]
    pub fn bits(&self, data_type: DataType) -> Option<u8> {
        let DataType::Other(code @ 0x40..=0x25F) = data_type else { return data_type.bits() };
        let definition = self.object(code).filter(|object| object.kind == ObjectKind::DefType)?;
        let size = definition.entry(0)?.default.as_ref()?.as_integer()?;
        u8::try_from(size).ok().filter(|bits| (1..=64).contains(bits))
    }

    /// All entries, by index and sub-index.
    pub fn entries(&self) -> impl Iterator<Item = &Entry> {
        self.objects.iter().flat_map(|object| &object.entries)
    }

    /// The parameters of all other interfaces.
    pub fn parameters(&self) -> impl Iterator<Item = &Parameter> {
        self.interfaces.values().flat_map(|interface| &interface.parameters)
    }
}

impl Object {
    /// An object of which only the place is known.
    #[must_use]
    pub fn new(index: u16, kind: ObjectKind, span: Span) -> Self {
        Self {
            index,
            name: String::new(),
            list: ObjectList::Optional,
            kind,
            entries: Vec::new(),
            flags: 0,
            span,
            details: Sparse::NONE,
        }
    }

    #[must_use]
    /// Replaces its details.
    pub fn with_details(self, details: ObjectDetails) -> Self {
        Self { details: Sparse::new(details), ..self }
    }

    /// The entry at this sub-index.
    #[must_use]
    pub fn entry(&self, sub: u8) -> Option<&Entry> {
        let at = self.entries.binary_search_by_key(&sub, |entry| entry.sub).ok()?;
        self.entries.get(at)
    }
}

impl Entry {
    /// An entry of which only the place is known.
    #[must_use]
    pub fn new(index: u16, sub: u8, span: Span) -> Self {
        Self {
            index,
            sub,
            name: String::new(),
            data_type: DataType::Other(0),
            access: AccessType::Ro,
            pdo_mapping: false,
            default: None,
            span,
            details: Sparse::NONE,
        }
    }

    #[must_use]
    /// Replaces its details.
    pub fn with_details(self, details: EntryDetails) -> Self {
        Self { details: Sparse::new(details), ..self }
    }
}

impl ObjectList {
    /// The list that CiA 306 assigns to an index.
    #[must_use]
    pub const fn of_index(index: u16) -> Self {
        match index {
            cia301::DEVICE_TYPE | cia301::ERROR_REGISTER | cia301::IDENTITY => Self::Mandatory,
            0x2000..=0x5FFF => Self::Manufacturer,
            _ => Self::Optional,
        }
    }
}

impl ObjectKind {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::Null, Self::Domain, Self::DefType, Self::DefStruct, Self::Variable, Self::Array, Self::Record];

    /// The kind with this object code.
    #[must_use]
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.code() == code)
    }

    /// The object code.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Null => 0,
            Self::Domain => 2,
            Self::DefType => 5,
            Self::DefStruct => 6,
            Self::Variable => 7,
            Self::Array => 8,
            Self::Record => 9,
        }
    }

    /// The word of CiA 301: `VAR`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Null => "NULL",
            Self::Domain => "DOMAIN",
            Self::DefType => "DEFTYPE",
            Self::DefStruct => "DEFSTRUCT",
            Self::Variable => "VAR",
            Self::Array => "ARRAY",
            Self::Record => "RECORD",
        }
    }

    /// Whether it has sub-indices.
    #[must_use]
    pub const fn has_subs(self) -> bool {
        matches!(self, Self::Array | Self::Record | Self::DefStruct)
    }
}

impl AccessType {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::Ro, Self::Wo, Self::Rw, Self::Rwr, Self::Rww, Self::Const];

    /// The word of CiA 306: `rw`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ro => "ro",
            Self::Wo => "wo",
            Self::Rw => "rw",
            Self::Rwr => "rwr",
            Self::Rww => "rww",
            Self::Const => "const",
        }
    }

    /// The right with this name, in any case.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|access| access.name().eq_ignore_ascii_case(name))
    }

    /// Whether an SDO may read it.
    #[must_use]
    pub const fn readable(self) -> bool {
        !matches!(self, Self::Wo)
    }

    /// Whether an SDO may write it.
    #[must_use]
    pub const fn writable(self) -> bool {
        !matches!(self, Self::Ro | Self::Const)
    }
}

impl Value {
    /// The number, of an integer.
    #[must_use]
    pub const fn as_integer(&self) -> Option<i128> {
        match self {
            Self::Integer(number) => Some(*number),
            _ => None,
        }
    }
}

impl Details for ObjectDetails {
    fn none() -> &'static Self {
        static NONE: ObjectDetails = ObjectDetails {
            description: None,
            links: Vec::new(),
            denotation: None,
            designator: None,
            properties: None,
        };
        &NONE
    }
}

impl Details for EntryDetails {
    fn none() -> &'static Self {
        static NONE: EntryDetails = EntryDetails {
            configured: None,
            low: None,
            high: None,
            denotation: None,
            designator: None,
            srdo_mapping: false,
            inverted: None,
            upload_file: None,
            download_file: None,
            meaning: Meaning::Plain,
            ranges: Vec::new(),
            first_character_high: false,
            persistent: false,
            not_simulated: None,
            writable_in: None,
            description: None,
            properties: None,
        };
        &NONE
    }
}

impl Deref for Object {
    type Target = ObjectDetails;

    fn deref(&self) -> &ObjectDetails {
        self.details.get()
    }
}

impl DerefMut for Object {
    fn deref_mut(&mut self) -> &mut ObjectDetails {
        self.details.get_mut()
    }
}

impl Deref for Entry {
    type Target = EntryDetails;

    fn deref(&self) -> &EntryDetails {
        self.details.get()
    }
}

impl DerefMut for Entry {
    fn deref_mut(&mut self) -> &mut EntryDetails {
        self.details.get_mut()
    }
}

impl Device {
    /// Clears all places, so that devices from different files can be compared.
    pub fn clear_spans(&mut self) {
        self.for_each_span(|span| *span = Span::default());
    }

    /// Visits all places where something was described.
    pub(crate) fn for_each_span(&mut self, mut visit: impl FnMut(&mut Span)) {
        let of_modules = self.modules.iter_mut().flat_map(|module| &mut module.fixed);
        for object in self.objects.iter_mut().chain(of_modules) {
            visit(&mut object.span);
            object.entries.iter_mut().for_each(|entry| visit(&mut entry.span));
        }
        let extensions = self.modules.iter_mut().flat_map(|module| &mut module.extends);
        extensions.for_each(|extension| visit(&mut extension.entry.span));
        self.channels.iter_mut().for_each(|channel| visit(&mut channel.span));
        self.enumerations.values_mut().for_each(|enumeration| visit(&mut enumeration.span));
        self.bit_fields.values_mut().for_each(|bit_field| visit(&mut bit_field.span));
        self.quantities.values_mut().for_each(|quantity| visit(&mut quantity.span));
        for interface in self.interfaces.values_mut() {
            visit(&mut interface.span);
            for parameter in &mut interface.parameters {
                visit(&mut parameter.span);
                visit(&mut parameter.entry.span);
            }
        }
    }
}

impl Parameter {
    /// The index and sub-index of the object that it equals (for an ARRAY, of the first element).
    #[must_use]
    pub fn object(&self) -> Option<(u16, u8)> {
        (self.entry.index > 0).then_some((self.entry.index, self.entry.sub))
    }
}

/// `1016`, or `E1/F1`.
impl std::fmt::Display for ParameterNumber {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            ParameterNumber::Number(number) => number.fmt(f),
            ParameterNumber::Text(text) => text.fmt(f),
        }
    }
}
