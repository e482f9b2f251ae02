//! What programs read of `lexican monitor --json`: the fields that cli/README.md promises.

#[path = "common/mod.rs"]
mod common;

use common::{folder, lexican_in};
use serde_json::{Value, json};

/// Watches a log of these frames, 100 ms apart, and returns what was told.
fn watch(name: &str, frames: &[&str], more: &[&str]) -> Vec<Value> {
    let folder = folder(name);
    let lines = frames.iter().enumerate().map(|(number, frame)| {
        let ms = number * 100;
        format!("({:010}.{:03}000) can0 {frame}\n", ms / 1000, ms % 1000)
    });
    std::fs::write(folder.join("bus.log"), lines.collect::<String>()).unwrap();
    let run = lexican_in(&folder, &[&["monitor", "--bus", "log:bus.log", "--json"], more].concat());
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    run.stdout.lines().map(|line| serde_json::from_str(line).expect("each line is JSON")).collect()
}

/// Each of the frames has these fields, and may have others.
#[track_caller]
fn check(name: &str, script: &[(&str, Value)]) {
    let frames: Vec<_> = script.iter().map(|(frame, _)| *frame).collect();
    let told = watch(name, &frames, &["--device", "5=siko/ag03-1"]);
    assert_eq!(told.len(), script.len(), "{told:#?}");
    for (told, (frame, fields)) in told.iter().zip(script) {
        contains(told, fields, frame);
    }
}

#[track_caller]
fn contains(told: &Value, fields: &Value, what: &str) {
    match (told, fields) {
        (Value::Object(_), Value::Object(fields)) => {
            for (key, field) in fields {
                contains(&told[key], field, &format!("{what} .{key}"));
            }
        }
        (Value::Array(told), Value::Array(fields)) => {
            assert_eq!(told.len(), fields.len(), "{what}: {told:?}");
            told.iter().zip(fields).for_each(|(told, field)| contains(told, field, what));
        }
        _ => assert_eq!(told, fields, "{what}"),
    }
}

#[test]
fn the_network_has_fields_of_its_own() {
    check(
        "json-network",
        &[
            (
                "705#00",
                json!({ "time": 0.0, "id": "705", "remote": false, "data": "00", "node": 5,
                "service": "boot-up", "error_control": { "kind": "boot-up" } }),
            ),
            (
                "000#0105",
                json!({ "time": 0.1, "node": 5, "nmt": { "command": "start", "code": "01", "state": "OPERATIONAL" } }),
            ),
            ("000#8100", json!({ "node": null, "nmt": { "command": "reset node" } })),
            ("080#07", json!({ "node": null, "sync": { "counter": 7 } })),
            ("080#", json!({ "sync": { "counter": null } })),
            ("100#E80300000100", json!({ "time_of_day": { "ms": 1000, "days": 1 } })),
            ("705#R1", json!({ "remote": true, "error_control": { "kind": "guarding" } })),
            ("705#85", json!({ "error_control": { "kind": "heartbeat", "state": "OPERATIONAL", "toggle": true } })),
            (
                "085#2031050000000000",
                json!({ "alarming": true, "emcy": { "code": "3120", "meaning": "undervoltage",
                "register": "05", "register_text": "general error + voltage", "msef": "00 00 00 00 00" } }),
            ),
            (
                "086#3081110102030405",
                json!({ "node": 6, "emcy": { "code": "8130",
                "meaning": "life guard error or heartbeat error", "register": "11", "msef": "01 02 03 04 05" } }),
            ),
        ],
    );
}

#[test]
fn a_pdo_has_every_mapped_entry() {
    check(
        "json-pdo",
        &[
            (
                "405#1F0088130000",
                json!({ "service": "RPDO3", "pdo": { "number": 3, "direction": "receive", "fields": [
                { "address": "6040:00", "index": "6040", "sub": "00", "name": "Controlword", "type": "UNSIGNED16", "value": 31 },
                { "name": "Target Position", "value": 5000, "unit": "increments", "scaled": 5000.0, "text": "+5000 increments" },
            ] } }),
            ),
            (
                "186#0102",
                json!({ "service": "TPDO1", "node": 6, "pdo": { "number": 1, "direction": "transmit", "fields": [] } }),
            ),
        ],
    );
}

