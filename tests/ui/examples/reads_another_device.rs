// error: this object is not one of the node's device
// error: an object of `ui::od::Device`, and the node is a `ui::drive::Device`
// error: take the one of the dictionary that the node is bound to

use lexican_runtime::NodeId;
use lexican_runtime::host::{VirtualBus, blocking::Network};

fn main() {
    let mut network = Network::new(VirtualBus::new().link());
    let mut drive = network.node(NodeId::literal(5), ui::drive::DEVICE);
    let _ = drive.read(ui::od::RO_UNMAPPED);
}
