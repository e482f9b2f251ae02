//! Crates outside of the workspace, which nested runs of cargo build.

mod a_drive_in_an_hour;
mod bare;
mod cases;
mod downstream;
mod golden;
mod outside;
mod readme;
mod ui;
