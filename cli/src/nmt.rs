//! `lexican nmt`: commands to the state machine of nodes.

use std::io::Write;

use lexican_runtime::host::Pace;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::wire::nmt::{NmtCommand, NmtMessage, NmtState};
use lexican_runtime::{Duration, NodeId};

use crate::bus::failure::link_failure;
use crate::bus::{BusArgs, node_id};
use crate::output::{Failure, Outcome};

/// Send an NMT command to a node, or to all
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    bus: BusArgs,

    /// What to do
    #[arg(value_enum)]
    command: Command,

    /// The node-ID, 1 to 127
    #[arg(long, value_name = "ID", value_parser = node_id, required_unless_present = "all")]
    node: Option<NodeId>,

    /// All nodes
    #[arg(long, conflicts_with = "node")]
    all: bool,

    /// Print a JSON object
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican nmt --bus can0 start --node 5
    lexican nmt --bus can0 reset-node --all";

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum Command {
    /// Enter OPERATIONAL: everything works
    Start,
    /// Enter STOPPED: only NMT and heartbeat work
    Stop,
    /// Enter PRE-OPERATIONAL: everything but PDOs works
    PreOperational,
    /// Begin anew, as after power-on
    ResetNode,
    /// Begin anew with the communication objects only
    ResetCommunication,
}

impl From<Command> for NmtCommand {
    fn from(command: Command) -> NmtCommand {
        match command {
            Command::Start => NmtCommand::Start,
            Command::Stop => NmtCommand::Stop,
            Command::PreOperational => NmtCommand::EnterPreOperational,
            Command::ResetNode => NmtCommand::ResetNode,
            Command::ResetCommunication => NmtCommand::ResetCommunication,
        }
    }
}

/// NMT has no answer; so long the frame may take to leave.
const LEAVING: Duration = Duration::from_millis(20);

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let mut network = Network::new(args.bus.open(Pace::Virtual)?.settled()?.link);
    let message = NmtMessage { command: args.command.into(), node: args.node };
    network.command(message.command, message.node).map_err(|error| link_failure(&error))?;
    let until = network.now() + LEAVING;
    while network.next_event(until).map_err(|error| link_failure(&error))?.is_some() {}
    let whom = message.node.map_or("all nodes".to_owned(), |node| format!("node {node}"));
    let what = match message.command.target() {
        NmtState::Initialising => message.command.to_string(),
        state => format!("enter {state}"),
    };
    let mut stdout = anstream::stdout().lock();
    if args.json {
        let node = message.node.map(NodeId::get);
        writeln!(stdout, "{}", serde_json::json!({ "node": node, "command": message.command.to_string() }))?;
    } else {
        writeln!(stdout, "{whom}: {what}")?;
    }
    Ok(Outcome::Clean)
}
