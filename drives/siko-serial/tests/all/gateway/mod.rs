//! The driver of the AG02 through its serial port: the same tests as on CAN, and trouble on the line.

mod any_frames;
#[path = "../../../../siko-ag02/tests/driver/cases.rs"]
mod cases;
mod interface;
mod noisy;
mod rig;
mod trouble;
