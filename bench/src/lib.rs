//! A CANopen bus at a glance: one model, shown by two kinds of clients.
//!
//! A client (the page, the terminal) gives [`Request`]s and shows the [`View`]. Both are plain data, which the page gets as JSON.

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
