//! The gateway with a door that does what the test says: frames become jobs, and reports become frames.

mod face;
mod link;
mod node;
mod rig;
