//! `lexican boot`: configures and starts a network, and keeps it running.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use anstyle::AnsiColor;
use lexican_eds::Source;
use lexican_machine::{Files, Machine};
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{BootNetworkError, Link, Pace};
use lexican_runtime::manager::{Event, NetworkEvent};
use lexican_runtime::object::{Address, Object, Ro};
use lexican_runtime::procedure::BootError;
use lexican_runtime::{CobId, Duration, Instant, NodeId, cia301, wire};
use lexican_toolbox::node::identity::{recognise, words};
use lexican_toolbox::node::remote::RemoteNode;
use lexican_toolbox::parameters::backup::read_identity;
use serde_json::json;

use crate::bus::{BusArgs, node_id, of_node};
use crate::machine::{OnBus, found, on_bus, sound_on_bus, without_errors};
use crate::output::{Failure, Outcome, ctrl_c, fields, print_result, styled, warn};
use crate::send::time::now as time_of_this_machine;
use lexican_toolbox::text::duration::{in_milliseconds, milliseconds, time};

/// Boot a machine: check, configure and start its nodes (CiA 302-2)
///
/// Resets the nodes, compares them with their data sheets, configures, watches and starts them: those of machine.toml, or those
/// that are named here. A node has booted when it reports OPERATIONAL itself. Exit code 1 if a mandatory node has not booted.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    bus: BusArgs,

    /// The machine, of which `lexican machine --help` shows one; by default machine.toml in this folder or one above it
    #[arg(value_name = "MACHINE", conflicts_with_all = ["node", "optional", "heartbeat", "guarding"])]
    machine: Option<PathBuf>,

    /// A mandatory node: 5, or 5=drive.dcf, 5=siko/ag03-1; may be given several times
    #[arg(long, value_name = "NODE[=DEVICE]", value_parser = node)]
    node: Vec<(NodeId, Option<String>)>,

    /// An optional node
    #[arg(long, value_name = "NODE[=DEVICE]", value_parser = node)]
    optional: Vec<(NodeId, Option<String>)>,

    /// Corrections and meanings in addition to the data sheet of a node (TOML): 5=FILE.toml; may be given several times
    #[arg(long, value_name = "NODE=FILE", value_parser = of_node, conflicts_with = "machine")]
    overlay: Vec<(NodeId, String)>,

    /// Set the heartbeat of the nodes (1017h); they are lost after three times that
    #[arg(long, value_name = "TIME", value_parser = milliseconds, conflicts_with = "guarding")]
    heartbeat: Option<Duration>,

    /// The guard time; the nodes are lost after three times that
    #[arg(long, value_name = "TIME", value_parser = milliseconds)]
    guarding: Option<Duration>,

    /// The time within which the mandatory nodes must boot; 0 for no limit
    #[arg(long, value_name = "TIME", value_parser = milliseconds, default_value = "10s")]
    boot_time: Duration,

    /// Keep the network up until the command is interrupted: nodes that are lost are booted again
    #[arg(long)]
    keep: bool,

    /// Keep it up for this long
    #[arg(long = "for", value_name = "TIME", value_parser = time)]
    span: Option<Duration>,

    /// Print one JSON object per line
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican boot --bus can0 --node 5=siko/ag03-1 --optional 7 --heartbeat 100ms
    lexican boot --bus can0 machine.toml --keep";

