//! `lexican pdo`, with simulated drives.

use crate::common::{folder, lexican, lexican_in};

const AKD: &str = "sim:kollmorgen/akd?node=5";
const AG03: &str = "sim:siko/ag03-1?node=5";

#[test]
fn pdos_are_shown_with_their_bits() {
    let run = lexican(&["pdo", "show", "5", "tpdo3", "rpdo1", "--bus", AG03]);
    run.on_stdout(0, "TPDO3  385h, ");
    let picture = "       0        1        2        3        4        5\n    \
                   aaaaaaaa aaaaaaaa bbbbbbbb bbbbbbbb bbbbbbbb bbbbbbbb\n    \
                   a  bits 0-15   6041:00 Statusword\n    \
                   b  bits 16-47  6064:00 Position Actual Value\n";
    run.on_stdout(0, picture);
    run.on_stdout(0, "RPDO1  205h, takes effect at once (255)\n");
    let all = lexican(&["pdo", "show", "5", "--bus", AG03, "--json", "--values"]);
    all.on_stdout(0, "\"text\":\"0 increments\"");
    assert_eq!(all.stdout.lines().count(), 8, "{all}");
    // Without a data sheet, the node is asked for its PDOs.
    let unknown = lexican(&["pdo", "show", "5", "--bus", AG03, "--device", "none"]);
    unknown.on_stdout(0, "b  bits 16-47  6064:00\n");
    lexican(&["pdo", "show", "5", "tpdo9", "--bus", AG03]).on_stderr(1, "node 5 has no TPDO9");
    lexican(&["pdo", "show", "5", "spdo1", "--bus", AG03]).on_stderr(2, "is no PDO such as tpdo1 or rpdo3");
}

#[test]
fn a_pdo_is_mapped_and_read_back() {
    let map = |args: &[&str]| lexican(&[&["pdo", "map", "5"], args, &["--bus", AKD]].concat());
    let run = map(&["tpdo1", "statusword", "position actual value", "--every", "10ms", "--inhibit", "500us"]);
    run.on_stdout(0, "TPDO1  185h, at events of the profile (255), inhibit time 0.5 ms, event timer 10 ms\n");
    run.on_stdout(0, "b  bits 16-47  6064:00 Position actual value\n");
    let run = map(&["rpdo1", "6040", "target position", "--sync", "1", "--cob-id", "0x225", "--json"]);
    run.on_stdout(0, "\"cob_id\":\"225\"");
    run.on_stdout(0, "\"transmission_type\":1");
    map(&["tpdo2", "--off"]).on_stdout(0, "TPDO2  285h, switched off, ");
    let run = map(&["tpdo1", "statusword", "--dry-run"]);
    run.on_stderr(0, "nothing was written: this is how it would be");
    map(&["tpdo1"]).on_stderr(0, "TPDO1: it already was so");
}

#[test]
fn what_the_data_sheet_does_not_allow_is_refused_before_anything_is_sent() {
    for (bus, args, code, words) in [
        (AKD, &["tpdo1", "controlword"][..], 1, "6040:00 Controlword is rww: TPDO1 cannot map it"),
        (AKD, &["rpdo1", "statusword"], 1, "6041:00 Statusword is ro: RPDO1 cannot map it"),
        (AKD, &["tpdo1", "1018:01"], 1, "cannot be mapped into a PDO: its data sheet has PDOMapping=0"),
        (AKD, &["tpdo1", "6064", "6064", "statusword"], 1, "the objects have 80 bits, and a PDO has 64"),
        (AKD, &["tpdo1", "UNSIGNED16"], 1, "only PDOs that the device receives have placeholders"),
        (AKD, &["rpdo1", "--every", "10ms"], 1, "RPDO1 has no event timer: there is no 1400:05"),
        (AKD, &["tpdo1", "--cob-id", "585"], 1, "no PDO can have the COB-ID 585h"),
        (AG03, &["tpdo1", "position actual value"], 1, "the mapping of TPDO1 is fixed: 1A00:00 is "),
        (AKD, &["tpdo1", "positon actual value"], 2, "did you mean 6064:00 Position actual value"),
        (AKD, &["tpdo1", "6064", "--every", "soon"], 2, "is not a time such as 500ms"),
        (AKD, &["tpdo77"], 2, "node 5 has no TPDO77"),
    ] {
        let run = lexican(&[&["pdo", "map", "5"], args, &["--bus", bus]].concat());
        run.on_stderr(code, words);
        assert!(run.stdout.is_empty(), "{run}");
    }
}

/// According to its overlay the object can be mapped, but the drive refuses it.
#[test]
fn a_pdo_whose_change_the_node_refuses_is_put_back() {
    let folder = folder("pdo-put-back");
    let overlay = "[overlay]\nformat = 1\n[object.\"1018:01\"]\npdo_mapping = true\n";
    std::fs::write(folder.join("overlay.toml"), overlay).unwrap();
    let objects = ["statusword", "1018:01", "--every", "20ms", "--overlay", "overlay.toml"];
    let run = lexican_in(&folder, &[&["pdo", "map", "5", "tpdo1", "--bus", AKD], &objects[..]].concat());
    run.on_stderr(1, "1A00:02 ");
    run.on_stderr(1, "the device aborts: 0604 0041");
    run.on_stderr(1, "TPDO1 was put back as it was");
}
