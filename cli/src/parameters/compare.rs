//! `lexican compare`.

use std::io::Write;

use anstyle::AnsiColor;
use lexican_eds::model::Device;
use lexican_machine::Machine;
use lexican_runtime::NodeId;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{BusUrl, Pace};
use lexican_toolbox::node::remote::RemoteNode;
use lexican_toolbox::parameters::compare::{Difference, Side, compare};
use lexican_toolbox::values::report::ValueReport;
use serde_json::{Value as Json, json};

use super::archive::{MACHINE, compare_machines, is_archive};
use super::{LeftOutArgs, Watch, by_reason, known};
use crate::bus::{BUS, BoxedLink, BusArgs, Nodes, SheetArgs, node_id, url};
use crate::machine::own_bus;
use crate::output::{self, Failure, Outcome, fields, plural, print_result, styled};

/// Compare the parameters of two devices, backups or data sheets
///
/// Each side is a node of the bus (node:5), a DCF, an EDS, or a device that lexican knows; or both are of a whole machine: `machine`,
/// what the nodes of machine.toml have now, or a backup of it (FILE.tar). Of a DCF the configured values
/// count, of an EDS the defaults. What is no parameter of either side is left out, as in a backup. `lexican eds diff` compares the
/// data sheets themselves, `lexican check` a device with its data sheet. Exit code 1 if anything differs.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The bus, if a side is a node: can0, slcan:/dev/ttyACM0?bitrate=500000, sim:siko/ag03-1?node=5
    #[arg(long, value_name = "URL", env = BUS, value_parser = url)]
    bus: Option<BusUrl>,

    #[command(flatten)]
    sheet: SheetArgs,

    #[command(flatten)]
    left_out: LeftOutArgs,

    /// Print one JSON object per line
    #[arg(long)]
    json: bool,

    /// The first side: node:5, FILE.dcf, FILE.eds, siko/ag03-1; machine, FILE.tar
    #[arg(value_name = "A")]
    a: String,

    /// The second side
    #[arg(value_name = "B")]
    b: String,
}

const EXAMPLES: &str = "\
Examples:
    lexican compare --bus can0 node:5 drive.dcf
    lexican compare --bus can0 node:5 node:0x10
    lexican compare drive.dcf siko/ag03-1 --json
    lexican compare labeller.tar machine";

/// The node-ID in an argument.
fn node(side: &str) -> Result<Option<NodeId>, Failure> {
    side.strip_prefix("node:").map(node_id).transpose().map_err(Failure::new)
}

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    if [&args.a, &args.b].iter().any(|side| *side == MACHINE || is_archive(side.as_ref())) {
        let print = |name: &str, difference: &Difference| args.print(Some(name), difference);
        return compare_machines([&args.a, &args.b], args.json, |machine| args.connect(machine), print);
    }
    let (a, b) = (node(&args.a)?, node(&args.b)?);
    let ids: Vec<_> = a.into_iter().chain(b).collect();
    let mut nodes = match (&args.bus, ids.is_empty()) {
        (_, true) => None,
        (Some(bus), false) => Some(args.sheet.connect(&BusArgs::named(bus.clone()), Some(ids), Pace::Virtual)?),
        (None, false) => {
            return Err(Failure::new("on which bus is the node?").help("name it with --bus, or in LEXICAN_BUS"));
        }
    };
    // `$NODEID` in a data sheet becomes the node-ID of the other side.
    let of_file = |name: &str, id: Option<NodeId>, other: Option<NodeId>| match id {
        Some(_) => Ok(None),
        None => {
            let device = args.sheet.load(name)?;
            let id = other.or_else(|| commissioned(&device));
            Ok::<_, Failure>(Some((device, id)))
        }
    };
    let (file_a, file_b) = (of_file(&args.a, a, b)?, of_file(&args.b, b, a)?);
    let id = [&file_a, &file_b].into_iter().flatten().find_map(|(_, id)| *id).unwrap_or(NodeId::literal(1));
    let sheets = [file_a, file_b].map(|file| file.map(|(device, _)| device));
    let [other_a, other_b] = [sheets[1].clone(), sheets[0].clone()];
    let [sheet_a, sheet_b] = sheets;
    let watch = Watch::new()?;
    let mut side =
        |sheet: Option<Device>, id_of_side: Option<NodeId>, other: Option<Device>| match (id_of_side, &mut nodes) {
            (Some(id), Some(nodes)) => of_node(nodes, id, other, &watch),
            _ => Ok(Side::of_sheet(sheet.expect("it is a file or a node"), id)),
        };
    let (a, b) = (side(sheet_a, a, other_a)?, side(sheet_b, b, other_b)?);
    drop(watch);
    let comparison = compare(&a, &b);
    let count = comparison.differences.len();
    comparison.differences.iter().try_for_each(|difference| args.print(None, difference))?;
    let unknown = match comparison.unknown.len() {
        0 => String::new(),
        count => format!("; {count} are known of one side only"),
    };
    let verdict = if count == 0 { "the same".to_owned() } else { format!("{count} differ") };
    let compared = plural(comparison.compared, "parameter");
    let object = json!({
        "event": "summary", "compared": comparison.compared, "differ": count, "unknown": comparison.unknown.len(),
        "left_out": by_reason(&comparison.left_out),
    });
    print_result(args.json, object, format_args!("{compared} compared, {verdict}{unknown}"))?;
    args.left_out.print(args.json, &a.device, &comparison.left_out)?;
    Ok(if count == 0 { Outcome::Clean } else { Outcome::Found })
}

