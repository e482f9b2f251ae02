//! `lexican time`.

use std::time::{SystemTime, UNIX_EPOCH};

use lexican_runtime::object::TimeOfDay;
use lexican_runtime::{CobId, Duration, wire};
use lexican_toolbox::text::time_of_day;

use super::schedule::Schedule;
use super::session::Session;
use crate::output::{Failure, Outcome, note};

/// Send TIME: the date and the time of day (TIME_OF_DAY)
///
/// The devices that consume it (bit 31 of 1012h) set their clocks. Without a time, that of this machine is sent, in UTC: CANopen has no time zones.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    schedule: Schedule,

    /// The time: "2026-11-23 12:00:00.500", 2026-11-23T12:00:00, or a day; with --every it goes on
    #[arg(value_name = "TIME", value_parser = time)]
    time: Option<TimeOfDay>,
}

const EXAMPLES: &str = "\
Examples:
    lexican time --bus can0
    lexican time --bus can0 \"2026-11-23 12:00:00\"
    lexican time --bus can0 --every 60s";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let first = args.time.or_else(now).ok_or_else(|| {
        Failure::new("the clock of this machine is before 1984 or after 2163, which no TIME_OF_DAY can say")
    })?;
    let mut session = Session::of(&args.schedule)?;
    if !args.schedule.json {
        note(format_args!("the time sent is {}", time_of_day::text(first)));
    }
    let time = |_, elapsed: Duration| {
        let time = match args.time {
            Some(first) => time_of_day::later(first, elapsed.as_micros() / 1000),
            None => now(),
        };
        time.map(|time| wire::time::frame(CobId::TIME, time)).into_iter().collect()
    };
    session.tick(&args.schedule, Duration::ZERO, time, |_, _| Ok(()))
}

/// The time of this computer, in UTC.
#[expect(clippy::disallowed_methods, reason = "the date is nowhere else")]
pub(crate) fn now() -> Option<TimeOfDay> {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).ok()?;
    time_of_day::of_unix(u64::try_from(since.as_millis()).ok()?)
}

fn time(text: &str) -> Result<TimeOfDay, String> {
    time_of_day::parse(text)
        .ok_or_else(|| format!("{text:?} is not a time such as \"2026-11-23 12:00:00\", from 1984 to 2163"))
}
