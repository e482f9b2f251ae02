//! Commands on a bus: a simulated drive, and a log.

use crate::common::{folder, lexican, lexican_in};

const DRIVE: &str = "sim:siko/ag03-1?node=5";

/// Runs the command and compares the exit code and a part of its output.
#[track_caller]
fn check(args: &[&str], code: i32, words: &str) {
    let run = lexican(args);
    if code == 0 { run.on_stdout(code, words) } else { run.on_stderr(code, words) }
}

#[test]
fn objects_are_read_by_address_and_by_name_with_their_unit() {
    check(&["read", "--bus", DRIVE, "6064"], 0, "6064:00 Position Actual Value = 0 increments\n");
    check(&["read", "--bus", DRIVE, "Modes of Operation"], 0, "6060:00 Modes of Operation = profile position (1)\n");
    check(&["read", "--bus", DRIVE, "241B:01"], 0, " = 24.0 V\n");
    check(&["read", "--bus", DRIVE, "statusword"], 0, "SWITCH ON DISABLED + voltage enabled");
    check(&["read", "--bus", DRIVE, "--json", "1018:01"], 0, "\"value\":405");
    check(&["read", "--bus", DRIVE, "2FFF"], 1, "object does not exist");
    let refused = lexican(&["read", "--bus", DRIVE, "--json", "2FFF", "6064"]);
    assert_eq!(refused.code, Some(1));
    assert!(refused.stdout.contains("\"abort_code\":\"06020000\"") && refused.stdout.contains("\"6064:00\""));
    check(&["read", "--bus", DRIVE, "positon actual value"], 2, "did you mean 6064:00 Position Actual Value");
    check(&["read", "--bus", DRIVE, "--node", "7", "6064"], 2, "lexican scan");
}

#[test]
fn objects_are_written_by_name_and_unit() {
    check(&["write", "--bus", DRIVE, "6060", "profile velocity"], 0, "= profile velocity (2)");
    check(&["write", "--bus", DRIVE, "2412", "2.5 mm"], 0, "Spindle Pitch = 2.50 mm");
    check(&["write", "--bus", DRIVE, "2412", "raw:250"], 0, "Spindle Pitch = 2.50 mm");
    check(&["write", "--bus", DRIVE, "--type", "UNSIGNED8", "6060", "2"], 0, "6060:00");
    check(&["write", "--bus", DRIVE, "--json", "6060", "2"], 0, "\"text\":\"profile velocity (2)\"");
    check(&["write", "--bus", DRIVE, "607A", "-5000"], 0, "= -5000 increments");
    check(&["write", "--bus", DRIVE, "2412", "250"], 2, "raw:250");
    check(&["write", "--bus", DRIVE, "6060", "homing"], 2, "profile position, profile velocity");
    check(&["write", "--bus", DRIVE, "6060", "300"], 2, "300 is no UNSIGNED8");
    check(&["write", "--bus", DRIVE, "2FFF", "1"], 2, "the data sheet has no 2FFF:00");
    check(&["write", "--bus", DRIVE, "1018:01", "1"], 1, "1018:01 Identity Object, Vendor ID: the data sheet says ro");
    const ABORTS: &str = "1018:01 Identity Object, Vendor ID: the device aborts: 0601";
    check(&["write", "--bus", DRIVE, "--force", "1018:01", "1"], 1, ABORTS);
    check(&["write", "--bus", DRIVE, "6060", "9"], 1, "allows profile position (1) to profile velocity (2)");
}

/// The AG02 writes only by 23h, and has the first character of its version in the highest byte.
#[test]
fn the_overlay_says_how_the_ag02_is_written_and_read() {
    const AG02: &str = "sim:siko/ag02?node=5";
    check(
        &["write", "--bus", AG02, "6060", "profile velocity"],
        0,
        "6060:00 Modes of Operation = profile velocity (2)",
    );
    check(&["write", "--bus", AG02, "2412", "2.5 mm"], 0, "2412:00 Spindle Pitch = 2.50 mm");
    check(
        &["write", "--bus", AG02, "--device", "none", "--type", "UNSIGNED8", "6060", "2"],
        1,
        "aborts: 0601 0000: unsupported",
    );
    check(&["read", "--bus", AG02, "100A"], 0, "(322E3030h \"2.00\")");
    check(&["check", "--bus", AG02, "--write"], 0, "");
}