/// Reads a node by its data sheet, or by that of the other side.
fn of_node(nodes: &mut Nodes, id: NodeId, other: Option<Device>, watch: &Watch) -> Result<Side, Failure> {
    let device = match (nodes.device(id)?, other) {
        (None, Some(other)) => {
            nodes.check_identity(id, &other, "the other side")?;
            Some(other)
        }
        (own, _) => own,
    };
    let device = known(id, device.as_ref())?.clone();
    Ok(Side::of_node(&mut RemoteNode::new(&mut nodes.network, id), device, &mut |progress| watch.see(progress))?)
}

/// The node-ID of a DCF.
fn commissioned(device: &Device) -> Option<NodeId> {
    NodeId::new(device.commissioning.as_ref()?.node_id?)
}

impl Args {
    /// Opens the nodes of a machine, on its bus unless another one is named.
    fn connect(&self, machine: &Machine) -> Result<Network<BoxedLink>, Failure> {
        let bus = self.bus.clone().map_or_else(|| own_bus(machine), Ok)?;
        self.sheet.connect_known(&BusArgs::named(bus), machine.nodes.iter().filter_map(|node| node.id))
    }

    /// Prints a difference, with the name of the node if there are several.
    fn print(&self, name: Option<&str>, difference: &Difference) -> Result<(), Failure> {
        let Difference { a, b, .. } = difference;
        let Some(known) = a.as_ref().or(b.as_ref()) else { return Ok(()) };
        let mut stdout = output::stdout();
        if self.json {
            let side = |side: &Option<ValueReport>| match side {
                Some(report) => Json::Object(report.json().into_iter().filter(|(key, _)| is_of_value(key)).collect()),
                None => Json::Null,
            };
            let mut object = known.json();
            object.retain(|key, _| !is_of_value(key));
            object.extend(fields(json!({ "event": "difference", "a": side(a), "b": side(b) })));
            object.extend(name.map(|name| ("name".to_owned(), json!(name))));
            writeln!(stdout, "{}", Json::Object(object))?;
        } else {
            let text = |side: &Option<ValueReport>| match side {
                Some(report) => report.text().to_owned(),
                None => "(no such entry)".to_owned(),
            };
            let (a, b) = (text(a), text(b));
            let a = styled(AnsiColor::Red.on_default(), format_args!("{a:<28}"));
            let b = styled(AnsiColor::Green.on_default(), b);
            let name = name.map(|name| format!("{name}: ")).unwrap_or_default();
            writeln!(stdout, "{:<44}  {a}  {b}", name + &known.title())?;
        }
        stdout.flush()?;
        Ok(())
    }
}

/// Whether a JSON field of an entry is about its value.
fn is_of_value(key: &str) -> bool {
    matches!(key, "value" | "text" | "scaled" | "unit")
}
