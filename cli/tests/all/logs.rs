//! `lexican record`, `replay` and `convert`.

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Command, Stdio};

use crate::common::{files, folder, lexican_in};
use serde_json::{Value, json};

const LOG: &str = "\
(1506783973.191000) can0 605#4018100100000000
(1506783973.291000) can1 00000185#AB
(1506783973.391000) can0 705#R1
(1506783973.491000) can0 085#2031050000000000
(1506783974.191000) can0 123##1AA
(1506783975.191000) can0 20000004#0000000000000000
";

fn with_log(name: &str) -> std::path::PathBuf {
    let folder = folder(name);
    fs::write(folder.join("bus.log"), LOG).unwrap();
    folder
}

fn result(folder: &Path, args: &[&str]) -> Value {
    let run = lexican_in(folder, args);
    assert_eq!(run.code, Some(0), "{run}");
    serde_json::from_str(run.stdout.trim()).unwrap_or_else(|error| panic!("{error}: {run}"))
}

#[test]
fn a_log_goes_through_every_format_and_back() {
    let folder = with_log("logs-formats");
    let classic: String = LOG.split_inclusive('\n').take(4).collect();
    let without_interfaces = classic.replace("can1", "can0");
    for (name, expected) in [
        ("a.log", &classic),
        ("a.pcap", &without_interfaces),
        ("a.pcapng", &classic),
        ("a.asc", &classic),
        ("a.trc", &classic),
        ("a.blf", &classic),
    ] {
        let run = lexican_in(&folder, &["convert", "bus.log", name]);
        run.on_stderr(0, "left out: 1 frame of CAN FD, 1 error frame");
        assert!(run.stdout.starts_with(&format!("{name}: 4 frames, ")), "{run}");
        lexican_in(&folder, &["convert", name, "-", "--to", "candump"]).on_stdout(0, expected);
        // A log is the bus of another command.
        let url = format!("log:{name}");
        lexican_in(&folder, &["monitor", "--bus", &url, "--json"]).on_stdout(0, "\"time\":1506783973.191");
    }
    let fields = result(&folder, &["convert", "bus.log", "b.asc", "--json"]);
    let bytes = fs::metadata(folder.join("b.asc")).unwrap().len();
    assert_eq!(
        fields,
        json!({ "frames": 4, "bytes": bytes, "from": "candump", "to": "asc", "fd": 1, "errors": 1, "other": 0, "cut": false })
    );
}

#[test]
fn frames_are_chosen_and_shifted() {
    let folder = with_log("logs-chosen");
    for (options, lines) in [
        (&["--cob-id", "605,700-7FF"][..], &[0, 2][..]),
        (&["--except", "00000185"], &[0, 2, 3]),
        (&["--cob-id", "080-085,605,705", "--except", "705"], &[0, 3]),
        (&["--interface", "can1"], &[1]),
        (&["--after", "0.1s", "--before", "0.3s"], &[1, 2]),
    ] {
        let expected: String = lines.iter().map(|at| LOG.split_inclusive('\n').nth(*at).unwrap()).collect();
        let run = lexican_in(&folder, &[&["convert", "bus.log", "-", "--to", "candump"], options].concat());
        assert_eq!((run.code, &run.stdout), (Some(0), &expected), "{run}");
    }
    let shifted = ["convert", "bus.log", "-", "--to", "candump", "--begin", "2026-09-30T15:06:13Z", "--after", "0.1s"];
    lexican_in(&folder, &shifted)
        .on_stdout(0, "(1790780773.000000) can1 00000185#AB\n(1790780773.100000) can0 705#R1\n");
}

#[test]
fn what_cannot_be_read_or_written_is_named() {
    let folder = with_log("logs-wrong");
    fs::write(folder.join("bad.log"), "(1.5) can0 080#\n(1.5) can0 800#\n").unwrap();
    fs::write(folder.join("cut.log"), "(1.5) can0 080#\n(1.6) can0").unwrap();
    fs::write(folder.join("none"), "nonsense\n").unwrap();
    for (args, code, text) in [
        (&["convert", "bad.log", "a.asc"][..], 2, "bad.log:2: this is no CAN frame"),
        (&["convert", "cut.log", "a.asc"], 0, "the log ends in the middle of a frame"),
        (&["convert", "none", "new.asc"], 2, "none: this is no log of a known format: candump, pcap, "),
        (&["convert", "missing.log", "new.asc"], 2, "cannot read the log missing.log: no such file or directory"),
        (&["convert", "bus.log", "a.mdf"], 2, "which format is a.mdf?"),
        (&["convert", "bus.log", "-"], 2, "name it with --to: candump, pcap"),
        (&["convert", "bus.log", "bus.log"], 2, "cannot write bus.log: it is read at the same time"),
        (&["convert", "bus.log", "no/folder/a.asc"], 2, "cannot write no/folder/a.asc: no such file or directory"),
        (&["convert", "bus.log", "new.asc", "--cob-id", "800"], 2, "names no identifiers"),
        (&["convert", "bus.log", "new.asc", "--begin", "today"], 2, "is no time"),
        (&["replay", "missing.log", "--bus", "sim:siko/ag03-1"], 2, "cannot read the log missing.log"),
        (&["replay", "bus.log", "--bus", "sim:siko/ag03-1", "--speed", "0"], 2, "is no factor"),
        (&["record", "--bus", "log:bus.log", "-o", "a", "--max-size", "1k"], 2, "--split-size"),
        (&["record", "--bus", "log:bad.log", "-o", "a.log"], 2, "bad.log:2: this is no CAN frame"),
    ] {
        lexican_in(&folder, args).on_stderr(code, text);
    }
    // The frames before the error are kept.
    assert_eq!(fs::read_to_string(folder.join("a.log")).unwrap(), "(0000000001.500000) can0 080#\n");
}

