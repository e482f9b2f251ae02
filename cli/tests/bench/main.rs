//! `lexican bench` with both clients, and other pages in a browser. Separate from `all`, whose tests judge times.

#[cfg(unix)]
#[path = "../common/bench.rs"]
mod bench;
#[cfg(unix)]
#[path = "../common/browser.rs"]
mod browser;
mod command;
#[path = "../common/mod.rs"]
mod common;
mod log;
mod page;
#[path = "../common/recording.rs"]
mod recording;
mod report;
mod sequence;
#[cfg(unix)]
#[path = "../common/simulation.rs"]
mod simulation;
#[cfg(unix)]
#[path = "../common/terminal.rs"]
mod terminal;
#[cfg(unix)]
#[path = "../common/tmux.rs"]
mod tmux;
mod tui;
