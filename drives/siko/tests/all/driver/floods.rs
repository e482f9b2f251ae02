//! A link that always has a frame: no operation waits until there are none.

use std::sync::{Arc, Mutex};

use lexican_runtime::Duration;
use lexican_runtime::host::VirtualBus;
use siko_ag03_1::driver::{Drive, Error};
use siko_ag03_1::sim::MODEL;
use siko_ag03_1::sim::SimulatedDrive;

use super::rig::NODE;

use crate::flooded::flooded;

#[test]
fn connecting_to_a_silent_node_ends() {
    let (link, _) = flooded(&VirtualBus::with_bit_rate(500));
    assert!(matches!(Drive::connect_unprotected(link, NODE), Err(Error::Sdo(_))));
}

#[test]
fn a_moving_drive_that_is_dropped_is_sent_its_stop_first() {
    let bus = VirtualBus::with_bit_rate(500);
    let simulated = Arc::new(Mutex::new(SimulatedDrive::new(&MODEL, NODE)));
    bus.attach(Arc::clone(&simulated));
    let (link, sent) = flooded(&bus);
    let mut drive = Drive::connect_unprotected(link, NODE).unwrap();
    drive.enable().unwrap();
    drive.start_moving_to(50_000).unwrap();
    drive.pass(Duration::from_secs(1)).unwrap();
    sent.lock().unwrap().clear();
    drop(drive);
    assert_eq!(sent.lock().unwrap().first().map(String::as_str), Some("205#0F01"));
    bus.advance(Duration::from_secs(2));
    assert_eq!(simulated.lock().unwrap().velocity(bus.now()), 0);
}