#[test]
fn a_transfer_has_its_object_its_kind_and_its_abort() {
    check(
        "json-sdo",
        &[
            (
                "605#2B122400C8000000",
                json!({ "sdo": { "from": "client", "command": "initiate-download", "access": "write",
                "transfer": "expedited", "address": "2412:00", "name": "Spindle Pitch", "value": 200, "text": "2.00 mm",
                "unit": "mm", "scaled": 2.0, "raw": "C8 00", "complete": false } }),
            ),
            ("585#6012240000000000", json!({ "sdo": { "from": "server", "value": 200, "complete": true } })),
            ("605#4018100900000000", json!({ "sdo": { "access": "read", "index": "1018", "sub": "09" } })),
            (
                "585#8018100911000906",
                json!({ "alarming": true, "sdo": { "command": "abort", "abort_code": "06090011",
                "abort": "sub-index does not exist", "complete": true } }),
            ),
            ("606#4008100000000000", json!({ "sdo": { "command": "initiate-upload" } })),
            ("586#410810000A000000", json!({ "sdo": { "transfer": "segmented", "size": 10, "complete": false } })),
            ("606#6000000000000000", json!({ "sdo": { "command": "upload-segment", "toggle": false } })),
            ("586#006465766963652D", json!({ "sdo": { "toggle": false, "last": false } })),
            ("606#7000000000000000", json!({ "sdo": { "toggle": true } })),
            (
                "586#1931323300000000",
                json!({ "sdo": { "toggle": true, "last": true, "complete": true,
                "address": "1008:00", "value": "device-123", "text": "\"device-123\"" } }),
            ),
            (
                "606#A00810007F000000",
                json!({ "sdo": { "command": "initiate-block-upload", "transfer": "block", "block_size": 127 } }),
            ),
            ("586#C20810000A000000", json!({ "sdo": { "size": 10 } })),
            ("606#A300000000000000", json!({ "sdo": { "command": "start-block-upload" } })),
            ("586#016465766963652D", json!({ "sdo": { "command": "block-segment", "sequence": 1, "last": false } })),
            ("586#8231323300000000", json!({ "sdo": { "sequence": 2, "last": true } })),
            ("606#A2027F0000000000", json!({ "sdo": { "command": "confirm-block-upload", "sequence": 2 } })),
            (
                "586#D100000000000000",
                json!({ "sdo": { "command": "end-block-upload", "value": "device-123", "complete": false } }),
            ),
            ("606#A100000000000000", json!({ "sdo": { "from": "client", "complete": true } })),
        ],
    );
}

#[test]
fn lss_has_its_command_and_values() {
    check(
        "json-lss",
        &[
            (
                "7E5#0401000000000000",
                json!({ "lss": { "from": "manager", "command": "switch-global", "code": "04", "state": "configuration" } }),
            ),
            (
                "7E5#4095010000000000",
                json!({ "lss": { "command": "switch-selective", "part": "vendor", "value": 405 } }),
            ),
            ("7E4#4400000000000000", json!({ "lss": { "from": "device", "command": "switch-selective" } })),
            ("7E5#1105000000000000", json!({ "lss": { "command": "configure-node-id", "node_id": 5 } })),
            ("7E4#1101000000000000", json!({ "alarming": true, "lss": { "error": 1, "specific": 0 } })),
            ("7E5#1300020000000000", json!({ "lss": { "table": 0, "entry": 2, "kbit_per_s": 500 } })),
            (
                "7E5#51950100001F0001",
                json!({ "lss": { "command": "fastscan", "value": 405, "bit_checked": 31, "part": "vendor", "next": "product" } }),
            ),
            ("7E5#4A07000000000000", json!({ "lss": { "command": "identify", "part": "serial-low", "value": 7 } })),
            ("7E4#5EFF000000000000", json!({ "lss": { "command": "inquire-node-id", "node_id": null } })),
        ],
    );
}

#[test]
fn two_answers_to_one_question_are_an_event() {
    let answer = "586#4300100092010000";
    let told = watch("json-twins", &["606#4000100000000000", answer, answer], &[]);
    assert_eq!(told.len(), 4);
    contains(&told[3], &json!({ "event": "two-nodes", "node": 6, "evidence": "second-answer", "time": 0.2 }), "event");
}

#[test]
fn a_device_is_recognised_when_somebody_reads_its_identity() {
    let frames =
        ["605#4018100100000000", "585#4318100195010000", "605#4018100200000000", "585#4318100200000000", "185#3702"];
    let told = watch("json-identity", &frames, &[]);
    contains(&told[4], &json!({ "event": "identified", "node": 5, "device": "siko/ag03-1", "time": 0.3 }), "event");
    contains(&told[5], &json!({ "pdo": { "fields": [{ "name": "Statusword" }] } }), "after it");
    let told = watch("json-no-identity", &frames, &["--device", "5=none"]);
    assert_eq!(told.len(), frames.len());
    contains(&told[4], &json!({ "pdo": { "fields": [] } }), "unknown on purpose");
}
