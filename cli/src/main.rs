//! `lexican`: CANopen on the command line.
//!
//! [`device`] loads data sheets, [`bus`] opens links and explains their errors, and [`output`] prints results and sets
//! the exit code. What needs no terminal is in `lexican_toolbox`. All other modules are commands: `demo`, and with the
//! feature `full` all [`commands`].

// Without the feature, some of the shared code is unused.
#![cfg_attr(not(feature = "full"), allow(dead_code, unused_imports))]

mod demo;
mod device;
mod node_place;
mod output;
mod print;

/// The modules that only the full command has.
#[cfg(feature = "full")]
#[path = ""]
mod whole {
    pub(crate) mod access;
    pub(crate) mod bench;
    pub(crate) mod boot;
    pub(crate) mod bus;
    #[cfg(unix)]
    pub(crate) mod chaos;
    pub(crate) mod check;
    pub(crate) mod commands;
    pub(crate) mod completions;
    pub(crate) mod conform;
    pub(crate) mod devices;
    pub(crate) mod drive;
    pub(crate) mod eds;
    pub(crate) mod flash;
    pub(crate) mod follow;
    pub(crate) mod generate;
    pub(crate) mod log;
    pub(crate) mod lsp;
    pub(crate) mod lss;
    pub(crate) mod machine;
    pub(crate) mod monitor;
    pub(crate) mod nmt;
    #[cfg(test)]
    mod pages;
    pub(crate) mod parameters;
    pub(crate) mod pdo;
    pub(crate) mod replace;
    pub(crate) mod run;
    pub(crate) mod scan;
    pub(crate) mod screen;
    pub(crate) mod send;
    pub(crate) mod simulate;
    pub(crate) mod statistics;
    #[cfg(test)]
    mod style;
}

use std::ffi::OsString;
use std::process::ExitCode;

use clap::{CommandFactory, Parser};
#[cfg(feature = "full")]
use whole::*;

/// CANopen on the command line: check data sheets, generate code from them, simulate and move drives
#[derive(Parser, Debug)]
#[command(name = "lexican", version, arg_required_else_help = true, after_help = BEGIN)]
struct Cli {
    #[command(subcommand)]
    command: Command,

    /// The file of the machine; by default what LEXICAN_MACHINE names, or machine.toml in this folder or one above it
    #[cfg(feature = "full")]
    #[arg(id = "file-of-machine", long = "machine", value_name = "FILE", global = true)]
    _machine: Option<std::path::PathBuf>,
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
    let args = resolved(std::env::args_os().collect(), &Cli::command());
    match carried_out(args) {
        Ok(outcome) => outcome.into(),
        Err(failure) => failure.report(),
    }
}

/// Resolves names of the machine's nodes, and puts the node where the command takes it.
fn resolved(args: Vec<OsString>, cli: &clap::Command) -> Vec<OsString> {
    #[cfg(feature = "full")]
    let args = machine::names::resolved(args, cli);
    node_place::settled(args, cli)
}

fn carried_out(args: Vec<OsString>) -> Result<output::Outcome, output::Failure> {
    match Cli::try_parse_from(args).unwrap_or_else(|error| error.exit()).command {
        Command::Demo(args) => demo::run(&args),
        #[cfg(feature = "full")]
        Command::Other(command) => command.run(SHELL),
    }
}

/// What sequences use of this command.
#[cfg(feature = "full")]
const SHELL: run::Shell = run::Shell { command: Cli::command, resolved, check: understood, run: carried_out };

/// Checks arguments without running them; returns the error text.
#[cfg(feature = "full")]
fn understood(args: Vec<OsString>) -> Result<(), String> {
    match Cli::try_parse_from(args) {
        Ok(Cli { command: Command::Other(command), .. }) => command.check().map_err(|failure| failure.to_string()),
        Ok(_) => Ok(()),
        Err(error) => {
            let text = error.to_string();
            let reason = text.split("\n\nUsage:").next().and_then(|text| text.split("\n\nFor more").next());
            Err(reason.unwrap_or_default().trim_start_matches("error: ").to_owned())
        }
    }
}