#[test]
fn a_bus_is_recorded_until_the_end() {
    let folder = with_log("logs-record");
    let fields = result(&folder, &["record", "--bus", "log:bus.log", "-o", "a.trc", "--cob-id", "605,085", "--json"]);
    let bytes = fs::metadata(folder.join("a.trc")).unwrap().len();
    assert_eq!([&fields["frames"], &fields["bytes"], &fields["missing"]], [&json!(2), &json!(bytes), &json!(0)]);
    assert_eq!(fields["file"], "a.trc");
    let bus = "sim:siko/ag03-1?node=5";
    lexican_in(&folder, &["record", "--bus", bus, "-o", "sim.blf", "--for", "5s"]).on_stdout(0, " in 5.0 s, ");
    lexican_in(&folder, &["monitor", "--bus", "log:sim.blf"]).on_stdout(0, "boot-up");
    let counted = result(&folder, &["record", "--bus", "log:bus.log", "-o", "b.log", "--count", "1", "--json"]);
    assert_eq!(counted["frames"], 1);
}

#[test]
fn a_ring_of_files_keeps_the_newest() {
    let folder = folder("logs-ring");
    let line = |number: u32| format!("({number:010}.000000) can0 080#\n");
    fs::write(folder.join("bus.log"), (0..100).map(line).collect::<String>()).unwrap();
    let limits = ["--split-size", "300", "--max-size", "1k"];
    lexican_in(&folder, &[&["record", "--bus", "log:bus.log", "-o", "r.log"], &limits[..]].concat())
        .on_stdout(0, "r-0011.log");
    let names = ["bus.log", "r-0009.log", "r-0010.log", "r-0011.log"];
    let left = files(&folder);
    assert_eq!(left[left.len() - 3..], names[1..]);
    let all: String = left.iter().skip(1).map(|name| fs::read_to_string(folder.join(name)).unwrap()).collect();
    assert!(all.ends_with(&line(99)) && (300..=1000).contains(&all.len()), "{left:?}");
}

#[test]
fn a_log_commands_a_simulated_drive() {
    let folder = folder("logs-replay");
    // A simulated drive answers by the time of the log, not of the wall clock.
    let log = "(1.0) can0 000#0105\n(1.2) can0 605#2F17100000000000\n(1.3) can0 605#4041600000000000\n";
    fs::write(folder.join("bus.log"), log).unwrap();
    let bus = ["--bus", "sim:siko/ag03-1?node=5&pace=virtual", "--json"];
    let replay = |more: &[&str]| result(&folder, &[&["replay", "bus.log"], &bus[..], more].concat());
    let seconds = |fields: &Value| fields["seconds"].as_f64().unwrap();
    let plain = replay(&[]);
    assert_eq!([&plain["frames"], &plain["passes"]], [3, 1].map(|number| json!(number)).each_ref());
    assert!((0.3..0.5).contains(&seconds(&plain)), "{plain}");
    let slow = replay(&["--speed", "0.1"]);
    assert!((3.0..3.2).contains(&seconds(&slow)), "{slow}");
    let fast = replay(&["--fast", "--loop", "3"]);
    assert_eq!([&fast["frames"], &fast["passes"]], [9, 3].map(|number| json!(number)).each_ref());
    assert!(seconds(&fast) < 0.1, "{fast}");
    assert_eq!(replay(&["--cob-id", "605"])["frames"], 2);
}

#[test]
fn a_pipe_is_converted_while_it_is_written() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lexican"));
    command.args(["convert", "-", "-", "--to", "candump"]);
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let mut stdout = BufReader::new(child.stdout.take().unwrap());
    let text: String = (0..64).map(|number| format!("  can0  {number:03X}   [1]  AB\n")).collect();
    std::io::Write::write_all(&mut stdin, text.as_bytes()).unwrap();
    let mut line = String::new();
    stdout.read_line(&mut line).unwrap();
    assert_eq!(line, "(0000000000.000000) can0 000#AB\n");
    drop(stdin);
    let mut rest = String::new();
    stdout.read_to_string(&mut rest).unwrap();
    assert_eq!((rest.lines().count(), child.wait().unwrap().code()), (63, Some(0)));
}

#[test]
#[cfg(unix)]
fn a_signal_ends_a_recording_cleanly() {
    let folder = folder("logs-signal");
    for (name, signal) in [("term.blf", "-TERM"), ("int.log", "-INT"), ("kill.log", "-KILL")] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_lexican"));
        command.args(["record", "--bus", "sim:siko/ag03-1?node=5", "-o", name]).current_dir(&folder);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        // The boot-up message comes soon, and is written within a fifth of a second.
        let path = folder.join(name);
        while !fs::metadata(&path).is_ok_and(|data| data.len() > 20) {
            assert_eq!(child.try_wait().unwrap(), None, "it is still recording");
            std::thread::yield_now();
        }
        let id = child.id().to_string();
        assert!(Command::new("kill").args([signal, &id]).status().unwrap().success());
        let code = child.wait().unwrap().code();
        assert_eq!(code, if signal == "-KILL" { None } else { Some(0) }, "{name}");
        lexican_in(&folder, &["monitor", "--bus", &format!("log:{name}")]).on_stdout(0, "boot-up");
    }
}
