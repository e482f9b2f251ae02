//! All commands except `demo`.

#[cfg(unix)]
use crate::chaos;
use crate::output::{Failure, Outcome};
use crate::{
    access, bench, boot, check, completions, conform, devices, drive, eds, flash, follow, generate, log, lsp, lss,
    machine, monitor, nmt, parameters, pdo, replace, run, scan, send, simulate, statistics,
};

#[derive(clap::Subcommand, Debug)]
pub(crate) enum Command {
    Bench(Box<bench::Args>),
    /// Show, check, compare and format electronic data sheets (EDS, DCF)
    #[command(subcommand)]
    Eds(eds::Command),
    Lsp(lsp::Args),
    Gen(generate::Args),
    /// Check, plan and format a machine in one file
    #[command(subcommand, long_about = machine::ABOUT)]
    Machine(machine::Command),
    Scan(scan::Args),
    Read(access::ReadArgs),
    Write(access::WriteArgs),
    Backup(parameters::backup::Args),
    Restore(parameters::restore::Args),
    Compare(parameters::compare::Args),
    Replace(replace::Args),
    Apply(parameters::apply::Args),
    Nmt(nmt::Args),
    Boot(boot::Args),
    Flash(flash::Args),
    #[command(subcommand)]
    Lss(lss::Command),
    Drive(drive::Args),
    Run(run::Args),
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

impl Command {
    /// Reports what is wrong with the arguments beyond what clap checks.
    pub(crate) fn check(&self) -> Result<(), Failure> {
        match self {
            Command::Drive(args) => args.check_value(),
            _ => Ok(()),
        }
    }

    /// Runs the command. `shell` can run all commands, for sequences.
    pub(crate) fn run(self, shell: run::Shell) -> Result<Outcome, Failure> {
        match self {
            Command::Bench(args) => bench::run(&args, shell),
            Command::Eds(command) => command.run(),
            Command::Lsp(args) => lsp::run(&args),
            Command::Gen(args) => generate::run(&args),
            Command::Machine(command) => command.run(),
            Command::Scan(args) => scan::run(&args),
            Command::Read(args) => access::read(&args),
            Command::Write(args) => access::write(&args),
            Command::Backup(args) => parameters::backup::run(&args),
            Command::Restore(args) => parameters::restore::run(&args),
            Command::Compare(args) => parameters::compare::run(&args),
            Command::Replace(args) => replace::run(&args),
            Command::Apply(args) => parameters::apply::run(&args),
            Command::Nmt(args) => nmt::run(&args),
            Command::Boot(args) => boot::run(&args),
            Command::Flash(args) => flash::run(&args),
            Command::Lss(command) => command.run(),
            Command::Drive(args) => drive::run(&args),
            Command::Run(args) => run::run(&args, shell),
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
            Command::Man(args) => completions::man(&args, (shell.command)()),
        }
    }
}
