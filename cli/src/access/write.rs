//! `lexican write`.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use clap_complete::engine::ArgValueCompleter;
use lexican_eds::model::{Device, Value};
use lexican_eds::types::{Class, DataType};
use lexican_runtime::NodeId;
use lexican_runtime::host::AccessError;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::object::Address;
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::lookup::resolve;
use lexican_toolbox::values::report::ValueReport;
use lexican_toolbox::values::text::parse_as;
use lexican_toolbox::values::wire::{encode, written};
use serde_json::json;

use super::{Printer, follow, is_answer, read_conditions};
use crate::bus::{BoxedLink, NODES, NetworkArgs, NodeIds};
use crate::completions::objects;
use crate::output::{Failure, Outcome, ctrl_c, note, warn};
use lexican_toolbox::text::files::read_up_to;

/// Write an object of nodes by SDO
///
/// A value is a number (5000, 0x1F), a number with the unit of the data sheet ("24.0 V"), a name of its
/// enumeration ("profile velocity") or names of its bits joined by +. raw:240 is the number as it is transferred.
/// A DOMAIN is pairs of digits (01 A0 FF), or the content of a file: @image.bin.
///
/// What the data sheet does not allow (access, limits, values without a name) is not sent, unless --force is given. Without
/// --device, lexican reads the node's identity (1018h) and looks it up among the devices it knows. Exit code 1 if the data
/// sheet or a node refuses; 2 if the text is no value, or a node does not answer.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct WriteArgs {
    #[command(flatten)]
    network: NetworkArgs,

    #[arg(long, value_name = "NODES", help = NODES)]
    node: Option<NodeIds>,

    /// The data type, if no data sheet gives it: UNSIGNED16, VISIBLE_STRING, DOMAIN
    #[arg(long = "type", value_name = "TYPE", value_parser = data_type)]
    data_type: Option<DataType>,

    /// Write also what the data sheet does not allow
    #[arg(long)]
    force: bool,

    /// Print a JSON object
    #[arg(long)]
    json: bool,

    /// The object: 6064, 2410:05, 2410/v-Pos, "Target Position"
    #[arg(add = ArgValueCompleter::new(objects))]
    object: String,

    /// The value
    #[arg(allow_hyphen_values = true)]
    value: String,
}

const EXAMPLES: &str = "\
Examples:
    lexican write --bus can0 --node 5 6060 \"profile velocity\"
    lexican write --bus can0 --node 3,5-9 2412 \"2.5 mm\"
    lexican write --bus can0 --node 5 1F50:1 @program.bin
    lexican write --bus can0 --node 9 --device none --type UNSIGNED16 1017 1000";

pub(crate) fn write(args: &WriteArgs) -> Result<Outcome, Failure> {
    let nodes = args.network.connect_several(args.node.as_ref())?;
    let (names_node, interrupted) = (nodes.are_several(), ctrl_c()?);
    nodes.for_each(|network, node, device| {
        let printer = Printer { node, json: args.json, names_node };
        write_one(network, node, device, args, printer, &interrupted)
    })
}

fn write_one(
    network: &mut Network<BoxedLink>,
    node: NodeId,
    device: Option<&Device>,
    args: &WriteArgs,
    printer: Printer,
    interrupted: &AtomicBool,
) -> Result<Outcome, Failure> {
    let address = resolve(device, &args.object)?;
    let mut values = device.map(DeviceValues::new);
    let entry = device.and_then(|device| device.entry(address.index(), address.sub()));
    if let Some(values) = &mut values {
        read_conditions(network, node, address, values)?;
    }
    let data_type = match (args.data_type, entry) {
        (Some(data_type), _) => data_type,
        (None, Some(entry)) => entry.data_type,
        (None, None) if device.is_some() => {
            return Err(Failure::new(format_args!("the data sheet has no {address}"))
                .help("name its data type with --type UNSIGNED16 to write it anyway"));
        }
        (None, None) => {
            return Err(Failure::new(format_args!("the data type of {address} is unknown"))
                .help("name it with --type UNSIGNED16, or say with --device what the node is"));
        }
    };
    let value = match (file(data_type, &args.value), &values, entry) {
        (Some(path), ..) => Value::Bytes(content(path)?),
        (None, Some(values), Some(entry)) if args.data_type.is_none() => {
            parsed(address, values.parse(entry, &args.value))?
        }
        _ => parsed(address, parse_as(data_type, &args.value))?,
    };
    let report = ValueReport::without_value(values.as_ref(), address);
    if let (Some(values), Some(entry), false) = (&values, entry, args.force)
        && let Err(refusal) = values.check_write(entry, &value, node)
    {
        if args.json {
            let mut fields = report.json();
            fields.insert("refused".to_owned(), json!(refusal.to_string()));
            printer.print(fields, "")?;
        } else {
            warn(format_args!("{}{}: {refusal}", printer.prefix(), report.title()));
            note("nothing was written; --force writes it anyway");
        }
        return Ok(Outcome::Found);
    }
    let data = encode(data_type, &value);
    let data = data.ok_or_else(|| Failure::new(format_args!("{address}: the value is no {data_type}")))?;
    let bytes = written(device, data.clone());
    let len = u32::try_from(bytes.len()).map_err(|_| Failure::new("SDO transfers less than 4 GiB"))?;
    let what = format!("writing {address}");
    let mut followed = follow(&what, Some(bytes.len()), &*bytes, interrupted);
    let result = network.write_from(node, address, len, &mut followed);
    if followed.is_interrupted() {
        return Err(Failure::new(format_args!("{address}: interrupted, after part of it was written"))
            .help("`lexican read` shows what the device has"));
    }
    drop(followed);
    match result {
        Ok(()) => {}
        Err(AccessError::Sdo { error, .. }) if is_answer(&error) => {
            printer.refusal(&report, &error)?;
            return Ok(Outcome::Found);
        }
        Err(error) => return Err(error.into()),
    }
    let report = ValueReport::of_bytes(values.as_ref(), address, &data);
    let text = if entry.is_some() { report.equation() } else { format!("{address} written") };
    printer.print(report.json(), &text)?;
    Ok(Outcome::Clean)
}

fn parsed(address: Address, value: Result<Value, String>) -> Result<Value, Failure> {
    value.map_err(|error| Failure::new(format_args!("{address}: {error}")))
}

/// The file in a value such as `@image.bin`.
fn file(data_type: DataType, value: &str) -> Option<&Path> {
    let takes_files = matches!(data_type.class(), Class::Bytes | Class::Other);
    value.strip_prefix('@').filter(|_| takes_files).map(Path::new)
}

/// The content of a file, at most as long as an SDO transfer.
fn content(path: &Path) -> Result<Vec<u8>, Failure> {
    const LONGEST: usize = u32::MAX as usize;
    let data = read_up_to(path, LONGEST)?;
    if data.len() == LONGEST {
        return Err(Failure::new(format_args!("{} is longer than SDO can transfer", path.display())));
    }
    Ok(data)
}

pub(crate) fn data_type(text: &str) -> Result<DataType, String> {
    DataType::from_name(text).ok_or_else(|| {
        let names: Vec<_> = DataType::ALL.iter().map(|data_type| data_type.name()).collect();
        format!("there is no data type {text:?}; there is {}", names.join(", "))
    })
}
