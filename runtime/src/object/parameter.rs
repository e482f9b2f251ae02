//! Parameters of other interfaces of a device, such as a serial port or PROFIBUS-DP: mostly objects under other numbers.

use core::fmt;
use core::marker::PhantomData;

use super::{Access, Address, Condition, DataType, Readable, Type, Value, Writable};

/// A row of an interface's table: a number, and which object it stands for.
///
/// `N` is how the interface addresses its parameters: by a number (`u16`), such as a PNU, or by a text (`&str`), such as the
/// commands that read and write it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParameterRow<N> {
    /// What the interface calls it.
    pub number: N,
    /// The name in the words of its manual.
    pub name: &'static str,
    /// The data type that the interface has for it.
    pub data_type: DataType,
    /// What may be done with it through this interface.
    pub access: Access,
    /// The object that it equals, if there is one; of an array, its first element.
    pub object: Option<Address>,
    /// How many elements it has: 1, unless it is an array.
    pub elements: u8,
    /// The smallest and the largest value, in numbers of the object.
    pub range: Option<(i64, i64)>,
    /// Numbers of the interface, with those of the object; none where they are the same.
    pub codes: &'static [(i64, i64)],
    /// When the number stands for this, if it stands for several things.
    pub when: Option<Condition>,
}

impl<N> ParameterRow<N> {
    /// The object that an element equals; elements count from 0.
    #[must_use]
    pub fn object_at(&self, element: u8) -> Option<Address> {
        let first = self.object.filter(|_| element < self.elements)?;
        Some(Address::new(first.index(), first.sub().checked_add(element)?))
    }

    /// Which element equals an object.
    #[must_use]
    pub fn element_of(&self, object: Address) -> Option<u8> {
        let first = self.object.filter(|first| first.index() == object.index())?;
        object.sub().checked_sub(first.sub()).filter(|element| *element < self.elements)
    }

    /// What a number of the interface is in the object; none if it has no such number.
    #[must_use]
    pub fn in_object(&self, number: i64) -> Option<i64> {
        let code = || self.codes.iter().find(|(here, _)| *here == number).map(|(_, there)| *there);
        if self.codes.is_empty() { Some(number) } else { code() }
    }

    /// What a number of the object is in the interface; none if it has no such number.
    #[must_use]
    pub fn of_object(&self, number: i64) -> Option<i64> {
        let code = || self.codes.iter().find(|(_, there)| *there == number).map(|(here, _)| *here);
        if self.codes.is_empty() { Some(number) } else { code() }
    }
}

/// A parameter of another interface: `T` is the type that the object has, `A` what may be done with it through this
/// interface, and `N` how it is addressed, so that no interface takes the parameters of another one.
///
/// Of an array, the handle is its first element; [`Parameter::at`] has the others.
pub struct Parameter<T, A, N> {
    row: ParameterRow<N>,
    element: u8,
    // fn() -> _: a handle owns no T, so it is Send and Sync for any T.
    marker: PhantomData<fn() -> (T, A)>,
}

impl<T: Type, A, N: Copy> Parameter<T, A, N> {
    /// A parameter that equals no object and takes every number of its data type.
    #[must_use]
    pub const fn new(number: N, name: &'static str, access: Access) -> Self {
        let (data_type, object, range, when) = (T::DATA_TYPE, None, None, None);
        let row = ParameterRow { number, name, data_type, access, object, elements: 1, range, codes: &[], when };
        Parameter { row, element: 0, marker: PhantomData }
    }

    /// The object `index`:`sub`.
    #[must_use]
    pub const fn equals(mut self, index: u16, sub: u8) -> Self {
        self.row.object = Some(Address::new(index, sub));
        self
    }

    /// So many elements, at sub-indices that follow each other.
    #[must_use]
    pub const fn elements(mut self, elements: u8) -> Self {
        self.row.elements = elements;
        self
    }

    /// In another data type than the object has.
    #[must_use]
    pub const fn carried_as(mut self, data_type: DataType) -> Self {
        self.row.data_type = data_type;
        self
    }

    /// The smallest and the largest value.
    #[must_use]
    pub const fn within(mut self, low: i64, high: i64) -> Self {
        self.row.range = Some((low, high));
        self
    }

