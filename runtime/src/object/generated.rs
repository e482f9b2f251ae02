//! What generated code is made of. It has a row for each value, bit, unit and mapped object; these macros turn the rows
//! into types. They are for generated code alone.

/// The device, and the runtime's types marked with it: `device_model!(NAMES);`, or without names. They come by a glob, as
/// the runtime's do, so that they give way to types of the data sheet and of the user.
#[doc(hidden)]
#[macro_export]
macro_rules! device_model {
    ($($names:ident)?) => {
        use self::marked::*;
        pub use self::marked::{DEVICE, Device};

        /// The runtime's types, those of handles for this device.
        mod marked {
            pub(super) use $crate::object::*;

            /// This device: `network.node(id, DEVICE)` takes the handles of this dictionary, and no other's.
            pub const DEVICE: Device = Device;

            /// The type of [`DEVICE`], by which the handles are marked.
            #[derive(Clone, Copy, Debug)]
            pub struct Device;

            impl $crate::object::DeviceModel for Device {
                $(
                    fn names(&self) -> &'static [$crate::object::Name] {
                        super::$names
                    }
                )?
            }

            /// An object of this device.
            pub type Object<T, A, M = $crate::object::Unmapped> = $crate::object::Object<T, A, M, Device>;

            /// An ARRAY of this device.
            pub type Array<T, A, M = $crate::object::Unmapped, L = $crate::object::Ro> =
                $crate::object::Array<T, A, M, L, Device>;
        }
    };
}

