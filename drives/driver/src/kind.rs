//! A kind of drive as a type.

use crate::description::Description;

/// A kind of drive as a type, so that a `Drive` of one kind is not taken for one of another.
///
/// The type has no values; it is there for its description.
pub trait Kind: 'static {
    /// What the sequences have to know of it.
    const DESCRIPTION: &'static Description;
}
