//! The bench on a recorded log shows what `lexican monitor --json` says.

use std::path::Path;
use std::thread::yield_now;

use crate::common::{folder, lexican_in};
use crate::recording::record;
use lexican_bench::engine::Setup;
use lexican_bench::model::BusInfo;
use lexican_bench::view::{Row, TraceFilter};
use lexican_bench::{Answer, Bench, Request};
use lexican_toolbox::log::Reader;
use serde_json::Value as Json;

fn shown(path: &Path, filter: TraceFilter) -> Vec<Row> {
    let frames = Reader::open(path, None).unwrap().into_frames(None).collect::<Result<Vec<_>, _>>().unwrap();
    let count = frames.len() as u64;
    let bench = Bench::replay(frames, Setup::new(BusInfo::default())).unwrap();
    while bench.view().trace.end < count {
        yield_now();
    }
    let Ok(Answer::Frames(frames)) =
        bench.open_client().ask(Request::Trace { filter, from: 0, at: None, count: 1000 }).wait()
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
