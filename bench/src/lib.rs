//! The bench for a CANopen bus: one model, shown by two kinds of clients.
//!
//! A client (the page or the terminal) sends [`Request`]s and shows the [`View`]. Both are plain data; the page gets
//! them as JSON.

mod columns;
pub mod engine;
pub mod model;
mod number;
mod orders;
pub mod request;
pub mod sheet;
pub mod tui;
pub mod view;
pub mod web;

pub use engine::{Bench, Client};
pub use request::{Answer, Refused, Request};
pub use view::View;

#[cfg(test)]
mod tests {
    mod wire;
}
