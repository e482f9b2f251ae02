//! Puts mutants into the sources of one of the drives' crates; the package that is built decides which crate.

mod mutator;

use mutator::Sources;

/// What most of the crates have in common.
const PLAIN: Sources = Sources {
    folder: "",
    modules: &[],
    unmutated: &[],
    constants: &[],
    prefix: "",
    others: &[],
    spans: &[],
    exports: "",
    data: false,
};

static CRATES: [(&str, Sources); 5] = [
    (
        "lexican-mutated-siko",
        Sources {
            folder: "siko/src",
            modules: &["state", "model", "frames", "sim", "gateway"],
            // Code about texts, which is tested beside its source; and data that the verification reads.
            unmutated: &[
                "model",
                "sim",
                "sim/address",
                "sim/doors",
                "sim/eeprom",
                "sim/follow",
                "sim/require",
                "sim/script",
                "sim/script/toml",
                "sim/setup",
            ],
            constants: &["fault", "words"],
            prefix: "sim/",
            others: &[
                "by",
                "fault",
                "bit",
                "force",
                "clear",
                "with",
                "without",
                "default",
                "at_rest",
                "save",
                "next_save",
            ],
            spans: &["OVERCURRENT_FOR", "BLOCKED_FOR", "span"],
            exports: "pub use shared::{assert_describes, description, fault, faults, order, words, worked_examples};",
            ..PLAIN
        },
    ),
    (
        "lexican-mutated-kollmorgen-akd",
        Sources {
            folder: "kollmorgen-akd/src",
            modules: &["ascii", "driver", "fault", "sim"],
            // The number of faults is counted when the program is compiled.
            others: &["count", "is", "kind", "NAMES"],
            exports: "pub use shared::od;",
            data: true,
            ..PLAIN
        },
    ),
    (
        "lexican-mutated-profibus",
        Sources {
            folder: "../profibus/src",
            modules: &[
                "bus",
                "dp",
                "fdl",
                "master",
                "pkw",
                "profidrive",
                "slave",
                "trouble",
                "virtual_bus",
                "virtual_line",
            ],
            unmutated: &["trouble", "virtual_line"],
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
            exports: "pub use self::{slave::{Application, BitRate, Identity, Slave, State}, trouble::Trouble};",
            ..PLAIN
        },
    ),
    (
        "lexican-mutated-siko-serial",
        Sources {
            folder: "siko-serial/src",
            modules: &["answer", "client", "command", "error", "gateway", "line", "parameter", "sim", "telegram"],
            unmutated: &["line"],
            constants: &["../../siko/src/words"],
            others: &["parameter object"],
            exports: "pub use self::{client::{Client, Settings}, line::{Line, Port}};",
            ..PLAIN
        },
    ),
    (
        "lexican-mutated-siko-profibus",
        Sources {
            folder: "siko-profibus/src",
            modules: &["bus", "drive", "gateway", "line", "master", "model", "table", "words"],
            unmutated: &["words"],
            constants: &["../../siko/src/words", "../../../profibus/src/profidrive", "words"],
            others: &["model identity", "table new", "table rows"],
            exports: "pub use self::{drive::ProfibusDrive, model::{AG02, AG03_1, Model, PPO}};",
            ..PLAIN
        },
    ),
];

fn main() {
    let package = std::env::var("CARGO_PKG_NAME").unwrap();
    let known = CRATES.iter().find(|(name, _)| *name == package);
    known.unwrap_or_else(|| panic!("no sources of {package}")).1.mutate();
}
