//! The tests of machines.

mod bus_yml;
#[path = "../../../toolbox/tests/all/cantools.rs"]
mod cantools;
mod cpj;
mod exports;
mod files;
mod findings;
#[cfg(feature = "codegen")]
mod generate;
mod joints;
mod plans;
mod shells;

use lexican_eds::Source;
use lexican_machine::{Files, Machine};

/// A machine.
fn machine(text: &str) -> Machine {
    Machine::parse(Source::new("machine.toml", text), Files::Embedded(&[]))
}

/// A machine without findings.
#[track_caller]
fn sound(text: &str) -> Machine {
    let machine = machine(text);
    let findings = machine.findings.render(&machine.input);
    assert!(findings.is_empty(), "{findings}");
    machine
}

/// The writes to a node, one on each line: `1017:00 E803 error control`.
fn writes(machine: &Machine, node: &str) -> Vec<String> {
    let node = machine.node(node).unwrap();
    let line = |write: lexican_machine::Write| {
        let data: String = write.data.iter().map(|byte| format!("{byte:02X}")).collect();
        let default = if write.is_default { " (default)" } else { "" };
        format!("{} {data} {}{default}", write.address, write.why.name())
    };
    machine.writes(node).into_iter().map(line).collect()
}
