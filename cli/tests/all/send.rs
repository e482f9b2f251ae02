//! Commands that send: on a simulated bus, and on a bus of pseudo-terminals where nodes come and go.
#![cfg(unix)]

use std::io::{BufRead, BufReader};
use std::process::{Child, ChildStdout, Command, Stdio};

use crate::common::{folder, lexican};
use crate::simulation::Simulation;
use lexican_runtime::host::Link;
use lexican_runtime::host::slcan::{Settings, Slcan};
use lexican_runtime::{CobId, Duration};
use serde_json::{Value, json};

const DRIVE: &str = "sim:siko/ag03-1?node=5";

#[test]
fn what_was_sent_is_summed_up() {
    for (args, code, words) in [
        (&["sync"][..], 0, "1 frame sent\n"),
        (&["sync", "--every", "10ms", "--count", "100"], 0, "100 frames sent in 1.060 s, at most 0.000 ms late"),
        (&["sync", "--every", "10ms", "--for", "1s", "--json"], 0, "\"sent\":100"),
        (&["time"], 0, "1 frame sent\n"),
        (&["time", "2026-11-23 12:00", "--every", "1s", "--for", "3s"], 0, "3 frames sent"),
        (&["emcy", "5", "4210"], 0, "1 frame sent\n"),
        (&["send", "000#0105", "080#"], 0, "2 frames sent\n"),
        (&["send", "605#4064600000000000", "--wait", "100ms"], 0, "SDO response: 6064:00 Position Actual Value = 0"),
        (&["send", "605#40.64.60.00.00.00.00.00", "--wait", "100ms", "--json"], 0, "\"service\":\"SDO response\""),
        (&["heartbeat", "--every", "500ms", "--for", "5s"], 0, "10 heartbeats sent in 5.000 s"),
        (&["heartbeat", "--every", "500ms", "--for", "5s", "--watch", "6-7", "--json"], 1, "\"silent\":[6,7]"),
        (
            &["guard", "5", "--for", "5s"],
            0,
            "10 requests, 10 answers, 0 without toggling, 0 times lost; PRE-OPERATIONAL",
        ),
        (
            &["guard", "6", "--count", "4", "--every", "100ms"],
            1,
            "4 requests, 0 answers, 0 without toggling, 1 time lost",
        ),
    ] {
        lexican(&[args, &["--bus", DRIVE]].concat()).on_stdout(code, words);
    }
    lexican(&["emcy", "5", "4210", "--bus", DRIVE]).on_stderr(0, "device temperature");
    lexican(&["time", "2026-11-23 12:00", "--bus", DRIVE]).on_stderr(0, "2026-11-23 12:00:00.000");
}

#[test]
fn what_cannot_be_sent_is_refused() {
    for (args, words) in [
        (&["send"][..], "<FRAME>"),
        (&["send", "605"], "no classic CAN frame"),
        (&["send", "605#11223344556677889900"], "no classic CAN frame"),
        (&["sync", "--count", "5"], "--every"),
        (&["sync", "--every", "0"], "is not a time above zero"),
        (&["sync", "--counter", "1"], "2..=240"),
        (&["time", "yesterday"], "is not a time such as"),
        (&["emcy", "5", "123456"], "is not an error code"),
        (&["emcy", "5", "4210", "--data", "1 2 3 4 5 6"], "more than five bytes"),
        (&["emcy", "128", "4210"], "is not a node-ID"),
        (&["guard", "5", "--factor", "0"], "1..=255"),
    ] {
        lexican(&[args, &["--bus", DRIVE]].concat()).on_stderr(2, words);
    }
    let log = folder("send-log").join("bus.log");
    std::fs::write(&log, "").unwrap();
    lexican(&["sync", "--bus", &format!("log:{}", log.display())]).on_stderr(2, "a log takes no frames");
}

/// A command that runs until Ctrl-C.
struct Endless {
    command: Child,
    lines: std::io::Lines<BufReader<ChildStdout>>,
}

impl Endless {
    fn start(bus: &str, args: &[&str]) -> Self {
        // A shell lets its background jobs ignore SIGINT, and they pass this on to the processes that they start.
        let mut command = Command::new("env")
            .args(["--default-signal=INT", env!("CARGO_BIN_EXE_lexican")])
            .args(args)
            .args(["--bus", bus, "--json"])
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(command.stdout.take().unwrap()).lines();
        Endless { command, lines }
    }

