//! `lexican read` and `lexican write`: objects of a node over SDO, by name and unit.

use lexican_eds::model::{Entry, Value};
use lexican_eds::types::DataType;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{AccessError, Link};
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::{AbortCode, NodeId};
use serde_json::{Map, Value as Json, json};

use crate::bus::object::resolve;
use crate::bus::{Node, NodeArgs, network};
use crate::output::{Failure, Outcome, note, print_result, warn};
use crate::values::DeviceValues;
use crate::values::report::ValueReport;
use crate::values::text::parse_as;
use crate::values::wire::{encode, parse_padded, written};

/// Read objects of a node by SDO
///
/// Objects are given by address (6064, 2410:05) or, if the device is known, by the names of its data sheet.
/// Without --device, lexican reads the node's identity (1018h) and looks it up among the devices it knows.
/// Exit code 1 if the node refuses any of them.
#[derive(clap::Args, Debug)]
#[command(after_help = READ_EXAMPLES)]
pub(crate) struct ReadArgs {
    #[command(flatten)]
    node: NodeArgs,

    /// Print one JSON object per line
    #[arg(long)]
    json: bool,

    /// The objects: 6064, 2410:05, "Position Actual Value"
    #[arg(required = true, value_name = "OBJECT")]
    objects: Vec<String>,
}

const READ_EXAMPLES: &str = "\
Examples:
    lexican read --bus can0 --node 5 6041 6064
    lexican read --bus sim:siko/ag03-1?node=5 \"Position Actual Value\"
    lexican read --bus can0 --node 7 --device FILE.eds --json 1018:01 | jq .value";

/// Write an object of a node by SDO
///
/// A value is a number (5000, 0x1F), a number with the unit of the data sheet ("24.0 V"), a name of its
/// enumeration ("profile velocity") or names of its bits joined by +. raw:240 is the number as it is transferred.
/// Without --device, lexican reads the node's identity (1018h) and looks it up among the devices it knows.
/// Exit code 1 if the node refuses.
#[derive(clap::Args, Debug)]
#[command(after_help = WRITE_EXAMPLES)]
pub(crate) struct WriteArgs {
    #[command(flatten)]
    node: NodeArgs,

