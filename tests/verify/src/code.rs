//! The generated code of a drive, compiled in: every handle with what its type states, and every newtype with its
//! tables.

use std::any::type_name;
use std::collections::BTreeMap;

use lexican_runtime::NodeId;
use lexican_runtime::object::{
    Address, BitField, BitName, ConditionalLimit, Const, DataType, Enumeration, Mappable, Mapped, Object, Quantity, Ro,
    Rpdo, Rw, Table, Tpdo, Type, Unit, Unmapped, Value, ValueName, Wo, WritableIn,
};

/// The module that `lexican_runtime::include_od!` makes, as data. `build.rs` writes a function that uses every name in
/// the data sheet: if the generator loses or renames one, this does not compile.
pub(crate) struct Code {
    node: NodeId,
    pub(crate) handles: BTreeMap<Address, Handle>,
    pub(crate) enumerations: BTreeMap<&'static str, &'static [ValueName<'static>]>,
    pub(crate) bit_fields: BTreeMap<&'static str, &'static [BitName<'static>]>,
    pub(crate) quantities: BTreeMap<&'static str, &'static [Unit<'static>]>,
    /// For each PDO, such as `TPDO1`: its mapping, and its identifier.
    pub(crate) pdos: BTreeMap<&'static str, (&'static [Mapped], u32)>,
    pub(crate) table: &'static Table,
    pub(crate) ranges: &'static [ConditionalLimit],
    pub(crate) writable_in: &'static [WritableIn],
    pub(crate) persistent: &'static [Address],
    pub(crate) identity: Identity,
}

/// The constants about the device: names, numbers and bit rates.
pub(crate) struct Identity {
    pub(crate) names: [&'static str; 3],
    pub(crate) numbers: [u32; 3],
    pub(crate) profile: u16,
    pub(crate) bit_rates_kbit: &'static [u16],
}

/// What the type of a handle states.
pub(crate) struct Handle {
    /// As a program writes it: `MOTOR_PARAMETER_SET.v_pos`.
    pub(crate) path: &'static str,
    pub(crate) data_type: DataType,
    /// The newtype, or the plain type.
    pub(crate) value_type: &'static str,
    pub(crate) access: &'static str,
    pub(crate) is_mappable: bool,
    pub(crate) default: Option<i128>,
    pub(crate) limits: Option<(i128, i128)>,
}

/// Conditional limits, entries that can be written only in some states, and persistent entries.
type Rules = (&'static [ConditionalLimit], &'static [WritableIn], &'static [Address]);

impl Code {
    pub(crate) fn new(node: NodeId, table: &'static Table, identity: Identity, rules: Rules) -> Self {
        let (ranges, writable_in, persistent) = rules;
        let (handles, enumerations, bit_fields) = Default::default();
        let (quantities, pdos) = Default::default();
        Code {
            node,
            handles,
            enumerations,
            bit_fields,
            quantities,
            pdos,
            table,
            ranges,
            writable_in,
            persistent,
            identity,
        }
    }

    pub(crate) fn object<T: Value, A: Right, M: Right, D>(&mut self, path: &'static str, object: Object<T, A, M, D>) {
        let default = object.default(self.node).map(number);
        let limits = object.limits().map(|limits| (number(limits.low), number(limits.high)));
        let handle = Handle { default, limits, ..Handle::new::<T, A, M>(path) };
        self.take(object.address(), handle);
    }

    /// An object without a value of a fixed size.
    pub(crate) fn text<T: Type, A: Right, M: Right, D>(&mut self, path: &'static str, object: Object<T, A, M, D>) {
        self.take(object.address(), Handle::new::<T, A, M>(path));
    }

    fn take(&mut self, address: Address, handle: Handle) {
        assert!(self.handles.insert(address, handle).is_none(), "{address} has one handle");
    }

    pub(crate) fn enumeration<T: Enumeration>(&mut self) {
        self.enumerations.insert(short_name::<T>(), T::NAMES);
    }

    pub(crate) fn bit_field<T: BitField>(&mut self) {
        self.bit_fields.insert(short_name::<T>(), T::BITS);
    }

    pub(crate) fn quantity<T: Quantity>(&mut self) {
        self.quantities.insert(short_name::<T>(), T::UNITS);
    }

    /// The data type of an entry, as the drive serves it.
    pub(crate) fn data_type(&self, address: Address) -> Option<DataType> {
        self.table.entry(address).ok().map(|entry| entry.data_type)
    }

    /// The size of an entry in bytes; 4 if it has no fixed size.
    pub(crate) fn size(&self, index: u16, sub: u8) -> u8 {
        self.data_type(Address::new(index, sub)).and_then(DataType::bits).map_or(4, |bits| bits / 8)
    }
}

impl Handle {
    /// A handle without default and limits.
    fn new<T: Type, A: Right, M: Right>(path: &'static str) -> Self {
        let (access, is_mappable) = (A::NAME, M::NAME != "no");
        let value_type = short_name::<T>();
        Handle { path, data_type: T::DATA_TYPE, value_type, access, is_mappable, default: None, limits: None }
    }
}

pub(crate) trait Right {
    const NAME: &'static str;
}

macro_rules! rights {
    ($($right:ident $name:literal)*) => {
        $(impl Right for $right {
            const NAME: &'static str = $name;
        })*
    };
}

rights! { Ro "ro" Wo "wo" Rw "rw" Const "const" Unmapped "no" Tpdo "tpdo" Rpdo "rpdo" Mappable "both" }

/// The value as a number with its sign.
fn number<T: Value>(value: T) -> i128 {
    signed(value.to_raw(), T::DATA_TYPE)
}

/// The number in its form on the wire, with its sign.
pub(crate) fn signed(raw: u64, data_type: DataType) -> i128 {
    let unused = 64 - u32::from(data_type.bits().unwrap_or(64));
    if data_type.is_signed() { i128::from((raw << unused) as i64 >> unused) } else { i128::from(raw) }
}

fn short_name<T>() -> &'static str {
    let name = type_name::<T>();
    name.rsplit("::").next().unwrap_or(name)
}