    /// The next event of this kind.
    #[track_caller]
    fn until(&mut self, event: &str) -> Value {
        let mut events = self.lines.by_ref().map(|line| serde_json::from_str::<Value>(&line.unwrap()).unwrap());
        events.find(|json| json["event"] == event).unwrap_or_else(|| panic!("no {event}"))
    }

    /// Presses Ctrl-C.
    fn interrupt(mut self) -> (Value, Option<i32>) {
        assert!(Command::new("kill").args(["-INT", &self.command.id().to_string()]).status().unwrap().success());
        (self.until("summary"), self.command.wait().unwrap().code())
    }
}

#[test]
fn frames_arrive_and_ctrl_c_sums_up() {
    let mut drive = Simulation::begin(&folder("send-bus"), &["siko/ag03-1", "--node", "5", "--bus", "pty:2"]);
    drive.check("send", &["000#0105"], "1 frame sent");
    assert_eq!(drive.until("state")["state"], "OPERATIONAL");
    let mut other = Slcan::open(drive.buses[1].strip_prefix("slcan:").unwrap(), Settings::default()).unwrap();
    let mut hears = |id: u16, skip: usize| {
        let id = CobId::standard(id).unwrap();
        let until = other.now() + Duration::from_secs(60);
        let frames = std::iter::from_fn(|| other.receive_frame(until).unwrap());
        frames.filter(|frame| frame.id() == id).nth(skip).expect("it is sent").to_string()
    };
    let sync = Endless::start(&drive.buses[0], &["sync", "--every", "20ms", "--counter", "3"]);
    assert_eq!([hears(0x080, 0), hears(0x080, 0), hears(0x080, 0), hears(0x080, 0)].last().unwrap(), "080#01");
    let (summary, code) = sync.interrupt();
    assert!(code == Some(0) && summary["sent"].as_u64().unwrap() >= 4, "{summary}");
    drive.check("time", &["1984-01-03 00:00:01"], "1 frame sent");
    assert_eq!(hears(0x100, 0), "100#E80300000200");
    drive.check("emcy", &["9", "FF01", "--register", "81", "--data", "01 A0"], "1 frame sent");
    assert_eq!(hears(0x089, 0), "089#01FF8101A0000000");
}

#[test]
fn nodes_that_go_and_come_back_are_reported() {
    let mut drive = Simulation::begin(&folder("send-watch"), &["siko/ag03-1", "--node", "5", "--bus", "pty"]);
    let bus = drive.buses[0].clone();
    let mut guard = Endless::start(&bus, &["guard", "5", "--every", "100ms"]);
    assert_eq!(guard.until("heard")["state"], "PRE-OPERATIONAL");
    drive.asks("power off", "state");
    guard.until("lost");
    drive.asks("power on", "state");
    guard.until("booted");
    assert_eq!(guard.until("back")["state"], "PRE-OPERATIONAL");
    let (summary, code) = guard.interrupt();
    assert_eq!((code, &summary["lost"], &summary["toggle_errors"]), (Some(1), &json!(1), &json!(0)));

    drive.check("write", &["--node", "5", "1017", "raw:100"], "");
    let args = ["heartbeat", "--every", "100ms", "--watch", "5", "--within", "1s", "--manager", "126"];
    let mut manager = Endless::start(&bus, &args);
    assert_eq!(manager.until("heard")["node"], 5);
    drive.asks("power off", "state");
    manager.until("lost");
    drive.asks("power on", "state");
    manager.until("booted");
    let (summary, code) = manager.interrupt();
    assert_eq!((code, &summary["lost"], &summary["same_node_id"]), (Some(1), &json!(1), &json!(0)));
    // A node that does not answer, and one that does not report its state: the advice helps.
    drive.check("nmt", &["stop", "--node", "5", "--wait", "1s"], "STOPPED");
    drive.run("read", &["--node", "5", "6064"]).on_stderr(2, "`lexican nmt pre-operational --node NODE`");
    drive.check("nmt", &["pre-operational", "--node", "5"], "");
    drive.check("read", &["--node", "5", "6064"], "");
    // Two nodes with one node-ID.
    drive.check("write", &["--node", "5", "1017", "raw:100"], "");
    let twin = drive.run("heartbeat", &["--manager", "5", "--every", "100ms", "--for", "1s"]);
    twin.on_stderr(1, "another node 5 is on the bus");
}
