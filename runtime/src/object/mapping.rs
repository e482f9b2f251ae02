//! PDOs whose mapping the program chooses, by typed handles.

use core::fmt;
use core::marker::PhantomData;

use super::access::{Rpdo, RpdoMappable, Tpdo, TpdoMappable};
use super::pdo::{Direction, Mapped, MappedLengthMismatch, field, number, place};
use super::{AnyDevice, Joins, Object, Value};
use crate::frame::Frame;
use crate::id::CobId;

/// A mapping for a PDO that the device receives (`D` is [`Rpdo`]) or transmits ([`Tpdo`]), and the tuple `V` of its values.
///
/// It is built of handles, so that what the data sheet does not allow does not compile, and neither do more than 64 bits or
/// more than eight objects:
///
/// ```
/// use lexican_runtime::{CobId, NodeId};
/// use lexican_runtime::object::{Mapping, Object, Ro, Rpdo, Rw, Tpdo};
///
/// // As generated code has them.
/// const TARGET_POSITION: Object<i32, Rw, Rpdo> = Object::new(0x607A, 0x00);
/// const PROFILE_VELOCITY: Object<u32, Rw, Rpdo> = Object::new(0x6081, 0x00);
/// const STATUSWORD: Object<u16, Ro, Tpdo> = Object::new(0x6041, 0x00);
///
/// const MOVE: Mapping<Rpdo, (i32, u32)> = Mapping::receive().with(TARGET_POSITION).with(PROFILE_VELOCITY);
/// let frame = MOVE.frame(CobId::of_node(0x300, NodeId::literal(3)), (36_000, 20_000));
/// assert_eq!(frame.to_string(), "303#A08C0000204E0000");
///
/// const STATUS: Mapping<Tpdo, (u16,)> = Mapping::transmit().with(STATUSWORD);
/// assert_eq!(STATUS.values(&[0x37, 0x12]), Ok((0x1237,)));
/// ```
///
/// ```compile_fail,E0277
/// # use lexican_runtime::object::{Mapping, Object, Ro, Tpdo};
/// # const STATUSWORD: Object<u16, Ro, Tpdo> = Object::new(0x6041, 0x00);
/// // The drive sends it, and takes it from no PDO.
/// let mapping = Mapping::receive().with(STATUSWORD);
/// ```
///
/// ```compile_fail,E0080
/// # use lexican_runtime::object::{Mapping, Object, Rpdo, Rw};
/// # const POSITION: Object<i32, Rw, Rpdo> = Object::new(0x607A, 0x00);
/// # const WORD: Object<u16, Rw, Rpdo> = Object::new(0x6040, 0x00);
/// // 80 bits.
/// let mapping = Mapping::receive().with(POSITION).with(POSITION).with(WORD);
/// ```
///
/// `N` is the device of the handles: a constant has the type `Mapping<Tpdo, (od::Statusword,), od::Device>`, where `od` is
/// generated.
///
/// ```compile_fail,E0277
/// # use lexican_runtime::object::{DeviceModel, Mapping, Object, Ro, Tpdo};
/// # struct Servo;
/// # impl DeviceModel for Servo {}
/// # struct Encoder;
/// # impl DeviceModel for Encoder {}
/// # const STATUSWORD: Object<u16, Ro, Tpdo, Servo> = Object::new(0x6041, 0x00);
/// # const POSITION: Object<u32, Ro, Tpdo, Encoder> = Object::new(0x6004, 0x00);
/// // One is an object of a servo, the other of an encoder.
/// let mapping = Mapping::transmit().with(STATUSWORD).with(POSITION);
/// ```
pub struct Mapping<D, V, N = AnyDevice> {
    entries: [Mapped; MOST],
    // fn() -> _: a mapping owns no values.
    marker: PhantomData<fn() -> (D, V)>,
    device: PhantomData<fn() -> N>,
}

/// How many objects a mapping has at most: as many as a PDO has bytes.
const MOST: usize = 8;

/// A direction as a type: [`Rpdo`] or [`Tpdo`].
pub trait PdoDirection: sealed::Direction {
    /// The direction, as the device sees it.
    const DIRECTION: Direction;
}

