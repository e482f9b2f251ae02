//! A user's crate with a drive from the device library.
#![warn(missing_docs)]

/// The dictionary of the drive.
pub mod od {
    lexican_runtime::include_od!("siko_ag03_1");
}
