//! `lexican lss find`: the devices without node-ID.

use std::io::Write;

use serde_json::json;

use super::session::no_fastscan;
use super::{LinkArgs, identity_json, print, words};
use crate::output::{self, Failure, Outcome, note};

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
        let mut found = 0;
        while let Some(identity) = session.fastscan()? {
            found += 1;
            print(as_json, identity_json(identity), json!({}), &words(identity))?;
            if args.one {
                break;
            }
        }
        if found > 0 {
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

const NOBODY: &str = "no device without node-ID answers; `lexican scan` shows those that have one";
