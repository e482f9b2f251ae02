//! `lexican pdo`: shows and changes the configuration of PDOs.

mod map;
mod node;
mod show;

use crate::output::{Failure, Outcome};

#[derive(clap::Subcommand, Debug)]
pub(crate) enum Command {
    Show(show::Args),
    Map(Box<map::Args>),
}

impl Command {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        match self {
            Command::Show(args) => show::run(args),
            Command::Map(args) => map::run(args),
        }
    }
}