impl PdoDirection for Rpdo {
    const DIRECTION: Direction = Direction::Receive;
}

impl PdoDirection for Tpdo {
    const DIRECTION: Direction = Direction::Transmit;
}

/// The values of a mapping: a tuple of up to eight.
pub trait Values: Copy + sealed::Values {
    /// How many there are.
    const COUNT: usize;
    /// Their bits.
    const BITS: usize;

    /// Their bits as a number; the first value is in its lowest bits.
    fn to_raw(self) -> u64;

    /// The values of a number.
    fn from_raw(raw: u64) -> Self;
}

/// Values that can be followed by one more.
pub trait Append<T: Value>: Values {
    /// The values with that one.
    type Longer: Values;
}

mod sealed {
    pub trait Direction {}
    impl Direction for super::Rpdo {}
    impl Direction for super::Tpdo {}
    pub trait Values {}
}

const fn bits<T: Value>() -> usize {
    match T::DATA_TYPE.bits() {
        Some(bits) => bits as usize,
        None => panic!("a value has a fixed size"),
    }
}

macro_rules! values {
    ($($name:ident)*) => {
        impl<$($name: Value),*> sealed::Values for ($($name,)*) {}

        impl<$($name: Value),*> Values for ($($name,)*) {
            const COUNT: usize = <[&str]>::len(&[$(stringify!($name)),*]);
            const BITS: usize = 0 $(+ bits::<$name>())*;

            #[allow(non_snake_case, unused_mut, unused_assignments, unused_variables)]
            fn to_raw(self) -> u64 {
                let ($($name,)*) = self;
                let (mut raw, mut low) = (0, 0);
                $(
                    raw |= place($name.to_raw(), low, bits::<$name>() as u8);
                    low += bits::<$name>() as u8;
                )*
                raw
            }

            #[allow(non_snake_case, unused_mut, unused_assignments, unused_variables, clippy::unused_unit)]
            fn from_raw(raw: u64) -> Self {
                let mut low = 0;
                $(
                    let $name = field::<$name>(raw, low, bits::<$name>() as u8);
                    low += bits::<$name>() as u8;
                )*
                ($($name,)*)
            }
        }
    };
}

macro_rules! append {
    ($($name:ident)*) => {
        impl<$($name: Value,)* Next: Value> Append<Next> for ($($name,)*) {
            type Longer = ($($name,)* Next,);
        }
    };
}

values!();
values!(A);
values!(A B);
values!(A B C);
values!(A B C D);
values!(A B C D E);
values!(A B C D E F);
values!(A B C D E F G);
values!(A B C D E F G H);
append!();
append!(A);
append!(A B);
append!(A B C);
append!(A B C D);
append!(A B C D E);
append!(A B C D E F);
append!(A B C D E F G);

impl Mapping<Rpdo, ()> {
    /// A PDO that the device receives, and nothing in it yet.
    #[must_use]
    pub const fn receive() -> Self {
        Mapping { entries: [Mapped::new(0, 0, 0); MOST], marker: PhantomData, device: PhantomData }
    }
}

impl Mapping<Tpdo, ()> {
    /// A PDO that the device transmits, and nothing in it yet.
    #[must_use]
    pub const fn transmit() -> Self {
        Mapping { entries: [Mapped::new(0, 0, 0); MOST], marker: PhantomData, device: PhantomData }
    }
}

impl<V: Values, N> Mapping<Rpdo, V, N> {
    /// With one more object.
    #[must_use]
    pub const fn with<T: Value, A, M: RpdoMappable, E>(
        self,
        object: Object<T, A, M, E>,
    ) -> Mapping<Rpdo, V::Longer, N::Device>
    where
        V: Append<T>,
        N: Joins<E>,
    {
        self.append(Mapped::new(object.address().index(), object.address().sub(), bits::<T>() as u8))
    }

    /// With a gap: a value of the data type `T` that the device ignores, since it is another one's (CiA 301, 7.4.7.1).
    #[must_use]
    pub const fn with_gap<T: Value>(self) -> Mapping<Rpdo, V::Longer, N>
    where
        V: Append<T>,
    {
        self.append(Mapped::new(T::DATA_TYPE as u16, 0, bits::<T>() as u8))
    }
}

