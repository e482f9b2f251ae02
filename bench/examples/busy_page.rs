//! What a busy bus costs the server and the browser together: 10,000 frames of twelve simulated drives in a second, on the page.
//!
//! `cargo run --release -p lexican-bench --example busy_page [SECONDS [FRAMES_PER_SECOND]]` opens tab after tab for so many seconds
//! (10) and prints the processor time and the memory of both, and the times from one frame of the browser to the next (Linux, with a
//! headless Chromium).

#[path = "../../cli/tests/common/browser.rs"]
mod browser;

use std::collections::BTreeMap;
use std::fs::read_to_string;
use std::process::ExitCode;
use std::time::{Duration as Wall, Instant as Clock};

use browser::{Browser, Page};
use lexican_bench::engine::Setup;
use lexican_bench::model::BusInfo;
use lexican_bench::web::Server;
use lexican_bench::{Bench, Request};
use lexican_runtime::host::{Link, Node, Pace, VirtualBus, VirtualLink};
use lexican_runtime::{CobId, Duration, Frame, Instant};
use lexican_simulation::{Files, Plant};

/// How many drives there are.
const DRIVES: u8 = 12;

/// Ticks of the processor in a second, as Linux counts them for programs.
const TICKS: f64 = 100.0;

/// What is looked at. The trace follows, and the plot has two curves.
const TABS: [&str; 6] = ["nodes", "trace", "plots", "drives", "bus", "objects"];

fn main() -> ExitCode {
    let mut args = std::env::args().skip(1);
    let mut number = |default| args.next().map_or(Some(default), |text| text.parse().ok().filter(|it| *it > 0));
    let (Some(seconds), Some(rate)) = (number(10), number(10_000)) else {
        eprintln!("busy_page [SECONDS [FRAMES_PER_SECOND]]");
        return ExitCode::from(2);
    };
    let folder = std::env::temp_dir().join(format!("lexican-busy-page-{}", std::process::id()));
    let Some(browser) = Browser::start(&folder) else {
        eprintln!("there is no Chromium: apt-get install chromium-headless-shell");
        return ExitCode::FAILURE;
    };
    measure(&browser, Wall::from_secs(seconds), rate);
    drop(browser);
    let _ = std::fs::remove_dir_all(folder);
    ExitCode::SUCCESS
}

fn measure(browser: &Browser, span: Wall, rate: u64) {
    let (mut link, before) = (busy_bus(rate), Usage::of(&[std::process::id()]));
    let end = link.now() + Duration::from_secs(5);
    while link.receive(end).expect("a virtual bus is never lost").is_some() {}
    println!("the simulation alone takes {}", Usage::of(&[std::process::id()]).since(&before));

    let info = BusInfo { name: "busy".to_owned(), is_writable: true, bit_rate: Some(1_000_000) };
    let bench = Bench::live(Box::new(link), Setup::new(info)).expect("the machine has a thread for it");
    let server = Server::bind(([127, 0, 0, 1], 0).into(), Vec::new()).expect("a port is free");
    let (url, end, served) = (server.url(), server.end(), bench.clone());
    let serving = std::thread::spawn(move || server.run(served));
    let client = bench.open_client();
    for (node, signal) in [(5, "tpdo2"), (6, "6064:00")] {
        let _ = client.ask(Request::Plot { node, signals: vec![signal.to_owned()], every_ms: 20 }).wait();
    }
    let page = browser.window();
    page.opens(&url);
    page.reads("connection", "connected");
    page.until(&format!("document.querySelector('[data-test=node-{DRIVES}]')"));
    for tab in TABS {
        page.clicks(&format!("tab-{tab}"));
        look(&bench, browser, &page, tab, span);
    }
    drop(client);
    bench.end();
    end.end();
    let _ = serving.join();
}

/// A tab for so long.
fn look(bench: &Bench, browser: &Browser, page: &Page, tab: &str, span: Wall) {
    let browsers = || family(browser.process());
    let here = [std::process::id()];
    let (began, frames) = (clock(), bench.view().bus.frames);
    let (server, other) = (Usage::of(&here), Usage::of(&browsers()));
    let gaps = page.value(&format!(
        "new Promise(done => {{
            const gaps = [], end = performance.now() + {};
            let last = null;
            // The time by the clock: that of the frame is when it was to begin.
            const frame = () => {{
                const now = performance.now();
                if (last !== null) gaps.push(now - last);
                last = now;
                now < end ? requestAnimationFrame(frame) : done(gaps);
            }};
            requestAnimationFrame(frame); }})",
        span.as_millis()
    ));
    let took = began.elapsed().as_secs_f64();
    let frames = (bench.view().bus.frames - frames) as f64 / took;
    let (server, other) = (Usage::of(&here).since(&server), Usage::of(&browsers()).since(&other));
    let mut gaps: Vec<f64> = gaps.as_array().into_iter().flatten().filter_map(serde_json::Value::as_f64).collect();
    gaps.sort_by(f64::total_cmp);
    let part = |of: f64| gaps.get(((gaps.len() - 1) as f64 * of) as usize).copied().unwrap_or_default();
    println!(
        "{tab:>8}: {frames:>6.0} frames/s; server {server}; browser {other}; from frame to frame p50 {:.1}, p99 {:.1}, max {:.1} ms",
        part(0.5),
        part(0.99),
        part(1.0)
    );
}