    /// With numbers of its own.
    #[must_use]
    pub const fn coded(mut self, codes: &'static [(i64, i64)]) -> Self {
        self.row.codes = codes;
        self
    }

    /// While another object has a certain value.
    #[must_use]
    pub const fn when(mut self, when: Condition) -> Self {
        self.row.when = Some(when);
        self
    }

    /// Its row.
    #[must_use]
    pub const fn row(&self) -> ParameterRow<N> {
        self.row
    }

    /// What the interface calls it.
    #[must_use]
    pub const fn number(&self) -> N {
        self.row.number
    }

    /// Which element of an array it is, from 0; none if it is no array.
    #[must_use]
    pub const fn element(&self) -> Option<u8> {
        if self.row.elements > 1 { Some(self.element) } else { None }
    }

    /// An element of an array; elements count from 0.
    #[must_use]
    pub const fn at(self, element: u8) -> Option<Self> {
        if element < self.row.elements { Some(Parameter { element, ..self }) } else { None }
    }
}

impl<T: Value, A: Readable, N: Copy> Parameter<T, A, N> {
    /// The value that a number of the interface means; none if it means nothing.
    #[must_use]
    pub fn decode(&self, number: i64) -> Option<T> {
        self.row.in_object(number).map(|number| T::from_raw(number.cast_unsigned()))
    }
}

impl<T: Value, A: Writable, N: Copy> Parameter<T, A, N> {
    /// The number of the interface that means a value; none if it is out of range, or there is no number for it.
    #[must_use]
    pub fn encode(&self, value: T) -> Option<i64> {
        let unused = 64 - u32::from(T::DATA_TYPE.bits()?);
        let high = value.to_raw() << unused;
        let number =
            if T::DATA_TYPE.is_signed() { high.cast_signed() >> unused } else { (high >> unused).cast_signed() };
        let is_within = self.row.range.is_none_or(|(low, high)| (low..=high).contains(&number));
        self.row.of_object(number).filter(|_| is_within)
    }
}

impl<T, A, N: Copy> Clone for Parameter<T, A, N> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<T, A, N: Copy> Copy for Parameter<T, A, N> {}

impl<T: Type, A, N: fmt::Debug> fmt::Debug for Parameter<T, A, N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Parameter({:?} {})", self.row.number, T::DATA_TYPE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::object::{Ro, Rw};

    const MODE: Parameter<u8, Rw, u16> =
        Parameter::new(930, "Mode", Access::Rw).equals(0x6060, 0).within(1, 2).coded(&[(1, 2), (2, 1)]);
    const LIMIT: Parameter<i32, Rw, &str> = Parameter::new("E1/F1", "Limit", Access::Rw).within(-5, 5);
    const FAULTS: Parameter<u16, Ro, u16> =
        Parameter::new(945, "Faults", Access::Ro).equals(0x1003, 1).elements(10).coded(&[(0x41, 0x3120)]);

    #[test]
    fn numbers_become_values_and_back() {
        assert_eq!((MODE.decode(1), MODE.decode(2), MODE.decode(3)), (Some(2), Some(1), None));
        assert_eq!((MODE.encode(2), MODE.encode(3)), (Some(1), None));
        assert_eq!((LIMIT.decode(-3), LIMIT.encode(-5), LIMIT.encode(-6)), (Some(-3), Some(-5), None));
        let all: Parameter<i16, Rw, u16> = Parameter::new(1, "", Access::Rw);
        assert_eq!((all.decode(0xFFC9), all.encode(-55)), (Some(-55), Some(-55)));
    }

    #[test]
    fn an_array_has_elements_and_an_object_for_each() {
        let row = FAULTS.row();
        assert_eq!((FAULTS.element(), FAULTS.at(9).and_then(|last| last.element())), (Some(0), Some(9)));
        assert!(FAULTS.at(10).is_none() && MODE.element().is_none() && LIMIT.row().object_at(0).is_none());
        for element in 0..10 {
            let object = Address::new(0x1003, element + 1);
            assert_eq!((row.object_at(element), row.element_of(object)), (Some(object), Some(element)));
        }
        assert_eq!(row.object_at(10), None);
        for other in [Address::new(0x1003, 0), Address::new(0x1003, 11), Address::new(0x1004, 1)] {
            assert_eq!(row.element_of(other), None);
        }
    }
}
