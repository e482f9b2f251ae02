//! The options for how often and how long to send.

use lexican_runtime::Duration;
use lexican_runtime::host::Pace;

use crate::bus::{Bus, BusArgs};
use crate::output::Failure;
use lexican_toolbox::text::duration::{period, time};

/// The arguments that say how often and how long something is sent.
#[derive(clap::Args, Debug)]
pub(super) struct Schedule {
    #[command(flatten)]
    bus: BusArgs,

    /// Send again and again, this far apart: 10ms, 0.5s, 250us
    #[arg(long, value_name = "TIME", value_parser = period)]
    pub(super) every: Option<Duration>,

    /// Stop after so many times
    #[arg(long, value_name = "N", requires = "every", value_parser = clap::value_parser!(u64).range(1..))]
    pub(super) count: Option<u64>,

    /// Stop after this time; without --count or this, at Ctrl-C
    #[arg(long = "for", value_name = "TIME", requires = "every", value_parser = time)]
    pub(super) span: Option<Duration>,

    /// Print JSON objects
    #[arg(long)]
    pub(super) json: bool,
}

impl Schedule {
    /// Opens the bus. An endless simulation runs in real time, so that users can watch it.
    pub(super) fn open(&self) -> Result<Bus, Failure> {
        let pace = if self.is_endless() { Pace::RealTime } else { Pace::Virtual };
        self.bus.open(pace)?.settled()
    }

    /// Whether only Ctrl-C ends it.
    const fn is_endless(&self) -> bool {
        self.every.is_some() && self.count.is_none() && self.span.is_none()
    }
}
