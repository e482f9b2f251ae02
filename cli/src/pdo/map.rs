//! `lexican pdo map`.

use std::collections::BTreeMap;

use lexican_eds::model::Device;
use lexican_runtime::host::AccessError;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::object::Direction;
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::wire::pdo::TransmissionType;
use lexican_runtime::{AbortCode, CobId, Duration, NodeId};
use lexican_toolbox::pdo::{Change, Objection, PdoName, PdoState, Plan};
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::report::ValueReport;

use super::node::{print, reader};
use crate::bus::{BoxedLink, NetworkArgs, NodeIds, node_id};
use crate::output::{Failure, Outcome, note, warn};
use lexican_toolbox::text::duration::period;

/// Change what a PDO of a node maps, and when it is sent
///
/// The change is checked by the data sheet before anything is sent: whether each object can be mapped in this direction,
/// and the length of all of them. Then the PDO is switched off, changed and switched on (CiA 301, 7.5.2.35 to 7.5.2.38),
/// and read back. If the node refuses a step, the PDO is put back as it was. What is not given stays as it is. Most devices
/// take the change in PRE-OPERATIONAL only, and forget it at the next reset unless it is stored (1010h).
/// Exit code 1 if the data sheet or the node refuses the change.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    network: NetworkArgs,

    /// The node-ID: 1 to 127, or 0x1 to 0x7F
    #[arg(value_name = "NODE", value_parser = node_id)]
    node: NodeId,

    /// The PDO: tpdo1, rpdo3
    #[arg(value_name = "PDO")]
    pdo: PdoName,

    /// The objects in their order: 6041, "position actual value"; in a receive PDO also gaps, by their data type: UNSIGNED16
    #[arg(value_name = "OBJECT")]
    objects: Vec<String>,

    /// Send it at events, and whenever so much time has passed: 10ms, 1s; for a receive PDO, its deadline
    #[arg(long, value_name = "TIME", value_parser = period)]
    every: Option<Duration>,

    /// Send it with every N-th SYNC; 0 for the next SYNC after an event
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=240), conflicts_with = "every")]
    sync: Option<u8>,

    /// The shortest time between two PDOs: 500us, 2ms
    #[arg(long, value_name = "TIME", value_parser = period)]
    inhibit: Option<Duration>,

    /// The COB-ID: 1A5, 0x1A5; eight digits for 29 bits
    #[arg(long, value_name = "COB-ID", value_parser = cob_id)]
    cob_id: Option<CobId>,

    /// Switch the PDO off
    #[arg(long)]
    off: bool,

    /// Check the change, and show the PDO as it would be; write nothing
    #[arg(long)]
    dry_run: bool,

    /// Print the PDO as a JSON object
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican pdo map 5 tpdo1 statusword \"position actual value\" --every 10ms --bus can0
    lexican pdo map 5 rpdo2 6040 UNSIGNED16 607A --sync 1 --bus can0 --dry-run
    lexican pdo map 5 tpdo4 --off --bus can0";

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let nodes = args.network.connect_several(Some(&NodeIds(vec![args.node])))?;
    nodes.for_each(|network, node, device| {
        let before = PdoState::read(args.pdo, reader(network, node))?;
        let before = before.ok_or_else(|| {
            Failure::new(format_args!("node {node} has no {}", args.pdo)).help("`lexican pdo show` lists its PDOs")
        })?;
        let plan = match plan(args, device, before) {
            Ok(plan) => plan,
            Err(objections) => return refuse(objections),
        };
        if args.dry_run || plan.changes_nothing() {
            let why = if args.dry_run { "nothing was written: this is how it would be" } else { "it already was so" };
            note(format_args!("{}: {why}", args.pdo));
            print(args.json, node, &plan.after, device, &BTreeMap::new())?;
            return Ok(Outcome::Clean);
        }
        apply(args, network, device, &plan)
    })
}

