//! `lexican machine`: commands for the file of a machine. All other commands find it too, and accept the names of its
//! nodes.

mod check;
mod export;
mod file;
mod fmt;
pub(crate) mod names;
mod new;
mod plan;

use crate::output::{Failure, Outcome, print_result};
pub(crate) use file::{OnBus, found, machine_of_sheet, on_bus, sheet_of_node, sound_on_bus, without_errors};
pub(crate) use plan::own_bus;

/// The commands for a machine in one file.
#[derive(clap::Subcommand, Debug)]
pub(crate) enum Command {
    New(new::Args),
    Check(check::Args),
    Plan(plan::Args),
    Export(export::Args),
    Fmt(fmt::Args),
    /// Print the JSON Schema of the file, by which editors complete and explain its keys
    Schema,
}

impl Command {
    pub(crate) fn run(self) -> Result<Outcome, Failure> {
        match self {
            Command::New(args) => new::run(&args),
            Command::Check(args) => check::run(&args),
            Command::Plan(args) => plan::run(&args),
            Command::Export(args) => export::run(&args),
            Command::Fmt(args) => fmt::run(&args),
            Command::Schema => {
                print_result(false, serde_json::Value::Null, format_args!("{:#}", lexican_machine::schema()))?;
                Ok(Outcome::Clean)
            }
        }
    }
}

/// The long help of the command.
pub(crate) const ABOUT: &str = "\
Check, plan and format a machine in one file

The file is machine.toml, in this folder or one above it, or what LEXICAN_MACHINE names. All other commands find it as well: \
they take the names of its nodes for their node-IDs, and its bus and data sheets where none are given; --bus sim is its \
simulation.

    [bus]
    url = \"can0\"
    bit-rate = \"500 kbit/s\"
    manager = 127
    heartbeat = \"200 ms\"             # the nodes watch it

    [node.feeder]
    id = 5
    sheet = \"siko/ag03-1\"            # a file, or a device that lexican knows
    overlay = [\"axis.toml\"]          # corrections and meanings in addition to it
    guarding = \"100 ms\"              # or heartbeat
    settings = { 6060 = \"profile velocity\", 2412 = \"2.5 mm\" }

    [node.io]
    id = 7
    sheet = \"io.eds\"
    heartbeat = \"100 ms\"
    optional = true
    tpdo.1 = [\"6000:01\"]

    [wire]                           # PDOs are made for it
    \"feeder.statusword\" = \"manager\"
    \"io.6000:01\" = { to = [\"manager\"], every = \"20 ms\" }

    [simulate.feeder]                # what a real machine does not need
    inputs = [\"blocked = true\"]

`lexican machine schema` has all keys, with their explanations.";