/// Twelve drives, and one who says what they say, more often.
fn busy_bus(rate: u64) -> VirtualLink {
    let node = |id| {
        format!(
            "[node.axis{id}]\nid = {id}\nsheet = 'kollmorgen/akd'\n[simulate.axis{id}]\nsettings = {{ 1017 = 100 }}\n"
        )
    };
    let machine = (1..=DRIVES).map(node).collect::<String>();
    let plant = Plant::parse(&machine, "machine.toml", Files::Embedded(&[])).expect("its devices are in the library");
    let bus = VirtualBus::new();
    bus.attach(plant.segment(bus.now()).expect("a plant of its own"));
    bus.attach(Talker { next: bus.now(), every: Duration::from_micros(1_000_000 / rate), number: 0, due: 0 });
    bus.set_pace(Pace::RealTime);
    bus.link()
}

/// Sends process data of each drive in turn: statusword, and mode of operation.
struct Talker {
    next: Instant,
    every: Duration,
    number: u64,
    due: u64,
}

impl Node for Talker {
    fn handle_frame(&mut self, _: Instant, _: &Frame) {}

    fn handle_timeout(&mut self, _: Instant) {
        self.next += self.every;
        self.due += 1;
    }

    fn poll_transmit(&mut self, _: Instant) -> Option<Frame> {
        let number = (self.number < self.due).then_some(self.number)?;
        self.number += 1;
        let (node, turn) = ((number % u64::from(DRIVES)) as u16 + 1, number / u64::from(DRIVES));
        let word = if turn / 100 % 2 == 0 { 0x37 } else { 0x40 };
        let (base, data) = if turn % 2 == 0 { (0x180, &[word, 2][..]) } else { (0x280, &[word, 2, 1][..]) };
        let id = CobId::standard(base + node).expect("it has 11 bits");
        Some(Frame::new(id, data).expect("it has at most 8 bytes"))
    }

    fn poll_timeout(&self) -> Option<Instant> {
        Some(self.next)
    }

    fn concerns(&self) -> Vec<CobId> {
        // Of nobody: none at all would be all.
        CobId::standard(0x7FF).into_iter().collect()
    }
}

/// What processes have used.
struct Usage {
    at: Clock,
    seconds: f64,
    megabytes: f64,
}

impl Usage {
    fn of(processes: &[u32]) -> Self {
        let seconds = |process: &u32| {
            let stat = read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
            // After the name in parentheses: the 12th and 13th are the times as user and in the kernel.
            let rest = stat.rsplit(") ").next().unwrap_or_default().to_owned();
            rest.split(' ').skip(11).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / TICKS
        };
        // What processes share counts once.
        let megabytes = |process: &u32| {
            let memory = read_to_string(format!("/proc/{process}/smaps_rollup")).unwrap_or_default();
            let line = memory.lines().find_map(|line| line.strip_prefix("Pss:")?.strip_suffix("kB"));
            line.and_then(|kilobytes| kilobytes.trim().parse::<f64>().ok()).unwrap_or_default() / 1e3
        };
        Usage {
            at: clock(),
            seconds: processes.iter().map(seconds).sum(),
            megabytes: processes.iter().map(megabytes).sum(),
        }
    }

    fn since(&self, before: &Usage) -> String {
        let percent = 100.0 * (self.seconds - before.seconds) / (self.at - before.at).as_secs_f64();
        format!("{percent:.0} % of a core, {:.0} MB", self.megabytes)
    }
}

/// A process and all that it has started.
fn family(process: u32) -> Vec<u32> {
    let mut children: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for entry in std::fs::read_dir("/proc").into_iter().flatten().flatten() {
        let Some(child) = entry.file_name().to_str().and_then(|name| name.parse().ok()) else { continue };
        let stat = read_to_string(entry.path().join("stat")).unwrap_or_default();
        let parent = stat.rsplit(") ").next().and_then(|rest| rest.split(' ').nth(1)?.parse().ok());
        children.entry(parent.unwrap_or_default()).or_default().push(child);
    }
    let mut family = vec![process];
    let mut at = 0;
    while let Some(one) = family.get(at) {
        let of_one = children.remove(one).unwrap_or_default();
        family.extend(of_one);
        at += 1;
    }
    family
}

fn clock() -> Clock {
    #[expect(clippy::disallowed_methods, reason = "this measures")]
    Clock::now()
}
