//! The bench on a recorded log shows what `lexican monitor --json` says.

#[path = "common/mod.rs"]
mod common;

use std::path::Path;
use std::thread::yield_now;

use common::{folder, lexican_in};
use lexican_bench::command::TraceFilter;
use lexican_bench::engine::Setup;
use lexican_bench::model::BusInfo;
use lexican_bench::view::Row;
use lexican_bench::{Answer, Bench, Command};
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{Incoming, Link, VirtualBus};
use lexican_runtime::object::Address;
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_runtime::{CobId, Duration, Frame, NodeId};
use lexican_toolbox::log::{Direction, Format, INTERFACE, Reader, Record, Writer};
use lexican_toolbox::simulation::{Files, Plant};
use serde_json::Value as Json;

const PLANT: &str = "
[[node]]
id = 5
device = 'siko/ag03-1'
settings = ['1017 = raw:100']

[[node]]
id = 6
device = 'kollmorgen/akd'
settings = ['1017 = 100']
";

/// A second of two drives that are asked who they are, and started; then what nobody understands.
fn record(path: &Path) {
    let plant = Plant::parse(PLANT, "plant.toml", Files::Embedded(&[])).unwrap();
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(plant.segment(bus.now()).unwrap());
    let (mut listener, mut network) = (bus.link(), Network::new(bus.link()));
    for node in [5, 6].map(|node| NodeId::new(node).unwrap()) {
        for (index, sub) in [(0x1018, 1), (0x1018, 2), (0x1008, 0), (0x6041, 0), (0x6064, 0), (0x5FFF, 1)] {
            // Some of these are refused.
            let _ = network.read_bytes(node, Address::new(index, sub));
        }
    }
    network.write_bytes(NodeId::new(6).unwrap(), Address::new(0x6081, 0), &[1, 0, 0, 0]).unwrap();
    network.command(NmtCommand::Start, None).unwrap();
    let mut talker = bus.link();
    let strange: [(u16, &[u8]); 6] = [
        (0x000, &[1]),
        (0x085, &[0x10, 0x43, 0x01, 0, 0, 0, 0, 0]),
        (0x605, &[0x40, 0x41, 0x60, 0, 0, 0, 0]),
        (0x123, &[1, 2, 3]),
        (0x080, &[]),
        (0x7E5, &[4, 1, 0, 0, 0, 0, 0, 0]),
    ];
    for (id, data) in strange {
        talker.send(&Frame::new(CobId::standard(id).unwrap(), data).unwrap()).unwrap();
    }
    let end = bus.now() + Duration::from_secs(1);
    let mut writer = Writer::new(std::fs::File::create(path).unwrap(), Format::Candump);
    while let Some(incoming) = listener.receive(end).unwrap() {
        if let Incoming::Frame(frame) = incoming {
            let at = listener.now();
            let record = Record { at, interface: INTERFACE.into(), direction: Direction::Received, frame };
            writer.write(&record).unwrap();
        }
    }
    writer.finish().unwrap();
}

fn shown(path: &Path, filter: TraceFilter) -> Vec<Row> {
    let frames = Reader::open(path, None).unwrap().into_frames(None).collect::<Result<Vec<_>, _>>().unwrap();
    let count = frames.len() as u64;
    let bench = Bench::replay(frames, Setup::new(BusInfo::default())).unwrap();
    while bench.view().trace.end < count {
        yield_now();
    }
    let Ok(Answer::Frames(frames)) =
        bench.open_face().ask(Command::Trace { filter, from: 0, at: None, count: 1000 }).wait()
    else {
        panic!("rows")
    };
    bench.end();
    frames.rows
}

#[track_caller]
fn compare(folder: &Path, args: &[&str], filter: TraceFilter) {
    let run = lexican_in(folder, &[&["monitor", "--bus", "log:bus.log", "--json"], args].concat());
    assert_eq!(run.code, Some(0), "{run}");
    let lines = run.stdout.lines().map(|line| serde_json::from_str::<Json>(line).expect("each line is JSON"));
    let lines: Vec<_> = lines.filter(|line| line.get("event").is_none()).collect();
    let rows = shown(&folder.join("bus.log"), filter);
    let said = |line: &Json| {
        let text = |key: &str| line[key].as_str().unwrap_or_default().to_owned();
        let (service, alarming) = (text("service"), line["alarming"].as_bool().unwrap());
        (text("id"), text("data"), line["node"].as_u64(), service, text("text"), alarming)
    };
    let shown = |row: &Row| {
        let is_frame = row.service != "SDO transfer";
        let id = if is_frame { row.id.clone() } else { String::new() };
        (id, row.data.clone(), row.node.map(u64::from), row.service.clone(), row.text.clone(), row.alarming)
    };
    assert!(lines.len() > 3, "{run}");
    for (line, row) in lines.iter().zip(&rows) {
        assert_eq!(said(line), shown(row));
    }
    assert_eq!(lines.len(), rows.len());
}

#[test]
fn the_bench_shows_of_a_log_what_the_monitor_says() {
    let folder = folder("bench-log");
    record(&folder.join("bus.log"));
    let none = TraceFilter::default;
    compare(&folder, &[], none());
    compare(&folder, &["--node", "5"], TraceFilter { nodes: "5".to_owned(), ..none() });
    let of_sdo = TraceFilter { services: "sdo,emcy".to_owned(), ..none() };
    compare(&folder, &["--service", "sdo,emcy"], of_sdo);
    let without = TraceFilter { without: "heartbeat".to_owned(), nodes: "5-6".to_owned(), ..none() };
    compare(&folder, &["--without", "heartbeat", "--node", "5-6"], without);
    let object = TraceFilter { object: "6041".to_owned(), ..none() };
    compare(&folder, &["--object", "6041"], object);
    compare(&folder, &["--cob-id", "580-5FF"], TraceFilter { ids: "580-5FF".to_owned(), ..none() });
    compare(&folder, &["--text", "position"], TraceFilter { text: "position".to_owned(), ..none() });
    compare(&folder, &["--transfers"], TraceFilter { transfers: true, ..none() });
    let refused = TraceFilter { transfers: true, services: "sdo".to_owned(), ..none() };
    compare(&folder, &["--transfers", "--service", "sdo"], refused);
}
