//! `lexican`: CANopen on the command line.
//!
//! [`device`] loads data sheets, [`bus`] opens links and explains their errors, [`duration`] parses times, and [`output`] prints
//! results and sets the exit code; what needs no terminal is in `lexican_toolbox`. Each other module is one command.

mod access;
mod bench;
mod boot;
mod bus;
#[cfg(unix)]
mod chaos;
mod check;
mod completions;
mod conform;
mod demo;
mod device;
mod devices;
mod drive;
mod duration;
mod eds;
mod flash;
mod follow;
mod generate;
mod log;
mod lss;
mod monitor;
mod nmt;
mod node_place;
mod output;
#[cfg(test)]
mod pages;
mod parameters;
mod pdo;
mod print;
mod scan;
mod screen;
mod send;
mod simulate;
mod statistics;
#[cfg(test)]
mod style;
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

const BEGIN: &str = "\
To begin without hardware, open a simulated plant in the browser; or simulate a drive in one terminal, and try the other
commands in a second one:

    lexican bench --demo
    lexican simulate siko/ag03-1 --node 5
    lexican scan --bus slcan:/dev/pts/3          (the bus that the simulation prints)

A bus is can0, slcan:/dev/ttyACM0?bitrate=500000, sim:siko/ag03-1?node=5 or log:FILE. Exit codes: 0 success, \
1 findings, 2 failure.";

#[derive(clap::Subcommand, Debug)]
enum Command {
    Demo(demo::Args),
    Bench(Box<bench::Args>),
    /// Show, check, compare and format electronic data sheets (EDS, DCF)
    #[command(subcommand)]
    Eds(eds::Command),
    Gen(generate::Args),
    Scan(scan::Args),
    Read(access::ReadArgs),
    Write(access::WriteArgs),
    Backup(parameters::backup::Args),
    Restore(parameters::restore::Args),
    Compare(parameters::compare::Args),
    Apply(parameters::apply::Args),
    Nmt(nmt::Args),
    Boot(boot::Args),
    Flash(flash::Args),
    #[command(subcommand)]
    Lss(lss::Command),
    Drive(drive::Args),
    Send(send::frames::Args),
    Sync(send::sync::Args),
    Time(send::time::Args),
    Emcy(send::emcy::Args),
    Heartbeat(send::heartbeat::Args),
    Guard(send::guard::Args),
    Monitor(monitor::Args),
    Statistics(statistics::Args),
    Watch(follow::WatchArgs),
    Plot(follow::PlotArgs),
    Record(log::record::Args),
    Replay(log::replay::Args),
    Convert(log::convert::Args),
    /// Show and change what PDOs map, and when they are sent
    #[command(subcommand)]
    Pdo(pdo::Command),
    Check(check::Args),
    Conform(Box<conform::Args>),
    Simulate(simulate::Args),
    #[cfg(unix)]
    Chaos(Box<chaos::Args>),
    /// List the devices that lexican knows
    Devices,
    Completions(completions::CompletionsArgs),
    Man(completions::ManArgs),
}

fn main() -> ExitCode {
    completions::answer(Cli::command);
    let args = node_place::settled(std::env::args_os().collect(), &Cli::command());
    let result = match Cli::parse_from(args).command {
        Command::Demo(args) => demo::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Eds(command) => command.run(),
        Command::Gen(args) => generate::run(&args),
        Command::Scan(args) => scan::run(&args),
        Command::Read(args) => access::read(&args),
        Command::Write(args) => access::write(&args),
        Command::Backup(args) => parameters::backup::run(&args),
        Command::Restore(args) => parameters::restore::run(&args),
        Command::Compare(args) => parameters::compare::run(&args),
        Command::Apply(args) => parameters::apply::run(&args),
        Command::Nmt(args) => nmt::run(&args),
        Command::Boot(args) => boot::run(&args),
        Command::Flash(args) => flash::run(&args),
        Command::Lss(command) => command.run(),
        Command::Drive(args) => drive::run(&args),
        Command::Send(args) => send::frames::run(&args),
        Command::Sync(args) => send::sync::run(&args),
        Command::Time(args) => send::time::run(&args),
        Command::Emcy(args) => send::emcy::run(&args),
        Command::Heartbeat(args) => send::heartbeat::run(&args),
        Command::Guard(args) => send::guard::run(&args),
        Command::Monitor(args) => monitor::run(&args),
        Command::Statistics(args) => statistics::run(&args),
        Command::Watch(args) => follow::watch(&args),
        Command::Plot(args) => follow::plot(&args),
        Command::Record(args) => log::record::run(&args),
        Command::Replay(args) => log::replay::run(&args),
        Command::Convert(args) => log::convert::run(&args),
        Command::Pdo(command) => command.run(),
        Command::Check(args) => check::run(&args),
        Command::Conform(args) => conform::run(&args),
        Command::Simulate(args) => simulate::run(&args),
        #[cfg(unix)]
        Command::Chaos(args) => chaos::run(&args),
        Command::Devices => devices::run(),
        Command::Completions(args) => completions::completions(&args),
        Command::Man(args) => completions::man(&args, Cli::command()),
    };
    match result {
        Ok(outcome) => outcome.into(),
        Err(failure) => failure.report(),
    }
}
