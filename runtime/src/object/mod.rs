//! Objects of a device's dictionary: typed handles for whoever accesses them, tables for the device
//! that serves them.
//!
//! A handle such as `Object<u16, Rw>` is plain data, known at compile time: an address, limits, a
//! default. Its type says what may be done with it, so that writing a read-only object does not
//! compile. A [`Dictionary`] is the device's side: it owns the values, and answers by address.

mod access;
mod address;
mod dictionary;
mod handle;
mod types;
mod value;

pub use access::{Const, Mappable, Readable, Ro, Rpdo, RpdoMappable, Rw, Tpdo, TpdoMappable, Unmapped, Wo, Writable};
pub use address::Address;
pub use dictionary::{Access, Dictionary, Entry, Limit, NodeRelative, ObjectDictionary, PdoMapping, Table};
pub use handle::{Array, DefaultValue, Limits, Object, OutOfRange};
pub use types::DataType;
pub use value::{
    Domain, I24, I40, I48, I56, LengthMismatch, OctetString, TimeDifference, TimeOfDay, Type, U24, U40, U48, U56,
    UnicodeString, Value, VisibleString,
};
