//! Commands that send: `lexican sync`, `time`, `send`, `emcy`, `heartbeat` and `guard`.

pub(crate) mod emcy;
pub(crate) mod frames;
pub(crate) mod guard;
pub(crate) mod heartbeat;
mod schedule;
mod session;
pub(crate) mod sync;
mod ticker;
pub(crate) mod time;
