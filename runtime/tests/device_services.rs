//! How the services of a device keep out of each other's way, and what a change of one does to another.

mod common;

use common::testing::TestOd;
use common::{Bench, FULL};
use lexican_runtime::device::{Behaviour, Event};

fn device(changes: &str) -> Bench {
    Bench::new(TestOd::new(FULL).with(changes), Behaviour::CIA_301)
}

#[test]
fn a_heartbeat_that_is_switched_on_ends_life_guarding() {
    let mut bench = device("100C:00 u16 rw - 100\n100D:00 u8 rw - 3").operational();
    bench.send("705#R1");
    bench.write(0x1017, 0, 2, 1000).unwrap();
    bench.take_events();
    assert_eq!(bench.pass_ms(500), ["0 705#05"]);
    assert_eq!(bench.take_events(), []);
    // Without the heartbeat it begins again with the next request.
    bench.write(0x1017, 0, 2, 0).unwrap();
    bench.take_events();
    bench.pass_ms(1000);
    assert_eq!(bench.take_events(), []);
    bench.send("705#R1");
    bench.pass_ms(300);
    assert!(matches!(bench.take_events()[..], [Event::LifeGuarding(_), ..]));
}
