//! Objects of a device's dictionary: typed handles for access, tables for the device
//! that serves them.
//!
//! A handle such as `Object<u16, Rw>` is plain data, known at compile time: an address, limits, a
//! default. Its type says what may be done with it and [which device](DeviceModel) it is of, so that writing a read-only
//! object does not compile, and neither does an object of another device. A [`Dictionary`] is the device's side: it owns the values, and answers by address.

mod access;
mod address;
mod device;
mod dictionary;
mod generated;
mod handle;
mod layer;
mod mapping;
mod meaning;
mod parameter;
mod pdo;
mod rule;
mod table;
mod text;
mod value;

pub use access::{
    AnyDevice, Const, Mappable, Readable, Ro, Rpdo, RpdoMappable, Rw, Tpdo, TpdoMappable, Unmapped, Wo, Writable,
};
pub use address::Address;
pub use device::{DeviceModel, Fits, Joins};
pub use dictionary::{Dictionary, ObjectDictionary};
pub use handle::{Array, DefaultValue, Limits, Object, OutOfRange};
pub use layer::Layer;
pub use lexican_cia::DataType;
pub use mapping::{Append, Mapping, PdoDirection, Values};
pub use meaning::{
    BitField, BitName, Enumeration, Meaning, Name, Quantity, Unit, ValueName, debug_enumeration, name_of, nearest,
    wire_form,
};
pub use parameter::{Parameter, ParameterRow};
pub(crate) use pdo::number;
pub use pdo::{Direction, Mapped, MappedLengthMismatch, Pdo, field, pack, place, replace, take, take_signed};
pub use rule::{Condition, ConditionalLimit, WritableIn};
pub use table::{Access, Entry, Limit, PdoMapping, Row, Table};
pub use text::{Names, NoValue, debug_bits, display_quantity, integer};
pub use value::{
    Domain, I24, I40, I48, I56, LengthMismatch, OctetString, TimeDifference, TimeOfDay, Type, U24, U40, U48, U56,
    UnicodeString, Value, VisibleString,
};

/// The shape of generated code that this runtime fits.
const FORMAT: u32 = 4;

/// What generated code begins with: a runtime that does not fit is reported in one sentence.
///
/// # Panics
///
/// At compile time, when the code was generated for another shape.
pub const fn generated_for(format: u32) {
    assert!(format == FORMAT, "lexican-codegen and lexican-runtime do not fit together: give both the same version");
}

/// Includes a dictionary that `lexican-codegen` has generated from the build script:
/// `mod od { lexican_runtime::include_od!("valve"); }`.
///
/// The items land where the macro stands. Lints are allowed inside, also if the crate
/// denies them: a user cannot mend generated code, and need not use all that a data sheet describes.
#[macro_export]
macro_rules! include_od {
    ($name:literal) => {
        #[allow(
            dead_code,
            missing_copy_implementations,
            missing_debug_implementations,
            trivial_numeric_casts,
            unnameable_types,
            unreachable_pub,
            clippy::all,
            clippy::nursery,
            clippy::pedantic,
            clippy::restriction
        )]
        mod generated {
            const _: &str = ::core::env!(
                ::core::concat!("LEXICAN_OD_", $name),
                ::core::concat!(
                    "there is no dictionary `",
                    $name,
                    "`; the build script has generated ",
                    ::core::env!(
                        "LEXICAN_OD",
                        "no dictionary has been generated: call `lexican_codegen::Config` in build.rs"
                    )
                )
            );
            ::core::include!(::core::concat!(::core::env!("OUT_DIR"), "/", $name, ".rs"));
        }
        #[allow(unused_imports, unreachable_pub)]
        pub use generated::*;
    };
}
