//! Puts mutants into SIKO's drives on PROFIBUS-DP.

#[path = "../mutator.rs"]
mod mutator;

use mutator::Sources;

static SIKO: Sources = Sources {
    folder: "siko-profibus/src",
    modules: &["bus", "drive", "gateway", "line", "master", "model", "table", "words"],
    mutated: &["bus", "drive", "gateway", "line", "master", "model", "table"],
    constants: &["../../siko/src/words", "../../../profibus/src/profidrive", "words"],
    prefix: "",
    others: &["model identity", "table new", "table rows"],
    spans: &[],
    before: "",
    data: false,
};

fn main() {
    SIKO.mutate();
}
