//! Tests of the model with frames, and of the engine with its clients over simulated devices.

mod live;
mod model;
mod recording;
mod stop;
mod tui;
mod web;

use std::ops::Deref;

use lexican_bench::engine::Setup;
use lexican_bench::model::BusInfo;
use lexican_bench::request::{Nmt, Verb};
use lexican_bench::view::View;
use lexican_bench::{Bench, Client, Request};
use lexican_runtime::host::{Pace, VirtualBus};

/// A bench that ends with its test.
struct Ending(Bench);

impl Deref for Ending {
    type Target = Bench;

    fn deref(&self) -> &Bench {
        &self.0
    }
}

impl Drop for Ending {
    fn drop(&mut self) {
        self.0.end();
    }
}

/// A bench on a bus, in real time.
fn bench_of(bus: &VirtualBus) -> Ending {
    let link = bus.link();
    bus.set_pace(Pace::RealTime);
    let info = BusInfo { name: "plant".to_owned(), is_writable: true, bit_rate: Some(500_000) };
    Ending(Bench::live(Box::new(link), Setup::new(info)).unwrap())
}

/// A client with control, of a bench that knows its two drives.
fn client(bench: &Bench) -> Client {
    until(bench, |view| {
        view.drives.len() == 2 && view.drives.iter().all(|drive| drive.position.is_some() && drive.state.is_some())
    });
    let client = bench.open_client();
    client.ask(Request::TakeControl { force: false }).wait().unwrap();
    client
}

/// Starts all nodes, and enables drive 5.
fn enable(client: &Client) {
    client.ask(Request::Nmt { node: None, command: Nmt::Start }).wait().unwrap();
    client.ask(drive(5, Verb::Enable, None)).wait().unwrap();
}

fn moves(view: &View) -> bool {
    view.drives[0].velocity.is_some_and(|velocity| velocity != 0.0)
}

/// Waits until a view satisfies a condition.
#[track_caller]
fn until(bench: &Bench, is_so: impl Fn(&View) -> bool) -> View {
    // The harness ends a test that never ends.
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
