//! `lexican eds`: the commands for data sheets.

mod diff;
mod dump;
mod fmt;
mod lint;

use crate::output::{Failure, Outcome};

/// The commands for data sheets.
#[derive(clap::Subcommand, Debug)]
pub(crate) enum Command {
    Dump(dump::Args),
    Lint(lint::Args),
    Diff(diff::Args),
    Fmt(fmt::Args),
}

impl Command {
    pub(crate) fn run(self) -> Result<Outcome, Failure> {
        match self {
            Command::Dump(args) => dump::run(&args),
            Command::Lint(args) => lint::run(&args),
            Command::Diff(args) => diff::run(&args),
            Command::Fmt(args) => fmt::run(&args),
        }
    }
}