fn plan(args: &Args, device: Option<&Device>, before: PdoState) -> Result<Plan, Vec<Objection>> {
    let mapping = (!args.objects.is_empty()).then(|| args.pdo.map(device, &args.objects)).transpose()?;
    let is_event_driven = before.transmission.is_some_and(TransmissionType::is_event_driven);
    let is_timed = args.every.is_some() && args.pdo.direction == Direction::Transmit;
    let transmission = match args.sync {
        Some(n) => Some(TransmissionType::from_code(n)),
        None => (is_timed && !is_event_driven).then_some(TransmissionType::EventProfile),
    };
    let units =
        |time: Option<Duration>, unit| time.map(|time| u16::try_from(time.as_micros() / unit).unwrap_or(u16::MAX));
    let change = Change {
        on: Some(!args.off),
        cob_id: args.cob_id,
        transmission,
        inhibit_100us: units(args.inhibit, 100),
        event_timer_ms: units(args.every, 1000),
        mapping,
    };
    Plan::new(device, args.node, before, &change)
}

/// Reports why nothing was sent. An unknown name counts as a wrong command line.
fn refuse(objections: Vec<Objection>) -> Result<Outcome, Failure> {
    for objection in objections {
        match objection {
            Objection::Object(error) => return Err(error.into()),
            objection => warn(objection),
        }
    }
    note("nothing was written");
    Ok(Outcome::Found)
}

/// Makes the change, reads the PDO back, and prints it.
fn apply(
    args: &Args,
    network: &mut Network<BoxedLink>,
    device: Option<&Device>,
    plan: &Plan,
) -> Result<Outcome, Failure> {
    let (node, pdo) = (args.node, args.pdo);
    match network.configure(node, &plan.apply()) {
        Ok(()) => {}
        Err(AccessError::Sdo { error: SdoError::Aborted { address, code }, .. }) => {
            let values = device.map(DeviceValues::new);
            let title = ValueReport::without_value(values.as_ref(), address).title();
            warn(format_args!("{title}: the device aborts: {code}"));
            if code == AbortCode::DEVICE_STATE {
                note(format_args!("`lexican nmt pre-operational --node {node}` first: many devices demand it"));
            }
            put_back(args, network, plan)?;
            return Ok(Outcome::Found);
        }
        Err(error) => {
            return Err(Failure::from(error).help(format_args!(
                "{pdo} may be switched off or half changed: `lexican pdo show {node} {pdo}` shows it"
            )));
        }
    }
    let after = PdoState::read(pdo, reader(network, node))?;
    let after = after.ok_or_else(|| Failure::new(format_args!("{pdo} of node {node} has vanished")))?;
    let differences = after.differences(&plan.after);
    for difference in &differences {
        warn(format_args!("{pdo} was written, but {difference}"));
    }
    print(args.json, node, &after, device, &BTreeMap::new())?;
    Ok(if differences.is_empty() { Outcome::Clean } else { Outcome::Found })
}

/// Restores the PDO, and reports whether that worked.
fn put_back(args: &Args, network: &mut Network<BoxedLink>, plan: &Plan) -> Result<(), Failure> {
    let (node, pdo) = (args.node, args.pdo);
    let undone = network.configure(node, &plan.undo());
    let now = PdoState::read(pdo, reader(network, node))?;
    match (undone, now) {
        (Ok(()), Some(now)) if now == plan.before => note(format_args!("{pdo} was put back as it was")),
        (Err(error), _) => warn(format_args!("{pdo} could not be put back as it was: {error}")),
        (_, now) => {
            let differences = now.map_or_else(Vec::new, |now| now.differences(&plan.before));
            warn(format_args!("{pdo} could not be put back as it was: {}", differences.join("; ")));
        }
    }
    Ok(())
}

/// Parses a COB-ID, `1A5`, `0x1A5` or `00000185`: with eight digits it has 29 bits.
fn cob_id(text: &str) -> Result<CobId, String> {
    let digits = text.strip_prefix("0x").unwrap_or(text);
    let raw = u32::from_str_radix(digits, 16).ok();
    let id = raw.and_then(|raw| match u16::try_from(raw) {
        Ok(raw) if digits.len() < 8 => CobId::standard(raw),
        _ => CobId::extended(raw),
    });
    id.ok_or_else(|| format!("{text:?} is not a COB-ID such as 1A5 or 0x1A5"))
}
