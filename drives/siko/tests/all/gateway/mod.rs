//! The gateway with a scripted door: frames become jobs, and reports become frames.

mod face;
mod link;
mod node;
mod rig;
