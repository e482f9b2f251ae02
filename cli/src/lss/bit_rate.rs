//! `lexican lss bit-rate`: a bit rate for a device, or for all.

use lexican_runtime::host::Link;
use serde_json::json;

use super::args::{LinkArgs, SelectArgs, select};
use super::print::{print, print_refusal, selected_json, title};
use super::session::Session;
use crate::decode::lss::{AUTOMATIC, BIT_TIMING_TABLE};
use crate::output::{Failure, Outcome, note};

/// Give a device, or all, a bit rate
///
/// Nothing changes on the bus before it is activated, or the devices that have stored it are switched on again. All
/// devices of a bus must change together. Exit code 1 when a device refuses; then nothing is activated.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    link: LinkArgs,

    #[command(flatten)]
    select: SelectArgs,

    /// All devices are meant; those without LSS remain at their bit rate
    #[arg(long, conflicts_with_all = ["vendor", "unconfigured"])]
    all: bool,

    /// Let the devices store it, so that they have it without power, too
    #[arg(long)]
    store: bool,

    /// Let the devices be silent for so many ms, then change, and be silent for as long again
    ///
    /// The command ends when that is over; then the interface must be set to the new bit rate.
    #[arg(long, value_name = "MS", value_parser = delay_ms)]
    activate: Option<u16>,

    /// In kbit/s: 1000, 800, 500, 250, 125, 50, 20 or 10; auto lets the device find it out
    #[arg(value_name = "KBIT", value_parser = rate)]
    rate: Rate,
}

const EXAMPLES: &str = "\
Examples:
    lexican lss bit-rate --bus can0 --all 250 --store                  (for the next start)
    lexican lss bit-rate --bus can0 --all 250 --store --activate 1000  (in a second)
    ip link set can0 down; ip link set can0 up type can bitrate 250000";

/// An entry of the table of CiA 305.
#[derive(Clone, Copy, Debug)]
struct Rate {
    entry: u8,
    /// `None`: the device finds it out.
    kbit_per_s: Option<u16>,
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

/// What fits into the request.
fn delay_ms(text: &str) -> Result<u16, String> {
    text.parse().map_err(|_| format!("{text:?} is not a number of milliseconds, 0 to {}", u16::MAX))
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    args.link.work(|session| give(session, args))
}

fn give<L: Link>(session: &mut Session<L>, args: &Args) -> Result<Outcome, Failure> {
    let selected = select(session, &args.select, args.all)?;
    if let Err(refusal) = session.configure_bit_rate(args.rate.entry)? {
        return print_refusal(args.link.json, selected, refusal);
    }
    if args.store
        && let Err(refusal) = session.store()?
    {
        return print_refusal(args.link.json, selected, refusal);
    }
    if let Some(delay_ms) = args.activate {
        session.activate(delay_ms)?;
    }
    let kbit_per_s = args.rate.kbit_per_s;
    let rate = kbit_per_s.map_or_else(|| "the bit rate of the bus".to_owned(), |rate| format!("{rate} kbit/s"));
    let more = json!({ "kbit_per_s": kbit_per_s, "stored": args.store, "activated": args.activate.is_some() });
    print(args.link.json, selected_json(selected), more, &format!("{}: {rate}", title(selected)))?;
    match (args.activate, args.store) {
        (Some(_), _) => note(format_args!("set the interface to {rate}, too, before the next command")),
        (None, true) => note("it takes effect when the device is switched on again"),
        (None, false) => note("neither activated nor stored: nothing changes without --activate or --store"),
    }
    Ok(Outcome::Clean)
}
