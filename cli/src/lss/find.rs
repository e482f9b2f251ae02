//! `lexican lss find`: the devices without node-ID.

use std::io::Write;

use lexican_toolbox::lss::Trouble;
use serde_json::json;

use super::args::LinkArgs;
use super::print::{describe, identity_json, print};
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
        let found = |identity| -> Result<bool, Failure> {
            print(as_json, identity_json(identity), json!({}), &describe(identity))?;
            Ok(!args.one)
        };
        let found = session.find_all(found, |identity| {
            let device = describe(identity);
            warn(format_args!("{device}: still answers after it was found; searching for the others beside it"));
        })?;
        if !found.is_empty() {
            if !as_json {
                note("`lexican lss node-id --unconfigured ID` gives the first of them a node-ID");
            }
            return Ok(Outcome::Clean);
        }
        if session.has_unconfigured()? {
            return Err(Trouble::NoFastscan.into());
        }
        if !as_json {
            writeln!(output::stdout(), "no device without node-ID answers; `lexican scan` shows those that have one")?;
        }
        Ok(Outcome::Found)
    })
}
