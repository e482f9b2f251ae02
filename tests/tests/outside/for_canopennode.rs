//! The page for users of CANopenNode, followed to the letter with a data sheet in the style of CANopenEditor.
#![cfg(unix)]

use crate::a_drive_in_an_hour::User;

const PAGE: &str = include_str!("../../../docs/canopennode.md");

#[test]
fn the_page_tests_a_device_and_talks_to_it() {
    let mut user = User::begins("panel", &[("eds/io.xdd", include_str!("../../../docs/canopennode/io.xdd"))]);
    let (_, compared) = user.follows(PAGE, "panel");
    assert_eq!(compared, 5, "what the page says of the output is compared");
}
