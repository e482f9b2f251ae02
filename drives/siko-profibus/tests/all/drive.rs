//! The drivers of both drives over PROFIBUS: the operations and outcomes that they have over CANopen.

mod rig;
mod same;
mod trouble;
