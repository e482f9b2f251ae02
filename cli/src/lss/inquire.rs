//! `lexican lss inquire`: who a device is.

use serde_json::json;

use super::args::{LinkArgs, SelectArgs};
use super::print::{print, selected_json, words};
use crate::output::{Failure, Outcome};

/// Tell the identity and the node-ID of a device
///
/// Without a selection, of the only device on the bus.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(flatten)]
    link: LinkArgs,

    #[command(flatten)]
    select: SelectArgs,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let selected = args.link.work(|session| session.select(args.select.whom()))?;
    let node = selected.node.map_or_else(|| "no node-ID".to_owned(), |node| format!("node-ID {node}"));
    let text = format!("{}, {node}", words(selected.identity));
    print(args.link.json, selected_json(Some(selected)), json!({}), &text)?;
    Ok(Outcome::Clean)
}
