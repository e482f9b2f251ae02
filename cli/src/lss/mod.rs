//! `lexican lss`: node-IDs and bit rates for devices that are found by their identity (CiA 305).

mod bit_rate;
mod find;
mod inquire;
mod node_id;
mod session;
mod store;

use lexican_runtime::host::{Link, Pace};
use lexican_runtime::wire::lss::{Identity, LssResponse};
use lexican_runtime::{Duration, NodeId};
use serde_json::{Map, Value as Json, json};

use crate::bus::BusArgs;
use crate::decode::lss::response_text;
use crate::duration::milliseconds;
use crate::identity::{self, recognise};
use crate::output::{Failure, Outcome, fields, tell, warn};
use session::{Selected, Session, Times, Whom};

/// Give node-IDs and bit rates to devices that have LSS (CiA 305)
///
/// Every command begins and ends with all devices waiting: what one command has selected is not selected in the
/// next. Some older devices answer to LSS only while they are stopped: `lexican nmt stop --all`.
#[derive(clap::Subcommand, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) enum Command {
    Find(find::Args),
    Inquire(inquire::Args),
    NodeId(node_id::Args),
    BitRate(bit_rate::Args),
    Store(store::Args),
}

const EXAMPLES: &str = "\
Examples:
    lexican lss find --bus can0                                (who has no node-ID?)
    lexican lss node-id --bus can0 --unconfigured 5 --store    (give node-ID 5 to the next one)
    lexican lss inquire --bus can0                             (the only device on the bus)";

impl Command {
    pub(crate) fn run(self) -> Result<Outcome, Failure> {
        match self {
            Command::Find(args) => find::run(&args),
            Command::Inquire(args) => inquire::run(&args),
            Command::NodeId(args) => node_id::run(&args),
            Command::BitRate(args) => bit_rate::run(&args),
            Command::Store(args) => store::run(&args),
        }
    }
}

/// The arguments of every command.
#[derive(clap::Args, Debug)]
struct LinkArgs {
    #[command(flatten)]
    bus: BusArgs,

    /// How long to wait for an answer, in milliseconds
    #[arg(long, value_name = "MS", default_value = "500", value_parser = milliseconds)]
    wait: Duration,

    /// How long each of the 133 steps of the search for devices without node-ID lasts, in milliseconds
    #[arg(long, value_name = "MS", default_value = "25", value_parser = milliseconds)]
    step: Duration,

    /// Print one JSON object per line
    #[arg(long)]
    json: bool,
}

impl LinkArgs {
    /// Does some work with LSS on the bus.
    fn work<T>(
        &self,
        work: impl FnOnce(&mut Session<Box<dyn Link + Send>>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let link = self.bus.open(Pace::Virtual)?.settled()?.link;
        let times = Times { answer: self.wait, step: self.step };
        Session::run(link, times, work)
    }
}

/// The arguments that select a device.
#[derive(clap::Args, Debug)]
struct SelectArgs {
    /// The vendor-ID (1018h:01) of the device that is meant: 405, 0x195 or 195h
    ///
    /// With neither this nor --unconfigured, the only device on the bus is meant.
    #[arg(long, value_name = "NUMBER", value_parser = number, requires_all = ["product", "revision", "serial"])]
    vendor: Option<u32>,

    /// Its product code (1018h:02)
    #[arg(long, value_name = "NUMBER", value_parser = number, requires = "vendor")]
    product: Option<u32>,

    /// Its revision number (1018h:03)
    #[arg(long, value_name = "NUMBER", value_parser = number, requires = "vendor")]
    revision: Option<u32>,

    /// Its serial number (1018h:04)
    #[arg(long, value_name = "NUMBER", value_parser = number, requires = "vendor")]
    serial: Option<u32>,

    /// A device without node-ID is meant; of several, the one that `lexican lss find` finds first
    #[arg(long, conflicts_with = "vendor")]
    unconfigured: bool,
}

impl SelectArgs {
    fn whom(&self) -> Whom {
        match (self.vendor, self.product, self.revision, self.serial) {
            (Some(vendor), Some(product), Some(revision), Some(serial)) => {
                Whom::Identity(Identity { vendor, product, revision, serial })
            }
            _ if self.unconfigured => Whom::Unconfigured,
            _ => Whom::Only,
        }
    }
}

/// The device that is selected; `None` when all are.
fn select<L: Link>(
    session: &mut Session<L>,
    select: &SelectArgs,
    everybody: bool,
) -> Result<Option<Selected>, Failure> {
    if everybody { session.select_all().map(|()| None) } else { session.select(select.whom()).map(Some) }
}

/// A number of an identity on the command line: as it is printed, as programs write it, or decimal.
fn number(text: &str) -> Result<u32, String> {
    let hex = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")).or_else(|| text.strip_suffix(['h', 'H']));
    let (digits, radix) = hex.map_or((text, 10), |digits| (digits, 16));
    let number = u32::from_str_radix(digits, radix).ok().filter(|_| !digits.starts_with('+'));
    number.ok_or_else(|| format!("{text:?} is not a number of 32 bits such as 405, 0x195 or 195h"))
}

/// Whom a line is about.
fn title(selected: Option<Selected>) -> String {
    selected.map_or_else(|| "all devices".to_owned(), |selected| words(selected.identity))
}

/// `siko/ag03-1, vendor 195h, product 0h, revision 10000h, serial 2Ah`.
fn words(identity: Identity) -> String {
    let Identity { vendor, product, revision, serial } = identity;
    let device = recognise(vendor, product).map(|known| known.id.to_owned());
    let numbers = identity::words([vendor, product, revision, serial].map(Some));
    device.into_iter().chain(numbers).collect::<Vec<_>>().join(", ")
}

/// The same in fields.
fn identity_json(identity: Identity) -> Map<String, Json> {
    let Identity { vendor, product, revision, serial } = identity;
    let device = recognise(vendor, product).map(|known| known.id);
    fields(json!({
        "vendor": vendor, "product": product, "revision": revision, "serial": serial, "device": device,
    }))
}

/// Who it was; nothing when it was everybody.
fn selected_json(selected: Option<Selected>) -> Map<String, Json> {
    let Some(Selected { identity, node }) = selected else { return Map::new() };
    let mut fields = identity_json(identity);
    fields.insert("node".to_owned(), json!(node.map(NodeId::get)));
    fields
}

/// Tells a device and what has become of it.
fn print(as_json: bool, mut device: Map<String, Json>, more: Json, text: &str) -> Result<(), Failure> {
    device.extend(fields(more));
    tell(as_json, device, text)
}

/// That a device refused: an object for programs, a warning for people.
fn print_refusal(as_json: bool, selected: Option<Selected>, refusal: LssResponse) -> Result<Outcome, Failure> {
    let text = response_text(refusal);
    if as_json {
        let mut more = crate::decode::lss::response_json(refusal);
        more["refusal"] = json!(text);
        print(true, selected_json(selected), more, "")?;
    } else {
        warn(format_args!("{}: {text}", title(selected)));
    }
    Ok(Outcome::Found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_an_identity_are_understood() {
        let check = |text: &str, expected: Option<u32>| assert_eq!(number(text).ok(), expected, "{text}");
        check("405", Some(405));
        check("0x195", Some(0x195));
        check("195h", Some(0x195));
        check("0XffffFFFF", Some(u32::MAX));
        check("100000000h", None);
        check("195", Some(195));
        check("2A", None);
        check("-1", None);
        check("+1", None);
        check("", None);
        check("h", None);
    }
}
