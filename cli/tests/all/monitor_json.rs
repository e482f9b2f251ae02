//! The fields of `lexican monitor --json`, as cli/README.md documents them.

use crate::common::{folder, lexican_in};
use serde_json::{Value, json};

/// Monitors a log of these frames, 100 ms apart, and returns its output.
fn monitor(name: &str, frames: &[&str], more: &[&str]) -> Vec<Value> {
    let folder = folder(name);
    let lines = frames.iter().enumerate().map(|(number, frame)| {
        let ms = number * 100;
        format!("({:010}.{:03}000) can0 {frame}\n", ms / 1000, ms % 1000)
    });
    std::fs::write(folder.join("bus.log"), lines.collect::<String>()).unwrap();
    let run = lexican_in(&folder, &[&["monitor", "--bus", "log:bus.log", "--json"], more].concat());
    assert_eq!(run.code, Some(0), "{run}");
    run.stdout.lines().map(|line| serde_json::from_str(line).expect("each line is JSON")).collect()
}

#[track_caller]
fn contains(json: &Value, fields: &Value) {
    for (key, field) in fields.as_object().unwrap() {
        assert_eq!(&json[key], field, "{key} of {json}");
    }
}

#[test]
fn a_frame_has_its_fields_and_those_of_its_service() {
    let services = [
        ("705#00", "error_control"),
        ("000#8100", "nmt"),
        ("705#R1", "error_control"),
        ("085#2031050000000000", "emcy"),
        ("080#07", "sync"),
        ("100#E80300000100", "time_of_day"),
        ("405#1F0088130000", "pdo"),
        ("605#4018100900000000", "sdo"),
        ("7E5#0401000000000000", "lss"),
        ("7E4#4400000000000000", "lss"),
    ];
    let lines = monitor("json-frame", &services.map(|(frame, _)| frame), &[]);
    for (line, (frame, service)) in lines.iter().zip(services) {
        assert!(line[service].is_object(), "{frame}: {line}");
    }
    let boot_up = json!({ "time": 0.0, "id": "705", "remote": false, "data": "00", "node": 5, "service": "boot-up",
        "text": "", "alarming": false, "error_control": { "kind": "boot-up", "state": "INITIALISING" } });
    let reset =
        json!({ "time": 0.1, "node": null, "nmt": { "command": "reset node", "code": "81", "state": "INITIALISING" } });
    contains(&lines[0], &boot_up);
    contains(&lines[1], &reset);
    contains(&lines[2], &json!({ "time": 0.2, "remote": true, "error_control": { "kind": "guarding" } }));
    contains(&lines[3], &json!({ "time": 0.3, "alarming": true, "service": "EMCY" }));
}

#[test]
fn two_responses_to_one_request_are_an_event() {
    let answer = "586#4300100092010000";
    let lines = monitor("json-two-nodes", &["606#4000100000000000", answer, answer], &[]);
    assert_eq!(lines.len(), 4);
    contains(&lines[3], &json!({ "event": "two-nodes", "node": 6, "evidence": "second-answer", "time": 0.2 }));
}

#[test]
fn a_device_is_recognised_when_a_client_reads_its_identity() {
    let frames =
        ["605#4018100100000000", "585#4318100195010000", "605#4018100200000000", "585#4318100200000000", "185#3702"];
    let lines = monitor("json-identity", &frames, &[]);
    contains(&lines[4], &json!({ "event": "identified", "node": 5, "device": "siko/ag03-1", "time": 0.3 }));
    assert_eq!(lines[5]["pdo"]["fields"][0]["name"], "Statusword");
    let lines = monitor("json-no-identity", &frames, &["--device", "5=none"]);
    assert_eq!(lines.len(), frames.len());
    assert_eq!(lines[4]["pdo"]["fields"], json!([]), "the device is given as unknown");
}

/// The fields that programs read stay. Fields may be added (`LEXICAN_BLESS=1`); their order does not matter.
#[test]
fn golden_every_protocol_has_the_fields_that_it_had() {
    let folder_of_cases = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all");
    let folder = folder("json-every-protocol");
    std::fs::copy(format!("{folder_of_cases}/every_protocol.log"), folder.join("bus.log")).unwrap();
    let monitor = ["monitor", "--bus", "log:bus.log", "--json", "--device", "5=siko/ag03-1"];
    let all = [&[][..], &["--transfers"]].map(|more| lexican_in(&folder, &[&monitor, more].concat()).stdout);
    let (path, text) = (format!("{folder_of_cases}/every_protocol.jsonl"), all.concat());
    if std::env::var_os("LEXICAN_BLESS").is_some() {
        std::fs::write(&path, &text).unwrap();
    }
    let golden = std::fs::read_to_string(&path).unwrap();
    assert_eq!(text.lines().count(), golden.lines().count());
    for (line, expected) in text.lines().zip(golden.lines()) {
        let [found, wanted] = [line, expected].map(|line| serde_json::from_str::<Value>(line).unwrap());
        assert_eq!(found, wanted);
    }
}
