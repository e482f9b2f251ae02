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
/// Makes a node of any data sheet: it has the default values, enforces access and limits, and serves PDOs, heartbeat
/// and EMCY. A drive of CiA 402 also moves: any data sheet with 6040h, 6041h and 6060h. SIKO's drives do as their
/// manuals say. Runs until it is interrupted.
///
/// By default it makes pseudo-terminals that act as serial adapters, so that all other commands can be tried without
/// CAN hardware; it prints their --bus.
///
/// Lines on stdin control the device; help lists them: get, set, emcy, power, status, and for a drive every key of
/// its scripts, such as battery_v = 2.5, or of a CiA 402 drive, such as blocked = true.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    pub(super) device: DeviceArgs,

    /// The bus: can0, slcan:/dev/ttyACM0?bitrate=500000, or pty for a bus of pseudo-terminals
    ///
    /// pty makes two, one for a monitor and one for another command; pty:4 makes four. serial makes one at which the
    /// drive speaks the protocol of its own serial interface, if it has one: siko/ag02 does.
    #[arg(long, value_name = "URL", default_value = "pty")]
    pub(super) bus: Place,

    /// The node-ID, 1 to 127; none for a device that gets one by LSS
    #[arg(long, value_name = "ID", default_value = "1")]
    pub(super) node: NodeOrNone,

    /// The file for stored parameters, as the EEPROM of a device
    #[arg(long, value_name = "FILE")]
    pub(super) eeprom: Option<PathBuf>,

    /// A script of events for a drive, such as faults, supply and a blocked shaft (TOML)
    #[arg(long, value_name = "FILE")]
    pub(super) script: Option<PathBuf>,

    /// Stop after so many seconds
    #[arg(long = "for", value_name = "SECONDS", value_parser = seconds)]
    pub(super) span: Option<Duration>,

    /// Also print reads and PDOs
    #[arg(long, short)]
    pub(super) verbose: bool,

    /// Print one JSON object per line, including reads and PDOs
    #[arg(long)]
    pub(super) json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican simulate siko/ag03-1 --node 5
    lexican read --bus slcan:/dev/pts/3 --node 5 6041      (in another terminal)
    lexican simulate FILE.eds --bus can0 --node 7 --eeprom kept.txt
    lexican simulate siko/ag02 --bus serial";

/// The bus of the device.
#[derive(Clone, Debug)]
pub(super) enum Place {
    /// A bus of so many pseudo-terminals.
    Ptys(usize),
    /// A pseudo-terminal that is the serial interface of a drive.
    Serial,
    Url(BusUrl),
}

impl FromStr for Place {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        const MOST: usize = 16;
        match text.split_once(':').unwrap_or((text, "2")) {
            ("serial", "2") if text == "serial" => Ok(Place::Serial),
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
