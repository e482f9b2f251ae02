//! Comparisons of tables that any manual has.

pub(crate) mod cia402;
pub(crate) mod frames;
pub(crate) mod network;
pub(crate) mod objects;
pub(crate) mod pdo;
pub(crate) mod prose;
pub(crate) mod sheet;
pub(crate) mod terms;
pub(crate) mod transmission;
