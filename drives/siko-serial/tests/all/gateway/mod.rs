//! The driver of the AG02 through its serial port: the tests that it has on CAN, and what the line can do to it.

mod any_frames;
#[path = "../../../../siko-ag02/tests/driver/cases.rs"]
mod cases;
mod interface;
mod noisy;
mod rig;
mod trouble;
