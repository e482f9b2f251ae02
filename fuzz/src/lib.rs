//! Fuzz targets: plain functions of bytes that panic when a promise is broken. libFuzzer calls them from
//! `fuzz/targets`, and the tests of the workspace call them with the files in `fuzz/corpus`.

#[path = "../../runtime/tests/all/common.rs"]
mod common;
#[path = "../../eds/tests/all/exercise.rs"]
mod exercise;
#[path = "../../runtime/tests/all/sdo_support.rs"]
mod sdo_support;

mod bus;
mod port;
mod profibus;
mod text;

pub use bus::{device, manager, sdo};
pub use port::siko_serial;
pub use profibus::profibus;
pub use text::{archive, bus_url, bus_yml, codegen, eds, log, logs, machine, parameters, script, slcan, xdd};
