//! What is allowed: the control for all the others.

use lexican_runtime::NodeId;
use lexican_runtime::host::{VirtualBus, blocking::Network};
use lexican_runtime::manager::MachinePdo as _;
use lexican_runtime::object::{Object, Ro};
use ui::machine::{Machine as _, feeder};

fn main() {
    let sum = ui::read(ui::od::RO_UNMAPPED) + ui::read(ui::od::RW_UNMAPPED) + ui::read(ui::od::CONST_UNMAPPED);
    ui::write(ui::od::RW_UNMAPPED, sum);
    ui::write(ui::od::WO_UNMAPPED, sum);
    ui::map_tpdo(ui::od::RO_MAPPABLE);
    ui::map_rpdo(ui::od::WO_MAPPABLE);
    ui::map_tpdo(ui::od::RW_MAPPABLE);
    ui::map_rpdo(ui::od::RW_MAPPABLE);
    ui::map_tpdo(ui::od::RWR_MAPPABLE);
    ui::map_rpdo(ui::od::RWW_MAPPABLE);
    // A position is the same type through every door.
    let position: Option<ui::doors::Position> = ui::read_serial(ui::doors::serial::UPPER_LIMIT);
    ui::write(ui::doors::LIMITS.upper(), position.unwrap_or_default());
    ui::write_serial(ui::doors::serial::UPPER_LIMIT, ui::read(ui::doors::TARGET_POSITION));
    ui::write(ui::drive::OPERATING_MODE, ui::drive::OperatingMode::POSITION);
    // The nodes of a machine.
    let mut machine = Network::new(VirtualBus::new().link());
    let _ = machine.feeder().write(feeder::CONTROLWORD, feeder::Controlword(6));
    let _ = machine.send(&feeder::Rpdo1 { controlword: feeder::Controlword(6) }.to_frame());
    // Handles that are written by hand fit every node, and values of one device fit another one.
    let mut network = Network::new(VirtualBus::new().link());
    let by_hand = Object::<u8, Ro>::new(0x1001, 0);
    let _ = network.node(NodeId::literal(5), ui::drive::DEVICE).read(by_hand);
    if let Ok(mode) = network.node(NodeId::literal(5), ui::drive::DEVICE).read(ui::drive::OPERATING_MODE) {
        let _ = network.node(NodeId::literal(6), ui::drive::DEVICE).write(ui::drive::OPERATING_MODE, mode);
    }
}
