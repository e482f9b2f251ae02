// error: the EDS does not allow writing this object
// error: access = "rw"

use lexican_runtime::host::{VirtualBus, blocking::Network};
use ui::machine::{Machine as _, feeder};

fn main() {
    let mut machine = Network::new(VirtualBus::new().link());
    let _ = machine.feeder().write(feeder::STATUSWORD, feeder::Statusword(0));
}