    /// The data type, if no data sheet gives it: UNSIGNED16, VISIBLE_STRING, DOMAIN
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

const WRITE_EXAMPLES: &str = "\
Examples:
    lexican write --bus can0 --node 5 6060 \"profile velocity\"
    lexican write --bus can0 --node 5 2412 \"2.5 mm\"
    lexican write --bus can0 --node 9 --device none --type UNSIGNED16 1017 1000";

pub(crate) fn read(args: &ReadArgs) -> Result<Outcome, Failure> {
    let Node { link, id, device } = args.node.open()?;
    let device = device.as_ref();
    let addresses: Vec<_> = args.objects.iter().map(|text| resolve(device, text)).collect::<Result<_, _>>()?;
    let mut network = network(link)?;
    let mut values = device.map(DeviceValues::new);
    let mut outcome = Outcome::Clean;
    for address in addresses {
        if let Some(values) = &mut values {
            read_conditions(&mut network, id, address, values);
        }
        match network.read_bytes(id, address) {
            Ok(data) => {
                let report = ValueReport::of_bytes(values.as_ref(), address, &data);
                if let (Some(values), Some(value)) = (&mut values, &report.value) {
                    values.set(address, value);
                }
                print(args.json, id, report.json(), &report.equation())?;
            }
            Err(AccessError::Sdo { error, .. }) if is_answer(&error) => {
                print_refusal(args.json, id, &ValueReport::without_value(values.as_ref(), address), &error)?;
                outcome = Outcome::Found;
            }
            Err(error) => return Err(error.into()),
        }
    }
    Ok(outcome)
}

pub(crate) fn write(args: &WriteArgs) -> Result<Outcome, Failure> {
    let Node { link, id, device } = args.node.open()?;
    let device = device.as_ref();
    let address = resolve(device, &args.object)?;
    let mut network = network(link)?;
    let mut values = device.map(DeviceValues::new);
    let entry = device.and_then(|device| device.entry(address.index(), address.sub()));

    let (data_type, value) = match (args.data_type, &mut values, entry) {
        (Some(data_type), _, _) => (data_type, parse_as(data_type, &args.value)),
        (None, Some(values), Some(entry)) => {
            read_conditions(&mut network, id, address, values);
            (entry.data_type, values.parse(entry, &args.value))
        }
        (None, Some(_), None) => {
            return Err(Failure::new(format_args!("the data sheet has no {address}"))
                .help("name its data type with --type UNSIGNED16 to write it anyway"));
        }
        _ => {
            return Err(Failure::new(format_args!("the data type of {address} is unknown"))
                .help("name it with --type UNSIGNED16, or say with --device what the node is"));
        }
    };
    let value = value.map_err(|error| Failure::new(format_args!("{address}: {error}")))?;
    let data = encode(data_type, &value);
    let data = data.ok_or_else(|| Failure::new(format_args!("{address}: the value is no {data_type}")))?;
    match network.write_bytes(id, address, &written(device, data.clone())) {
        Ok(()) => {}
        Err(AccessError::Sdo { error, .. }) if is_answer(&error) => {
            print_refusal(args.json, id, &ValueReport::without_value(values.as_ref(), address), &error)?;
            if let (Some(values), Some(entry)) = (&values, entry)
                && let Some(limits) = limits(values, entry).filter(|_| is_about_the_value(&error))
            {
                note(format_args!("the data sheet allows {limits}"));
            }
            return Ok(Outcome::Found);
        }
        Err(error) => return Err(error.into()),
    }
    let report = ValueReport::of_bytes(values.as_ref(), address, &data);
    let text = if entry.is_some() { report.equation() } else { format!("{address} written") };
    print(args.json, id, report.json(), &text)?;
    Ok(Outcome::Clean)
}

/// Reads the entries on which the unit of an entry depends.
fn read_conditions<L: Link>(network: &mut Network<L>, node: NodeId, address: Address, values: &mut DeviceValues<'_>) {
    let Some(entry) = values.entry(address) else { return };
    for condition in values.conditions(entry) {
        // If the node does not answer, the default of its data sheet counts.
        let (Ok(data), Some(setting)) = (network.read_bytes(node, condition), values.entry(condition)) else {
            continue;
        };
        if let Some(value) = parse_padded(setting.data_type, &data) {
            values.set(condition, &value);
        }
    }
}

/// Whether the node has answered, though with an error.
fn is_answer(error: &SdoError) -> bool {
    !matches!(error, SdoError::TimedOut { .. })
}

fn print(as_json: bool, node: NodeId, mut fields: Map<String, Json>, text: &str) -> Result<(), Failure> {
    fields.insert("node".to_owned(), json!(node.get()));
    print_result(as_json, fields, text)
}

/// Prints an abort: an object for programs, a warning for people.
fn print_refusal(as_json: bool, node: NodeId, report: &ValueReport, error: &SdoError) -> Result<(), Failure> {
    match error {
        SdoError::Aborted { code, .. } if as_json => return print(true, node, report.refusal(*code), ""),
        SdoError::Aborted { code, .. } => warn(format_args!("{}: the device aborts: {code}", report.title())),
        error => warn(error),
    }
    Ok(())
}

fn is_about_the_value(error: &SdoError) -> bool {
    const ABOUT: [AbortCode; 3] = [AbortCode::INVALID_VALUE, AbortCode::VALUE_TOO_HIGH, AbortCode::VALUE_TOO_LOW];
    matches!(error, SdoError::Aborted { code, .. } if ABOUT.contains(code))
}

/// `-5.0 V to 30.0 V`: the limits that hold unconditionally.
fn limits(values: &DeviceValues<'_>, entry: &Entry) -> Option<String> {
    let text = |value: &Value| values.describe(entry, value);
    match (&entry.low, &entry.high) {
        (Some(low), Some(high)) => Some(format!("{} to {}", text(low), text(high))),
        (Some(low), None) => Some(format!("{} and more", text(low))),
        (None, Some(high)) => Some(format!("up to {}", text(high))),
        (None, None) => None,
    }
}

fn data_type(text: &str) -> Result<DataType, String> {
    DataType::from_name(text).ok_or_else(|| {
        let names: Vec<_> = DataType::ALL.iter().map(|data_type| data_type.name()).collect();
        format!("there is no data type {text:?}; there is {}", names.join(", "))
    })
}
