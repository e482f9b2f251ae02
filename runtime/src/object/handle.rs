//! Typed handles: what the generated code consists of.

use core::fmt;
use core::marker::PhantomData;

use super::{Address, AnyDevice, Ro, Type, Unmapped, Value};
use crate::id::NodeId;

/// An object of a device: where it lies, what type it has, and what may be done with it.
///
/// `T` is the type of the value, `A` the access right ([`Ro`], `Wo`, `Rw`, `Const`), `M` whether PDOs
/// may map it, `D` the [device](super::DeviceModel) it is of. All of it is known at compile time; a handle costs nothing
/// where it is used.
pub struct Object<T, A, M = Unmapped, D = AnyDevice> {
    address: Address,
    default: DefaultValue<T>,
    limits: Option<Limits<T>>,
    // fn() -> _: a handle owns no T, so it is Send and Sync for any T.
    marker: PhantomData<fn() -> (A, M)>,
    device: PhantomData<fn() -> D>,
}

/// What an object holds in a new device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum DefaultValue<T> {
    /// The data sheet does not say.
    None,
    /// A value.
    Value(T),
    /// The node-ID plus a number (`$NODEID+0x180`).
    NodeIdPlus(u64),
}

/// The smallest and the largest value allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Limits<T> {
    pub low: T,
    pub high: T,
}

impl<T: Type, A, M, D> Object<T, A, M, D> {
    /// A handle without default and limits.
    #[must_use]
    pub const fn new(index: u16, sub: u8) -> Self {
        Object {
            address: Address::new(index, sub),
            default: DefaultValue::None,
            limits: None,
            marker: PhantomData,
            device: PhantomData,
        }
    }

    /// With the default of the data sheet.
    #[must_use]
    pub const fn with_default(self, default: T) -> Self {
        Object { default: DefaultValue::Value(default), ..self }
    }

    /// With a default of the node-ID plus `base`.
    #[must_use]
    pub const fn with_default_node_id_plus(self, base: u64) -> Self {
        Object { default: DefaultValue::NodeIdPlus(base), ..self }
    }

    /// With the limits of the data sheet.
    #[must_use]
    pub const fn with_limits(self, low: T, high: T) -> Self {
        Object { limits: Some(Limits { low, high }), ..self }
    }

    /// Index and sub-index.
    #[must_use]
    pub const fn address(&self) -> Address {
        self.address
    }

    /// The limits of the data sheet.
    #[must_use]
    pub const fn limits(&self) -> Option<Limits<T>> {
        self.limits
    }
}

impl<T: Value, A, M, D> Object<T, A, M, D> {
    /// What the object holds in a new device with this node-ID; `None` when the data sheet does not say.
    #[must_use]
    pub fn default(&self, node: NodeId) -> Option<T> {
        match self.default {
            DefaultValue::None => None,
            DefaultValue::Value(value) => Some(value),
            DefaultValue::NodeIdPlus(base) => Some(T::from_raw(base.wrapping_add(u64::from(node.get())))),
        }
    }

    /// Whether the data sheet allows `value`.
    #[inline]
    pub fn check(&self, value: T) -> Result<(), OutOfRange> {
        match self.limits {
            Some(limits) if value < limits.low => Err(OutOfRange { address: self.address, above: false }),
            Some(limits) if value > limits.high => Err(OutOfRange { address: self.address, above: true }),
            _ => Ok(()),
        }
    }
}

impl<T: Copy, A, M, D> Clone for Object<T, A, M, D> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<T: Copy, A, M, D> Copy for Object<T, A, M, D> {}

impl<T: Type, A, M, D> fmt::Debug for Object<T, A, M, D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Object({} {})", self.address, T::DATA_TYPE)
    }
}

/// A value outside the limits of the data sheet. Nothing was sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[error("{address}: the value is {} the limits of the data sheet", if *.above { "above" } else { "below" })]
pub struct OutOfRange {
    /// The object.
    pub address: Address,
    /// Whether the value is above the upper limit; else it is below the lower one.
    pub above: bool,
}

/// An ARRAY: `len` elements of one type at sub-indices 1 to `len`, and their number at sub-index 0.
///
/// `L` is the access right of sub-index 0, which some arrays clear by a write (1003h).
pub struct Array<T, A, M = Unmapped, L = Ro, D = AnyDevice> {
    len: u8,
    first: Object<T, A, M, D>,
    marker: PhantomData<fn() -> L>,
}

impl<T: Type, A, M, L, D> Array<T, A, M, L, D> {
    /// An array whose elements are all like `first`, the element at sub-index 1.
    #[must_use]
    pub const fn new(len: u8, first: Object<T, A, M, D>) -> Self {
        Array { len, first, marker: PhantomData }
    }

    /// The element at `sub`, 1 to [`Array::len`].
    #[must_use]
    pub const fn at(&self, sub: u8) -> Option<Object<T, A, M, D>> {
        if sub == 0 || sub > self.len {
            return None;
        }
        Some(Object { address: Address::new(self.first.address.index(), sub), ..self.first })
    }

    /// The number of elements that the data sheet describes.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "an array of a data sheet has elements")]
    pub const fn len(&self) -> u8 {
        self.len
    }

    /// All elements.
    pub fn iter(&self) -> impl Iterator<Item = Object<T, A, M, D>> + use<'_, T, A, M, L, D> {
        (1..=self.len).filter_map(|sub| self.at(sub))
    }

    /// Sub-index 0: the number of elements, as the device counts them.
    #[must_use]
    pub const fn len_object(&self) -> Object<u8, L, Unmapped, D> {
        Object::new(self.first.address.index(), 0)
    }
}

impl<T: Copy, A, M, L, D> Clone for Array<T, A, M, L, D> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<T: Copy, A, M, L, D> Copy for Array<T, A, M, L, D> {}

impl<T: Type, A, M, L, D> fmt::Debug for Array<T, A, M, L, D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Array({:04X}, {} of {})", self.first.address.index(), self.len, T::DATA_TYPE)
    }
}
