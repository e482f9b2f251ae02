//! The type of an entry.

use std::collections::BTreeMap;

use lexican_eds::model::Entry;
use lexican_eds::types::{Class, DataType};

/// The type of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Type {
    /// A data type of CiA 301.
    Plain(DataType),
    /// The position in [`Plan::newtypes`](super::Plan::newtypes).
    Newtype(usize),
}

/// The types of entries to which an overlay gives a meaning, by address.
pub(crate) type Types = BTreeMap<(u16, u8), Type>;

pub(crate) fn type_of(entry: &Entry, types: &Types) -> Type {
    types.get(&(entry.index, entry.sub)).copied().unwrap_or(Type::Plain(entry.data_type))
}

/// Whether values of the type have a fixed size.
pub(crate) fn has_values(data_type: DataType) -> bool {
    !matches!(data_type.class(), Class::Text | Class::Bytes | Class::Other)
}