impl<V: Values, N> Mapping<Tpdo, V, N> {
    /// With one more object.
    #[must_use]
    pub const fn with<T: Value, A, M: TpdoMappable, E>(
        self,
        object: Object<T, A, M, E>,
    ) -> Mapping<Tpdo, V::Longer, N::Device>
    where
        V: Append<T>,
        N: Joins<E>,
    {
        self.append(Mapped::new(object.address().index(), object.address().sub(), bits::<T>() as u8))
    }
}

impl<D, V: Values, N> Mapping<D, V, N> {
    const fn append<L: Values, E>(self, entry: Mapped) -> Mapping<D, L, E> {
        const { assert!(L::BITS <= 64, "a PDO maps at most 64 bits") };
        let mut entries = self.entries;
        entries[V::COUNT] = entry;
        Mapping { entries, marker: PhantomData, device: PhantomData }
    }

    /// The objects in their order.
    #[must_use]
    pub fn entries(&self) -> &[Mapped] {
        self.entries.get(..V::COUNT).unwrap_or(&self.entries)
    }

    /// The bytes on the bus, 0 to 8.
    #[must_use]
    pub const fn length(&self) -> usize {
        V::BITS.div_ceil(8)
    }

    /// The frame that carries the values under `id`.
    ///
    /// # Panics
    ///
    /// Never: a PDO has at most eight bytes.
    #[must_use]
    pub fn frame(&self, id: CobId, values: V) -> Frame {
        let bytes = values.to_raw().to_le_bytes();
        Frame::new(id, bytes.get(..self.length()).unwrap_or(&bytes)).expect("a PDO has at most eight bytes")
    }

    /// The values of a frame's data. Bytes beyond the mapped ones are ignored (CiA 301, 7.5.2.36).
    pub fn values(&self, data: &[u8]) -> Result<V, MappedLengthMismatch> {
        if data.len() < self.length() {
            return Err(MappedLengthMismatch { mapped: self.length(), got: data.len() });
        }
        Ok(V::from_raw(number(data)))
    }
}

impl<D, V, N> Clone for Mapping<D, V, N> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<D, V, N> Copy for Mapping<D, V, N> {}

impl<D, V: Values, N> fmt::Debug for Mapping<D, V, N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.entries()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Ro, Rw};
    use super::*;

    #[test]
    fn values_lie_one_after_the_other() {
        let bit = Object::<bool, Rw, Rpdo>::new(0x2000, 1);
        let byte = Object::<i8, Rw, Rpdo>::new(0x2000, 2);
        let word = Object::<u16, Rw, Rpdo>::new(0x2000, 3);
        let mapping = Mapping::receive().with(bit).with(byte).with_gap::<u32>().with(word);
        let entries = [(0x2000, 1, 1), (0x2000, 2, 8), (0x0007, 0, 32), (0x2000, 3, 16)];
        assert_eq!(mapping.entries(), entries.map(|(index, sub, bits)| Mapped::new(index, sub, bits)));
        let values = (true, -2, 0, 0x8001);
        let frame = mapping.frame(CobId::SYNC, values);
        assert_eq!(std::format!("{frame}"), "080#FD01000000020001");
        assert_eq!(mapping.values(frame.data()), Ok(values));
        assert_eq!(mapping.values(&[1, 2]), Err(MappedLengthMismatch { mapped: 8, got: 2 }));
    }

    #[test]
    fn eight_bytes_are_eight_objects() {
        let byte = Object::<u8, Ro, Tpdo>::new(0x2000, 1);
        let four = Mapping::transmit().with(byte).with(byte).with(byte).with(byte);
        let eight = four.with(byte).with(byte).with(byte).with(byte);
        assert_eq!(eight.values(&[1, 2, 3, 4, 5, 6, 7, 8]), Ok((1, 2, 3, 4, 5, 6, 7, 8)));
        assert_eq!((eight.entries().len(), Mapping::transmit().entries().len()), (8, 0));
    }
}
