//! The model by frames, the engine and its faces over simulated devices.

mod live;
mod model;
mod recording;
mod stop;
mod tui;
mod web;

use lexican_bench::command::Verb;
use lexican_bench::view::View;
use lexican_bench::{Bench, Command};

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

fn drive(node: u8, order: Verb, value: Option<&str>) -> Command {
    Command::Drive { node, order, value: value.map(str::to_owned) }
}
