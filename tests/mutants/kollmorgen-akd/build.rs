//! Puts mutants into the driver and the simulator of the AKD.

#[path = "../mutator.rs"]
mod mutator;

use mutator::Sources;

static AKD: Sources = Sources {
    folder: "kollmorgen-akd/src",
    modules: &["ascii", "driver", "fault", "sim"],
    mutated: &["ascii", "driver", "fault", "sim"],
    constants: &[],
    prefix: "",
    // How many faults there are is counted when the program is compiled.
    others: &["count", "is", "kind", "NAMES"],
    spans: &[],
    before: "use shared::od;",
    data: true,
};

fn main() {
    AKD.mutate();
}
