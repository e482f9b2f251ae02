//! Findings about a `bus.yml`: what dcfgen and cogen drop, override or reorder silently, and what cannot be read.

use lexican_eds::Source;
use lexican_machine::{BusYml, Files, Machine};

use crate::joints::sheet;

/// The machine of a `bus.yml`, and the findings, one on each line.
fn read(text: &str) -> (String, Vec<String>) {
    let sheet = sheet();
    let files = Files::Embedded(&[("joint.eds", &sheet)]);
    let read = BusYml::read(Source::new("bus.yml", text), files, &str::to_owned);
    let line = |finding: &lexican_eds::Diagnostic| {
        let help = finding.help.as_ref().map(|help| format!(" | {help}")).unwrap_or_default();
        format!("{}{help}", finding.render_short(&read.input).replacen("bus.yml:", "", 1))
    };
    let findings: Vec<_> = read.findings.iter().map(line).collect();
    let text = read.draft.text();
    let machine = Machine::parse(Source::new("machine.toml", text.as_str()), files);
    if !read.findings.has_errors() && text.contains("[node.") {
        assert!(!machine.findings.has_errors(), "{text}{}", machine.findings.render(&machine.input));
    }
    (text, findings)
}

/// Checks some lines of a slave for a part of their only finding, and for a part of the machine.
#[track_caller]
fn slave(lines: &str, wanted: &str, machine: &str) {
    let (text, found) = read(&format!("master: {{node_id: 1}}\na:\n  node_id: 3\n  dcf: joint.eds\n{lines}"));
    match wanted {
        "" => assert!(found.is_empty(), "{lines}\n{found:#?}"),
        _ => assert!(found.len() == 1 && found[0].contains(wanted), "{lines}\nwanted {wanted}\nfound {found:#?}"),
    }
    assert!(text.contains(machine), "{lines}\nwanted {machine}\nfound {text}");
}

#[test]
fn a_slave_is_a_node() {
    slave("", "", "[node.a]\nid = 3\nsheet = \"joint.eds\"\noptional = true\n");
    slave("  mandatory: yes\n  serial_number: 010", "", "identity = { serial = 0x8 }\n");
    slave("  boot: false\n  reset_communication: off", "", "boots-again = false\nkeep-alive = true\n");
    let pdo = "  tpdo: {1: {cob_id: 0x1A6, transmission: 2, mapping: [{index: 0x6041}]}}";
    slave(pdo, "", "tpdo.1 = { map = [\"Statusword\"], cob-id = 0x1A6, transmission = \"sync 2\" }\n");
    slave(
        "  tpdo: {1: {transmission: 2, event_timer: 20}}",
        "the data sheet has no 1800:05, which dcfgen does not write",
        "",
    );
}

#[test]
fn what_the_tools_do_without_a_word_is_said() {
    slave("  hartbeat_producer: 10", "5:3: warning[bus-yml::key]: unknown key `hartbeat_producer`, which dcfgen", "");
    slave("  heartbeat_producer: 10\n  heartbeat_producer: 20", "comes again below", "heartbeat = \"20 ms\"");
    let pdo = "  tpdo: {1: {cob_id: 0x80000183, mapping: [{index: 0x6041}]}}";
    slave(pdo, "drops the rest of this without a word, and so does the machine | cob_id: auto", "tpdo.1 = \"off\"");
    slave("  tpdo: {1: {event_deadline: 10}}", "it is how long the master waits", "");
    slave("  tpdo: {1: {mapping: [{index: 0x1017}]}}", "PDOMapping=0; dcfgen writes it all the same", "");
    slave("  tpdo: {9: {}}", "no such PDO as tpdo 9: dcfgen stops here", "");
    slave("  rpdo: {1: {sync_start: 3}}", "`sync_start` is left out", "");
    slave("  software_version: 3", "`software_version` is left out: `lexican flash` writes it", "");
    slave("  sdo: [{index: 0x6081, value: 1.5}]", "dcfgen writes 1 for this", "\"Profile velocity\" = 1\n");
    let twice = "  sdo: [{index: 0x6081, value: 1}, {index: 0x6081, value: 2}]";
    slave(twice, "6081:00 is written twice: the last value is kept", "\"Profile velocity\" = 2\n");
    let order = "  sdo: [{index: 0x60C2, sub_index: 1, value: 1}, {index: 0x6081, value: 2}]";
    slave(order, "dcfgen writes these in their order, a boot by their indices", "");
    slave("  sdo: [{index: 0x6082, value: 1}]", "the data sheet has no 6082:00, which dcfgen", "");
    slave("  sdo: [{index: 0x60C2, sub_index: 1, value: 300}]", "300 is no UNSIGNED8, which 60C2:01 has", "");
    slave("  heartbeat_producer: x", "\"x\" is no number that `heartbeat_producer` can be", "");
}

#[test]
fn a_file_is_read_as_its_tool_does() {
    let one = |text: &str, wanted: &str| {
        let (_, found) = read(text);
        assert!(found.len() == 1 && found[0].contains(wanted), "{text}\nwanted {wanted}\nfound {found:#?}");
    };
    one("", "this is no bus.yml");
    one("a: [", "error[bus-yml::syntax]: ");
    one("a: *b", "error[bus-yml::syntax]: ");
    one("master: {}\na: {node_id: 3}", "2:1: error[bus-yml::sheet]: a has no `dcf`");
    one("master: {}\na: {dcf: joint.eds}", "a has no node-ID: dcfgen leaves it out");
    one("a: {node_id: 3, dcf: joint.eds}", "there is no `master`: dcfgen stops here");
    one("master: {}\nnodes: [a, b]", "nodes are no list | its documentation draws a list");
    one("master: {sync_period: 500}", "`sync_period` is left out: a machine has whole milliseconds");
    let node = "{node_id: 3, dcf: joint.eds}";
    one(&format!("master: {{heartbeat_producer: 100}}\na: {node}"), "0 of 1 nodes watch it; in a machine");
    let cogen = "master: {}\ndefaults: {heartbeat_producer: 10}\nnodes:\n  a: {node_id: 3, dcf: joint.eds, heartbeat_producer: 20}";
    one(cogen, "cogen takes `heartbeat_producer` of `defaults` and drops this");
    one(&format!("master: {{}}\nnodes:\n  b: {node}\n  a: {{node_id: 4, dcf: joint.eds}}"), "cogen sorts the nodes");
    let (text, found) =
        read("master: {}\n.base: &base {dcf: joint.eds, heartbeat_producer: 10}\na.b:\n  <<: *base\n  node_id: 3");
    assert!(found.len() == 1 && found[0].contains("\"a.b\" cannot be the name of a node"), "{found:#?}");
    assert!(
        text.contains("[node.a-b]\nid = 3\nsheet = \"joint.eds\"\noptional = true\nheartbeat = \"10 ms\"\n"),
        "{text}"
    );
}
