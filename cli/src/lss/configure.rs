//! `lexican lss node-id` and `lexican lss bit-rate`.

use lexican_runtime::NodeId;
use lexican_runtime::host::Link;
use lexican_runtime::wire::lss::BIT_TIMING_TABLE;
use serde_json::json;

use super::args::{DeviceArgs, DevicesArgs};
use super::print::{describe, print, print_refusal, selected_json, title};
use crate::bus::NodeOrNone;
use crate::output::{Failure, Outcome, note, warn};
use lexican_toolbox::decode::lss::AUTOMATIC;
use lexican_toolbox::lss::{Selected, Session};
use lexican_toolbox::text::duration::{in_milliseconds, milliseconds};

/// Give a device a node-ID
///
/// A device without node-ID boots with it at once; one that has another keeps that until its communication is reset.
/// Exit code 1 if the device refuses.
#[derive(clap::Args, Debug)]
#[command(after_help = NODE_ID_EXAMPLES)]
pub(crate) struct NodeIdArgs {
    #[command(flatten)]
    device: DeviceArgs,

    /// Let the device store it, so that it keeps it without power
    #[arg(long)]
    store: bool,

    /// Reset the communication of a device that does not boot with its node-ID by itself
    ///
    /// One that has another node-ID keeps it until then, and some that have none wait for a reset, too. Exit code 1 if the
    /// device does not boot with it.
    #[arg(long)]
    activate: bool,

    /// Give it even if another node has it already
    #[arg(long)]
    force: bool,

    /// The node-ID that it gets, 1 to 127; none takes it away
    #[arg(value_name = "NODE|none")]
    node: NodeOrNone,
}

const NODE_ID_EXAMPLES: &str = "\
Examples:
    lexican lss node-id --bus can0 5 --activate                     (the only device on the bus)
    lexican lss node-id --bus can0 --unconfigured 5 --store         (the next one without node-ID)
    lexican lss node-id --bus can0 --vendor 195h --product 0 --revision 10000h --serial 42 5";

/// Give a device, or all, a bit rate
///
/// The bit rate is used when it is activated, or when devices that have stored it are switched on again. All devices
/// of a bus must change together. Exit code 1 if a device refuses; then nothing is activated.
#[derive(clap::Args, Debug)]
#[command(after_help = BIT_RATE_EXAMPLES)]
pub(crate) struct BitRateArgs {
    #[command(flatten)]
    devices: DevicesArgs,

    /// Let the devices store it, so that they keep it without power
    #[arg(long)]
    store: bool,

    /// Let the devices be silent for this long, then change, and be silent for as long again
    ///
    /// The command ends after that; then the interface must be set to the new bit rate.
    #[arg(long, value_name = "TIME", value_parser = switch_delay)]
    switch_delay: Option<u16>,

    /// In kbit/s: 1000, 800, 500, 250, 125, 50, 20 or 10; auto lets the device detect it
    #[arg(value_name = "KBIT", value_parser = rate)]
    rate: Rate,
}

const BIT_RATE_EXAMPLES: &str = "\
Examples:
    lexican lss bit-rate --bus can0 --all 250 --store                  (for the next start)
    lexican lss bit-rate --bus can0 --all 250 --store --switch-delay 1s  (in a second)
    ip link set can0 down; ip link set can0 up type can bitrate 250000";

/// An entry of CiA 305's bit rate table.
#[derive(Clone, Copy, Debug)]
struct Rate {
    entry: u8,
    /// `None` for automatic detection.
    kbit_per_s: Option<u16>,
}

/// Parses the switch delay in ms (CiA 305, activate bit timing parameters).
fn switch_delay(text: &str) -> Result<u16, String> {
    let ms = in_milliseconds(milliseconds(text)?);
    u16::try_from(ms).map_err(|_| format!("{text} is longer than LSS can say, which is 65535ms"))
}

fn rate(text: &str) -> Result<Rate, String> {
    if text == "auto" {
        return Ok(Rate { entry: AUTOMATIC, kbit_per_s: None });
    }
    let rates = (0..).zip(BIT_TIMING_TABLE).filter_map(|(entry, rate)| Some((entry, rate?)));
    let found = rates.clone().find(|(_, rate)| rate.to_string() == text);
    found.map(|(entry, rate)| Rate { entry, kbit_per_s: Some(rate) }).ok_or_else(|| {
        let all: Vec<_> = rates.map(|(_, rate)| rate.to_string()).collect();
        format!("CiA 305 has no bit rate of {text} kbit/s; it has {} and auto", all.join(", "))
    })
}

