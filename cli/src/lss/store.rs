//! `lexican lss store`: node-ID and bit rate for good.

use serde_json::json;

use super::args::{LinkArgs, SelectArgs, select};
use super::print::{print, print_refusal, selected_json, title};
use crate::output::{Failure, Outcome};

/// Let a device, or all, store node-ID and bit rate
///
/// Exit code 1 when a device refuses: not every one can.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(flatten)]
    link: LinkArgs,

    #[command(flatten)]
    select: SelectArgs,

    /// All devices are meant
    #[arg(long, conflicts_with_all = ["vendor", "unconfigured"])]
    all: bool,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    args.link.work(|session| {
        let selected = select(session, &args.select, args.all)?;
        if let Err(refusal) = session.store()? {
            return print_refusal(args.link.json, selected, refusal);
        }
        let text = format!("{}: stored", title(selected));
        print(args.link.json, selected_json(selected), json!({ "stored": true }), &text)?;
        Ok(Outcome::Clean)
    })
}
