//! A company's own bus crate, which brings the runtime along.

pub use lexican_runtime as canopen;
