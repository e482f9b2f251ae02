//! The drivers of both drives over PROFIBUS: the operations and outcomes that they have over CANopen.

mod bench;
mod same;
mod trouble;
