//! What a device may have or leave out, as types.
//!
//! A part of a state machine that is left out has a type without values, so that the compiler leaves neither code nor
//! memory of it: an `Option` of it is always `None`, and a variant that holds it never comes.

use core::convert::Infallible;
use core::fmt::Debug;
use core::marker::PhantomData;
use core::ops::{Deref, DerefMut};

/// [`With`] or [`Without`].
pub trait Choice: Copy + Debug + Send + Sync + 'static + sealed::Choice {}

/// It is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum With {}

/// It is left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Without {}

impl Choice for With {}
impl Choice for Without {}

/// A value that is there.
#[derive(Clone, Copy, Debug)]
pub struct Held<T>(T);

/// A value that is left out: there is none.
#[derive(Clone, Copy, Debug)]
pub struct LeftOut<T>(Infallible, PhantomData<T>);

pub(crate) mod sealed {
    use super::{Debug, DerefMut, Held, LeftOut, With, Without};

    pub trait Choice {
        /// A `T`, or a type without values.
        type Part<T: Copy + Debug>: Copy + Debug + DerefMut<Target = T>;

        /// Whether it is there.
        const IS_THERE: bool;

        /// `None` if it is left out.
        fn part<T: Copy + Debug>(value: T) -> Option<Self::Part<T>>;
    }

    impl Choice for With {
        type Part<T: Copy + Debug> = Held<T>;
        const IS_THERE: bool = true;

        fn part<T: Copy + Debug>(value: T) -> Option<Held<T>> {
            Some(Held(value))
        }
    }

    impl Choice for Without {
        type Part<T: Copy + Debug> = LeftOut<T>;
        const IS_THERE: bool = false;

        fn part<T: Copy + Debug>(_: T) -> Option<LeftOut<T>> {
            None
        }
    }
}

impl<T> Deref for Held<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0
    }
}

impl<T> DerefMut for Held<T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.0
    }
}

impl<T> Deref for LeftOut<T> {
    type Target = T;

    fn deref(&self) -> &T {
        match self.0 {}
    }
}

impl<T> DerefMut for LeftOut<T> {
    fn deref_mut(&mut self) -> &mut T {
        match self.0 {}
    }
}
