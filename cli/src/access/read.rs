//! `lexican read`.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap_complete::engine::ArgValueCompleter;
use lexican_eds::model::Device;
use lexican_runtime::NodeId;
use lexican_runtime::cia301;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{AccessError, Bytes};
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::SdoError;
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::lookup::resolve_all;
use lexican_toolbox::values::report::ValueReport;

use super::{Printer, follow, is_answer, read_conditions};
use crate::bus::{BoxedLink, NODES, NetworkArgs, NodeIds};
use crate::completions::objects;
use crate::output::{Failure, ForceArgs, Outcome, ctrl_c, raw_stdout};

/// Read objects of nodes by SDO
///
/// Objects are given by address (6064, 2410:05), by a path (2410/5, "Motor Parameter Set/v-Pos") or, if the device is
/// known, by the names of its data sheet. An index without a sub-index, and the name of a record or an array, are all of
/// its entries; 2410:00 is the first of them. Without --device, lexican reads the node's identity (1018h) and looks it up
/// among the devices it knows. Exit code 1 if a node refuses any of them; 2 if one of several nodes does not answer.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ReadArgs {
    #[command(flatten)]
    network: NetworkArgs,

    #[arg(long, value_name = "NODES", help = NODES)]
    node: Option<NodeIds>,

    /// Write the bytes of the object into a file; - for stdout
    #[arg(long, short, value_name = "FILE", conflicts_with = "json")]
    output: Option<PathBuf>,

    #[command(flatten)]
    force: ForceArgs,

    /// The most bytes that are taken of an object of any length; the transfer of a longer one is aborted
    #[arg(long, value_name = "BYTES", default_value_t = LONGEST, value_parser = clap::value_parser!(u32).range(4..))]
    max: u32,

    /// Print one JSON object per line
    #[arg(long)]
    json: bool,

    /// The objects: 6064, 2410:05, 2410/v-Pos, "Position Actual Value"
    #[arg(required = true, value_name = "OBJECT", add = ArgValueCompleter::new(objects))]
    objects: Vec<String>,
}

const EXAMPLES: &str = "\
Examples:
    lexican read --bus can0 --node 5 6041 6064
    lexican read --bus sim:siko/ag03-1?node=5 \"Position Actual Value\" \"Motor Parameter Set\"
    lexican read --bus can0 --node 3,5-9 6041 --timeout 200ms
    lexican read --bus can0 --node 5 1F50:1 -o program.bin
    lexican read --bus can0 --node 7 --device FILE.eds --json 1018:01 | jq .value";

pub(crate) fn read(args: &ReadArgs) -> Result<Outcome, Failure> {
    if let Some(path) = &args.output {
        args.force.guard(path, args.network.files())?;
    }
    let nodes = args.network.connect_several(args.node.as_ref())?;
    if args.output.is_some() && nodes.are_several() {
        return Err(Failure::new("one file takes the object of one node"));
    }
    let names_node = nodes.are_several();
    nodes.for_each(|network, node, device| {
        let addresses: Vec<_> =
            args.objects.iter().map(|text| resolve_all(device, text)).collect::<Result<Vec<_>, _>>()?;
        if let Some(path) = &args.output {
            let [[address]] = addresses.iter().map(Vec::as_slice).collect::<Vec<_>>()[..] else {
                return Err(Failure::new("one file takes one entry").help("name the sub-index as well: 1F50:01"));
            };
            return save(network, node, *address, args.max, path, &args.force);
        }
        let printer = Printer { node, json: args.json, names_node };
        let mut reading = Reading { network, values: device.map(DeviceValues::new), printer, max: args.max };
        let mut outcome = Outcome::Clean;
        for object in addresses {
            outcome = outcome.max(reading.object(device, object)?);
        }
        Ok(outcome)
    })
}

/// The longest value read without `--max`, in bytes.
pub(crate) const LONGEST: u32 = 64 << 20;
/// The longest value read of a type with a fixed size, in bytes: enough to show what a device sends instead.
const LONGEST_NUMBER: u32 = 64;

