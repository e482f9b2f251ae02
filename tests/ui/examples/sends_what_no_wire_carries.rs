// error: has no field named `target_position`
// error: all struct fields are already assigned

use lexican_runtime::host::{VirtualBus, blocking::Network};
use lexican_runtime::manager::MachinePdo as _;
use ui::machine::{Machine as _, feeder};

fn main() {
    let mut machine = Network::new(VirtualBus::new().link());
    let pdo = feeder::Rpdo1 { controlword: feeder::Controlword(6), target_position: feeder::Position(1) };
    let _ = machine.feeder().network().send(&pdo.to_frame());
}
