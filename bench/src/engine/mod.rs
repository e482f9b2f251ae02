//! The bench over a live bus: what its clients ask for is carried out on threads, and the model hears all of it.

mod access;
mod bench;
mod client;
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
mod sequence;
mod wanted;
mod worker;

pub use bench::{Bench, Line, Player, Setup, Simulation};
pub use client::Client;
pub use reply::Reply;
