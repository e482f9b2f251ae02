//! Following a path: everything that can go wrong has a named outcome, and leaves all axes at rest.

mod any_frames;
mod axis;
mod lost_frames;
mod outcomes;
mod rig;
mod servo;
mod servos;
#[cfg(feature = "tokio")]
mod tokio_shell;
