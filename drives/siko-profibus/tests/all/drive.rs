//! The drivers of both drives over PROFIBUS: the same operations and outcomes as over CANopen.

mod rig;
mod same;
mod trouble;
