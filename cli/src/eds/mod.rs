//! `lexican eds`: the commands for data sheets.

mod convert;
mod diff;
mod dump;
mod edit;
mod file;
mod fmt;
mod lint;
mod new;
mod to_dbc;

use crate::output::{Failure, Outcome};

/// The commands for data sheets.
#[derive(clap::Subcommand, Debug)]
pub(crate) enum Command {
    New(new::Args),
    Dump(dump::Args),
    Lint(lint::Args),
    Diff(diff::Args),
    Convert(convert::Args),
    Fmt(fmt::Args),
    Set(edit::SetArgs),
    Add(edit::AddArgs),
    Remove(edit::RemoveArgs),
    ToDbc(to_dbc::Args),
}

impl Command {
    pub(crate) fn run(self) -> Result<Outcome, Failure> {
        match self {
            Command::New(args) => new::run(&args),
            Command::Dump(args) => dump::run(&args),
            Command::Lint(args) => lint::run(&args),
            Command::Diff(args) => diff::run(&args),
            Command::Convert(args) => convert::run(&args),
            Command::Fmt(args) => fmt::run(&args),
            Command::Set(args) => edit::set(&args),
            Command::Add(args) => edit::add(&args),
            Command::Remove(args) => edit::remove(&args),
            Command::ToDbc(args) => to_dbc::run(&args),
        }
    }
}
