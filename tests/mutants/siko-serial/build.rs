//! Puts mutants into the AG02's serial port.

#[path = "../mutator.rs"]
mod mutator;

use mutator::Sources;

static SERIAL: Sources = Sources {
    folder: "siko-serial/src",
    modules: &["answer", "client", "command", "error", "gateway", "line", "parameter", "sim", "telegram"],
    mutated: &[
        "answer",
        "client",
        "command",
        "error",
        "gateway",
        "gateway/objects",
        "parameter",
        "sim",
        "sim/line",
        "telegram",
    ],
    constants: &["../../siko/src/words"],
    prefix: "",
    others: &["parameter object"],
    spans: &[],
    before: "use client::{Client, Settings}; use line::{Line, Port};",
    data: false,
};

fn main() {
    SERIAL.mutate();
}
