//! The bench over a live bus: carries out requests on threads, while the model receives every frame.

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
