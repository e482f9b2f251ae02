//! Drives that exist only in software: what they share.

pub mod trajectory;

mod storage;

pub use storage::{Storage, signed};
