//! `lexican lss find`: the devices without node-ID.

use std::io::Write;

use lexican_runtime::host::Link;
use lexican_runtime::wire::lss::Identity;
use serde_json::json;

use super::args::LinkArgs;
use super::print::{identity_json, print, words};
use super::session::{Session, no_fastscan};
use crate::output::{self, Failure, Outcome, note, warn};

/// Find the devices that have no node-ID, one after the other
///
/// Their identities are found bit by bit (LSS fastscan), which takes some seconds for each of them. Nothing is
/// changed. Exit code 1 when there is none.
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
    args.link.work(|session| {
        let found = |identity| {
            print(as_json, identity_json(identity), json!({}), &words(identity))?;
            Ok(!args.one)
        };
        let found = all(session, found, |identity| {
            let words = words(identity);
            warn(format_args!("{words}: answers also when it was found already; the others are looked for beside it"));
            Ok(())
        })?;
        if !found.is_empty() {
            if !as_json {
                note("`lexican lss node-id --unconfigured ID` gives the first of them a node-ID");
            }
            return Ok(Outcome::Clean);
        }
        if session.somebody_is_unconfigured()? {
            return Err(no_fastscan());
        }
        if !as_json {
            writeln!(output::stdout(), "{NOBODY}")?;
        }
        Ok(Outcome::Found)
    })
}

/// All devices without node-ID: each is `found`, which goes on or not; `repeated` is the first that is found again.
pub(super) fn all<L: Link>(
    session: &mut Session<L>,
    mut found: impl FnMut(Identity) -> Result<bool, Failure>,
    repeated: impl FnOnce(Identity) -> Result<(), Failure>,
) -> Result<Vec<Identity>, Failure> {
    let mut known = Vec::new();
    while let Some(identity) = session.fastscan()? {
        if known.contains(&identity) {
            repeated(identity)?;
            while let Some(identity) = session.fastscan_beside(&known)? {
                known.push(identity);
                if !found(identity)? {
                    break;
                }
            }
            break;
        }
        known.push(identity);
        if !found(identity)? {
            break;
        }
    }
    Ok(known)
}

const NOBODY: &str = "no device without node-ID answers; `lexican scan` shows those that have one";