/// A number with a meaning: on the wire it is the number.
#[doc(hidden)]
#[macro_export]
macro_rules! newtype {
    ($(#[$meta:meta])* $name:ident($inner:ty), Real32) => {
        $crate::newtype!(@ $(#[$meta])*; $name($inner), Real32);
    };
    ($(#[$meta:meta])* $name:ident($inner:ty), Real64) => {
        $crate::newtype!(@ $(#[$meta])*; $name($inner), Real64);
    };
    ($(#[$meta:meta])* $name:ident($inner:ty), $data_type:ident) => {
        $crate::newtype!(@ $(#[$meta])* #[derive(Eq, Ord, Hash)]; $name($inner), $data_type);
    };
    (@ $(#[$meta:meta])*; $name:ident($inner:ty), $data_type:ident) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Default, PartialEq, PartialOrd)]
        pub struct $name(
            /// The number on the wire.
            pub $inner,
        );

        impl $crate::object::Type for $name {
            const DATA_TYPE: $crate::object::DataType = $crate::object::DataType::$data_type;
        }

        impl $crate::object::Value for $name {
            #[inline]
            fn to_raw(self) -> u64 {
                $crate::object::Value::to_raw(self.0)
            }
            #[inline]
            fn from_raw(raw: u64) -> Self {
                Self($crate::object::Value::from_raw(raw))
            }
        }

        impl ::core::convert::From<$inner> for $name {
            fn from(number: $inner) -> Self {
                Self(number)
            }
        }

        impl ::core::convert::From<$name> for $inner {
            fn from(value: $name) -> Self {
                value.0
            }
        }
    };
}

/// Named values: `POSITION = 1, "position";`. The documentation is the name, or the words after it where Markdown would
/// read the name differently, and then the lines above the row.
#[doc(hidden)]
#[macro_export]
macro_rules! enumeration {
    (
        $(#[$meta:meta])*
        pub struct $name:ident($inner:ty): $data_type:ident {
            $($(#[$doc:meta])* $value:ident = $number:literal, $text:literal $(, $words:literal)?;)*
        }
    ) => {
        $crate::newtype!($(#[$meta])* $name($inner), $data_type);

        impl $name {
            $(
                #[doc = ::core::concat!($crate::words!($text $(, $words)?), "\n\n")]
                $(#[$doc])*
                pub const $value: Self = Self($crate::constant!($data_type, $inner, $number));
            )*

            /// The name, if the data sheet has one for this value.
            pub fn name(self) -> ::core::option::Option<&'static str> {
                $crate::object::name_of(self)
            }
        }

        impl $crate::object::Enumeration for $name {
            const NAMES: &'static [$crate::object::ValueName<'static>] = &[$(
                $crate::object::ValueName::new(
                    $crate::object::wire_form($crate::object::DataType::$data_type, $number),
                    $text,
                )
            ),*];
        }

        impl ::core::fmt::Debug for $name {
            fn fmt(&self, f: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
                $crate::object::debug_enumeration(f, ::core::stringify!($name), *self, self.0)
            }
        }

        impl ::core::fmt::Display for $name {
            fn fmt(&self, f: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
                match self.name() {
                    ::core::option::Option::Some(name) => f.pad(name),
                    ::core::option::Option::None => ::core::fmt::Display::fmt(&self.0, f),
                }
            }
        }
    };
}

/// Named bits: `mode, with_mode: u8 = 4..=6, "mode";`, without the second name if no object of this type can be
/// written.
#[doc(hidden)]
#[macro_export]
macro_rules! bit_field {
    (
        $(#[$meta:meta])*
        pub struct $name:ident($inner:ty): $data_type:ident {
            $(
                $(#[$doc:meta])*
                $get:ident $(, $set:ident)?: $type:ident = $low:literal $(..= $high:literal)?, $text:literal
                $(, $words:literal)?;
            )*
        }
    ) => {
        $crate::newtype!($(#[$meta])* $name($inner), $data_type);

        impl $name {
            $($crate::bits! {
                $data_type($inner), $low $(..= $high)?, $crate::words!($text $(, $words)?), $(#[$doc])*;
                $get $(, $set)?: $type
            })*
        }

        impl $crate::object::BitField for $name {
            const BITS: &'static [$crate::object::BitName<'static>] =
                &[$($crate::object::BitName::new($low, 1 $(+ $high - $low)?, $text)),*];
        }

        impl ::core::fmt::Debug for $name {
            fn fmt(&self, f: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
                $crate::object::debug_bits(f, ::core::stringify!($name), *self)
            }
        }
    };
}

/// Getter and setter of neighbouring bits. They are constant functions, which cannot use the trait `Value`.
#[doc(hidden)]
#[macro_export]
macro_rules! bits {
    ($number:ident($inner:ty), $low:literal, $words:expr, $($rest:tt)*) => {
        $crate::bits!(@ $number($inner), $low, 1, ::core::concat!("Bit ", $low, ": ", $words, "\n\n"), $($rest)*);
    };
    ($number:ident($inner:ty), $low:literal..=$high:literal, $words:expr, $($rest:tt)*) => {
        $crate::bits!(
            @ $number($inner), $low, $high - $low + 1,
            ::core::concat!("Bits ", $low, " to ", $high, ": ", $words, "\n\n"), $($rest)*
        );
    };
    (
        @ $number:ident($inner:ty), $low:literal, $width:expr, $words:expr, $(#[$doc:meta])*;
        $get:ident $(, $set:ident)?: $type:ident
    ) => {
        #[doc = $words]
        $(#[$doc])*
        #[must_use]
        pub const fn $get(self) -> $type {
            let word = $crate::odd!($number { self.0.get() } { self.0 }) as u64;
            $crate::truncate!($type, $crate::object::take(word, $low, $width))
        }
        $(
            #[doc = ::core::concat!("With another [`", ::core::stringify!($get), "`](Self::", ::core::stringify!($get), ").")]
            #[must_use]
            pub const fn $set(self, value: $type) -> Self {
                let word = $crate::odd!($number { self.0.get() } { self.0 }) as u64;
                let word = $crate::object::replace(word, $low, $width, value as u64);
                Self($crate::odd!($number { <$inner>::from_low_bits(word) } { word as $inner }))
            }
        )?
    };
}

/// Units: `volts, from_volts = "V", 1 / 10;`, and a condition if another object decides.
#[doc(hidden)]
#[macro_export]
macro_rules! quantity {
    (
        $(#[$meta:meta])*
        pub struct $name:ident($inner:ty): $data_type:ident {
            $(
                $(#[$doc:meta])*
                $get:ident, $from:ident = $symbol:literal, $num:literal / $den:literal $(, $when:expr)?;
            )*
        }
    ) => {
        $crate::newtype!($(#[$meta])* $name($inner), $data_type);

        impl $name {
            $(
                $(#[$doc])*
                #[must_use]
                pub const fn $get(self) -> f64 {
                    $crate::odd!($data_type { self.0.get() } { self.0 }) as f64 * $num as f64 / $den as f64
                }

                #[doc = ::core::concat!(
                    "The value nearest to [`", ::core::stringify!($get), "`](Self::", ::core::stringify!($get),
                    "); `None` if the data type does not reach that far."
                )]
                #[must_use]
                pub fn $from(value: f64) -> ::core::option::Option<Self> {
                    $crate::object::nearest(value * $den as f64 / $num as f64)
                }
            )*
        }

        impl $crate::object::Quantity for $name {
            const UNITS: &'static [$crate::object::Unit<'static>] =
                &[$($crate::object::Unit::new($symbol, $num, $den)$(.when($when))?),*];
        }

        impl ::core::fmt::Debug for $name {
            fn fmt(&self, f: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
                f.debug_tuple(::core::stringify!($name)).field(&self.0).finish()
            }
        }

        impl ::core::fmt::Display for $name {
            fn fmt(&self, f: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
                $crate::object::display_quantity(f, *self)
            }
        }
    };
}

/// A PDO: its fields by the bits they have in the frame, and the mapping as the data sheet has it.
#[doc(hidden)]
#[macro_export]
macro_rules! pdo {
    (
        $(#[$meta:meta])*
        pub struct $name:ident: $direction:ident $number:literal {
            $($(#[$doc:meta])* $field:ident: $type:ty = $low:literal $(..= $high:literal)?;)*
        }
        mapping: $($mapped:literal),*;
        $(transmission_type: $transmission_type:literal;)?
        $(cob_id($node:ident): $base:literal $(+ $node_id:ident)?;)?
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct $name {
            $($(#[$doc])* pub $field: $type,)*
        }

        impl $name {
            /// What is mapped, in order.
            pub const MAPPING: &'static [$crate::object::Mapped] = &[$($crate::object::Mapped::from_parameter($mapped)),*];
            $(
                /// The default of the transmission type.
                pub const TRANSMISSION_TYPE: u8 = $transmission_type;
            )?
            $(
                /// The default COB-ID of a node.
                #[must_use]
                pub const fn cob_id($node: $crate::NodeId) -> $crate::CobId {
                    $crate::CobId::from_parameter($base $(+ $node_id.get() as u32)?)
                }
            )?

            /// The data of a frame.
            #[must_use]
            pub fn pack(self) -> [u8; <Self as $crate::object::Pdo>::LENGTH] {
                $crate::object::pack(self)
            }

            /// The values of a frame's data; bytes beyond the mapped ones are ignored.
            pub fn unpack(data: &[u8]) -> ::core::result::Result<Self, $crate::object::MappedLengthMismatch> {
                $crate::object::Pdo::from_data(data)
            }
        }

        impl $crate::object::Pdo for $name {
            const DIRECTION: $crate::object::Direction = $crate::object::Direction::$direction;
            const NUMBER: u16 = $number;
            const MAPPING: &'static [$crate::object::Mapped] = Self::MAPPING;

            fn to_raw(self) -> u64 {
                0 $(| $crate::object::place(
                    $crate::object::Value::to_raw(self.$field),
                    $low,
                    1 $(+ $high - $low)?,
                ))*
            }

            #[allow(unused_variables)]
            fn from_raw(raw: u64) -> Self {
                Self { $($field: $crate::object::field(raw, $low, 1 $(+ $high - $low)?),)* }
            }
        }
    };
}

/// A name as documentation: in other words where there are some.
#[doc(hidden)]
#[macro_export]
macro_rules! words {
    ($text:literal) => {
        $text
    };
    ($text:literal, $words:literal) => {
        $words
    };
}

/// A literal as a constant of a data type.
#[doc(hidden)]
#[macro_export]
macro_rules! constant {
    (Boolean, $inner:ty, $number:literal) => {
        $number != 0
    };
    ($data_type:ident, $inner:ty, $number:literal) => {
        $crate::odd!($data_type { <$inner>::literal($number) } { $number })
    };
}

/// Bits as the type of a getter.
#[doc(hidden)]
#[macro_export]
macro_rules! truncate {
    (bool, $bits:expr) => {
        $bits != 0
    };
    ($type:ident, $bits:expr) => {
        $bits as $type
    };
}

/// The first code for the integers that no type of Rust holds, the second for all others.
#[doc(hidden)]
#[macro_export]
macro_rules! odd {
    (Integer24 { $($odd:tt)* } { $($plain:tt)* }) => { $($odd)* };
    (Integer40 { $($odd:tt)* } { $($plain:tt)* }) => { $($odd)* };
    (Integer48 { $($odd:tt)* } { $($plain:tt)* }) => { $($odd)* };
    (Integer56 { $($odd:tt)* } { $($plain:tt)* }) => { $($odd)* };
    (Unsigned24 { $($odd:tt)* } { $($plain:tt)* }) => { $($odd)* };
    (Unsigned40 { $($odd:tt)* } { $($plain:tt)* }) => { $($odd)* };
    (Unsigned48 { $($odd:tt)* } { $($plain:tt)* }) => { $($odd)* };
    (Unsigned56 { $($odd:tt)* } { $($plain:tt)* }) => { $($odd)* };
    ($plain:ident { $($odd:tt)* } { $($code:tt)* }) => { $($code)* };
}

#[cfg(test)]
mod tests {
    #![allow(unreachable_pub, reason = "generated types are public")]

    use crate::object::{BitField, BitName, DataType, Enumeration, I24, Mapped, Pdo, Quantity, Type, Unit, ValueName};
    use crate::{CobId, NodeId};
    use std::format;

    crate::enumeration! {
        /// Where it goes.
        pub struct Way(i8): Integer8 {
            BACK = -1, "back";
            /// And no step aside.
            FORTH = 0x01, "<forth>", "\\<forth\\>";
        }
    }

    crate::enumeration! {
        /// Whether it goes.
        pub struct Going(bool): Boolean {
            YES = 1, "yes";
        }
    }

    crate::bit_field! {
        /// Bits in a number with a sign.
        pub struct Flags(I24): Integer24 {
            low, with_low: u16 = 0..=11, "low";
            middle: u8 = 12..=14, "middle";
            top, with_top: bool = 23, "top";
        }
    }

    crate::quantity! {
        /// How far.
        pub struct Distance(I24): Integer24 {
            /// In m, 3/100 per count.
            metres, from_metres = "m", 3 / 100;
        }
    }

    crate::pdo! {
        /// Transmit PDO 6.
        pub struct Tpdo6: Transmit 6 {
            /// In fewer bits than it has.
            way: Way = 0..=1;
            /// After a gap.
            going: Going = 10;
        }
        mapping: 0x20000002, 0x00050008, 0x20010001;
        transmission_type: 254;
        cob_id(node): 0x180 + node;
    }

    #[test]
    fn values_have_names() {
        let row = |raw, name| ValueName::new(raw, name);
        assert_eq!(Way::NAMES, [row(0xFF, "back"), row(0x01, "<forth>")]);
        assert_eq!((Way::BACK.0, Way::FORTH.name(), Way(3).name()), (-1, Some("<forth>"), None));
        assert_eq!((format!("{} {}", Way::BACK, Way(3)), Going::YES), ("back 3".into(), Going(true)));
        assert_eq!((Way::DATA_TYPE, Going::DATA_TYPE), (DataType::Integer8, DataType::Boolean));
    }

    #[test]
    fn bits_are_read_and_changed_in_constants() {
        const FLAGS: Flags = Flags(I24::literal(0)).with_top(true).with_low(0xABC);
        assert_eq!((FLAGS.top(), FLAGS.low(), FLAGS.middle()), (true, 0xABC, 0));
        assert_eq!(FLAGS.0.get(), 0xABC - (1 << 23));
        assert_eq!((FLAGS.with_top(false).with_low(0).0.get(), Flags(I24::literal(-1)).middle()), (0, 7));
        assert_eq!(Flags::BITS[1], BitName::new(12, 3, "middle"));
    }

    #[test]
    fn units_convert_in_both_directions() {
        const METRES: f64 = Distance(I24::literal(-200)).metres();
        assert_eq!((METRES, Distance::from_metres(-6.0)), (-6.0, Some(Distance(I24::literal(-200)))));
        assert_eq!((Distance::from_metres(1e9), Distance::UNITS), (None, &[Unit::new("m", 3, 100)][..]));
    }

    #[test]
    fn a_pdo_places_its_fields() {
        let pdo = Tpdo6 { way: Way::BACK, going: Going::YES };
        assert_eq!((pdo.pack(), Tpdo6::unpack(&[0b11, 0b100, 0xFF]), Tpdo6::LENGTH), ([0b11, 0b100], Ok(pdo), 2));
        assert_eq!(Tpdo6::MAPPING[1], Mapped::new(0x0005, 0, 8));
        assert_eq!((Tpdo6::NUMBER, Tpdo6::TRANSMISSION_TYPE), (6, 254));
        assert_eq!(Tpdo6::cob_id(NodeId::literal(5)), CobId::from_parameter(0x185));
    }
}
