//! The arguments of the command.

use std::path::PathBuf;
use std::str::FromStr;

use lexican_runtime::host::BusUrl;
use lexican_runtime::{Duration, NodeId};
use lexican_simulation::plant::is_machine;
use lexican_simulation::{Plant, PlantDevice};
use lexican_toolbox::text::files::read;

use crate::bus::kind::{Simulated, Terminal};
use crate::bus::kinds::{KINDS, url};
use crate::bus::{NodeOrNone, read_plant};
use crate::device::DeviceArgs;
use crate::output::Failure;
use lexican_toolbox::text::duration::time;

/// Simulate a device, or those of a machine, on a bus
///
/// Makes a node of any data sheet: it has the default values, enforces access and limits, and serves PDOs, heartbeat
/// and EMCY. A drive of CiA 402 also moves: any data sheet with 6040h, 6041h and 6060h. SIKO's drives do as their
/// manuals say. Runs until it is interrupted.
///
/// By default it makes pseudo-terminals that act as serial adapters, so that all other commands can be tried without
/// CAN hardware; it prints their --bus.
///
/// A file that ends in .toml is a machine: devices on one bus, and the faults between them; the last part of this help shows
/// one.
///
/// Lines on stdin control the device; help lists them: get, set, emcy, power, status, and for a drive every key of
/// its scripts, such as battery_v = 2.5, or of a CiA 402 drive, such as blocked = true.
/// In a machine they begin with the node-ID or the name of a device: 5: blocked = true.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    pub(super) plant: PlantArgs,

    /// The bus: can0, slcan:/dev/ttyACM0?bitrate=500000, or pty for a bus of pseudo-terminals
    ///
    /// pty makes two pseudo-terminals, one for a monitor and one for another command; pty:4 makes four. serial makes one, on
    /// which siko/ag02 speaks the protocol of its own serial port. profibus makes one, on which siko/ag02 or siko/ag03-1 is a
    /// PROFIBUS-DP slave; its address is the node-ID.
    #[arg(long, value_name = "URL", default_value = "pty")]
    pub(super) bus: Place,

    /// Stop after this time
    #[arg(long = "for", value_name = "TIME", value_parser = time)]
    pub(super) span: Option<Duration>,

    /// Also print reads and PDOs
    #[arg(long, short)]
    pub(super) verbose: bool,

    /// Print one JSON object per line, including reads and PDOs
    #[arg(long)]
    pub(super) json: bool,
}

/// What is simulated.
#[derive(clap::Args, Debug)]
pub(crate) struct PlantArgs {
    #[command(flatten)]
    device: DeviceArgs,

    /// The node-ID, 1 to 127; none for a device that gets one by LSS; 1 by default
    #[arg(long, value_name = "NODE")]
    node: Option<NodeOrNone>,

    /// The file for stored parameters, as the EEPROM of a device
    #[arg(long, value_name = "FILE")]
    eeprom: Option<PathBuf>,

    /// A script of events for a drive, such as faults, supply and a blocked shaft (TOML)
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Examples:
    lexican simulate siko/ag03-1 --node 5
    lexican read --bus slcan:/dev/pts/3 --node 5 6041      (in another terminal)
    lexican simulate FILE.eds --bus can0 --node 7 --eeprom kept.txt
    lexican simulate siko/ag02 --bus serial
    lexican simulate siko/ag03-1 --bus profibus --node 5
    lexican simulate machine.toml
    lexican scan --bus sim:machine.toml                    (the same machine for one command)

A machine (TOML; only id and sheet have to be there; paths are relative to the file):

    bus.bit-rate = \"250 kbit/s\"    # with sim: only

    [node.feeder]                  # the name begins lines on stdin, feeder: blocked = true
    id = 5                         # or \"none\", for a device that gets one by LSS
    sheet = \"drive.eds\"            # or a device that lexican knows: siko/ag03-1
    overlay = [\"drive.toml\"]       # corrections and meanings in addition to it

    [simulate.feeder]              # until it is reset
    settings = { 6060 = \"profile velocity\", 1017 = \"100 ms\" }
    inputs = [\"blocked = true\"]    # of a drive, as on stdin
    eeprom = \"feeder.txt\"          # what it stores
    script = \"jam.toml\"            # or steps, each a table [[simulate.feeder.step]]
    power = \"on\"                   # or off

    [[simulate.feeder.step]]
    when = \"moving\"
    after_ms = 500
    blocked = true

    [[fault]]
    action = \"lose\"                # or repeat, delay
    from = \"feeder\"                # what this node sends
    cob-id = 0x705                 # frames with this identifier
    every = 20                     # each twentieth one
    in-a-row = 4                   # and the three before it
    # delay = \"20 ms\"              # by how much they are delayed";

impl PlantArgs {
    /// The name of what is simulated.
    pub(crate) fn name(&self) -> &str {
        self.device.name()
    }

    /// Makes the devices to simulate.
    pub(crate) fn plant(&self) -> Result<Plant, Failure> {
        let name = self.name();
        if !is_machine(name) {
            let node = self.node.map_or(Some(NodeId::literal(1)), |node| node.0);
            let mut device = PlantDevice::new(node, name, self.device.load()?);
            device.eeprom = self.eeprom.clone();
            device.script = self.script.as_deref().map(read).transpose()?;
            return Ok(Plant::of(device));
        }
        let given = [
            ("--overlay", self.device.has_overlays()),
            ("--node", self.node.is_some()),
            ("--eeprom", self.eeprom.is_some()),
            ("--script", self.script.is_some()),
        ];
        if let Some((option, _)) = given.iter().find(|(_, is_given)| *is_given) {
            return Err(Failure::new(format_args!("{option} is of one device, and {name} is a machine"))
                .help("the machine says it of each device: `lexican simulate --help` shows one"));
        }
        read_plant(name.as_ref())
    }
}

/// Where the device is simulated.
#[derive(Clone, Debug)]
pub(super) enum Place {
    /// A bus of this many pseudo-terminals.
    Ptys(usize),
    /// A pseudo-terminal as the other interface of a drive.
    Terminal(Terminal),
    Url(BusUrl),
}

impl FromStr for Place {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        const MOST: usize = 16;
        let terminals = KINDS.iter().filter_map(|kind| match kind.simulated {
            Simulated::AtTerminal(terminal) => Some(terminal),
            _ => None,
        });
        match text.split_once(':').unwrap_or((text, "")) {
            ("pty", "") => Ok(Place::Ptys(2)),
            ("pty", count) => match count.parse() {
                Ok(count @ 1..=MOST) => Ok(Place::Ptys(count)),
                _ => Err(format!("{count:?} is not a number of pseudo-terminals: that is 1 to {MOST}")),
            },
            (name, rest) => match terminals.into_iter().find(|it| it.name == name && rest.is_empty()) {
                Some(terminal) => Ok(Place::Terminal(terminal)),
                None => url(text).map(Place::Url).map_err(|error| error.to_string()),
            },
        }
    }
}
