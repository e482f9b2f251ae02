//! The tokio driver through the serial port.

use lexican_runtime::NodeId;
use lexican_runtime::host::VirtualBus;
use lexican_runtime::host::tokio::Network;
use siko_ag02::driver::tokio::Drive;
use siko_ag02::driver::{Error, Outcome};
use siko_ag02::sim::{MODEL, SimulatedDrive};
use siko_serial::Settings;
use siko_serial::gateway::{self, NODE};
use siko_serial::sim::{SerialDrive, VirtualLine};

async fn travels(network: Network, node: NodeId) -> Result<Outcome, Error> {
    let mut drive = Drive::connect_unprotected(network, node).await?;
    drive.enable().await?;
    drive.start_moving_to(5000).await?;
    drive.interrupt().await?;
    drive.resume().await?;
    let outcome = drive.finish().await?;
    drive.disable().await?;
    Ok(outcome)
}

#[tokio::test]
async fn a_drive_travels_on_a_link_of_its_own() {
    let line = VirtualLine::new(SerialDrive::default());
    let network = Network::spawn(gateway::link(line, Settings::default(), NODE)).unwrap();
    assert_eq!(travels(network, NODE).await.unwrap(), Outcome::Reached { position: 5000 });
}

/// A drive at a serial port and one on CAN travel at once on one network.
#[tokio::test]
async fn drives_behind_two_doors_travel_at_once() {
    let can = VirtualBus::with_bit_rate(500);
    can.attach(gateway::node(VirtualLine::new(SerialDrive::default()), Settings::default(), NODE));
    let other = NodeId::literal(7);
    can.attach(SimulatedDrive::new(&MODEL, other));
    let network = Network::spawn(can.link()).unwrap();
    let (serial, on_can) = tokio::join!(travels(network.clone(), NODE), travels(network, other));
    assert_eq!(serial.unwrap(), Outcome::Reached { position: 5000 });
    assert_eq!(on_can.unwrap(), Outcome::Reached { position: 5000 });
}
