//! Puts mutants into PROFIBUS-DP.

#[path = "../mutator.rs"]
mod mutator;

use mutator::Sources;

static PROFIBUS: Sources = Sources {
    folder: "../profibus/src",
    // `trouble` and `virtual_line` are not mutated.
    modules: &["bus", "dp", "fdl", "master", "pkw", "profidrive", "slave", "trouble", "virtual_bus", "virtual_line"],
    mutated: &[
        "bus",
        "dp",
        "fdl",
        "master",
        "pkw",
        "pkw/master",
        "pkw/server",
        "pkw/typed",
        "profidrive",
        "slave",
        "virtual_bus",
    ],
    constants: &[],
    prefix: "",
    others: &[
        "bus keep",
        "profidrive len",
        "profidrive begin",
        "profidrive ppo",
        "profidrive lengths",
        "pkw/typed of",
        "pkw/master new",
        "pkw/server new",
    ],
    spans: &[],
    before: "",
    data: false,
};

fn main() {
    PROFIBUS.mutate();
}
