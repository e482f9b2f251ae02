//! Names in Wireshark: tshark shows what `lexican monitor` shows.

use std::path::Path;
use std::process::Command;

use crate::common::{folder, lexican_in};
use serde_json::Value;

/// What tshark shows for each frame: the names of objects, and their numbers. `None` if it is not installed.
fn tshark(folder: &Path, log: &str, script: &str) -> Option<Vec<(Vec<String>, Vec<f64>)>> {
    let fields =
        ["-T", "fields", "-E", "separator=|", "-E", "aggregator=;", "-e", "lexican.object", "-e", "lexican.number"];
    let run = Command::new("tshark")
        .current_dir(folder)
        .args(["-r", log, "-d", "can.subdissector,canopen", "-X", &format!("lua_script:{script}")])
        .args(fields)
        .output();
    let Ok(run) = run else {
        eprintln!("SKIPPED: tshark is not installed");
        return None;
    };
    let [stdout, stderr] = [run.stdout, run.stderr].map(|text| String::from_utf8(text).unwrap());
    assert!(run.status.success() && !stderr.contains("Lua"), "{stderr}");
    let parts = |text: &str| text.split(';').filter(|it| !it.is_empty()).map(str::to_owned).collect::<Vec<_>>();
    let line = |line: &str| {
        let (names, numbers) = line.split_once('|').expect("two fields");
        (parts(names), parts(numbers).iter().map(|it| it.parse().expect("a number")).collect())
    };
    Some(stdout.lines().map(line).collect())
}

/// The objects of a frame in the JSON of `monitor`, and their numbers.
fn monitored(line: &Value) -> (Vec<String>, Vec<f64>) {
    let fields = match (&line["pdo"]["fields"], &line["sdo"]) {
        (Value::Array(fields), _) => fields.as_slice(),
        (_, sdo) => std::slice::from_ref(sdo),
    };
    let name = |field: &Value| field["name"].as_str().map(str::to_owned);
    let number = |field: &Value| field["scaled"].as_f64().or_else(|| field["value"].as_f64());
    (fields.iter().filter_map(name).collect(), fields.iter().filter_map(number).collect())
}

/// Compares the two for a log. Returns how many numbers both have.
fn compare(folder: &Path, log: &str, nodes: &str) -> Option<usize> {
    let script = ["eds", "to-wireshark", "siko/ag03-1", "--node", nodes, "-o", "names.lua", "--force"];
    lexican_in(folder, &script).on_stdout(0, "");
    let shown = tshark(folder, log, "names.lua")?;
    let bus = format!("log:{log}");
    let mut monitor = vec!["monitor", "--json", "--bus", &bus];
    let devices: Vec<_> = nodes.split(',').map(|node| format!("{node}=siko/ag03-1")).collect();
    devices.iter().for_each(|device| monitor.extend(["--device", device]));
    let run = lexican_in(folder, &monitor);
    let lines = run.stdout.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let frames: Vec<_> = lines.filter(|line| line["event"].is_null()).collect();
    assert_eq!(frames.len(), shown.len());
    let mut numbers = 0;
    for (frame, (names, shown)) in frames.iter().zip(&shown) {
        let (expected, known) = monitored(frame);
        assert_eq!(*names, expected, "{frame}");
        // For the answer to a write, the command repeats the number of the transfer; tshark has only what is in the
        // frame.
        if !shown.is_empty() {
            assert_eq!(*shown, known, "{frame}");
        }
        assert!(!shown.is_empty() || frame["pdo"]["fields"].as_array().is_none_or(Vec::is_empty), "{frame}");
        numbers += shown.len();
    }
    Some(numbers)
}

#[test]
fn tshark_shows_the_names_and_numbers_that_monitor_shows() {
    let folder = folder("wireshark");
    lexican_in(&folder, &["demo"]);
    if let Some(numbers) = compare(&folder, "demo.log", "5") {
        assert!(numbers > 50, "{numbers}");
    }
    // A text in segments, which do not name their object; a refusal; and a PDO that is too short.
    let frames = ["605#4008100000000000", "585#410810000A000000", "605#6000000000000000", "585#0041473033000000"];
    let more = ["605#2F60600001000000", "585#8060600031000906", "385#3702", "085#2031050000000000"];
    let lines = frames.iter().chain(&more).zip(1..).map(|(frame, at)| format!("({at}.000000) can0 {frame}\n"));
    std::fs::write(folder.join("sdo.log"), lines.collect::<String>()).unwrap();
    compare(&folder, "sdo.log", "5");
}
