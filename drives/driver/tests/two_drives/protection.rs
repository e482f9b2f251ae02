//! A drive that consumes heartbeats is armed by 1016h, and receives them.

use std::sync::{Arc, Mutex};

use lexican_driver::{Drive, Protection, Supervision};
use lexican_runtime::{CobId, Duration, Instant, NodeId};

use crate::script::{Sheet, bus};
use crate::servo::{self, BySdo};

/// A drive with three consumers, one of which monitors node 9.
const CONSUMER: Sheet = Sheet {
    objects: &[
        (0x1000, 0x00, 4, 0x0002_0192),
        (0x1008, 0x00, 4, u32::from_le_bytes(*b"M006") as u64),
        (0x100C, 0x00, 2, 0),
        (0x100D, 0x00, 1, 0),
        (0x1016, 0x00, 1, 3),
        (0x1016, 0x01, 4, 0x0009_01F4),
        (0x1016, 0x02, 4, 0),
        (0x1016, 0x03, 4, 0),
        (0x1018, 0x01, 4, 0x6A),
        (0x6041, 0x00, 2, 0x0240),
    ],
    ..servo::SHEET
};

#[test]
fn a_free_heartbeat_consumer_is_armed_and_kept_going() {
    let (bus, device) = bus(CONSUMER);
    // Node 127, 1000 ms (CiA 301, 7.5.2.19).
    let script = "
        > 603#23161002E8037F00
        > 77F#05
    ";
    device.lock().unwrap().follow(bus.now(), script);
    let within = Duration::from_secs(1);
    let mut drive =
        Drive::<_, BySdo>::connect_protected(bus.link(), CONSUMER.node, Supervision::within(within)).unwrap();
    drive.pass(Duration::from_millis(10)).unwrap();
    let expected =
        Protection::Heartbeat { entry: 2, manager: NodeId::literal(127), period: Duration::from_millis(250), within };
    assert_eq!(drive.protection(), expected);
    assert!(device.lock().unwrap().is_through());
    device.lock().unwrap().follow(bus.now(), "> 77F#05\n> 77F#05\n> 77F#05\n> 77F#05\n> 603#2316100200000000");
    drive.pass(Duration::from_secs(1)).unwrap();
    let _link = drive.release();
    assert!(device.lock().unwrap().is_through(), "four heartbeats, and disarmed");
}

#[test]
fn a_drive_that_can_notice_nothing_says_so() {
    let (bus, _) = bus(servo::SHEET);
    let within = Supervision::within(Duration::from_secs(1));
    let error = Drive::<_, BySdo>::connect_protected(bus.link(), servo::SHEET.node, within).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the servo has no life guarding, and no heartbeat consumer that is free and takes a node-ID"
    );
}

#[test]
fn a_drive_is_protected_as_far_as_it_can_be_unless_the_program_says_otherwise() {
    let (bus, device) = bus(CONSUMER);
    // Armed, and disarmed at a regular end.
    device.lock().unwrap().follow(bus.now(), "> 603#23161002E8037F00\n> 77F#05\n> 603#2316100200000000");
    let mut drive = Drive::<_, BySdo>::connect(bus.link(), CONSUMER.node).unwrap();
    drive.pass(Duration::from_millis(10)).unwrap();
    assert!(matches!(drive.protection(), Protection::Heartbeat { entry: 2, .. }), "{:?}", drive.protection());
    drop(drive);
    assert!(device.lock().unwrap().is_through());
    let (bus, _) = crate::script::bus(servo::SHEET);
    let drive = Drive::<_, BySdo>::connect(bus.link(), servo::SHEET.node).unwrap();
    assert_eq!(drive.protection(), Protection::None, "it can notice nothing");
    let (bus, _) = crate::script::bus(CONSUMER);
    let drive = Drive::<_, BySdo>::connect_unprotected(bus.link(), CONSUMER.node).unwrap();
    assert_eq!(drive.protection(), Protection::None);
}

/// The virtual clock advances only in operations. All of them keep the drive supplied, however long and dense they are.
#[test]
fn a_drive_does_not_trip_while_its_program_works() {
    let (bus, device) = bus(CONSUMER);
    device.lock().unwrap().follow(bus.now(), "> 603#23161002E8037F00");
    let mut drive = Drive::<_, BySdo>::connect(bus.link(), CONSUMER.node).unwrap();
    let beats: Arc<Mutex<Vec<Instant>>> = Arc::default();
    let heard = Arc::clone(&beats);
    bus.observe(move |now, frame| {
        if frame.id() == CobId::of_node(0x700, NodeId::literal(127)) {
            heard.lock().unwrap().push(now);
        }
    });
    let began = bus.now();
    for _ in 0..2000 {
        drive.state().unwrap();
    }
    drive.pass(Duration::from_secs(600)).unwrap();
    let beats = beats.lock().unwrap();
    let gaps = beats.windows(2).map(|pair| pair[1].since(pair[0])).chain([bus.now().since(*beats.last().unwrap())]);
    let longest = gaps.chain([beats[0].since(began)]).max().unwrap();
    assert!(longest <= Duration::from_millis(300), "{longest} of 1 s");
}

#[cfg(feature = "tokio")]
#[tokio::test]
async fn the_other_shell_sends_heartbeats_too() {
    use lexican_runtime::host::tokio::Network;

    let (bus, device) = bus(CONSUMER);
    let script = "
        > 603#23161002E8037F00
        > 77F#05
        > 77F#05
        > 77F#05
        > 77F#05
    ";
    device.lock().unwrap().follow(bus.now(), script);
    let network = Network::spawn(bus.link()).unwrap();
    let within = Supervision::within(Duration::from_secs(1));
    let mut drive =
        lexican_driver::tokio::Drive::<BySdo>::connect_protected(network, CONSUMER.node, within).await.unwrap();
    drive.pass(Duration::from_millis(800)).await.unwrap();
    assert!(device.lock().unwrap().is_through());
}
