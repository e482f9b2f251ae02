//! `lexican watch`, `lexican plot` and `lexican statistics` without a terminal.

use crate::common::{folder, lexican, lexican_in};
use serde_json::Value;

const DRIVE: &str = "sim:siko/ag03-1?node=5";

/// A log of node 5, an AG03/1: half a second of heartbeats and positions, then half a second of another node's
/// heartbeats.
const LOG: &str = "\
(0000000000.000000) can0 705#05
(0000000000.100000) can0 705#05
(0000000000.110000) can0 385#370200000000
(0000000000.200000) can0 705#05
(0000000000.210000) can0 385#370264000000
(0000000000.500000) can0 085#2031050000000000
(0000000001.000000) can0 706#05
";

#[test]
fn watch_prints_a_line_for_each_change() {
    let run = lexican(&["watch", "--bus", DRIVE, "--for", "1s", "6064", "modes of operation"]);
    run.on_stdout(0, "6060:00 Modes of Operation = profile position (1)\n");
    assert_eq!(run.stdout.lines().count(), 2, "nothing changes: {run}");
    let folder = folder("watch-log");
    std::fs::write(folder.join("bus.log"), LOG).unwrap();
    let log = ["watch", "--bus", "log:bus.log", "--node", "5", "--device", "siko/ag03-1", "--json", "6064"];
    let run = lexican_in(&folder, &log);
    let values: Vec<Value> = run.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let values: Vec<_> = values.iter().map(|line| (line["time"].as_f64(), line["value"].as_i64())).collect();
    assert_eq!(values, [(Some(0.0), Some(0)), (Some(0.1), Some(100))], "{run}");
    lexican(&["watch", "--bus", DRIVE, "no such object"]).on_stderr(2, "names no object");
}

#[test]
fn plot_writes_a_picture_and_a_table() {
    let folder = folder("plot-log");
    std::fs::write(folder.join("bus.log"), LOG).unwrap();
    let log = ["plot", "--bus", "log:bus.log", "--node", "5", "--device", "siko/ag03-1", "tpdo3"];
    let run = lexican_in(&folder, &[&log[..], &["--svg", "a.svg", "--csv", "a.csv"]].concat());
    run.on_stderr(0, "a.csv is written");
    let table = std::fs::read_to_string(folder.join("a.csv")).unwrap();
    assert!(table.starts_with("time_s,entry,name,value,unit,text\n"), "{table}");
    assert!(table.contains("0.100000,6064:00,Position Actual Value,100,increments,+100 increments\n"), "{table}");
    let picture = std::fs::read_to_string(folder.join("a.svg")).unwrap();
    assert!(picture.contains("[increments]") && picture.contains("Position Actual Value"), "{picture}");
    lexican_in(&folder, &log).on_stderr(2, "--svg FILE");
    let nothing = [&log[..], &["--svg", "b.svg", "--for", "0.05s"]].concat();
    lexican_in(&folder, &nothing).on_stderr(2, "no value has come");
}

#[test]
fn statistics_name_what_is_silent() {
    let folder = folder("statistics-log");
    std::fs::write(folder.join("bus.log"), LOG).unwrap();
    let run = lexican_in(&folder, &["statistics", "--bus", "log:bus.log", "--bit-rate", "125"]);
    run.on_stdout(1, "silent for 0.5 s; 3120h");
    run.on_stdout(1, "7 frames in 1.0 s: 7.0 per second");
    let run = lexican_in(&folder, &["statistics", "--bus", "log:bus.log", "--json"]);
    let report: Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!((&report["frames"], &report["nodes"][0]["silent_seconds"]), (&7.into(), &0.5.into()), "{run}");
    assert_eq!(report["ids"][2]["gaps"]["mean_ms"], 100.0, "{run}");
    lexican(&["statistics", "--bus", DRIVE, "--for", "1s"]).on_stdout(0, "load unknown: name the bit rate");
}
