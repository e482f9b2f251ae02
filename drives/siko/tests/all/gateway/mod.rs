//! The gateway with a door that does what the test says: frames become jobs, and reports become frames.

mod bench;
mod face;
mod link;
mod node;
