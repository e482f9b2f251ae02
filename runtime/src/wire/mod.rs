//! Bytes to meaning and back: one file per protocol, without state.
//!
//! Parsing is total: data without a meaning are `None`. Parsing what was emitted gives the same value.

pub mod crc;
pub mod emcy;
pub mod heartbeat;
pub mod lss;
pub mod nmt;
pub mod pdo;
pub mod sdo;
pub mod sdo_block;
pub mod sync;
pub mod time;
