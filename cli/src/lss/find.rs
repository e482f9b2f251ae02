//! `lexican lss find`: the devices without node-ID.

use std::io::Write;

use lexican_runtime::host::Link;
use lexican_runtime::wire::lss::Identity;
use serde_json::json;

use super::args::LinkArgs;
use super::print::{describe, identity_json, print};
use super::session::{Session, no_fastscan};
use crate::output::{self, Failure, Outcome, note, warn};

/// Find the devices that have no node-ID, one after the other
///
/// Their identities are found bit by bit (LSS fastscan), which takes some seconds for each. Nothing is changed.
/// Exit code 1 if there is none.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(flatten)]
    link: LinkArgs,

    /// Stop after the first one
    #[arg(long)]
    one: bool,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let as_json = args.link.json;
    args.link.run(|session| {
        let found = |identity| {
            print(as_json, identity_json(identity), json!({}), &describe(identity))?;
            Ok(!args.one)
        };
        let found = all(session, found, |identity| {
            let device = describe(identity);
            warn(format_args!("{device}: still answers after it was found; searching for the others beside it"));
            Ok(())
        })?;
        if !found.is_empty() {
            if !as_json {
                note("`lexican lss node-id --unconfigured ID` gives the first of them a node-ID");
            }
            return Ok(Outcome::Clean);
        }
        if session.has_unconfigured()? {
            return Err(no_fastscan());
        }
        if !as_json {
            writeln!(output::stdout(), "no device without node-ID answers; `lexican scan` shows those that have one")?;
        }
        Ok(Outcome::Found)
    })
}

/// Finds all devices without node-ID. `found` gets each, and returns whether to go on; `repeated` gets the first that
/// goes on answering.
pub(super) fn all<L: Link>(
    session: &mut Session<L>,
    mut found: impl FnMut(Identity) -> Result<bool, Failure>,
    repeated: impl FnOnce(Identity) -> Result<(), Failure>,
) -> Result<Vec<Identity>, Failure> {
    let (mut known, mut repeated) = (Vec::new(), Some(repeated));
    while let Some(identity) = if repeated.is_some() { session.fastscan()? } else { session.fastscan_beside(&known)? } {
        let is_new = !known.contains(&identity);
        if is_new {
            known.push(identity);
            if !found(identity)? {
                break;
            }
        }
        if (!is_new || session.is_anything_confirmed()?)
            && let Some(repeated) = repeated.take()
        {
            repeated(identity)?;
        }
    }
    Ok(known)
}
