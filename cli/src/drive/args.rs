//! The command line of `lexican drive`.

use std::path::PathBuf;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use lexican_driver::Description;
use lexican_runtime::{Duration, NodeId};
use lexican_toolbox::drive::{Order, Scales, Verb};

use crate::bus::{BusArgs, node_id};
use crate::output::Failure;
use lexican_toolbox::text::duration::{milliseconds, time};

/// Move a drive of CiA 402, by its data sheet
///
/// THE DRIVE MOVES AT ONCE: the command says what it is about to do, and asks no question. Before anything is sent that
/// moves, the order is checked against the limits of the data sheet, those that the drive is set to, and its state; the mode is
/// set. A drive that is not enabled is not enabled by an order to move, unless --enable says so.
///
/// The drive stands when the command ends, however it does: Ctrl-C, SIGTERM and SIGHUP stop it, and so does what has gone
/// wrong. If it cannot be told to stop, since its bus is lost, the command says so and exits with 2. For the case that the
/// command is killed, or its machine loses power, the drive's heartbeat consumer (1016h) or life guarding (100Ch) is armed
/// while it moves, if it has one. None of this replaces an emergency stop.
///
/// Exit code 1 if the drive refuses the order, or has not carried it out; 2 also if it may be moving still.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    pub(super) bus: BusArgs,

    /// The node-ID: 1 to 127, or 0x1 to 0x7F
    #[arg(value_name = "NODE", value_parser = node_id)]
    pub(super) node: NodeId,

    /// What it is to do
    #[arg(value_parser = verbs(), value_name = "ORDER", required_unless_present = "explain")]
    order: Option<Verb>,

    /// Where to, how far, how fast, or the homing method: "5 mm", "-0.5 mm", "60 rpm", raw:5000
    ///
    /// A number in the unit of the data sheet or its overlay; without a unit there, a plain number.
    #[arg(allow_hyphen_values = true)]
    value: Option<String>,

    /// The unit, if it is a word of its own
    unit: Option<String>,

    /// The drive: an EDS, DCF or XDD file, or a device that lexican knows
    ///
    /// By default the device that is named in the URL of the bus, else the device that lexican knows by the node's identity (1018h).
    #[arg(long, value_name = "FILE|DEVICE")]
    pub(super) device: Option<String>,

    /// Corrections and units in addition to the data sheet (TOML); may be given several times
    #[arg(long, value_name = "FILE")]
    pub(super) overlay: Vec<PathBuf>,

    /// Only say whether the drive can be moved: what is missing, what is used instead, and what has to be set
    ///
    /// Nothing is ordered. With what has to be set, exit code 1; 2 if something is missing without which it cannot be moved.
    #[arg(long, conflicts_with_all = ["order", "enable", "velocity", "acceleration"])]
    pub(super) explain: bool,

    /// The velocity of a travel: set 6081h before the order; it stays set until the drive restarts
    #[arg(long, value_name = "VELOCITY")]
    velocity: Option<String>,

    /// The ramps of a travel: set 6083h and 6084h, likewise
    #[arg(long, value_name = "ACCELERATION")]
    acceleration: Option<String>,

    /// Enable the drive before it moves, and disable it afterwards if it was not enabled before
    #[arg(long)]
    pub(super) enable: bool,

    /// Run or watch for this long; without it, until Ctrl-C
    #[arg(long = "for", value_name = "TIME", value_parser = time)]
    pub(super) span: Option<Duration>,

    /// Stop the drive if it has not done what was ordered within this time
    #[arg(long, value_name = "TIME", value_parser = time, default_value = "10min")]
    pub(super) within: Duration,

    /// How soon the drive is to notice that the command is gone; 0 for not at all
    #[arg(long, value_name = "TIME", value_parser = milliseconds, default_value = "1s")]
    pub(super) protect: Duration,

    /// The node-ID of the command, under which it sends heartbeats to the drive; no node may have it
    #[arg(long, value_name = "NODE", value_parser = node_id, default_value = "127")]
    pub(super) manager: NodeId,

    /// Print a line this often while it moves; on a terminal, one line changes
    #[arg(long, value_name = "TIME", value_parser = milliseconds, default_value = "500ms")]
    pub(super) every: Duration,

    /// Print one JSON object per line
    #[arg(long)]
    pub(super) json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican drive --bus can0 5 enable
    lexican drive --bus can0 5 move-to 5000
    lexican drive feeder move-to 50 mm
    lexican drive --bus can0 5 step \"-0.5 mm\"
    lexican drive --bus can0 7 run \"60 rpm\" --for 10s --enable --device FILE.eds --overlay units.toml
    lexican drive --bus can0 5 watch
    lexican drive --bus can0 5 --explain --device FILE.eds
    lexican drive --bus sim:siko/ag03-1?node=5 5 move-to 5000 --enable";

/// Parses an order from its word.
fn verbs() -> impl TypedValueParser<Value = Verb> {
    let words = Verb::ALL.iter().map(|verb| PossibleValue::new(verb.word()).help(verb.help()));
    let named = |word: String| Verb::ALL.iter().copied().find(|verb| verb.word() == word);
    PossibleValuesParser::new(words).map(move |word| named(word).expect("one of the possible values"))
}

impl Args {
    /// Whether only Ctrl-C ends the order.
    pub(super) fn is_endless(&self) -> bool {
        self.order.is_some_and(Verb::lasts) && self.span.is_none()
    }

    pub(crate) fn check_value(&self) -> Result<(), Failure> {
        self.verb().check(self.value().as_deref()).map_err(Failure::new)
    }

    fn value(&self) -> Option<String> {
        let unit = self.unit.as_ref().map(|unit| format!(" {unit}")).unwrap_or_default();
        Some(self.value.clone()? + &unit)
    }

    /// The order; without one, as with `--explain`, the one that only looks.
    fn verb(&self) -> Verb {
        self.order.unwrap_or(Verb::Watch)
    }

    /// The velocity and the acceleration to set, in the units of 6081h and 6083h.
    pub(super) fn profile(&self, scales: &Scales<'_>, description: &Description) -> Result<[Option<i64>; 2], Failure> {
        let numbers = description.profile.map(|profile| [Some(profile.velocity), profile.acceleration]);
        let numbers = numbers.unwrap_or_default();
        let mut values = [None; 2];
        for ((text, number), value) in [&self.velocity, &self.acceleration].into_iter().zip(numbers).zip(&mut values) {
            let Some(text) = text else { continue };
            let number = number.ok_or_else(|| {
                Failure::new(format_args!("where the {} has its velocity and ramps is not known", description.name))
                    .help("set them by `lexican write`, as its manual says")
            })?;
            *value = Some(scales.parse_value(number.address(), text).map_err(Failure::new)?);
        }
        Ok(values)
    }

    pub(super) fn order(&self, scales: &Scales<'_>) -> Result<Order, Failure> {
        self.verb().order(self.value().as_deref(), scales).map_err(Failure::new)
    }
}
