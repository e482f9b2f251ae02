//! The tokio drivers over PROFIBUS.

use lexican_profibus::bus::Bus;
use lexican_profibus::virtual_bus::VirtualBus;
use lexican_runtime::host::tokio::Network;
use lexican_runtime::{Duration, NodeId, host};
use siko_ag02::driver::{Error, Mode, Outcome};
use siko_ag02::sim::SimulatedDrive;
use siko_profibus::{AG02, AG03_1, bus, line};

/// Both drives on one PROFIBUS, and one on CAN, travel at once on one network.
#[tokio::test]
async fn drives_behind_two_doors_travel_at_once() {
    let [five, six, seven] = [5, 6, 7].map(NodeId::literal);
    let mut segment = VirtualBus::new();
    bus::attach_unknown(&mut segment, &AG02, five.get());
    bus::attach_unknown(&mut segment, &AG03_1, six.get());
    let segment = Bus::new(segment);
    let can = host::VirtualBus::with_bit_rate(500);
    can.attach(line::node(&segment, &AG02, five).unwrap());
    can.attach(line::node(&segment, &AG03_1, six).unwrap());
    can.attach(SimulatedDrive::new(AG02.drive, seven));
    let network = Network::spawn(can.link()).unwrap();
    let ag02 = async |node| {
        let mut drive = siko_ag02::driver::tokio::Drive::connect_unprotected(network.clone(), node).await?;
        drive.enable().await?;
        let outcome = drive.move_to(1000).await?;
        drive.disable().await?;
        Ok::<_, Error>(outcome)
    };
    let ag03_1 = async {
        let mut drive = siko_ag03_1::driver::tokio::Drive::connect_unprotected(network.clone(), six).await?;
        drive.set_mode(Mode::Velocity).await?;
        drive.enable().await?;
        drive.run_at(30).await?;
        drive.pass(Duration::from_secs(1)).await?;
        drive.stop().await?;
        drive.set_mode(Mode::Positioning).await?;
        drive.move_to(1100).await
    };
    let (one, other, third) = tokio::join!(ag02(five), ag03_1, ag02(seven));
    assert_eq!(one.unwrap(), Outcome::Reached { position: 1000 });
    assert_eq!(other.unwrap(), Outcome::Reached { position: 1100 });
    assert_eq!(third.unwrap(), Outcome::Reached { position: 1000 });
}

#[tokio::test]
async fn a_drive_travels_on_a_link_of_its_own() {
    let node = NodeId::literal(5);
    let mut segment = VirtualBus::new();
    let id = bus::attach_unknown(&mut segment, &AG02, node.get());
    let segment = Bus::new(segment);
    let network = Network::spawn(line::link(&segment, &AG02, node).unwrap()).unwrap();
    let mut drive = siko_ag02::driver::tokio::Drive::connect_unprotected(network, node).await.unwrap();
    drive.enable().await.unwrap();
    drive.start_moving_to(5000).await.unwrap();
    drive.interrupt().await.unwrap();
    drive.resume().await.unwrap();
    assert_eq!(drive.finish().await.unwrap(), Outcome::Reached { position: 5000 });
    segment.with(|line| line.set_connected(id, false));
    let error = drive.move_to(0).await.unwrap_err();
    assert!(matches!(error.into_cause(), Error::Sdo(_)));
}
