//! `lexican`: CANopen on the command line.
//!
//! [`device`] loads data sheets, [`bus`] opens links and explains their errors, [`duration`] parses times, and [`output`] prints
//! results and sets the exit code; what needs no terminal is in `lexican_toolbox`. Each other module is one command: `demo`, and
//! with the feature `full` all [`commands`].

// What several commands share is more than one of them uses.
#![cfg_attr(not(feature = "full"), allow(dead_code, unused_imports))]

mod demo;
mod device;
mod node_place;
mod output;
mod print;

#[cfg(feature = "full")]
mod access;
#[cfg(feature = "full")]
mod bench;
#[cfg(feature = "full")]
mod boot;
#[cfg(feature = "full")]
mod bus;
#[cfg(all(feature = "full", unix))]
mod chaos;
#[cfg(feature = "full")]
mod check;
#[cfg(feature = "full")]
mod commands;
#[cfg(feature = "full")]
mod completions;
#[cfg(feature = "full")]
mod conform;
#[cfg(feature = "full")]
mod devices;
#[cfg(feature = "full")]
mod drive;
#[cfg(feature = "full")]
mod duration;
#[cfg(feature = "full")]
mod eds;
#[cfg(feature = "full")]
mod flash;
#[cfg(feature = "full")]
mod follow;
#[cfg(feature = "full")]
mod generate;
#[cfg(feature = "full")]
mod log;
#[cfg(feature = "full")]
mod lss;
#[cfg(feature = "full")]
mod monitor;
#[cfg(feature = "full")]
mod nmt;
#[cfg(all(feature = "full", test))]
mod pages;
#[cfg(feature = "full")]
mod parameters;
#[cfg(feature = "full")]
mod pdo;
#[cfg(feature = "full")]
mod scan;
#[cfg(feature = "full")]
mod screen;
#[cfg(feature = "full")]
mod send;
#[cfg(feature = "full")]
mod simulate;
#[cfg(feature = "full")]
mod statistics;
#[cfg(all(feature = "full", test))]
mod style;
#[cfg(feature = "full")]
mod toml_text;

use std::process::ExitCode;

use clap::{CommandFactory, Parser};

/// CANopen on the command line: check data sheets, generate code from them, simulate and move drives
#[derive(Parser, Debug)]
#[command(name = "lexican", version, arg_required_else_help = true, after_help = BEGIN)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[cfg(feature = "full")]
const BEGIN: &str = "\
To begin without hardware, open a simulated plant in the browser; or simulate a drive in one terminal, and try the other
commands in a second one:

    lexican bench --demo
    lexican simulate siko/ag03-1 --node 5
    lexican scan --bus slcan:/dev/pts/3          (the bus that the simulation prints)

A bus is can0, slcan:/dev/ttyACM0?bitrate=500000, sim:siko/ag03-1?node=5 or log:FILE. Exit codes: 0 success, \
1 findings, 2 failure.";

#[cfg(not(feature = "full"))]
const BEGIN: &str = "\
It has been built without its other commands: `cargo install --path cli` has all of them.";

#[derive(clap::Subcommand, Debug)]
enum Command {
    Demo(demo::Args),
    #[cfg(feature = "full")]
    #[command(flatten)]
    Other(Box<commands::Command>),
}

fn main() -> ExitCode {
    #[cfg(feature = "full")]
    completions::answer(Cli::command);
    let args = node_place::settled(std::env::args_os().collect(), &Cli::command());
    let result = match Cli::parse_from(args).command {
        Command::Demo(args) => demo::run(&args),
        #[cfg(feature = "full")]
        Command::Other(command) => command.run(Cli::command),
    };
    match result {
        Ok(outcome) => outcome.into(),
        Err(failure) => failure.report(),
    }
}
