//! `lexican lss`: configures node-IDs and bit rates of devices selected by identity (CiA 305).

mod args;
mod configure;
mod find;
mod print;
#[cfg(test)]
mod tests;

use serde_json::json;

use crate::output::{Failure, Outcome};
pub(crate) use args::number;
use args::{DeviceArgs, DevicesArgs};
use print::{describe, print, print_refusal, selected_json, title};

/// Give node-IDs and bit rates to devices with LSS (CiA 305)
///
/// Every command begins and ends with all devices in the state WAITING: a selection does not last until the next
/// command. Older devices may need `lexican nmt stop --all` first: some have LSS only while they are stopped.
#[derive(clap::Subcommand, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) enum Command {
    Find(find::Args),
    /// Show the identity and the node-ID of a device
    Inquire(DeviceArgs),
    NodeId(configure::NodeIdArgs),
    BitRate(configure::BitRateArgs),
    /// Let a device, or all, store node-ID and bit rate
    ///
    /// Exit code 1 if a device refuses: not every device can.
    Store(DevicesArgs),
}

const EXAMPLES: &str = "\
Examples:
    lexican lss find --bus can0                                (devices without node-ID)
    lexican lss node-id --bus can0 --unconfigured 5 --store    (give node-ID 5 to the next one)
    lexican lss inquire --bus can0                             (the only device on the bus)";

impl Command {
    pub(crate) fn run(self) -> Result<Outcome, Failure> {
        match self {
            Command::Find(args) => find::run(&args),
            Command::Inquire(args) => inquire(&args),
            Command::NodeId(args) => configure::node_id(&args),
            Command::BitRate(args) => configure::bit_rate(&args),
            Command::Store(args) => store(&args),
        }
    }
}

fn inquire(args: &DeviceArgs) -> Result<Outcome, Failure> {
    let selected = args.link.run(|session| Ok(session.select(args.target())?))?;
    let node = selected.node.map_or_else(|| "no node-ID".to_owned(), |node| format!("node-ID {node}"));
    let text = format!("{}, {node}", describe(selected.identity));
    print(args.link.json, selected_json(Some(selected)), json!({}), &text)?;
    Ok(Outcome::Clean)
}

fn store(args: &DevicesArgs) -> Result<Outcome, Failure> {
    let json = args.device.link.json;
    args.device.link.run(|session| {
        let selected = args.select(session)?;
        if let Err(refusal) = session.store()? {
            return print_refusal(json, selected, refusal);
        }
        print(json, selected_json(selected), json!({ "stored": true }), &format!("{}: stored", title(selected)))?;
        Ok(Outcome::Clean)
    })
}
