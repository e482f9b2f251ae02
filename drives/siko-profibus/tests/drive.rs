//! The drivers of both drives over PROFIBUS: the operations and outcomes that they have over CANopen.

#[path = "drive/bench.rs"]
mod bench;
#[path = "drive/same.rs"]
mod same;
#[path = "drive/trouble.rs"]
mod trouble;
