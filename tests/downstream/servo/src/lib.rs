//! The driver of a servo that does what CiA 402 says.

pub use od::driver::{Drive, Kind};

pub mod od {
    lexican_runtime::include_od!("servo");
}

/// A data sheet that `build.rs` makes of it.
pub mod otherwise {
    lexican_runtime::include_od!("otherwise");
}
