//! Bytes to meaning and back: one file per protocol, without state.
//!
//! Parsing is total: data that mean nothing are `None`. What is emitted is parsed as what it was.

pub mod crc;
pub mod sdo;
pub mod sdo_block;
