//! What the interface has and lacks, and what it costs.

use lexican_runtime::object::{Address, Object, Rw};
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::{AbortCode, Duration, NodeId};
use siko_ag02::driver::{Capability, Drive, Error, Outcome, Supervision};
use siko_ag02::od;
use siko_ag02::sim::inputs::Inputs;
use siko_serial::Settings;
use siko_serial::gateway::{self, NODE};
use siko_serial::sim::{SerialDrive, VirtualLine};

use super::rig::Rig;

#[test]
fn an_object_that_the_interface_lacks_is_aborted_before_anything_is_sent() {
    for (index, sub) in [(0x100C, 0), (0x1016, 0), (0x1010, 1), (0x2420, 0), (0x2410, 7)] {
        let mut rig = Rig::new();
        rig.pass(500);
        rig.set_fate(|_, byte| Some(byte));
        match rig.drive.read(Object::<u16, Rw>::new(index, sub)) {
            Err(Error::Sdo(SdoError::Aborted { address, code, .. })) => {
                assert_eq!(address, Address::new(index, sub));
                assert!(matches!(code, AbortCode::NO_SUCH_OBJECT | AbortCode::NO_SUCH_SUB_INDEX), "{code}");
            }
            other => panic!("{index:04X}: {other:?}"),
        }
        assert!(rig.node.lock().unwrap().line().0.bytes() <= 20, "the status is read, and nothing else");
    }
}

#[test]
fn protection_is_unsupported() {
    let settings = Settings::default();
    let link = gateway::link(VirtualLine::new(SerialDrive::default()), settings, NODE);
    let supervision = Supervision { within: Duration::from_secs(1), manager: NodeId::literal(1) };
    match Drive::connect_protected(link, NODE, supervision) {
        Err(Error::Unsupported { what: Capability::Protection, .. }) => {}
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_another_program_has_left_holding_is_released_when_the_node_becomes_operational() {
    let mut rig = Rig::new();
    rig.drive.enable().unwrap();
    rig.drive.move_to(1000).unwrap();
    let line = rig.node.lock().unwrap().line().0.line.clone();
    let mut drive =
        Drive::connect_unprotected(gateway::link(line, Settings { baud: 19_200, ..Settings::default() }, NODE), NODE)
            .unwrap();
    drive.enable().unwrap();
    assert_eq!(drive.move_to(2000).unwrap(), Outcome::Reached { position: 2000 });
}

#[test]
fn a_link_that_is_dropped_has_stopped_the_drive() {
    let mut rig = Rig::new();
    rig.drive.enable().unwrap();
    rig.drive.start_moving_to(20_000).unwrap();
    rig.pass(1000);
    let Rig { node, drive, bus } = rig;
    drop(drive);
    bus.advance(Duration::from_secs(3));
    assert_eq!(node.lock().unwrap().line().0.line.drive().drive().velocity(bus.now()), 0);
}

#[test]
fn the_enable_input_takes_the_torque_away_and_gives_it_back() {
    let mut rig = Rig::new();
    rig.drive.enable().unwrap();
    rig.drive.move_to(1000).unwrap();
    rig.world(|inputs: &mut Inputs| inputs.enable = false);
    rig.pass(500);
    rig.world(|inputs: &mut Inputs| inputs.enable = true);
    rig.pass(500);
    assert_eq!(rig.drive.move_to(2000).unwrap(), Outcome::Reached { position: 2000 });
}

#[test]
fn the_set_point_is_kept_by_the_drive() {
    let mut rig = Rig::new();
    rig.drive.write(od::TARGET_POSITION, od::Position(1234)).unwrap();
    assert_eq!(rig.drive.read(od::TARGET_POSITION).unwrap(), od::Position(1234));
    // The gateway keeps the target of the other mode.
    rig.drive.write(od::TARGET_VELOCITY, od::Velocity(30)).unwrap();
    assert_eq!(rig.drive.read(od::TARGET_VELOCITY).unwrap(), od::Velocity(30));
    assert_eq!(rig.drive.read(od::TARGET_POSITION).unwrap(), od::Position(1234));
}
