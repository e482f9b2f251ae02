//! The SIKO AG03/1 positioning drive: a typed driver, and a drive that exists only in software.

mod direction;
pub mod driver;
pub mod fault;
pub mod parameter;
pub mod sim;
pub mod state;
pub mod words;
pub mod worked_examples;

pub use direction::Direction;

/// The dictionary, generated from the data sheet `siko/ag03-1` and its overlay.
pub mod od {
    lexican_runtime::include_od!("siko_ag03_1");
}
