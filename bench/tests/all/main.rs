//! The model by frames, the engine and its clients over simulated devices.

mod live;
mod model;
mod recording;
mod stop;
mod tui;
mod web;

use lexican_bench::engine::Setup;
use lexican_bench::model::BusInfo;
use lexican_bench::request::Verb;
use lexican_bench::view::View;
use lexican_bench::{Bench, Client, Request};
use lexican_runtime::host::{Pace, VirtualBus};

/// A bench of a bus, in real time.
fn bench_of(bus: &VirtualBus) -> Bench {
    let link = bus.link();
    bus.set_pace(Pace::RealTime);
    let info = BusInfo { name: "plant".to_owned(), is_writable: true, bit_rate: Some(500_000) };
    Bench::live(Box::new(link), Setup::new(info)).unwrap()
}

/// A client that has control, of a bench whose two drives are known.
fn client(bench: &Bench) -> Client {
    until(bench, |view| {
        view.drives.len() == 2 && view.drives.iter().all(|drive| drive.position.is_some() && drive.state.is_some())
    });
    let client = bench.open_client();
    client.ask(Request::TakeControl { force: false }).wait().unwrap();
    client
}

fn moves(view: &View) -> bool {
    view.drives[0].velocity.is_some_and(|velocity| velocity != 0.0)
}

/// Waits until a view is so.
#[track_caller]
fn until(bench: &Bench, is_so: impl Fn(&View) -> bool) -> View {
    // The harness ends a test that waits for ever.
    loop {
        let view = bench.view();
        if is_so(&view) {
            return view;
        }
        std::thread::yield_now();
    }
}

fn drive(node: u8, order: Verb, value: Option<&str>) -> Request {
    Request::Drive { node, order, value: value.map(str::to_owned) }
}
