//! Tests of the command, one file for each subcommand.

mod access;
mod archive;
mod boot;
mod bus;
mod certify;
mod chaos;
mod check;
#[path = "../common/mod.rs"]
mod common;
mod completions;
mod conform;
mod demo;
mod drive;
mod eds;
mod eds_edit;
mod files;
mod follow;
mod help;
mod identity;
mod logs;
mod lsp;
mod machine;
mod machine_life;
mod monitor;
mod monitor_json;
mod output;
#[cfg(unix)]
#[path = "../common/page.rs"]
mod page;
mod parameters;
mod pdo;
mod plant;
mod profibus;
mod recorded_trace;
mod run;
mod screens;
mod send;
mod service_visit;
mod simulate;
#[path = "../common/simulation.rs"]
mod simulation;
#[cfg(unix)]
#[path = "../common/terminal.rs"]
mod terminal;
mod trace;
mod wireshark;
