//! A CANopen bus at a glance: one model, two faces.
//!
//! A face (the page, the terminal) gives [`Command`]s and shows the [`View`]. Both are plain data, which the page gets as JSON.

pub mod command;
pub mod engine;
pub mod model;
mod number;
pub mod sheet;
pub mod tui;
pub mod view;
pub mod web;

pub use command::{Answer, Command, Refused};
pub use engine::{Bench, Face};
pub use view::View;
