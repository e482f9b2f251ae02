//! What the newtypes of generated code have in common. The generated code brings the struct, its names and
//! its numbers; these macros bring the traits. They are for generated code alone.

/// A newtype over a number: on the wire it is that number.
#[doc(hidden)]
#[macro_export]
macro_rules! newtype {
    ($name:ident($inner:ty), $data_type:ident) => {
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

/// A newtype with named values; the generated code implements `Enumeration` for it.
#[doc(hidden)]
#[macro_export]
macro_rules! enumeration {
    ($name:ident($inner:ty), $data_type:ident) => {
        $crate::newtype!($name($inner), $data_type);

        impl $name {
            /// The name, when the data sheet has one for this value.
            pub fn name(self) -> ::core::option::Option<&'static str> {
                $crate::object::name_of(self)
            }
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

/// A newtype of named bits; the generated code implements `BitField` for it.
#[doc(hidden)]
#[macro_export]
macro_rules! bit_field {
    ($name:ident($inner:ty), $data_type:ident) => {
        $crate::newtype!($name($inner), $data_type);

        impl ::core::fmt::Debug for $name {
            fn fmt(&self, f: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
                $crate::object::debug_bits(f, ::core::stringify!($name), *self)
            }
        }
    };
}

/// A newtype with units; the generated code implements `Quantity` for it.
#[doc(hidden)]
#[macro_export]
macro_rules! quantity {
    ($name:ident($inner:ty), $data_type:ident) => {
        $crate::newtype!($name($inner), $data_type);

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
