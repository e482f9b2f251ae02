// error: no method named `fedder`
// error: there is a method `feeder` with a similar name

use lexican_runtime::host::{VirtualBus, blocking::Network};
use ui::machine::{Machine as _, feeder};

fn main() {
    let mut machine = Network::new(VirtualBus::new().link());
    let _ = machine.fedder().read(feeder::STATUSWORD);
}
