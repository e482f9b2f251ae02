//! `lexican lss node-id`: a node-ID for a device.

use lexican_runtime::NodeId;
use lexican_runtime::host::Link;
use serde_json::json;

use super::args::{LinkArgs, SelectArgs};
use super::print::{print, print_refusal, selected_json, words};
use super::session::{Selected, Session};
use crate::bus::NodeOrNone;
use crate::output::{Failure, Outcome, note, warn};

/// Give a device a node-ID
///
/// A device without node-ID boots with it at once; one that has another keeps that until its communication is reset.
/// Exit code 1 when the device refuses.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    link: LinkArgs,

    #[command(flatten)]
    select: SelectArgs,

    /// Let the device store it, so that it has it without power, too
    #[arg(long)]
    store: bool,

    /// Let a device that has another node-ID take the new one at once, by a reset of its communication
    ///
    /// One that has none takes it in any case. Exit code 1 when it does not boot with it.
    #[arg(long)]
    activate: bool,

    /// Give it even if another node has it already
    #[arg(long)]
    force: bool,

    /// The node-ID, 1 to 127; none takes it away
    #[arg(value_name = "ID")]
    node: NodeOrNone,
}

const EXAMPLES: &str = "\
Examples:
    lexican lss node-id --bus can0 5 --activate                     (the only device on the bus)
    lexican lss node-id --bus can0 --unconfigured 5 --store         (the next one without node-ID)
    lexican lss node-id --bus can0 --vendor 195h --product 0 --revision 10000h --serial 42 5";

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    args.link.work(|session| give(session, args))
}

fn give<L: Link>(session: &mut Session<L>, args: &Args) -> Result<Outcome, Failure> {
    let NodeOrNone(new) = args.node;
    let selected = session.select(args.select.whom())?;
    if let Some(new) = new.filter(|new| !args.force && selected.node != Some(*new))
        && session.is_taken(new)?
    {
        return Err(Failure::new(format_args!("another node has the node-ID {new}"))
            .help("`lexican scan` shows who is there; --force gives it all the same"));
    }
    if let Err(refusal) = session.configure_node(new)? {
        return print_refusal(args.link.json, Some(selected), refusal);
    }
    if args.store
        && let Err(refusal) = session.store()?
    {
        return print_refusal(args.link.json, Some(selected), refusal);
    }
    let booted = match (selected.node, new) {
        (None, Some(new)) => session.boot(new)?,
        (Some(old), new) if args.activate && new != Some(old) => session.activate_node(old, new)?,
        _ => false,
    };
    let more = json!({ "node_id": new.map(NodeId::get), "booted": booted, "stored": args.store });
    print(args.link.json, selected_json(Some(selected)), more, &text(selected, new, booted))?;
    advise(selected, new, booted, args);
    let is_missed = args.activate && new.is_some() && new != selected.node && !booted;
    Ok(if is_missed { Outcome::Found } else { Outcome::Clean })
}

fn text(selected: Selected, new: Option<NodeId>, booted: bool) -> String {
    let taken = new.map_or_else(|| "no node-ID any more".to_owned(), |new| format!("node-ID {new}"));
    let booted = if booted { ", and has booted with it" } else { "" };
    format!("{}: {taken}{booted}", words(selected.identity))
}

/// What is still to be done, or to be known.
fn advise(selected: Selected, new: Option<NodeId>, booted: bool, args: &Args) {
    match selected.node {
        Some(old) if new != Some(old) && !args.activate => note(format_args!(
            "it is node {old} until its communication is reset: --activate does so, and `lexican nmt \
             reset-communication --node {old}`"
        )),
        Some(_) if args.activate && new.is_some() && new != selected.node && !booted => {
            warn("no boot-up message was heard: some devices take their node-ID when they are switched on only");
        }
        None if new.is_some() && !booted => {
            warn("no boot-up message was heard: some devices take their node-ID when they are switched on only");
        }
        _ => {}
    }
    if !args.store {
        note("not stored: without power the device forgets it, unless --store is given");
    }
}
