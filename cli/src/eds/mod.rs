//! `lexican eds`: the commands for data sheets.

mod convert;
mod diff;
mod doc;
mod dump;
mod edit;
mod fetch;
mod file;
mod fmt;
pub(crate) mod lint;
mod new;
mod to_tools;

use crate::output::{Failure, Outcome};

/// The commands for data sheets.
#[derive(clap::Subcommand, Debug)]
pub(crate) enum Command {
    New(new::Args),
    Fetch(fetch::Args),
    Dump(dump::Args),
    Doc(doc::Args),
    Lint(lint::Args),
    Diff(diff::Args),
    Convert(convert::Args),
    Fmt(fmt::Args),
    Set(edit::SetArgs),
    Add(edit::AddArgs),
    Remove(edit::RemoveArgs),
    /// Write a CAN database (DBC) of the messages of nodes with this data sheet
    ///
    /// PDOs by the mapping of the data sheet, EMCY, SDO, heartbeat, NMT and SYNC. Names come from the data sheet, units,
    /// scaling and named values from its overlay and from CiA 301 and 402. Exit code 1 if two messages have the same COB-ID, of
    /// which the second is left out.
    #[command(after_help = to_tools::DBC_EXAMPLES)]
    ToDbc(to_tools::Args),
    /// Write a script by which Wireshark and tshark show objects of nodes with this data sheet by name and unit
    ///
    /// PDOs by the mapping of the data sheet, SDO transfers, and the vendor's error codes in EMCY. Each object is a field to
    /// filter by. Units are those that the data sheet or DCF sets; the script does not follow a setting that changes them on the
    /// bus, as `lexican monitor` does. A machine has one for all its nodes: `lexican machine export --format wireshark`.
    #[command(after_help = to_tools::WIRESHARK_EXAMPLES)]
    ToWireshark(to_tools::Args),
}

impl Command {
    pub(crate) fn run(self) -> Result<Outcome, Failure> {
        match self {
            Command::New(args) => new::run(&args),
            Command::Fetch(args) => fetch::run(&args),
            Command::Dump(args) => dump::run(&args),
            Command::Doc(args) => doc::run(&args),
            Command::Lint(args) => lint::run(&args),
            Command::Diff(args) => diff::run(&args),
            Command::Convert(args) => convert::run(&args),
            Command::Fmt(args) => fmt::run(&args),
            Command::Set(args) => edit::set(&args),
            Command::Add(args) => edit::add(&args),
            Command::Remove(args) => edit::remove(&args),
            Command::ToDbc(args) => to_tools::dbc(&args),
            Command::ToWireshark(args) => to_tools::wireshark(&args),
        }
    }
}
