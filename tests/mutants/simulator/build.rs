//! Puts mutants into the sources of SIKO's simulated drives, and of the gateway to them.

#[path = "../mutator.rs"]
mod mutator;

use mutator::Sources;

/// Not mutated: `eeprom`, `follow` and `script`, which are about texts and are tested beside their sources, and `model` and
/// `setup`, which are data that the verification reads.
static SIKO: Sources = Sources {
    folder: "siko/src",
    modules: &["state", "model", "frames", "sim", "gateway"],
    mutated: &[
        "gateway",
        "gateway/face",
        "gateway/link",
        "gateway/node",
        "gateway/objects",
        "state",
        "frames",
        "sim/controller",
        "sim/drive",
        "sim/inputs",
        "sim/leds",
        "sim/motion",
        "sim/node",
        "sim/objects",
        "sim/parameters",
        "sim/power",
        "sim/status",
        "sim/switches",
        "sim/watch",
    ],
    constants: &["fault", "words"],
    prefix: "sim/",
    others: &["by", "fault", "bit", "force", "clear", "with", "without", "default", "at_rest", "save", "next_save"],
    spans: &["OVERCURRENT_FOR", "BLOCKED_FOR", "span"],
    before: "use shared::{fault, order, words};",
    data: false,
};

fn main() {
    SIKO.mutate();
}
