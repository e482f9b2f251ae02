//! Crates outside of the workspace, which nested runs of cargo build.

#[cfg(feature = "nested")]
mod a_drive_in_an_hour;
#[cfg(feature = "nested")]
mod bare;
mod cases;
#[cfg(feature = "nested")]
mod downstream;
#[cfg(feature = "nested")]
mod for_canopennode;
mod golden;
mod outside;
mod readme;
mod ui;
