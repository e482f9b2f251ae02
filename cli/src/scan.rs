//! `lexican scan`: who is on the bus.

use std::collections::BTreeMap;
use std::io::Write;

use lexican_eds::library;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{Link, Pace};
use lexican_runtime::object::Address;
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::wire::sdo::ClientRequest;
use lexican_runtime::{CobId, Duration, Frame, NodeId};
use serde_json::json;

use crate::bus::BusArgs;
use crate::output::{Failure, Outcome, styled};

/// Find the nodes of a bus
///
/// Asks every node-ID for its device type by SDO, and those that answer for their identity. Nothing is changed.
/// Exit code 1 when nobody answers.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(flatten)]
    bus: BusArgs,

    /// How long to wait for answers, in milliseconds
    #[arg(long, value_name = "MS", default_value_t = 500)]
    wait: u64,

    /// Print one JSON object per line
    #[arg(long)]
    json: bool,
}

/// Between two requests: 127 of them shall not crowd anybody else out.
const PAUSE: Duration = Duration::from_millis(1);
const DEVICE_TYPE: Address = Address::new(0x1000, 0);
const IDENTITY: u16 = 0x1018;

/// What a node tells of itself.
#[derive(Default)]
struct Found {
    device_type: Option<u32>,
    state: Option<NmtState>,
    vendor: Option<u32>,
    product: Option<u32>,
    revision: Option<u32>,
    serial: Option<u32>,
}

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let mut link = args.bus.open(Pace::Virtual)?.link;
    let mut found = ask_all(&mut link, Duration::from_millis(args.wait))?;
    let mut network = Network::new(link);
    for (&node, found) in &mut found {
        let mut number = |address| {
            let data = network.read_bytes(node, address).ok()?;
            let bytes = data.iter().take(4).rev();
            Some(bytes.fold(0_u32, |number, byte| number << 8 | u32::from(*byte)))
        };
        found.device_type = number(DEVICE_TYPE);
        found.vendor = number(Address::new(IDENTITY, 1));
        found.product = number(Address::new(IDENTITY, 2));
        found.revision = number(Address::new(IDENTITY, 3));
        found.serial = number(Address::new(IDENTITY, 4));
    }
    print(args.json, &found)?;
    Ok(if found.is_empty() { Outcome::Found } else { Outcome::Clean })
}

/// The nodes that answer, or send anything that tells of them.
fn ask_all(link: &mut dyn Link, wait: Duration) -> Result<BTreeMap<NodeId, Found>, Failure> {
    let mut found = BTreeMap::new();
    let request = ClientRequest::InitiateUpload { address: DEVICE_TYPE }.to_bytes();
    for node in NodeId::all() {
        link.send(&Frame::from_array(CobId::of_node(0x600, node), request)).map_err(Failure::new)?;
        listen(link, PAUSE, &mut found)?;
    }
    listen(link, wait, &mut found)?;
    Ok(found)
}

fn listen(link: &mut dyn Link, span: Duration, found: &mut BTreeMap<NodeId, Found>) -> Result<(), Failure> {
    let until = link.now() + span;
    while let Some(frame) = link.receive_frame(until).map_err(Failure::new)? {
        if let Some(node) = ErrorControl::node(frame.id()).filter(|_| !frame.is_remote()) {
            // Behind the boot-up message PRE-OPERATIONAL follows by itself.
            found.entry(node).or_default().state = ErrorControl::parse(frame.data()).map(|told| match told.state {
                NmtState::Initialising => NmtState::PreOperational,
                state => state,
            });
        } else if let Some(node) = responder(&frame) {
            found.entry(node).or_default();
        }
    }
    Ok(())
}

/// Whose SDO server has sent a frame.
fn responder(frame: &Frame) -> Option<NodeId> {
    let low = frame.id().raw().checked_sub(0x580).filter(|_| !frame.id().is_extended())?;
    NodeId::new(u8::try_from(low).ok()?)
}

fn print(as_json: bool, found: &BTreeMap<NodeId, Found>) -> Result<(), Failure> {
    let mut stdout = anstream::stdout().lock();
    for (node, found) in found {
        if as_json {
            let line = json!({
                "node": node.get(),
                "device_type": found.device_type,
                "state": found.state.map(|state| state.to_string()),
                "vendor": found.vendor,
                "product": found.product,
                "revision": found.revision,
                "serial": found.serial,
                "device": found.device(),
            });
            writeln!(stdout, "{line}")?;
        } else {
            let node = styled(anstyle::Style::new().bold(), format_args!("node {node:>3}"));
            writeln!(stdout, "{node}  {}", found.describe())?;
        }
    }
    if found.is_empty() && !as_json {
        writeln!(stdout, "no node answers")?;
    }
    stdout.flush()?;
    Ok(())
}

impl Found {
    /// The device of the library that it is, as far as its identity tells.
    fn device(&self) -> Option<&'static str> {
        let vendor = self.vendor.filter(|vendor| *vendor != 0)?;
        let mut same = library::all().iter().filter(|shipped| {
            let (device, _) = lexican_eds::load(&shipped.input());
            device.info.vendor_number == Some(vendor)
                && device.info.product_number.unwrap_or(0) == self.product.unwrap_or(0)
        });
        // Two that look the same are none.
        same.next().filter(|_| same.next().is_none()).map(|shipped| shipped.id)
    }

    fn describe(&self) -> String {
        let mut parts = Vec::new();
        parts.extend(self.device().map(str::to_owned));
        parts.extend(self.device_type.map(|number| match number & 0xFFFF {
            0 => "device type 0: no profile".to_owned(),
            profile => format!("CiA {profile} (device type {number:08X}h)"),
        }));
        let numbers =
            [("vendor", self.vendor), ("product", self.product), ("revision", self.revision), ("serial", self.serial)];
        parts.extend(numbers.into_iter().filter_map(|(name, number)| Some(format!("{name} {:X}h", number?))));
        parts.extend(self.state.map(|state| state.to_string()));
        if parts.is_empty() { "answers, but has no device type".to_owned() } else { parts.join(", ") }
    }
}
