//! A bench on a recorded log, and how clients move through it.

use super::{Ending, until};
use lexican_bench::engine::Setup;
use lexican_bench::model::BusInfo;
use lexican_bench::request::Nmt;
use lexican_bench::view::{TraceFilter, View};
use lexican_bench::{Answer, Bench, Client, Request};
use lexican_runtime::{CobId, Duration, Frame, Instant};

/// The time of the recording, which is not zero.
const BEGAN: Duration = Duration::from_secs(1_700_000_000);

fn frame(ms: u64, id: u16, data: &[u8]) -> (Instant, Frame) {
    (Instant::ZERO + BEGAN + Duration::from_millis(ms), Frame::new(CobId::standard(id).unwrap(), data).unwrap())
}

/// Node 5 boots, is started, is identified, and reports an emergency, within ten seconds.
fn log() -> Vec<(Instant, Frame)> {
    vec![
        frame(0, 0x705, &[0]),
        frame(1000, 0x000, &[1, 5]),
        frame(2000, 0x705, &[5]),
        frame(5000, 0x085, &[0x10, 0x43, 0x01, 0, 0, 0, 0, 0]),
        frame(10_000, 0x705, &[5]),
    ]
}

fn bench() -> (Ending, Client) {
    let info = BusInfo { name: "bus.log".to_owned(), ..BusInfo::default() };
    let bench = Ending(Bench::replay(log(), Setup::new(info)).unwrap());
    let client = bench.open_client();
    until(&bench, |view| position(view) == 10.0);
    (bench, client)
}

fn position(view: &View) -> f64 {
    view.log.as_ref().unwrap().position
}

fn rows(client: &Client) -> Vec<f64> {
    let trace = Request::Trace { filter: TraceFilter::default(), from: 0, at: None, count: 100 };
    let Ok(Answer::Frames(frames)) = client.ask(trace).wait() else { panic!("rows") };
    frames.rows.iter().map(|row| row.time).collect()
}

#[test]
fn all_of_it_is_shown_at_first() {
    let (bench, client) = bench();
    let view = bench.view();
    assert_eq!(view.log.as_ref().map(|log| (log.seconds, log.speed)), Some((10.0, 0.0)));
    assert_eq!(view.time, 10.0);
    assert!(!view.bus.is_writable);
    assert_eq!(rows(&client), [0.0, 1.0, 2.0, 5.0, 10.0], "in seconds from the first frame");
    assert_eq!(view.nodes[0].state.as_deref(), Some("OPERATIONAL"));
    assert_eq!(view.nodes[0].faults.iter().map(|fault| (fault.at, &*fault.code)).collect::<Vec<_>>(), [(5.0, "4310")]);
}

#[test]
fn a_client_goes_back_and_on() {
    let (bench, client) = bench();
    let seek = |seconds| client.ask(Request::Seek { seconds }).wait();
    assert_eq!(seek(1.5), Ok(Answer::Done));
    let view = bench.view();
    assert_eq!((position(&view), view.time, view.trace.end), (1.5, 1.5, 2));
    assert_eq!(view.nodes[0].state.as_deref(), Some("PRE-OPERATIONAL"));
    assert!(view.nodes[0].faults.is_empty());
    assert_eq!(seek(5.0), Ok(Answer::Done));
    assert_eq!(rows(&client), [0.0, 1.0, 2.0, 5.0], "each frame once");
    assert_eq!(bench.view().nodes[0].faults.len(), 1);
    for (wanted, there) in [(-3.0, 0.0), (f64::NAN, 0.0), (1e300, 10.0)] {
        assert_eq!(seek(wanted), Ok(Answer::Done));
        assert_eq!(position(&bench.view()), there, "{wanted}");
    }
}

#[test]
fn it_is_played_to_its_end() {
    let (bench, client) = bench();
    client.ask(Request::Seek { seconds: 1.0 }).wait().unwrap();
    assert_eq!(client.ask(Request::Play { speed: 1000.0 }).wait(), Ok(Answer::Done));
    let view = until(&bench, |view| view.log.as_ref().is_some_and(|log| log.position == 10.0 && log.speed == 0.0));
    assert_eq!(view.trace.end, 5);
    for speed in [-1.0, f64::NAN, f64::INFINITY] {
        client.ask(Request::Play { speed }).wait().unwrap_err();
    }
}

#[test]
fn a_data_sheet_that_is_given_later_holds_for_what_was_shown() {
    let (bench, client) = bench();
    let before = bench.view().nodes[0].faults[0].text.clone();
    let sheet = Request::SetSheet { node: 5, sheet: "siko/ag03-1".to_owned() };
    client.ask(sheet).wait().unwrap();
    let view = until(&bench, |view| view.nodes[0].faults.first().is_some_and(|fault| fault.text != before));
    assert_eq!((position(&view), view.trace.end), (10.0, 5));
}

#[test]
fn it_takes_no_frames() {
    let (bench, client) = bench();
    client.ask(Request::TakeControl { force: false }).wait().unwrap();
    let address = || "1000:00".to_owned();
    let requests = [
        Request::Nmt { node: None, command: Nmt::Start },
        Request::Scan,
        Request::Assign { node: 9 },
        Request::Read { node: 5, addresses: vec![address()] },
        Request::Write { node: 5, address: address(), text: "1".to_owned(), force: true },
        Request::Backup { node: 5 },
        Request::Pdos { node: 5 },
    ];
    for request in requests {
        let refused = client.ask(request.clone()).wait().unwrap_err();
        assert_eq!(refused.why, "a log takes no frames", "{request:?}");
    }
    assert!(bench.view().jobs.iter().all(|job| job.is_success == Some(false)), "none of them waits");
    let watch = Request::Watch { node: 5, address: address(), every_ms: 100 };
    assert_eq!(client.ask(watch).wait(), Ok(Answer::Done), "its value comes from the log");
    assert_eq!(rows(&client).len(), 5);
}
