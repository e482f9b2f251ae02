//! A kind of drive as a type.

use crate::description::Description;

/// A kind of drive as a type, so that a `Drive` of one kind is not taken for one of another.
///
/// The type has no values; it is there for its description.
pub trait Kind: 'static {
    /// What the sequences have to know of it.
    const DESCRIPTION: &'static Description;
}

/// Any kind: drives that are described when the program runs, so that those of several kinds stand in one list. They are
/// connected to by `connect_described`; without that, by what CiA 402 says.
#[derive(Clone, Copy, Debug)]
pub enum Any {}

impl Kind for Any {
    const DESCRIPTION: &'static Description = &Description::CIA_402;
}
