//! The driver against the simulated drive, in virtual time.

mod cases;
mod rig;

use std::sync::{Arc, Mutex};

use lexican_runtime::host::VirtualBus;
use lexican_runtime::{Frame, NodeId};
use rig::Rig;
use siko_ag02::driver::Drive;
use siko_ag02::sim::inputs::BusState;
use siko_ag02::sim::{MODEL, SimulatedDrive};
use siko_ag02::worked_examples::{Action, Example, NODE, POSITIONING, VELOCITY};

/// The frames of an example up to the one that disables the drive, for which the driver has a shorter way.
fn frames(example: &Example) -> Vec<Frame> {
    let sent = example.rows.iter().filter_map(|row| match row.action {
        Action::Send(frame) => Some((row.meaning, frame)),
        Action::Wait(_) => None,
    });
    sent.take_while(|(meaning, _)| *meaning != "RPDO1: Disable Operation").map(|(_, frame)| frame).collect()
}

#[track_caller]
fn sends(example: &Example, operate: impl FnOnce(&mut Rig)) {
    let mut rig = Rig::new();
    let heard = Arc::new(Mutex::new(Vec::new()));
    let list = Arc::clone(&heard);
    rig.bus.observe(move |_, frame| list.lock().unwrap().push(*frame));
    operate(&mut rig);
    rig.pass(10);
    let heard = heard.lock().unwrap();
    let mut rest = heard.iter();
    for frame in frames(example) {
        assert!(rest.any(|other| *other == frame), "{frame} of table {} is not sent in its place", example.table);
    }
}

#[test]
fn it_sends_the_frames_of_table_25() {
    sends(&POSITIONING, cases::table_25);
}

#[test]
fn it_sends_the_frames_of_table_26() {
    sends(&VELOCITY, cases::table_26);
}

#[test]
fn after_bus_off_the_code_is_that_of_fault_f() {
    let mut rig = Rig::new();
    rig.world(|inputs| inputs.bus = BusState::Off);
    rig.world(|inputs| inputs.bus = BusState::Active);
    let cause = rig.drive.cause().unwrap();
    assert_eq!(cause.to_string(), "CAN controller error passive, or bus off (fault F)");
}

#[test]
fn the_two_drives_of_one_vendor_are_told_apart() {
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(SimulatedDrive::new(&siko_ag03_1::sim::MODEL, NODE));
    let other = NodeId::literal(6);
    bus.attach(SimulatedDrive::new(&MODEL, other));
    let error = Drive::connect_unprotected(bus.link(), NODE).unwrap_err();
    assert_eq!(error.to_string(), "the node is not a SIKO AG02: vendor 195h, profile 402, name \"AG03\"");
    let error = siko_ag03_1::driver::Drive::connect_unprotected(bus.link(), other).unwrap_err();
    assert_eq!(error.to_string(), "the node is not a SIKO AG03/1: vendor 195h, profile 402, no name");
}
