// error: this object is not one of the node's device

use lexican_runtime::host::{VirtualBus, blocking::Network};
use ui::machine::{Machine as _, feeder};

fn main() {
    let mut machine = Network::new(VirtualBus::new().link());
    let _ = machine.io().read(feeder::STATUSWORD);
}
