//! `lexican read`: objects of a node, by name and unit.

use std::io::Write;

use lexican_eds::model::Value;
use lexican_runtime::NodeId;
use lexican_runtime::host::AccessError;
use lexican_runtime::host::Link;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::SdoError;
use serde_json::{Value as Json, json};

use crate::bus::object::{describe, resolve};
use crate::bus::{Node, NodeArgs, access_failure};
use crate::output::{Failure, Outcome, warn};
use crate::values::wire::{fitting, parse};
use crate::values::{Known, hex};

/// Read objects of a node by SDO
///
/// Objects are named by address (6064, 2410:05) or, when the device is known, by the names of its data sheet.
/// Exit code 1 when the node refuses any of them.
#[derive(clap::Args, Debug)]
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

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let Node { link, id, device } = args.node.open()?;
    let device = device.as_ref().map(|loaded| &loaded.device);
    let addresses: Vec<_> = args.objects.iter().map(|text| resolve(device, text)).collect::<Result<_, _>>()?;
    let mut network = Network::new(link);
    let mut known = device.map(Known::new);
    let mut outcome = Outcome::Clean;
    for address in addresses {
        if let Some(known) = &mut known {
            learn_conditions(&mut network, id, address, known);
        }
        match network.read_bytes(id, address) {
            Ok(data) => print(args.json, id, &Read::new(address, &data, known.as_mut()))?,
            Err(AccessError::Sdo { error, .. }) if refused(&error) => {
                warn(error);
                outcome = Outcome::Found;
            }
            Err(error) => return Err(access_failure(error)),
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

/// What was read.
struct Read<'a> {
    address: Address,
    data: &'a [u8],
    /// By the data sheet: what it is, in words, and as a number or text.
    told: Option<(String, String, Json)>,
}

impl<'a> Read<'a> {
    fn new(address: Address, data: &'a [u8], known: Option<&mut Known<'_>>) -> Self {
        let told = known.and_then(|known| {
            let entry = known.device.entry(address.index(), address.sub())?;
            let value = parse(entry.data_type, fitting(entry.data_type, data))?;
            known.learn(address.index(), address.sub(), &value);
            let number = match &value {
                Value::Integer(number) => i64::try_from(*number).map_or(Json::Null, Json::from),
                Value::Real(number) => json!(number),
                Value::Text(text) => json!(text),
                _ => Json::Null,
            };
            Some((describe(known.device, entry), known.describe(entry, &value), number))
        });
        Read { address, data, told }
    }
}

fn print(as_json: bool, node: NodeId, read: &Read<'_>) -> Result<(), Failure> {
    let mut stdout = anstream::stdout().lock();
    let Read { address, data, told } = read;
    if as_json {
        let (name, text, value) = match told {
            Some((name, text, value)) => (Some(name), Some(text), value.clone()),
            None => (None, None, Json::Null),
        };
        let raw = hex(data);
        writeln!(
            stdout,
            "{}",
            json!({ "node": node.get(), "address": address.to_string(), "name": name, "value": value, "text": text, "raw": raw })
        )?;
    } else {
        match told {
            Some((name, text, _)) => writeln!(stdout, "{name} = {text}")?,
            None => writeln!(stdout, "{address} = {}", hex(data))?,
        }
    }
    stdout.flush()?;
    Ok(())
}
