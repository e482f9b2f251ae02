//! `lexican sync`.

use lexican_runtime::wire::sync::Sync;
use lexican_runtime::{CobId, Duration};

use super::schedule::Schedule;
use super::session::Session;
use crate::output::{Failure, Outcome};

/// Send SYNC, once or again and again
///
/// SYNC STARTS WHAT WAITS FOR IT: drives take the targets that they hold, and follow their path. Nobody else may send SYNC on the
/// bus. What is late, for the machine was busy, is not made up for: the summary says how late, and how many were left out.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    schedule: Schedule,

    /// Count from 1 to N, and then from 1 again (1019h), 2 to 240; by default SYNC is empty
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(2..=240))]
    counter: Option<u8>,
}

const EXAMPLES: &str = "\
Examples:
    lexican sync --bus can0
    lexican sync --bus can0 --every 10ms --for 60s
    lexican sync --bus can0 --every 10ms --counter 240 --count 1000 --json";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let mut session = Session::of(&args.schedule)?;
    let overflow = args.counter.map(u64::from);
    let sync = |tick: u64, _| {
        let counter = overflow.map(|overflow| (tick % overflow) as u8 + 1);
        vec![Sync { counter }.frame(CobId::SYNC)]
    };
    session.tick(&args.schedule, Duration::ZERO, sync, |_: &mut Session, _| Ok(()))
}
