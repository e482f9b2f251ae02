//! The bench over a live bus: what its faces ask for is carried out on threads, and the model hears all of it.

mod access;
mod bench;
mod face;
mod filter;
mod hub;
mod jobs;
mod lock;
mod network;
mod order;
mod parameters;
mod pdo;
mod recording;
mod reply;
mod station;
mod wanted;

pub use bench::{Bench, Setup, Simulation};
pub use face::Face;
pub use reply::Reply;
