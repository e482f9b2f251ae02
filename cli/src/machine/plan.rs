//! `lexican machine plan`.

use lexican_machine::{Machine, Node};
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{AccessError, BusUrl, Pace};
use lexican_runtime::service::sdo_client::SdoError;
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::report::ValueReport;
use serde_json::json;

use super::file::{MachineArgs, sound};
use crate::bus::{BoxedLink, BusArgs, network, url};
use crate::output::{Failure, Outcome, print_result};

/// Print what a boot writes into each node, in order
///
/// With --live, or --bus for another bus than that of the machine, the present values are read and stand beside; exit code 1 if
/// any differs. Nothing is written.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    machine: MachineArgs,

    /// Only of this node
    #[arg(long, value_name = "NAME")]
    of: Option<String>,

    /// Read the present values, from the bus of the machine
    #[arg(long)]
    live: bool,

    /// Read them from this bus
    #[arg(long, value_name = "URL", value_parser = url)]
    bus: Option<BusUrl>,

    /// Print one JSON object per line
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican machine plan
    lexican machine plan --of feeder --live";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let name = args.machine.path()?;
    let (path, bus) = Machine::file_and_bus(&name);
    let machine = sound(path)?;
    let buses: Vec<_> = match (bus, &args.bus) {
        (None, None) => machine.buses().collect(),
        _ => vec![machine.on(bus).map_err(Failure::new)?],
    };
    let names: Vec<_> = buses.iter().flat_map(|it| &it.nodes).map(|node| node.name.as_str()).collect();
    if let Some(name) = args.of.as_deref().filter(|name| !names.contains(name)) {
        return Err(Failure::new(format_args!("there is no node {name:?}"))
            .help(format_args!("there are {}", names.join(", "))));
    }
    let mut outcome = Outcome::Clean;
    for machine in buses {
        let nodes = machine.nodes.iter().filter(|node| args.of.as_ref().is_none_or(|name| node.name.value == *name));
        let nodes: Vec<_> = nodes.collect();
        let mut network = match (&args.bus, args.live) {
            _ if nodes.is_empty() => continue,
            (Some(bus), _) => Some(open(bus.clone())?),
            (None, true) => Some(open(own_bus(machine)?)?),
            (None, false) => None,
        };
        for node in nodes {
            outcome = outcome.max(print(args.json, machine, node, network.as_mut())?);
        }
    }
    Ok(outcome)
}

/// The bus that a machine names.
pub(crate) fn own_bus(machine: &Machine) -> Result<BusUrl, Failure> {
    let place = machine.bus.url.as_ref().ok_or_else(|| {
        Failure::new("the machine does not say where its bus is").help("[bus] url = \"can0\", or --bus")
    })?;
    url(place).map_err(Failure::new)
}

fn open(bus: BusUrl) -> Result<Network<BoxedLink>, Failure> {
    network(BusArgs::named(bus).open(Pace::Virtual)?.settled()?.link)
}

fn print(
    as_json: bool,
    machine: &Machine,
    node: &Node,
    mut network: Option<&mut Network<BoxedLink>>,
) -> Result<Outcome, Failure> {
    let writes = machine.writes(node);
    let id = node.id.map_or_else(|| "by LSS".to_owned(), |id| id.to_string());
    if !as_json {
        let sheet = node.sheet_name.as_deref().unwrap_or("no data sheet");
        print_result(false, json!(null), format_args!("{} ({id}, {sheet})", node.name.value))?;
        if writes.is_empty() {
            print_result(false, json!(null), "  nothing is written")?;
        }
    }
    let mut values = node.device().map(DeviceValues::new);
    let mut outcome = Outcome::Clean;
    for (at, write) in writes.iter().enumerate() {
        // Compare only the last write of an entry: PDOs are disabled in between.
        let stays = !writes[at + 1..].iter().any(|later| later.address == write.address);
        let present = match (&mut network, node.id) {
            (Some(network), Some(id)) if stays => match network.read_bytes(id, write.address) {
                Ok(data) => Some(data),
                Err(AccessError::Sdo { error: SdoError::Aborted { .. }, .. }) => None,
                Err(error) => return Err(error.into()),
            },
            _ => None,
        };
        let wanted = ValueReport::of_bytes(values.as_ref(), write.address, &write.data);
        let now = present.map(|data| ValueReport::of_bytes(values.as_ref(), write.address, &data));
        let was = match &now {
            Some(now) if now.text() != wanted.text() => {
                outcome = Outcome::Found;
                format!("  (now {})", now.text())
            }
            Some(_) => "  (as it is)".to_owned(),
            None => String::new(),
        };
        let mut fields = wanted.json();
        fields.insert("node".to_owned(), json!(node.name.value));
        fields.insert("why".to_owned(), json!(write.why.name()));
        fields.insert("now".to_owned(), json!(now.as_ref().map(ValueReport::text)));
        print_result(as_json, fields, format_args!("  {}  [{}]{was}", wanted.equation(), write.why.name()))?;
        // Units and limits of other entries may depend on this value.
        if let (Some(values), Some(value)) = (&mut values, &wanted.value) {
            values.set(write.address, value);
        }
    }
    Ok(outcome)
}
