//! Tests that involve several crates.

mod boot_plan;
mod descriptions;
mod fuzzed;
mod link_slcan;
#[path = "../link_support/mod.rs"]
mod link_support;
mod lss_device;
mod parameters;
