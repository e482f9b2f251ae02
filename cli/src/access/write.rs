//! `lexican write`: an object of a node, by name and unit.

use lexican_eds::model::{Entry, Value};
use lexican_eds::types::DataType;
use lexican_runtime::AbortCode;
use lexican_runtime::host::AccessError;
use lexican_runtime::service::sdo_client::SdoError;

use super::{learn_conditions, print, print_refusal, refused};
use crate::bus::failure::access_failure;
use crate::bus::object::resolve;
use crate::bus::{Node, NodeArgs, network};
use crate::output::{Failure, Outcome, note};
use crate::values::Known;
use crate::values::text::untyped;
use crate::values::told::Told;
use crate::values::wire::encode;

/// Write an object of a node by SDO
///
/// A value is a number (5000, 0x1F), a number with the unit of the data sheet ("24.0 V"), a name of its
/// enumeration ("profile velocity") or names of its bits joined by +. raw:240 is the number as it is on the
/// wire. Without --device the node is asked for its identity (1018h), and recognised when lexican knows the
/// device. Exit code 1 when the node refuses.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    node: NodeArgs,

    /// The data type, where no data sheet tells it: UNSIGNED16, VISIBLE_STRING, DOMAIN
    #[arg(long = "type", value_name = "TYPE", value_parser = data_type)]
    data_type: Option<DataType>,

    /// Print a JSON object
    #[arg(long)]
    json: bool,

    /// The object: 6064, 2410:05, "Target Position"
    object: String,

    /// The value
    #[arg(allow_hyphen_values = true)]
    value: String,
}

const EXAMPLES: &str = "\
Examples:
    lexican write --bus can0 --node 5 6060 \"profile velocity\"
    lexican write --bus can0 --node 5 2412 \"2.5 mm\"
    lexican write --bus can0 --node 9 --device none --type UNSIGNED16 1017 1000";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let Node { link, id, device } = args.node.open()?;
    let device = device.as_ref();
    let address = resolve(device, &args.object)?;
    let mut network = network(link)?;
    let mut known = device.map(Known::new);
    let entry = device.and_then(|device| device.entry(address.index(), address.sub()));

    let (data_type, value) = match (args.data_type, &mut known, entry) {
        (Some(data_type), _, _) => (data_type, untyped(data_type, &args.value)),
        (None, Some(known), Some(entry)) => {
            learn_conditions(&mut network, id, address, known);
            (entry.data_type, known.understand(entry, &args.value))
        }
        (None, Some(_), None) => {
            return Err(Failure::new(format_args!("the data sheet has no {address}"))
                .help("name its data type with --type UNSIGNED16 to write it all the same"));
        }
        _ => {
            return Err(Failure::new(format_args!("nothing tells the data type of {address}"))
                .help("name it with --type UNSIGNED16, or say with --device what the node is"));
        }
    };
    let value = value.map_err(|error| Failure::new(format_args!("{address}: {error}")))?;
    let data = encode(data_type, &value);
    let data = data.ok_or_else(|| Failure::new(format_args!("{address}: the value is no {data_type}")))?;
    match network.write_bytes(id, address, &data) {
        Ok(()) => {}
        Err(AccessError::Sdo { error, .. }) if refused(&error) => {
            print_refusal(args.json, id, &Told::entry(known.as_ref(), address), &error)?;
            if let (Some(known), Some(entry)) = (&known, entry)
                && let Some(limits) = limits(known, entry).filter(|_| is_about_the_value(&error))
            {
                note(format_args!("the data sheet allows {limits}"));
            }
            return Ok(Outcome::Found);
        }
        Err(error) => return Err(access_failure(&error)),
    }
    let told = Told::transferred(known.as_ref(), address, &data);
    let text = match entry {
        Some(_) => format!("{} = {}", told.title(), told.words()),
        None => format!("{address} written"),
    };
    print(args.json, id, told.json(), &text)?;
    Ok(Outcome::Clean)
}

/// Whether a node refuses because of what was to be written.
fn is_about_the_value(error: &SdoError) -> bool {
    const ABOUT: [AbortCode; 3] = [AbortCode::INVALID_VALUE, AbortCode::VALUE_TOO_HIGH, AbortCode::VALUE_TOO_LOW];
    matches!(error, SdoError::Aborted { code, .. } if ABOUT.contains(code))
}

/// `-5.0 V to 30.0 V`: what an entry may be, whatever the others are.
fn limits(known: &Known<'_>, entry: &Entry) -> Option<String> {
    let words = |value: &Value| known.describe(entry, value);
    match (&entry.low, &entry.high) {
        (Some(low), Some(high)) => Some(format!("{} to {}", words(low), words(high))),
        (Some(low), None) => Some(format!("{} and more", words(low))),
        (None, Some(high)) => Some(format!("up to {}", words(high))),
        (None, None) => None,
    }
}

fn data_type(text: &str) -> Result<DataType, String> {
    DataType::from_name(text).ok_or_else(|| {
        let names: Vec<_> = DataType::ALL.iter().map(|data_type| data_type.name()).collect();
        format!("there is no data type {text:?}; there is {}", names.join(", "))
    })
}