/// `5`, `5=drive.dcf`.
fn node(text: &str) -> Result<(NodeId, Option<String>), String> {
    match text.split_once('=') {
        Some((id, device)) => Ok((node_id(id)?, Some(device.to_owned()))),
        None => Ok((node_id(text)?, None)),
    }
}

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let machine = args.machine()?;
    let plan = machine.boot_plan();
    let boot_time = machine.bus.boot_time.unwrap_or(args.boot_time);
    let mut link = args.bus.open(Pace::Virtual)?.settled()?.link;
    machine.give_node_ids(&mut link, |node, id| {
        let name = &node.name.value;
        let object = json!({ "event": "node-id", "node": id.get(), "name": name });
        print_result(args.json, object, format_args!("node {id}: {name} has got its node-ID by LSS"))
    })?;
    let mut network = Network::new(link);
    let interrupted = ctrl_c()?;
    let is_kept = args.keep || args.span.is_some();
    if is_kept {
        // Protection that relies on this command would trip after it ends.
        let now = network.now();
        machine.produce(network.manager(), now);
    }
    let mut next_time = machine.bus.time.filter(|_| is_kept).map(|_| network.now());

    let (mut written, mut others) = (Ok(()), BTreeSet::new());
    let mut report = |event: &Event| {
        if let Event::Network(NetworkEvent::Failed { node, error, .. }) = event
            && matches!(error, BootError::DeviceType { .. } | BootError::Identity { .. })
        {
            others.insert(*node);
        }
        if written.is_ok() {
            written = print(args.json, event);
        }
    };
    match network.boot(plan, boot_time, |event| report(&Event::Network(*event))) {
        Ok(()) => {}
        Err(BootNetworkError::NotReady(error)) => warn(format_args!("the network is not ready: {error}")),
        Err(BootNetworkError::Link(error)) => return Err(error.into()),
    }
    let end = args.span.map(|span| network.now() + span);
    let mut left = LEFT;
    loop {
        let now = network.now();
        let is_over = match end {
            Some(end) => now >= end,
            None => !is_kept && !is_booting(&mut network),
        };
        // At the end, report the events that are left, at most as many as the network keeps.
        if interrupted.load(Ordering::Relaxed) || is_over && left == 0 {
            break;
        }
        left -= usize::from(is_over);
        if let (Some(at), Some(period)) = (next_time, machine.bus.time)
            && now >= at
            && let Some(time) = time_of_this_machine()
        {
            network.send(&wire::time::frame(CobId::TIME, time))?;
            next_time = Some(at + period);
        }
        let until = [end, next_time].into_iter().flatten().fold(now + LOOK, Instant::min);
        let until = if is_over { now } else { until };
        match network.next_event(until)? {
            Some(event) => report(&event),
            None if is_over => break,
            None => {}
        }
    }
    written?;
    for node in others {
        if let Some(device) =
            machine.nodes.iter().find(|it| it.id == Some(node)).and_then(|it| it.sheet_name.as_deref())
        {
            warn(format_args!("node {node} is not {device}, but {}", identity(&mut network, node)));
        }
    }
    let is_ready = network.kept().is_some_and(|kept| kept.is_ready());
    let is_as_expected = software(&mut network, &machine);
    Ok(if is_ready && is_as_expected { Outcome::Clean } else { Outcome::Found })
}

/// Checks the software versions (100Ah) of the booted nodes against the machine; false if one differs.
fn software<L: Link>(network: &mut Network<L>, machine: &Machine) -> bool {
    let mut is_as_expected = true;
    for node in &machine.nodes {
        let (Some(id), Some(expected)) = (node.id, &node.software) else { continue };
        let version = match network.read_bytes(id, Address::new(cia301::MANUFACTURER_SOFTWARE_VERSION, 0)) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).trim_end_matches('\0').trim().to_owned(),
            Err(error) => error.to_string(),
        };
        if version != *expected {
            warn(format_args!("node {id}: the software version of {} is not {expected}: {version}", node.name.value));
            is_as_expected = false;
        }
    }
    is_as_expected
}

/// A node as text: the device by its identity, and the identity.
fn identity<L: Link>(network: &mut Network<L>, node: NodeId) -> String {
    let device_type = network.read(node, Object::<u32, Ro>::new(cia301::DEVICE_TYPE, 0)).ok();
    let [vendor, product, ..] = read_identity(&mut RemoteNode::new(network, node)).unwrap_or_default();
    let known =
        vendor.and_then(|vendor| recognise(vendor, product)).map_or("a device that lexican does not know", |it| it.id);
    let device_type = device_type.map(|it| format!("device type {it:08X}h"));
    let numbers: Vec<_> = device_type.into_iter().chain(words([vendor, product, None, None])).collect();
    format!("{known} ({})", numbers.join(", "))
}

/// The most events that are reported after the time is up.
const LEFT: usize = 1000;
/// The interval of checking for Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

