//! Data sheets of the library against the tables of the manuals that they were authored from (`tests/manual/`), where no
//! simulated drive is needed.

#![allow(unreachable_pub, reason = "none of the modules of a test is reachable")]

mod akd;
mod manual;
mod protocol;

use lexican_eds::library;
use lexican_eds::model::Device;

/// A data sheet of the library with its overlay; the two together have no findings.
fn device(id: &str) -> Device {
    let shipped = library::find(id).expect("the library has it");
    let (device, diagnostics) = lexican_eds::load(&shipped.input());
    assert!(diagnostics.is_empty(), "{}", diagnostics.render(&shipped.input()));
    device
}
