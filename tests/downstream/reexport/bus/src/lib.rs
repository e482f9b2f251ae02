//! A company's own bus crate, which re-exports the runtime.

pub use lexican_runtime as canopen;
