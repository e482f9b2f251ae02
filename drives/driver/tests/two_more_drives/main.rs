//! Two drives that this crate's sources do not know, described as data only: the SIKO AG02, by its own crate, and the
//! Kollmorgen AKD.
//! Scripted devices expect of the driver the frames that the manuals of these drives work out, and answer with theirs.

mod ag02;
mod akd;
mod homing;
mod nothing_starts_unasked;
mod protection;
mod script;
mod what_was_before;

use lexican_driver::{Description, Kind};

#[test]
fn nothing_is_wrong_with_the_descriptions() {
    for description in [akd::BySdo::DESCRIPTION, akd::ByPdo::DESCRIPTION] {
        let Description { name, .. } = description;
        assert_eq!(description.findings(), [""; 0], "{name}");
    }
}
