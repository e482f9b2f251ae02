//! What a busy bus costs the model: ten million frames of twelve drives, 10,000 in a second.
//!
//! `cargo run --release -p lexican-bench --example flood` prints the processor time for each second of the bus, how long a
//! client waits for its view and for rows, and the memory (Linux).

use std::time::{Duration as Wall, Instant as Clock};

use lexican_bench::model::{BusInfo, Model, Which};
use lexican_bench::sheet::Sheet;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};
use lexican_toolbox::bus::filter::Filter;
use lexican_toolbox::data_sheet::DataSheet;

/// In a second of the bus.
const RATE: u64 = 10_000;

/// How long the bus is heard, in seconds.
const SECONDS: u64 = 1000;

fn main() {
    let info = BusInfo { name: "flood".to_owned(), is_writable: false, bit_rate: Some(1_000_000) };
    let mut model = Model::new(Instant::ZERO, info);
    let sheet = Sheet::new("siko/ag03-1", DataSheet::load("siko/ag03-1", &[]).expect("it is in the library"));
    let nodes: Vec<_> = (1..=12).filter_map(NodeId::new).collect();
    nodes.iter().for_each(|node| model.introduce(*node, sheet));
    let filter = Filter { nodes: vec![nodes[4]], texts: vec!["position".to_owned()], ..Filter::default() };
    let filtered = Which { key: "position".to_owned(), filter, ..Which::default() };

    let (mut now, mut frames) = (Instant::ZERO, Wall::ZERO);
    let (mut view, mut rows) = (Wall::ZERO, Wall::ZERO);
    for second in 0..SECONDS {
        let began = clock();
        for number in 0..RATE {
            now += Duration::from_micros(1_000_000 / RATE);
            model.observe(now, &frame(nodes[(number % 12) as usize].get(), second * RATE + number));
        }
        frames += began.elapsed();
        // A client asks ten times in a second; once is measured.
        let began = clock();
        std::hint::black_box(model.view());
        view = view.max(began.elapsed());
        let began = clock();
        std::hint::black_box(model.rows(&filtered, None, -100, 100));
        rows = rows.max(began.elapsed());
        if (second + 1) % 100 == 0 {
            println!(
                "{:>4} s, {:>8} frames: {:.1} ms for a second of the bus, a view at most {:.1} ms, rows {:.1} ms, {}",
                second + 1,
                (second + 1) * RATE,
                frames.as_secs_f64() * 1e3 / (second + 1) as f64,
                view.as_secs_f64() * 1e3,
                rows.as_secs_f64() * 1e3,
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

fn clock() -> Clock {
    #[expect(clippy::disallowed_methods, reason = "this measures")]
    Clock::now()
}

fn memory() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.map_or_else(|| "memory unknown".to_owned(), |line| line.trim().to_owned())
}
