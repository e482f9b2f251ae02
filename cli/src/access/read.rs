//! `lexican read`: objects of a node, by name and unit.

use lexican_runtime::host::AccessError;

use super::{learn_conditions, print, print_refusal, refused};
use crate::bus::failure::access_failure;
use crate::bus::object::resolve;
use crate::bus::{Node, NodeArgs, network};
use crate::output::{Failure, Outcome};
use crate::values::Known;
use crate::values::told::Told;

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
                let text = format!("{} = {}", told.title(), told.words());
                print(args.json, id, told.json(), &text)?;
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
