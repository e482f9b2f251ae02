//! `lexican monitor`: what is going on on a bus, in words.

use std::io::Write;

use lexican_runtime::host::{Incoming, LinkError, Pace};
use lexican_runtime::{Duration, Frame, Instant, NodeId};
use serde_json::json;

use crate::bus::{Bus, BusArgs, node_id};
use crate::decode::{Decoded, Decoder};
use crate::device::Loaded;
use crate::output::{Failure, Outcome};
use crate::print;
use crate::values::hex;

/// Print every frame of a bus, in words by name and unit
///
/// Runs until it is interrupted, or until a log ends.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(flatten)]
    bus: BusArgs,

    /// What a node is: 5=siko/ag03-1, 7=drive.eds; may be given several times
    #[arg(long, value_name = "ID=DEVICE", value_parser = node_device)]
    device: Vec<(NodeId, String)>,

    /// Stop after so many frames
    #[arg(long, value_name = "N")]
    count: Option<u64>,

    /// Stop after so many seconds
    #[arg(long = "for", value_name = "SECONDS")]
    seconds: Option<u64>,

    /// Print one JSON object per line
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let named = args.device.iter().map(|(node, name)| Ok((*node, Loaded::named(name)?)));
    let mut devices = named.collect::<Result<Vec<_>, Failure>>()?;
    // Whoever watches a simulation wants to see it happen, unless it is over by itself.
    let pace = if args.seconds.is_some() { Pace::Virtual } else { Pace::RealTime };
    let Bus { mut link, simulated } = args.bus.open(pace)?;
    devices.extend(simulated);
    let mut decoder = Decoder::new();
    for (node, loaded) in devices.iter().rev() {
        decoder.introduce(*node, &loaded.device);
    }

    let end = args.seconds.map(|seconds| link.now() + Duration::from_secs(seconds));
    let mut left = args.count.unwrap_or(u64::MAX);
    let mut stdout = anstream::stdout().lock();
    while left > 0 {
        // Whatever waits longer is not waiting but sleeping: an hour is as good as for ever.
        let until = end.unwrap_or(link.now() + Duration::from_secs(3600));
        match link.receive(until) {
            Ok(Some(Incoming::Frame(frame))) => {
                let decoded = decoder.decode(&frame);
                let at = link.now();
                let line = if args.json { to_json(at, &frame, &decoded) } else { print::line(at, &frame, &decoded) };
                writeln!(stdout, "{line}")?;
                left -= 1;
            }
            Ok(Some(Incoming::State(state))) if args.json => {
                writeln!(stdout, "{}", json!({ "time": link.now().to_string(), "bus": state.to_string() }))?;
            }
            Ok(Some(Incoming::State(state))) => writeln!(stdout, "{:>12}  the bus is {state}", link.now().to_string())?,
            Ok(None) if end.is_some() => break,
            Ok(None) => {}
            Err(LinkError::Ended) => break,
            Err(error) => return Err(Failure::new(error)),
        }
    }
    stdout.flush()?;
    Ok(Outcome::Clean)
}

fn to_json(at: Instant, frame: &Frame, decoded: &Decoded) -> String {
    let id = frame.id().to_string();
    json!({
        "time": at.to_string(),
        "id": id,
        "remote": frame.is_remote(),
        "data": hex(frame.data()),
        "service": decoded.name,
        "node": decoded.node.map(NodeId::get),
        "text": decoded.text,
        "alarming": decoded.alarming,
    })
    .to_string()
}

fn node_device(text: &str) -> Result<(NodeId, String), String> {
    let (node, device) = text.split_once('=').ok_or("write ID=DEVICE, for example 5=siko/ag03-1")?;
    Ok((node_id(node)?, device.to_owned()))
}
