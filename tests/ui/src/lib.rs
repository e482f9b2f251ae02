//! Dictionaries whose code the test writes, and functions with the bounds that the runtime's have.

use lexican_runtime::object::{Object, Parameter, Readable, RpdoMappable, TpdoMappable, Value, Writable};

/// The dictionary of the golden case.
pub mod od {
    include!(concat!(env!("LEXICAN_CODE"), "/access_and_mapping.rs"));
}

/// The dictionary with meanings of the golden case.
pub mod drive {
    include!(concat!(env!("LEXICAN_CODE"), "/overlay.rs"));
}

/// The dictionary with one object of each data type.
pub mod types {
    include!(concat!(env!("LEXICAN_CODE"), "/data_types.rs"));
}

/// The dictionary of a device with other interfaces.
pub mod doors {
    include!(concat!(env!("LEXICAN_CODE"), "/interfaces.rs"));
}

/// The machine of the downstream crate.
pub mod machine {
    include!(concat!(env!("LEXICAN_CODE"), "/machine.rs"));
}

/// Reads through an interface that has texts for numbers.
pub fn read_serial<T: Value, A: Readable>(parameter: Parameter<T, A, &'static str>) -> Option<T> {
    parameter.decode(0)
}

/// Writes through it.
pub fn write_serial<T: Value, A: Writable>(parameter: Parameter<T, A, &'static str>, value: T) {
    let _ = parameter.encode(value);
}

/// Writes through an interface that has numbers.
pub fn write_profibus<T: Value, A: Writable>(parameter: Parameter<T, A, u16>, value: T) {
    let _ = parameter.encode(value);
}

/// Reads.
pub fn read<T: Value, A: Readable, M, D>(object: Object<T, A, M, D>) -> T {
    T::from_raw(object.address().index().into())
}

/// Writes.
pub fn write<T: Value, A: Writable, M, D>(object: Object<T, A, M, D>, value: T) {
    let _ = object.check(value);
}

/// Maps into a PDO that the device transmits.
pub fn map_tpdo<T: Value, A, M: TpdoMappable, D>(_object: Object<T, A, M, D>) {}

/// Maps into a PDO that the device receives.
pub fn map_rpdo<T: Value, A, M: RpdoMappable, D>(_object: Object<T, A, M, D>) {}