/// Whether a node is still booting: `Network::boot` does not wait for optional nodes.
fn is_booting<L: Link>(network: &mut Network<L>) -> bool {
    network.kept().is_some_and(|kept| kept.nodes().any(|node| kept.is_booting(node)))
}

impl Args {
    /// The machine of a file, or one made of the nodes in the arguments.
    fn machine(&self) -> Result<OnBus, Failure> {
        if self.node.is_empty() && self.optional.is_empty() {
            return sound_on_bus(&found(self.machine.clone())?);
        }
        let text = |text: &dyn std::fmt::Display| toml::Value::String(text.to_string());
        let mut file = String::new();
        for ((id, device), optional) in
            self.node.iter().map(|it| (it, false)).chain(self.optional.iter().map(|it| (it, true)))
        {
            // Writing to a string cannot fail.
            let _ = writeln!(file, "[node.node-{id}]\nid = {id}\noptional = {optional}");
            let overlays = self.overlay.iter().filter(|(node, _)| node == id);
            let overlays: Vec<_> = overlays.map(|(_, path)| text(path).to_string()).collect();
            if !overlays.is_empty() {
                let _ = writeln!(file, "overlay = [{}]", overlays.join(", "));
            }
            let sheet = device.as_ref().map(|device| ("sheet", text(device)));
            let times = [("heartbeat", self.heartbeat), ("guarding", self.guarding)];
            let times = times
                .into_iter()
                .filter_map(|(key, time)| Some((key, text(&format_args!("{}ms", in_milliseconds(time?))))));
            for (key, value) in sheet.into_iter().chain(times) {
                let _ = writeln!(file, "{key} = {value}");
            }
        }
        let machine = Machine::parse(Source::new("the command line", file), Files::Folder(Path::new("")));
        on_bus(without_errors(machine.into(), "the nodes")?, None)
    }
}

fn print(as_json: bool, event: &Event) -> Result<(), Failure> {
    let (name, node, text, is_bad, more) = match *event {
        // This may be the reason why the node is not OPERATIONAL.
        Event::Emergency { node, emergency } => {
            let (code, register) = (emergency.code, format!("{:02X}", emergency.register.0));
            let text = format!("EMCY {code}, error register = {register}h");
            let more = json!({ "code": format!("{:04X}", code.0), "meaning": code.text(), "register": register });
            ("emergency", Some(node), text, code.0 != 0, more)
        }
        Event::Network(event) => match event {
            NetworkEvent::Booted(node) => ("booted", Some(node), "has booted".to_owned(), false, json!({})),
            NetworkEvent::Failed { node, mandatory, error } => {
                let error = error.to_string();
                ("failed", Some(node), error.clone(), true, json!({ "mandatory": mandatory, "error": error }))
            }
            NetworkEvent::Ready => ("ready", None, "the network is ready".to_owned(), false, json!({})),
            NetworkEvent::BootTimeElapsed => {
                ("boot-time-elapsed", None, "the boot time is over".to_owned(), true, json!({}))
            }
            NetworkEvent::BootedUp(node) => {
                ("boot-up", Some(node), "boot-up; it is not booted again".to_owned(), false, json!({}))
            }
            NetworkEvent::StateChanged { node, state } => {
                ("state", Some(node), state.to_string(), false, json!({ "state": state.to_string() }))
            }
            NetworkEvent::Lost { node, mandatory } => {
                ("lost", Some(node), "is lost".to_owned(), true, json!({ "mandatory": mandatory }))
            }
            NetworkEvent::BootLoop(node) => {
                let text = "boots again and again, or is lost each time; from now on with a pause".to_owned();
                ("boot-loop", Some(node), text, true, json!({}))
            }
        },
        _ => return Ok(()),
    };
    let mut object = fields(more);
    object.insert("event".to_owned(), json!(name));
    object.extend(node.map(|node| ("node".to_owned(), json!(node.get()))));
    let text = node.map_or_else(|| text.clone(), |node| format!("node {node}: {text}"));
    print_result(as_json, object, if is_bad { styled(AnsiColor::Red.on_default(), text) } else { text })
}