/// Writes at most `max` bytes of an entry to a file.
pub(crate) fn save(
    network: &mut Network<BoxedLink>,
    node: NodeId,
    address: Address,
    max: u32,
    path: &Path,
    force: &ForceArgs,
) -> Result<Outcome, Failure> {
    let (what, interrupted) = (format!("reading {address}"), ctrl_c()?);
    let mut followed = follow(&what, None, Bytes::room_for(max as usize), &interrupted);
    let result = network.read_into(node, address, &mut followed);
    if followed.is_interrupted() {
        return Err(Failure::new(format_args!("{address}: interrupted; {} is as it was", path.display())));
    }
    let data = match result {
        Ok(len) => followed.into_payload().into_vec(len),
        Err(AccessError::Sdo { error: SdoError::TooLong { address, capacity }, .. }) => {
            return Err(too_long(address, capacity, max));
        }
        Err(AccessError::Sdo { error, .. }) if is_answer(&error) => {
            Printer { node, json: false, names_node: false }
                .refusal(&ValueReport::without_value(None, address), &error)?;
            return Ok(Outcome::Found);
        }
        Err(error) => return Err(error.into()),
    };
    if path == Path::new("-") {
        let mut stdout = raw_stdout();
        stdout.write_all(&data)?;
        stdout.flush()?;
    } else {
        force.write(path, &data)?;
    }
    Ok(Outcome::Clean)
}

struct Reading<'a, 'n> {
    network: &'n mut Network<BoxedLink>,
    values: Option<DeviceValues<'a>>,
    printer: Printer,
    max: u32,
}

/// The failure for a device that sends more than `bound` bytes, perhaps without end.
fn too_long(address: Address, bound: u32, max: u32) -> Failure {
    let failure = Failure::new(format_args!("{address}: the device sends more than {bound} bytes"));
    if bound < max {
        return failure.help("by its data type it has fewer; -o FILE takes what the device sends, whatever the type");
    }
    failure.help(format_args!("--max takes more, such as --max {}", u64::from(bound) * 16))
}

impl Reading<'_, '_> {
    /// Reads the entries of an object.
    fn object(&mut self, device: Option<&Device>, entries: Vec<Address>) -> Result<Outcome, Failure> {
        let is_whole = entries.len() > 1;
        let readable = |address: &Address| {
            let entry = device.and_then(|device| device.entry(address.index(), address.sub()));
            entry.is_none_or(|entry| entry.access.readable())
        };
        let mut outcome = Outcome::Clean;
        let mut last = u8::MAX;
        for address in entries {
            if is_whole && (!readable(&address) || address.sub() > last) {
                continue;
            }
            let (data, read) = self.entry(address)?;
            outcome = outcome.max(read);
            // Do not read entries beyond the count in sub-index 0.
            let counts = cia301::counts_entries(address.index());
            if let Some([count]) = data.as_deref().filter(|_| is_whole && counts && address.sub() == 0) {
                last = *count;
            }
        }
        Ok(outcome)
    }

    /// Reads and prints an entry; returns its bytes unless the node refuses.
    fn entry(&mut self, address: Address) -> Result<(Option<Vec<u8>>, Outcome), Failure> {
        let node = self.printer.node;
        if let Some(values) = &mut self.values {
            read_conditions(self.network, node, address, values)?;
        }
        let data_type = self.values.as_ref().and_then(|values| Some(values.entry(address)?.data_type));
        let has_size = data_type.is_some_and(|data_type| data_type.bits().is_some());
        let bound = if has_size { self.max.min(LONGEST_NUMBER) } else { self.max };
        let mut bytes = Bytes::room_for(bound as usize);
        match self.network.read_into(node, address, &mut bytes).map(|len| bytes.into_vec(len)) {
            Ok(data) => {
                let report = ValueReport::of_bytes(self.values.as_ref(), address, &data);
                if let (Some(values), Some(value)) = (&mut self.values, &report.value) {
                    values.set(address, value);
                }
                self.printer.print(report.json(), &report.equation())?;
                Ok((Some(data), Outcome::Clean))
            }
            Err(AccessError::Sdo { error: SdoError::TooLong { capacity, .. }, .. }) => {
                Err(too_long(address, capacity, self.max))
            }
            Err(AccessError::Sdo { error, .. }) if is_answer(&error) => {
                self.printer.refusal(&ValueReport::without_value(self.values.as_ref(), address), &error)?;
                Ok((None, Outcome::Found))
            }
            Err(error) => Err(error.into()),
        }
    }
}
