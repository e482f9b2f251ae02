//! `lexican lss`: node-IDs and bit rates for devices that are found by their identity (CiA 305).

mod args;
mod bit_rate;
mod find;
mod inquire;
mod node_id;
mod print;
mod session;
mod store;

use crate::output::{Failure, Outcome};

/// Give node-IDs and bit rates to devices that have LSS (CiA 305)
///
/// Every command begins and ends with all devices waiting: what one command has selected is not selected in the
/// next. Some older devices answer to LSS only while they are stopped: `lexican nmt stop --all`.
#[derive(clap::Subcommand, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) enum Command {
    Find(find::Args),
    Inquire(inquire::Args),
    NodeId(node_id::Args),
    BitRate(bit_rate::Args),
    Store(store::Args),
}

const EXAMPLES: &str = "\
Examples:
    lexican lss find --bus can0                                (who has no node-ID?)
    lexican lss node-id --bus can0 --unconfigured 5 --store    (give node-ID 5 to the next one)
    lexican lss inquire --bus can0                             (the only device on the bus)";

impl Command {
    pub(crate) fn run(self) -> Result<Outcome, Failure> {
        match self {
            Command::Find(args) => find::run(&args),
            Command::Inquire(args) => inquire::run(&args),
            Command::NodeId(args) => node_id::run(&args),
            Command::BitRate(args) => bit_rate::run(&args),
            Command::Store(args) => store::run(&args),
        }
    }
}