pub(super) fn node_id(args: &NodeIdArgs) -> Result<Outcome, Failure> {
    args.device.link.run(|session| configure_node(session, args))
}

pub(super) fn bit_rate(args: &BitRateArgs) -> Result<Outcome, Failure> {
    args.devices.device.link.run(|session| configure_bit_rate(session, args))
}

fn configure_node<L: Link>(session: &mut Session<L>, args: &NodeIdArgs) -> Result<Outcome, Failure> {
    let (NodeOrNone(new), json) = (args.node, args.device.link.json);
    let selected = session.select(args.device.target())?;
    if let Some(new) = new.filter(|new| !args.force && selected.node != Some(*new))
        && session.is_taken(new)?
    {
        return Err(Failure::new(format_args!("another node has the node-ID {new}"))
            .help("`lexican scan` shows the nodes of the bus; --force gives it anyway"));
    }
    let mut done = session.configure_node(new)?;
    if done.is_ok() && args.store {
        done = session.store()?;
    }
    if let Err(refusal) = done {
        return print_refusal(json, Some(selected), refusal);
    }
    let booted = session.take(selected.node, new, args.activate)?;
    let more = json!({ "node_id": new.map(NodeId::get), "booted": booted, "stored": args.store });
    let taken = new.map_or_else(|| "no node-ID any more".to_owned(), |new| format!("node-ID {new}"));
    let boots = if booted { ", and has booted with it" } else { "" };
    print(json, selected_json(Some(selected)), more, &format!("{}: {taken}{boots}", describe(selected.identity)))?;
    advise(selected, new, booted, args);
    let is_missed = args.activate && new.is_some() && new != selected.node && !booted;
    Ok(if is_missed { Outcome::Found } else { Outcome::Clean })
}

/// Tells what the user still has to do.
fn advise(selected: Selected, new: Option<NodeId>, booted: bool, args: &NodeIdArgs) {
    match selected.node {
        Some(old) if new != Some(old) && !args.activate => note(format_args!(
            "it is node {old} until its communication is reset: --activate does so, and `lexican nmt \
             reset-communication --node {old}`"
        )),
        None if !args.activate && !booted => {
            if let Some(new) = new {
                warn(format_args!(
                    "no boot-up message was heard: some devices take their node-ID only after a reset: `lexican nmt \
                     reset-communication --node {new}`, which --activate sends"
                ));
            }
        }
        _ if new.is_some() && new != selected.node && !booted => warn(
            "no boot-up message was heard, not after a reset either: some devices take their node-ID only when they are \
             switched on, so it has to be stored, and some by `lexican nmt reset-communication --all`, which resets all \
             nodes",
        ),
        _ => {}
    }
    if !args.store {
        note("not stored: without power the device forgets it, unless --store is given");
    }
}

fn configure_bit_rate<L: Link>(session: &mut Session<L>, args: &BitRateArgs) -> Result<Outcome, Failure> {
    let json = args.devices.device.link.json;
    let selected = args.devices.select(session)?;
    let mut done = session.configure_bit_rate(args.rate.entry)?;
    if done.is_ok() && args.store {
        done = session.store()?;
    }
    if let Err(refusal) = done {
        return print_refusal(json, selected, refusal);
    }
    if let Some(delay_ms) = args.switch_delay {
        session.activate(delay_ms)?;
    }
    let kbit_per_s = args.rate.kbit_per_s;
    let rate = kbit_per_s.map_or_else(|| "the bit rate of the bus".to_owned(), |rate| format!("{rate} kbit/s"));
    let more = json!({ "kbit_per_s": kbit_per_s, "stored": args.store, "activated": args.switch_delay.is_some() });
    print(json, selected_json(selected), more, &format!("{}: {rate}", title(selected)))?;
    match (args.switch_delay, args.store) {
        (Some(_), _) => note(format_args!("set the interface to {rate}, too, before the next command")),
        (None, true) => note("it takes effect when the device is switched on again"),
        (None, false) => note("neither activated nor stored: nothing changes without --switch-delay or --store"),
    }
    Ok(Outcome::Clean)
}
