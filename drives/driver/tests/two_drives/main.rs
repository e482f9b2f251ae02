//! Two drives that this crate's sources do not know, described only by data: the SIKO AG02, by its own crate, and a
//! servo, by the tests. Scripted devices expect the driver's frames, and answer them.

mod ag02;
mod cyclic;
mod homing;
mod latch;
mod nothing_starts_unasked;
mod process_data;
mod protection;
mod script;
mod servo;
mod set_points;
mod warnings;
mod what_was_before;

use lexican_driver::{Description, Kind};

#[test]
fn nothing_is_wrong_with_the_descriptions() {
    for description in [servo::BySdo::DESCRIPTION, servo::ByPdo::DESCRIPTION] {
        let Description { name, .. } = description;
        assert_eq!(description.findings(), [""; 0], "{name}");
    }
}
