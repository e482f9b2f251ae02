//! `lexican`: CANopen on the command line.
//!
//! [`device`] loads data sheets, [`identity`] recognises devices on the bus, [`bus`] opens links and explains their errors,
//! [`values`] and [`decode`] turn values and frames into text and JSON, [`duration`] parses times, and [`output`] prints
//! results and sets the exit code. Each other module is one command.

mod access;
mod boot;
mod bus;
mod check;
mod conform;
mod decode;
mod demo;
mod device;
mod devices;
mod duration;
mod eds;
mod generate;
mod identity;
mod lss;
mod monitor;
mod nmt;
mod output;
mod print;
mod scan;
mod simulate;
mod values;

use std::process::ExitCode;

use clap::Parser;

/// CANopen on the command line: check data sheets, generate code from them, simulate and move drives
#[derive(Parser, Debug)]
#[command(name = "lexican", version, arg_required_else_help = true, after_help = BEGIN)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const BEGIN: &str = "\
To begin without hardware, simulate a drive in one terminal, and try the other commands in a second one:

    lexican simulate siko/ag03-1 --node 5
    lexican scan --bus slcan:/dev/pts/3          (the bus that the first command prints)

A bus is can0, slcan:/dev/ttyACM0?bitrate=500000, sim:siko/ag03-1?node=5 or log:FILE. Exit codes: 0 success, \
1 findings, 2 failure.";

#[derive(clap::Subcommand, Debug)]
enum Command {
    Demo(demo::Args),
    /// Show, check, compare and format electronic data sheets (EDS, DCF)
    #[command(subcommand)]
    Eds(eds::Command),
    Gen(generate::Args),
    Scan(scan::Args),
    Read(access::ReadArgs),
    Write(access::WriteArgs),
    Nmt(nmt::Args),
    Boot(boot::Args),
    #[command(subcommand)]
    Lss(lss::Command),
    Monitor(monitor::Args),
    Check(check::Args),
    Conform(Box<conform::Args>),
    Simulate(simulate::Args),
    /// List the devices that lexican knows
    Devices,
}

fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Demo(args) => demo::run(&args),
        Command::Eds(command) => command.run(),
        Command::Gen(args) => generate::run(&args),
        Command::Scan(args) => scan::run(&args),
        Command::Read(args) => access::read(&args),
        Command::Write(args) => access::write(&args),
        Command::Nmt(args) => nmt::run(&args),
        Command::Boot(args) => boot::run(&args),
        Command::Lss(command) => command.run(),
        Command::Monitor(args) => monitor::run(&args),
        Command::Check(args) => check::run(&args),
        Command::Conform(args) => conform::run(&args),
        Command::Simulate(args) => simulate::run(&args),
        Command::Devices => devices::run(),
    };
    match result {
        Ok(outcome) => outcome.into(),
        Err(failure) => failure.report(),
    }
}
