//! `lexican read`: objects of a node, by name and unit.

use std::io::Write;

use lexican_runtime::NodeId;
use lexican_runtime::host::AccessError;
use lexican_runtime::host::Link;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::SdoError;
use serde_json::{Value as Json, json};

use crate::bus::failure::access_failure;
use crate::bus::object::resolve;
use crate::bus::{Node, NodeArgs, network};
use crate::output::{Failure, Outcome, warn};
use crate::values::Known;
use crate::values::told::Told;
use crate::values::wire::{fitting, parse};

/// Read objects of a node by SDO
///
/// Objects are named by address (6064, 2410:05) or, when the device is known, by the names of its data sheet.
/// Without --device the node is asked for its identity (1018h), and recognised when lexican knows the device.
/// Exit code 1 when the node refuses any of them.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    node: NodeArgs,

    /// Print one JSON object per line
    #[arg(long)]
    json: bool,

    /// The objects: 6064, 2410:05, "Position Actual Value"
    #[arg(required = true, value_name = "OBJECT")]
    objects: Vec<String>,
}

const EXAMPLES: &str = "\
Examples:
    lexican read --bus can0 --node 5 6041 6064
    lexican read --bus sim:siko/ag03-1?node=5 \"Position Actual Value\"
    lexican read --bus can0 --node 7 --device FILE.eds --json 1018:01 | jq .value";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let Node { link, id, device } = args.node.open()?;
    let device = device.as_ref();
    let addresses: Vec<_> = args.objects.iter().map(|text| resolve(device, text)).collect::<Result<_, _>>()?;
    let mut network = network(link)?;
    let mut known = device.map(Known::new);
    let mut outcome = Outcome::Clean;
    for address in addresses {
        if let Some(known) = &mut known {
            learn_conditions(&mut network, id, address, known);
        }
        match network.read_bytes(id, address) {
            Ok(data) => {
                let told = Told::transferred(known.as_ref(), address, &data);
                if let (Some(known), Some(value)) = (&mut known, &told.value) {
                    known.learn(address.index(), address.sub(), value);
                }
                print(args.json, id, &told)?;
            }
            Err(AccessError::Sdo { error, .. }) if refused(&error) => {
                print_refusal(args.json, id, &Told::entry(known.as_ref(), address), &error)?;
                outcome = Outcome::Found;
            }
            Err(error) => return Err(access_failure(&error)),
        }
    }
    Ok(outcome)
}

/// Reads the settings of the node that decide what a value means.
pub(crate) fn learn_conditions<L: Link>(
    network: &mut Network<L>,
    node: NodeId,
    address: Address,
    known: &mut Known<'_>,
) {
    let Some(entry) = known.device.entry(address.index(), address.sub()) else { return };
    for condition in known.conditions(entry) {
        let (index, sub) = (condition.index(), condition.sub());
        // Where the node does not tell, its data sheet does.
        let (Ok(data), Some(setting)) = (network.read_bytes(node, condition), known.device.entry(index, sub)) else {
            continue;
        };
        if let Some(value) = parse(setting.data_type, fitting(setting.data_type, &data)) {
            known.learn(index, sub, &value);
        }
    }
}

/// Whether a node answered, if not what was hoped for.
pub(crate) fn refused(error: &SdoError) -> bool {
    !matches!(error, SdoError::TimedOut { .. })
}

/// That a node refused: an object for programs, a warning for people.
pub(crate) fn print_refusal(as_json: bool, node: NodeId, told: &Told, error: &SdoError) -> Result<(), Failure> {
    match error {
        SdoError::Aborted { code, .. } if as_json => {
            let mut fields = told.refusal(*code);
            fields.insert("node".to_owned(), json!(node.get()));
            writeln!(anstream::stdout().lock(), "{}", Json::Object(fields))?;
        }
        SdoError::Aborted { code, .. } => warn(format_args!("{}: the device aborts: {code}", told.title())),
        error => warn(error),
    }
    Ok(())
}

fn print(as_json: bool, node: NodeId, told: &Told) -> Result<(), Failure> {
    let mut stdout = anstream::stdout().lock();
    if as_json {
        let mut fields = told.json();
        fields.insert("node".to_owned(), json!(node.get()));
        writeln!(stdout, "{}", Json::Object(fields))?;
    } else {
        writeln!(stdout, "{} = {}", told.title(), told.words())?;
    }
    stdout.flush()?;
    Ok(())
}
