//! Sequences: recorded by the bench, run by `lexican run`, and played by the bench over its own link.
#![cfg(unix)]

use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::Command;

use serde_json::{Value as Json, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket, client};

use crate::bench::Bench;
use crate::browser::Browser;
use crate::common::{folder, lexican_in};
use crate::terminal::{Screen, Terminal};

const MACHINE: &str = "\
[node.feeder]
id = 5
sheet = \"siko/ag03-1\"
settings = { 2412 = \"2.5 mm\" }

[node.cutter]
id = 6
sheet = \"kollmorgen/akd\"

[simulate.feeder]
settings = { 2412 = \"2.5 mm\" }

[bench]
sequences = [\"there.seq\"]
messages = { anew = \"nmt reset-node cutter\" }
filters = { cutter = { nodes = \"cutter\", services = \"heartbeat\" } }
";

/// A client of the bench that has control.
struct Page {
    socket: WebSocket<TcpStream>,
    address: String,
    view: Json,
    last: u64,
    answers: Vec<Json>,
}

impl Page {
    fn of(bench: &Bench) -> Self {
        let address = bench.origin().strip_prefix("http://").unwrap().to_owned();
        let mut request = format!("ws://{address}/ws").into_client_request().unwrap();
        request.headers_mut().insert("Origin", bench.origin().parse().unwrap());
        let protocols = format!("lexican-bench, {}", bench.token());
        request.headers_mut().insert("Sec-WebSocket-Protocol", protocols.parse().unwrap());
        let (socket, _) = client(request, TcpStream::connect(&address).unwrap()).unwrap();
        let mut page = Page { socket, address, view: json!({}), last: 0, answers: Vec::new() };
        page.until(|view| {
            let drives = view["drives"].as_array().unwrap();
            drives.len() == 2 && drives.iter().all(|drive| !drive["position"].is_null() && !drive["state"].is_null())
        });
        page.asks(json!({ "do": "take-control", "force": false }));
        page
    }

    /// Takes the next message: an answer, or a view.
    fn takes(&mut self) {
        let message: Json = serde_json::from_str(self.socket.read().unwrap().to_text().unwrap()).unwrap();
        let fields = message["view"].as_object();
        fields.into_iter().flatten().for_each(|(name, value)| self.view[name] = value.clone());
        if fields.is_some() {
            self.socket.send(Message::text(r#"{"seen":true}"#)).unwrap();
        }
        self.answers.extend(message.get("id").is_some().then_some(message));
    }

    fn until(&mut self, is_so: impl Fn(&Json) -> bool) {
        while self.view["drives"].is_null() || !is_so(&self.view) {
            self.takes();
        }
    }

    fn gives(&mut self, mut request: Json) -> u64 {
        self.last += 1;
        request["id"] = self.last.into();
        self.socket.send(Message::text(request.to_string())).unwrap();
        self.last
    }

    fn gets(&mut self, id: u64) -> Json {
        loop {
            if let Some(at) = self.answers.iter().position(|answer| answer["id"] == id) {
                return self.answers.remove(at);
            }
            self.takes();
        }
    }

    fn asks(&mut self, request: Json) -> Json {
        let id = self.gives(request);
        self.gets(id)
    }

    fn drives(&mut self, node: u8, order: &str, value: Option<&str>) {
        let done = self.asks(json!({ "do": "drive", "node": node, "order": order, "value": value }));
        assert_eq!(done["answer"], "done", "{done}");
    }

    fn file(&mut self, answer: &Json) -> String {
        let url = answer["answer"]["file"]["url"].as_str().unwrap_or_else(|| panic!("{answer}"));
        let mut stream = TcpStream::connect(&self.address).unwrap();
        write!(stream, "GET {url} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", self.address).unwrap();
        let mut text = String::new();
        stream.read_to_string(&mut text).unwrap();
        text.split_once("\r\n\r\n").unwrap().1.to_owned()
    }

    fn plays(&mut self, text: &str) -> Json {
        self.asks(json!({ "do": "play-sequence", "name": "a.seq", "text": text }))
    }
}

fn bench_of(folder: &Path) -> Bench {
    fs::write(folder.join("machine.toml"), MACHINE).unwrap();
    fs::write(folder.join("there.seq"), "boot\ndrive feeder move-to 5 mm --enable\n").unwrap();
    Bench::begin(folder, &["--bus", "sim"])
}

#[test]
fn what_somebody_does_becomes_a_sequence_that_runs() {
    let folder = folder("bench-record");
    let bench = bench_of(&folder);
    let mut page = Page::of(&bench);
    page.drives(5, "stop", None);
    page.asks(json!({ "do": "record", "on": true }));
    page.asks(json!({ "do": "nmt", "node": null, "command": "start" }));
    page.drives(5, "enable", None);
    page.drives(5, "move-to", Some("2.5 mm"));
    page.asks(json!({ "do": "write", "node": 5, "address": "2410:05", "text": "60", "force": false }));
    page.asks(json!({ "do": "write", "node": 5, "address": "2410:05", "text": "250", "force": false }));
    page.drives(6, "enable", None);
    let run = page.gives(json!({ "do": "drive", "node": 6, "order": "run", "value": "2000" }));
    page.until(|view| view["drives"][1]["velocity"] != 0.0 && !view["drives"][1]["order"].is_null());
    page.drives(6, "stop", None);
    page.gets(run);
    page.until(|view| view["kept"]["recorded"] == 8);
    let answer = page.asks(json!({ "do": "record", "on": false }));
    let recorded = page.file(&answer);
    let lines: Vec<_> = recorded.lines().filter(|line| !line.starts_with("wait ")).collect();
    assert_eq!(
        lines[..4],
        ["nmt start --all", "drive feeder enable", "drive feeder move-to '2.5 mm'", "write feeder 2410:05 60"],
        "{recorded}"
    );
    assert!(lines[4].starts_with("# write feeder 2410:05 250: ") && lines[4].contains("too high"), "{recorded}");
    assert_eq!(lines[5], "drive cutter enable");
    assert!(lines[6].starts_with("drive cutter run 2000 --for "), "{recorded}");
    assert_eq!(lines[7..], ["# Given before the line above had ended:", "drive cutter stop"], "{recorded}");
    fs::write(folder.join("recorded.seq"), recorded + "read feeder 6064\nread feeder 2410:05\n").unwrap();
    let run = lexican_in(&folder, &["run", "recorded.seq", "--bus", "sim"]);
    run.on_stdout(0, "6064:00 Position Actual Value = +2.50 mm\n");
    run.on_stdout(0, "= 60");
}

#[test]
fn a_sequence_is_played_on_the_link_of_the_bench_and_a_stop_ends_it() {
    let folder = folder("bench-play");
    let bench = bench_of(&folder);
    let mut page = Page::of(&bench);
    let wrong = page.plays("boot\ndrive feeder move-too 5\ndrive knife stop\n");
    let why = wrong["refused"]["why"].as_str().unwrap();
    assert!(why.contains("a.seq:2: ") && why.contains("a.seq:3: "), "{why}");
    assert_eq!(page.view["drives"][0]["ending"], Json::Null, "nothing was done, and nothing was stopped");
    let done = page.plays("boot\ndrive feeder move-to 2.5 mm --enable\nwait feeder.6064 >= 2.4 mm within 1 s\n");
    let report = page.file(&done);
    assert!(report.contains("2: drive feeder move-to 2.5 mm --enable\n"), "{report}");
    assert!(report.contains("it has reached its target") && report.contains("6064:00"), "{report}");
    page.until(|view| view["jobs"][1]["is_success"] == true);
    page.until(|view| view["drives"][0]["position"] == 2.5 && view["drives"][0]["unconfirmed"].is_null());
    let failed = page.plays("wait feeder.2412 = 9 mm within 100 ms\nboot\n");
    let why = failed["refused"]["why"].as_str().unwrap();
    assert!(why.starts_with("1: wait feeder.2412") && why.contains("not within 100 ms"), "{why}");
    let unlisted = page.asks(json!({ "do": "play-sequence", "name": "machine.toml" }));
    assert_eq!(unlisted["refused"]["why"], "the machine lists no sequence machine.toml");
    // A message stops no drive.
    let boot_ups = page.view["nodes"][1]["boots"].as_u64().unwrap();
    assert_eq!(page.asks(json!({ "do": "play-sequence", "name": "anew" }))["answer"], "done");
    page.until(|view| view["nodes"][1]["boots"].as_u64() == Some(boot_ups + 1));
    assert_eq!(page.view["kept"]["filters"][0][1]["nodes"], "6");
    assert_eq!(page.asks(json!({ "do": "nmt", "node": 6, "command": "start" }))["answer"], "done");
    // A stop ends a travel, and the lines after it are not run.
    let text = "drive cutter run 2000 --enable --for 10min\ndrive feeder move-to 0 mm --enable\n";
    let playing = page.gives(json!({ "do": "play-sequence", "name": "b.seq", "text": text }));
    page.until(|view| view["drives"][1]["velocity"].as_f64() > Some(1000.0));
    assert_eq!(
        page.asks(json!({ "do": "play-sequence", "name": "a.seq", "text": "boot" }))["refused"]["remedy"],
        "wait for it, or stop it"
    );
    let stopped = page.asks(json!({ "do": "stop-all" }));
    assert_eq!(stopped["answer"], "done", "{stopped}");
    assert_eq!(page.gets(playing)["refused"]["why"], "a stop has ended it");
    page.until(|view| view["drives"][1]["velocity"] == 0.0 && view["drives"][0]["position"] == 2.5);
    assert_eq!(bench.interrupt(), Some(0), "all drives stand");
}

#[test]
fn the_page_plays_what_the_machine_lists_and_records() {
    let folder = folder("bench-sequence-page");
    let Some(browser) = Browser::start(&folder) else {
        eprintln!("skipped: no Chromium to open the bench with: apt-get install chromium-headless-shell");
        return;
    };
    let bench = bench_of(&folder);
    let page = browser.window();
    page.opens(&bench.url);
    page.clicks("tab-drives");
    page.until("document.querySelector('[data-test=drive-5]')");
    page.clicks("take-control");
    page.clicks("record");
    page.reads("record", "Save 0 lines");
    page.clicks("play-there.seq");
    page.until("document.querySelector('.job.good')");
    page.reads("drive-5-position", "5");
    page.clicks("drive-5-disable");
    page.reads("record", "Save 1 lines");
    page.clicks("message-anew");
    page.clicks("tab-nodes");
    page.reads("node-6", "PRE-OPERATIONAL");
    page.clicks("tab-trace");
    page.clicks("filter-kept-cutter");
    page.until("document.querySelector('[data-test=filter-nodes]').value === '6'");
    assert_eq!(page.said(), [""; 0]);
    assert_eq!(page.nameless(), [""; 0]);
}

#[test]
fn the_terminal_records_and_plays() {
    const F5: &str = "\u{1b}[15~";
    let folder = folder("bench-sequence-terminal");
    fs::write(folder.join("machine.toml"), MACHINE).unwrap();
    fs::write(folder.join("there.seq"), "boot\ndrive feeder move-to 5 mm --enable\n").unwrap();
    fs::write(folder.join("recorded.seq"), "of yesterday").unwrap();
    let args = ["bench", "--bus", "sim", "--tui", "--lang", "en"];
    let mut screen = Terminal::of(Command::new(env!("CARGO_BIN_EXE_lexican")).args(args).current_dir(&folder));
    screen.wait_for(|text| text.contains("feeder") && text.contains("cutter"));
    screen.press(&format!("h6{F5}"));
    screen.wait_for(|text| text.contains("done"));
    screen.press("\u{1b}[17~");
    screen.wait_for(|text| text.contains("there.seq"));
    screen.press("there.seq\r");
    screen.wait_for(|text| text.contains("there.seq.txt written"));
    screen.press("d");
    screen.wait_for(|text| text.contains("it is disabled"));
    screen.press(F5);
    screen.wait_for(|text| text.contains("2-recorded.seq written"));
    screen.press("q");
    assert_eq!(screen.end().0, Some(0));
    let recorded = fs::read_to_string(folder.join("2-recorded.seq")).unwrap();
    assert_eq!(recorded, "drive feeder disable\n");
    let report = fs::read_to_string(folder.join("there.seq.txt")).unwrap();
    assert!(report.contains("2: drive feeder move-to 5 mm --enable"), "{report}");
}
