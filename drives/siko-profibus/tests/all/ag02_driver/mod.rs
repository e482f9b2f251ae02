//! The driver of the AG02 over PROFIBUS: the tests that it has on CAN.

mod bench;
#[path = "../../../../siko-ag02/tests/driver/cases.rs"]
mod cases;
