//! The driver of a servo that complies with CiA 402.

pub use od::driver::{Drive, Kind};

pub mod od {
    lexican_runtime::include_od!("servo");
}

/// The variant that `build.rs` makes of the data sheet.
pub mod otherwise {
    lexican_runtime::include_od!("otherwise");
}
