//! The arguments of the command.

use std::path::PathBuf;
use std::str::FromStr;

use lexican_runtime::Duration;
use lexican_runtime::host::BusUrl;

use crate::bus::NodeOrNone;
use crate::device::DeviceArgs;
use crate::duration::seconds;

/// Simulate a device on a bus
///
/// Any data sheet becomes a node: its defaults are the values, what is written is kept, access rights and limits
/// are enforced, PDOs, heartbeat and EMCY are alive. The SIKO AG03/1 also moves. Runs until it is interrupted.
///
/// Without --bus it makes pseudo-terminals that act as serial adapters, so that every other command can be tried
/// on any machine: it prints what to name as their --bus.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES, after_long_help = LONG_HELP)]
pub(crate) struct Args {
    #[command(flatten)]
    pub(super) device: DeviceArgs,

    /// The bus: can0, slcan:/dev/ttyACM0?bitrate=500000, or pty for a bus of pseudo-terminals
    ///
    /// pty makes two, so that one can watch while the other acts; pty:4 makes four.
    #[arg(long, value_name = "URL", default_value = "pty")]
    pub(super) bus: Place,

    /// The node-ID, 1 to 127; none for a device that waits for LSS to give it one
    #[arg(long, value_name = "ID", default_value = "1")]
    pub(super) node: NodeOrNone,

    /// Keep stored parameters in a file, as a device does in its EEPROM
    #[arg(long, value_name = "FILE")]
    pub(super) eeprom: Option<PathBuf>,

    /// What happens to a simulated drive, and when: faults, supply, temperature, a blocked shaft (TOML)
    #[arg(long, value_name = "FILE")]
    pub(super) script: Option<PathBuf>,

    /// Stop after so many seconds
    #[arg(long = "for", value_name = "SECONDS", value_parser = seconds)]
    pub(super) span: Option<Duration>,

    /// Tell of reads and PDOs, too
    #[arg(long, short)]
    pub(super) verbose: bool,

    /// Tell what happens as one JSON object per line, reads and PDOs included
    #[arg(long)]
    pub(super) json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican simulate siko/ag03-1 --node 5
    lexican read --bus slcan:/dev/pts/3 --node 5 6041      (in another terminal)";

const LONG_HELP: &str = "\
While it runs, lines on stdin control the device; help lists them: get, set, emcy, power, status, and for a drive \
every key of its scripts, such as battery_v = 2.5.

Examples:
    lexican simulate siko/ag03-1 --node 5
    lexican read --bus slcan:/dev/pts/3 --node 5 6041      (in another terminal)
    lexican simulate FILE.eds --bus can0 --node 7 --eeprom kept.txt";

/// Where the device is to be.
#[derive(Clone, Debug)]
pub(super) enum Place {
    /// On so many pseudo-terminals.
    Ptys(usize),
    Url(BusUrl),
}

impl FromStr for Place {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        const MOST: usize = 16;
        match text.split_once(':').unwrap_or((text, "2")) {
            ("pty", count) => match count.parse() {
                Ok(count @ 1..=MOST) => Ok(Place::Ptys(count)),
                _ => Err(format!("{count:?} is not a number of pseudo-terminals: that is 1 to {MOST}")),
            },
            _ => {
                text.parse().map(Place::Url).map_err(|error: lexican_runtime::host::url::BusUrlError| error.to_string())
            }
        }
    }
}
