//! What `lexican monitor` prints and what it leaves out.

use crate::common::{Run, folder, lexican, lexican_in};

/// Monitors a log of these frames, 1 ms apart, with the AG03/1 as node 5.
fn monitor(name: &str, frames: &str, more: &[&str]) -> Run {
    let folder = folder(name);
    let lines = frames.split_ascii_whitespace().enumerate();
    let lines: String = lines.map(|(ms, frame)| format!("(0000000000.{ms:03}000) can0 {frame}\n")).collect();
    std::fs::write(folder.join("bus.log"), lines).unwrap();
    lexican_in(&folder, &[&["monitor", "--bus", "log:bus.log", "--device", "5=siko/ag03-1"], more].concat())
}

/// The texts of the lines, without time, identifier and data.
#[track_caller]
fn check(run: &Run, lines: &[&str]) {
    assert_eq!(run.code, Some(0), "{run}");
    let printed: Vec<_> = run.stdout.lines().collect();
    assert_eq!(printed.len(), lines.len(), "{run}");
    for (printed, text) in printed.iter().zip(lines) {
        assert!(printed.contains(text), "no {text:?} in {printed:?}: {run}");
    }
}

const BUS: &str = "080# 705#05 385#370200000000 605#4064600000000000 585#4364600000000000 080# 705#05 385#370205000000 \
                   605#40FF2F0000000000 585#80FF2F0000000206 706#05";

#[test]
fn options_choose_the_frames() {
    check(&monitor("monitor-node", BUS, &["--node", "6,7"]), &["OPERATIONAL"]);
    check(&monitor("monitor-id", BUS, &["--cob-id", "700-77F"]), &["node 5", "node 5", "node 6"]);
    check(&monitor("monitor-service", BUS, &["--service", "sync,pdo"]), &["SYNC", "TPDO3", "SYNC", "TPDO3"]);
    check(&monitor("monitor-without", BUS, &["--without", "sync,pdo,heartbeat", "--text", "abort"]), &["abort 2FFF"]);
    check(
        &monitor("monitor-object", BUS, &["--object", "position actual value", "--without", "pdo"]),
        &["read 6064:00", "= 0 increments"],
    );
    check(&monitor("monitor-count", BUS, &["--service", "heartbeat", "--count", "2"]), &["OPERATIONAL", "OPERATIONAL"]);
    monitor("monitor-word", BUS, &["--service", "pdos"]).on_stderr(2, "nmt, sync, time, emcy, pdo");
    monitor("monitor-range", BUS, &["--cob-id", "1FF-180"]).on_stderr(2, "names no identifiers");
}

#[test]
fn a_transfer_is_one_line_with_its_duration() {
    check(
        &monitor("monitor-transfers", BUS, &["--transfers", "--service", "sdo"]),
        &[
            "read 6064:00 Position Actual Value = 0 increments (1.0 ms)",
            "read 2FFF:00: the device aborts: 0602 0000: object does not exist in the object dictionary (1.0 ms)",
        ],
    );
    let run = monitor("monitor-transfers-json", BUS, &["--transfers", "--node", "5", "--text", "abort", "--json"]);
    let line: serde_json::Value = serde_json::from_str(run.stdout.trim()).unwrap();
    assert_eq!((&line["transfer"]["abort_code"], &line["alarming"]), (&"06020000".into(), &true.into()), "{run}");
    // A request at the end of the log has no answer.
    check(&monitor("monitor-unanswered", "605#4064600000000000", &["--transfers"]), &["no answer"]);
}

#[test]
fn only_what_differs_is_printed() {
    check(
        &monitor("monitor-changes", BUS, &["--changes", "--service", "pdo,heartbeat,sync"]),
        &[
            "SYNC",
            "OPERATIONAL",
            "Statusword = OPERATION ENABLED",
            "  Position Actual Value = +5 increments",
            // Of another node.
            "node 6",
        ],
    );
}

#[test]
fn the_mapping_is_that_of_the_device() {
    // The answers of node 5 show that TPDO3 has another mapping.
    let mapping = "605#40021A0000000000 585#4F021A0001000000 605#40021A0100000000 585#43021A0110004160 385#3702";
    check(&monitor("monitor-mapping", mapping, &["--service", "pdo"]), &["Statusword = OPERATION ENABLED"]);
    let run =
        lexican(&["monitor", "--bus", "sim:siko/ag03-1?node=5", "--read-mapping", "--for", "3s", "--service", "sdo"]);
    run.on_stdout(0, "read 1A02:01");
    let run = monitor("monitor-log", BUS, &["--read-mapping"]);
    run.on_stderr(2, "a log takes no frames");
}
