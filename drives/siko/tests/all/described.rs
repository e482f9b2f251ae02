//! A drive described at run time is driven by that description, whichever way it is connected.

use lexican_driver::description::Description;
use lexican_driver::sequence::Recovery;
use lexican_driver::{Drive, Error, Protection, Supervision, tokio as shell};
use lexican_runtime::host::VirtualBus;
use lexican_runtime::host::tokio::Network;
use lexican_runtime::{Duration, NodeId};
use siko_ag02::driver::AG02;
use siko_ag03_1::driver::AG03_1;
use siko_ag03_1::sim::{MODEL, SimulatedDrive};

const NODE: NodeId = NodeId::literal(5);
const RECOVERY: Recovery = Recovery::within(Duration::from_secs(1));
const SUPERVISION: Supervision = Supervision::within(Duration::from_secs(1));

/// How a drive is protected, or why it cannot be connected.
type Connected = Result<Protection, Error>;

/// An AG03/1.
fn bus() -> VirtualBus {
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(SimulatedDrive::new(&MODEL, NODE));
    bus
}

fn connect_in_each_way(description: &'static Description) -> [Connected; 4] {
    [
        Drive::connect_described(bus().link(), NODE, description).map(|drive| drive.protection()),
        Drive::connect_described_unprotected(bus().link(), NODE, description).map(|drive| drive.protection()),
        Drive::connect_described_and_recover(bus().link(), NODE, description, &RECOVERY)
            .map(|(drive, _)| drive.protection()),
        Drive::connect_described_protected(bus().link(), NODE, description, SUPERVISION)
            .map(|drive| drive.protection()),
    ]
}

async fn connect_to_a_network_in_each_way(description: &'static Description) -> [Connected; 4] {
    let network = || Network::spawn(bus().link()).unwrap();
    [
        shell::Drive::connect_described(network(), NODE, description).await.map(|drive| drive.protection()),
        shell::Drive::connect_described_unprotected(network(), NODE, description).await.map(|drive| drive.protection()),
        shell::Drive::connect_described_and_recover(network(), NODE, description, &RECOVERY)
            .await
            .map(|(drive, _)| drive.protection()),
        shell::Drive::connect_described_protected(network(), NODE, description, SUPERVISION)
            .await
            .map(|drive| drive.protection()),
    ]
}

#[tokio::test]
async fn each_way_to_connect_goes_by_the_description() {
    for connected in [connect_in_each_way(&AG03_1), connect_to_a_network_in_each_way(&AG03_1).await] {
        let [Ok(usual), Ok(unprotected), Ok(recovered), Ok(protected)] = connected else { panic!("{connected:?}") };
        assert_eq!(unprotected, Protection::None);
        assert!(matches!(protected, Protection::LifeGuarding { .. }), "{protected:?}");
        assert_eq!([usual, recovered], [protected; 2], "within a second, unless another time is named");
    }
    for connected in [connect_in_each_way(&AG02), connect_to_a_network_in_each_way(&AG02).await] {
        assert!(connected.iter().all(|it| matches!(it, Err(Error::NotThisDrive { .. }))), "{connected:?}");
    }
}