#[test]
fn a_scan_finds_and_recognises_the_drive() {
    check(&["scan", "--bus", DRIVE], 0, "node   5  siko/ag03-1, CiA 402");
    check(&["scan", "--bus", DRIVE, "--json"], 0, "\"device\":\"siko/ag03-1\"");
    check(&["nmt", "--bus", DRIVE, "start", "--node", "5"], 0, "node 5: enter OPERATIONAL");
    check(&["nmt", "--bus", DRIVE, "reset-node", "--all"], 0, "all nodes: reset node");
    check(&["nmt", "--bus", DRIVE, "stop", "--node", "5", "--json"], 0, "\"node\":5");
    check(&["nmt", "--bus", DRIVE, "start", "--node", "5", "--wait", "2s"], 0, "node 5: OPERATIONAL\n");
    check(&["nmt", "--bus", DRIVE, "reset-node", "--all", "--wait", "2s"], 0, "node 5: has booted\n");
    check(&["nmt", "--bus", DRIVE, "start", "--node", "6", "--wait", "2s"], 1, "nothing was heard of node 6");
    let states = lexican(&["nmt", "--bus", DRIVE, "start", "--all", "--wait", "2s", "--json"]);
    assert_eq!(states.stdout, "{\"command\":\"start\",\"node\":5,\"reached\":true,\"state\":\"OPERATIONAL\"}\n");
}

#[test]
fn a_log_is_monitored_in_words() {
    let folder = folder("monitor");
    std::fs::write(
        folder.join("bus.log"),
        "(0000000001.000000) can0 405#1F0088130000\n(0000000001.100000) can0 385#R6\n",
    )
    .unwrap();
    let run = lexican_in(&folder, &["monitor", "--bus", "log:bus.log", "--device", "5=siko/ag03-1"]);
    assert_eq!(run.code, Some(0), "{run}");
    let lines: Vec<_> = run.stdout.lines().collect();
    assert_eq!(lines.len(), 2);
    assert!(
        lines[0].contains("1.000000  405  RPDO3 node 5") && lines[0].ends_with("Target Position = +5000 increments")
    );
    let run = lexican_in(&folder, &["monitor", "--bus", "log:bus.log", "--json", "--count", "1"]);
    assert_eq!(run.stdout.lines().count(), 1);
    assert!(run.stdout.contains("\"id\":\"405\""), "{run}");
    check(&["monitor", "--bus", DRIVE, "--for", "1s"], 0, "0.000116  705  boot-up node 5");
}

#[test]
fn any_data_sheet_is_a_node_of_a_simulated_bus() {
    let folder = folder("sheet-node");
    std::fs::write(
        folder.join("small.eds"),
        "[FileInfo]\nFileName=small.eds\n[DeviceInfo]\nProductName=Small\n[MandatoryObjects]\nSupportedObjects=1\n\
         1=0x1000\n[1000]\nParameterName=Device Type\nObjectType=0x7\nDataType=0x0007\nAccessType=ro\n\
         DefaultValue=0x191\nPDOMapping=0\n",
    )
    .unwrap();
    lexican_in(&folder, &["read", "--bus", "sim:small.eds?node=9", "Device Type"])
        .on_stdout(0, "1000:00 Device Type = 401");
}

#[test]
fn impossible_arguments_are_refused_with_advice() {
    check(&["read", "--bus", "can0", "--node", "0", "6064"], 2, "0 is not a node-ID: node-IDs are 1 to 127");
    check(&["read", "--bus", "can0", "--node", "128", "6064"], 2, "128 is not a node-ID: node-IDs are 1 to 127");
    check(&["simulate", "siko/ag03-1", "--bus", "can0", "--node", "300"], 2, "300 is not a node-ID");
    check(&["read", "--bus", "sim:siko/ag03-1?node=0", "6064"], 2, "0 is not a node-ID");
    check(&["read", "--bus", "sim:siko/ag03-9", "6064"], 2, "did you mean siko/ag03-1 or siko/ag02?");
    check(&["read", "--bus", "sim:siko/ag03-1?speed=1", "6064"], 2, "no parameter `speed`");
    check(&["read", "--bus", "pty", "--node", "5", "6064"], 2, "slcan:/dev/pts/3");
    check(&["read", "--bus", "carrier:pigeon", "6064"], 2, "there is no kind of bus");
    check(&["read", "--bus", "slcan:/dev/pts/none", "--node", "5", "6064"], 2, "is `lexican simulate` still running?");
    check(&["scan", "--bus", "can0", "--timeout", "250us"], 2, "250us is not a time of whole milliseconds");
    check(&["monitor", "--bus", DRIVE, "--for", "1 day"], 2, "is not a time such as 500ms, 10s");
    check(&["nmt", "--bus", "can0", "start"], 2, "--node <NODES>|--all");
    // The message depends on the machine.
    check(&["read", "--bus", "no-such-can", "--node", "5", "6064"], 2, "error: ");
    check(&["read", "--bus", DRIVE, "controlwort of another drive"], 2, "names no object");
    check(&["monitor", "--bus", "log:missing.log"], 2, "cannot read the log missing.log: no such file or directory");
    check(&["read", "--bus", "log:missing.log", "--node", "5", "6064"], 2, "lexican record");
    check(&["read", "--bus", "slcan:/dev/no-such-port", "--node", "5", "6064"], 2, "is the adapter plugged in?");
    check(&["monitor", "--bus", "log:missing.log", "--identify"], 2, "its nodes cannot be asked");
    check(&["monitor", "--bus", DRIVE, "--device", "siko/ag03-1"], 2, "ID=DEVICE");
}
