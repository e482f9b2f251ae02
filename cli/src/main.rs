//! `lexican`: CANopen on the command line.
//!
//! [`device`] finds the data sheet that a command is about, [`decode`] puts frames into words, [`output`]
//! knows how a command ends; every other module is one command.

mod bus;
mod decode;
mod demo;
mod device;
mod devices;
mod eds;
mod generate;
mod monitor;
mod nmt;
mod output;
mod print;
mod read;
mod scan;
mod simulate;
mod values;
mod write;

use std::process::ExitCode;

use clap::Parser;

/// CANopen on the command line: check data sheets, generate code from them, simulate and move drives
#[derive(Parser, Debug)]
#[command(name = "lexican", version, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand, Debug)]
enum Command {
    Demo(demo::Args),
    /// Show, check, compare and tidy electronic data sheets (EDS, DCF)
    #[command(subcommand)]
    Eds(eds::Command),
    Gen(generate::Args),
    Scan(scan::Args),
    Read(read::Args),
    Write(write::Args),
    Nmt(nmt::Args),
    Monitor(monitor::Args),
    Simulate(simulate::Args),
    /// List the devices that lexican brings along
    Devices,
}

fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Demo(args) => demo::run(&args),
        Command::Eds(command) => command.run(),
        Command::Gen(args) => generate::run(&args),
        Command::Scan(args) => scan::run(&args),
        Command::Read(args) => read::run(&args),
        Command::Write(args) => write::run(&args),
        Command::Nmt(args) => nmt::run(&args),
        Command::Monitor(args) => monitor::run(&args),
        Command::Simulate(args) => simulate::run(&args),
        Command::Devices => devices::run(),
    };
    match result {
        Ok(outcome) => outcome.into(),
        Err(failure) => failure.report(),
    }
}
