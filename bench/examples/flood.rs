//! What a busy bus costs the bench: ten million frames of twelve drives, 10,000 in a second, heard by the model and shown to a page.
//!
//! `cargo run --release -p lexican-bench --example flood`, or `cargo xtask bench flood`, which keeps the figures, prints how many frames
//! a core takes in a second while a page gets its ten views, what the parts cost in processor time, and the memory (Linux).

use lexican_bench::model::{BusInfo, Model, Which};
use lexican_bench::sheet::Sheet;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};
use lexican_toolbox::bus::filter::Filter;
use lexican_toolbox::data_sheet::DataSheet;

/// In a second of the bus.
const RATE: u64 = 10_000;

/// How long the bus is heard, in seconds.
const SECONDS: u64 = 1000;

/// How often a page gets a view in a second by the clock.
const VIEWS: f64 = 10.0;

fn main() {
    let info = BusInfo { name: "flood".to_owned(), is_writable: false, bit_rate: Some(1_000_000) };
    let mut model = Model::new(Instant::ZERO, info);
    let sheet = Sheet::new("siko/ag03-1", DataSheet::load("siko/ag03-1", &[]).expect("it is in the library"));
    let nodes: Vec<_> = (1..=12).filter_map(NodeId::new).collect();
    nodes.iter().for_each(|node| model.introduce(*node, sheet));
    let filter = Filter { nodes: vec![nodes[4]], texts: vec!["position".to_owned()], ..Filter::default() };
    let filtered = Which { key: "position".to_owned(), filter, ..Which::default() };

    println!("| frames | frames/s | a frame | a view, and its JSON | rows of a search | memory |");
    println!("| --- | --- | --- | --- | --- | --- |");
    let (mut now, mut frames) = (Instant::ZERO, 0.0);
    let (mut view, mut rows) = (0.0, 0.0);
    for second in 0..SECONDS {
        let began = processor_time();
        for number in 0..RATE {
            now += Duration::from_micros(1_000_000 / RATE);
            model.observe(now, &frame(nodes[(number % 12) as usize].get(), second * RATE + number));
        }
        frames += processor_time() - began;
        // Once in a second of the bus, as after a tenth of a second on a bus that is ten times as busy.
        let began = processor_time();
        std::hint::black_box(serde_json::to_string(&model.view()).expect("a view is plain data"));
        view += processor_time() - began;
        let began = processor_time();
        std::hint::black_box(model.rows(&filtered, None, -100, 100));
        rows += processor_time() - began;
        if (second + 1) % 200 == 0 {
            let (heard, seconds) = ((second + 1) * RATE, (second + 1) as f64);
            let [frame, view, rows] = [frames / heard as f64, view / seconds, rows / seconds];
            println!(
                "| {heard} | {:.0} | {:.2} us | {:.2} ms | {:.1} ms | {} |",
                (1.0 - VIEWS * view) / frame,
                frame * 1e6,
                view * 1e3,
                rows * 1e3,
                memory()
            );
        }
    }
}

/// Of ten frames, seven are process data, two an SDO transfer, one a heartbeat.
fn frame(node: u8, number: u64) -> Frame {
    let [low, high, ..] = (number / 120).to_le_bytes();
    let (base, data) = match number / 12 % 10 {
        7 => (0x600, vec![0x40, 0x64, 0x60, 0, 0, 0, 0, 0]),
        8 => (0x580, vec![0x43, 0x64, 0x60, 0, low, high, 0, 0]),
        9 => (0x700, vec![5]),
        _ => (0x180, vec![0x37, 0x02, low, high, 0, 0, 0, 0]),
    };
    let id = CobId::standard(base + u16::from(node)).expect("it has 11 bits");
    Frame::new(id, &data).expect("it has at most 8 bytes")
}

/// What this thread has used of a processor, in seconds: what else the machine does is not in it.
fn processor_time() -> f64 {
    let schedstat = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    schedstat.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()).unwrap_or_default() / 1e9
}

fn memory() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.map_or_else(|| "memory unknown".to_owned(), |line| line.trim().to_owned())
}
