//! A kind of drive as a type.

use crate::description::Description;

/// A kind of drive as a type, so that a `Drive` of one kind is not taken for one of another.
///
/// The type has no values; it only carries the description.
pub trait Kind: 'static {
    /// How the sequences work with it.
    const DESCRIPTION: &'static Description;
}

/// Any kind: for drives that are described at run time, so that several kinds fit into one list.
///
/// It is not a [`Kind`], since it has no description: each way to connect takes one as an argument.
///
/// ```
/// # use lexican_driver::{Any, Description, Drive, Error};
/// # use lexican_runtime::{NodeId, host::Link};
/// fn connect<L: Link + Send + 'static>(link: L, description: &'static Description) -> Result<Drive<L, Any>, Error> {
///     Drive::connect_described(link, NodeId::literal(5), description)
/// }
/// ```
///
/// ```compile_fail,E0599
/// # use lexican_driver::{Any, Description, Drive, Error};
/// # use lexican_runtime::{NodeId, host::Link};
/// fn connect<L: Link>(link: L) -> Result<Drive<L, Any>, Error> {
///     Drive::<L, Any>::connect(link, NodeId::literal(5))
/// }
/// ```
#[derive(Clone, Copy, Debug)]
pub enum Any {}
