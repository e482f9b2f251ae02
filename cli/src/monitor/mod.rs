//! `lexican monitor`: what is going on on a bus, in words.

mod identify;

use std::collections::BTreeMap;
use std::io::Write;

use lexican_runtime::host::{Link, LinkError, Listener, Pace, Pump, Turn};
use lexican_runtime::{Duration, Frame, Instant, NodeId};
use serde_json::{Value as Json, json};

use crate::bus::failure::link_failure;
use crate::bus::{Bus, BusArgs, NO_DEVICE, node_id};
use crate::decode::twins::Twins;
use crate::decode::{Decoded, Decoder};
use crate::device::Loaded;
use crate::duration;
use crate::output::{Failure, Outcome, note};
use crate::print;
use crate::values::hex;
use identify::{Asker, Overheard};

/// Print every frame of a bus, in words by name and unit
///
/// Runs until it is interrupted, or until a log ends. Nothing is sent, unless --identify asks for it. A node whose
/// identity (1018h) is read by anybody while the command listens is recognised when lexican knows the device.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES, after_long_help = JSON_HELP)]
pub(crate) struct Args {
    #[command(flatten)]
    bus: BusArgs,

    /// What a node is: 5=siko/ag03-1, 7=drive.eds, 9=none; may be given several times
    #[arg(long, value_name = "ID=DEVICE", value_parser = node_device)]
    device: Vec<(NodeId, String)>,

    /// Ask nodes that are heard for their identity, to know what they are
    ///
    /// Two SDO reads per node, when its SDO channel has been quiet for a while. Without this, the command only
    /// listens.
    #[arg(long)]
    identify: bool,

    /// Stop after so many frames
    #[arg(long, value_name = "N")]
    count: Option<u64>,

    /// Stop after so many seconds
    #[arg(long = "for", value_name = "SECONDS", value_parser = duration::seconds)]
    span: Option<Duration>,

    /// Print one JSON object per line
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican monitor --bus can0 --device 5=siko/ag03-1 --device 7=FILE.eds
    lexican monitor --bus log:bus.log --json | jq 'select(.sdo.abort)'";

const JSON_HELP: &str = "\
JSON: one object per line. A frame has time (seconds), id, remote, data, service, node, text, alarming, and what it \
says under the name of its protocol: nmt, sync, time_of_day, emcy, error_control, pdo, sdo or lss. Whatever has an \
entry of the object dictionary has address, index, sub, and with the device known name, type, value, text, unit and \
scaled. Identifiers and codes are strings of hexadecimal digits, values are numbers. What is not a frame has event: \
bus, gap, two-nodes or identified. cli/README.md lists every field.

    lexican monitor --bus can0 --json | jq 'select(.sdo.abort)'
    lexican monitor --bus can0 --json --device 5=siko/ag03-1 | jq -c '.pdo.fields[]? | {name, text}'";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    if args.identify && args.bus.is_log() {
        return Err(Failure::new("a log takes no frames: nobody there can be asked")
            .help("name the devices with --device ID=DEVICE"));
    }
    let named = args.device.iter().filter(|(_, name)| name != NO_DEVICE);
    let named = named.map(|(node, name)| Ok((*node, Loaded::named(name)?)));
    let mut devices = named.collect::<Result<Vec<_>, Failure>>()?;
    // Whoever watches a simulation wants to see it happen, unless it is over by itself.
    let pace = if args.span.is_some() { Pace::Virtual } else { Pace::RealTime };
    let Bus { mut link, simulated } = args.bus.open(pace)?;
    devices.extend(simulated);
    let mut watch = Watch::new(args, anstream::stdout().lock());
    for (node, loaded) in devices.iter().rev() {
        watch.decoder.introduce(*node, &loaded.device);
        watch.overheard.settle(*node);
    }
    for (node, _) in &args.device {
        watch.overheard.settle(*node);
    }
    watch.listen(&mut *link, args)?;
    Ok(Outcome::Clean)
}

/// Watches a bus, and writes what happens there.
struct Watch<'a, W> {
    decoder: Decoder<'a>,
    twins: Twins,
    overheard: Overheard,
    asker: Option<Asker>,
    /// Whether nothing was heard yet.
    is_silent: bool,
    json: bool,
    out: W,
}

impl<W: Write> Watch<'_, W> {
    fn new(args: &Args, out: W) -> Self {
        Watch {
            decoder: Decoder::new(),
            twins: Twins::default(),
            overheard: Overheard::default(),
            asker: args.identify.then(Asker::default),
            is_silent: true,
            json: args.json,
            out,
        }
    }

    fn listen(&mut self, link: &mut dyn Link, args: &Args) -> Result<(), Failure> {
        let (mut pump, end) = (Pump::new(), args.span.map(|span| link.now() + span));
        let mut left = args.count.unwrap_or(u64::MAX);
        while left > 0 {
            let now = link.now();
            let question = self.asker.as_mut().and_then(|asker| asker.poll_transmit(now));
            if let Some(question) = question {
                // Without an answer the node stays unknown; the bus's trouble is told when it is received.
                if link.send(&question).is_ok() {
                    self.frame(now, &question)?;
                }
            }
            // Whatever waits longer is not waiting but sleeping: an hour is as good as for ever.
            let hour = now + Duration::from_secs(3600);
            let question = self.asker.as_ref().and_then(Asker::poll_timeout);
            let until = [end, question].into_iter().flatten().fold(hour, Instant::min);
            match pump.turn(link, &mut Listener, until) {
                Ok(Turn::Event(frame)) => {
                    self.frame(link.now(), &frame)?;
                    left -= 1;
                }
                Ok(Turn::Bus(state)) => {
                    let fields = json!({ "event": "bus", "state": state.to_string() });
                    self.event(link.now(), fields, &format!("the bus is {state}"))?;
                }
                Ok(Turn::Gap(frames)) => {
                    let fields = json!({ "event": "gap", "frames": frames });
                    let text = format!("{frames} frames are missing here: they came faster than they were taken");
                    self.event(link.now(), fields, &text)?;
                }
                Ok(Turn::Over) if end.is_some_and(|end| link.now() >= end) => break,
                Ok(Turn::Over | Turn::Idle) => {}
                Err(LinkError::Ended) => break,
                Err(error) => return Err(link_failure(&error)),
            }
        }
        self.out.flush()?;
        if self.is_silent && !args.bus.is_log() {
            note("no frame was heard: are others on this bus, with power and at this bit rate?");
        }
        Ok(())
    }

    /// Tells a frame, and what follows from it.
    fn frame(&mut self, at: Instant, frame: &Frame) -> Result<(), Failure> {
        self.is_silent = false;
        let decoded = self.decoder.decode(frame);
        let line = if self.json { to_json(at, frame, &decoded) } else { print::line(at, frame, &decoded) };
        writeln!(self.out, "{line}")?;
        if let Some((node, evidence)) = self.twins.notice(at, &decoded) {
            let fields = json!({ "event": "two-nodes", "node": node.get(), "evidence": evidence.name() });
            self.event(at, fields, &format!("are there two nodes {node}? {evidence}"))?;
        }
        if let Some(asker) = &mut self.asker {
            asker.notice(at, &decoded, &self.overheard);
        }
        if let Some((node, shipped)) = self.overheard.notice(&decoded) {
            self.decoder.introduce(node, &shipped.device);
            let fields = json!({ "event": "identified", "node": node.get(), "device": shipped.id });
            self.event(at, fields, &format!("node {node} is a {} by its identity (1018h)", shipped.id))?;
        }
        Ok(())
    }

    /// Tells something that is not a frame.
    fn event(&mut self, at: Instant, mut fields: Json, text: &str) -> Result<(), Failure> {
        if self.json {
            fields["time"] = seconds(at);
            fields["text"] = json!(text);
            writeln!(self.out, "{fields}")?;
        } else {
            writeln!(self.out, "{:>12}  {}", at.to_string(), print::notice(text))?;
        }
        Ok(())
    }
}

fn to_json(at: Instant, frame: &Frame, decoded: &Decoded) -> String {
    let mut fields = BTreeMap::from([
        ("time", seconds(at)),
        ("id", json!(frame.id().to_string())),
        ("remote", json!(frame.is_remote())),
        ("data", json!(hex(frame.data()))),
        ("service", json!(decoded.name)),
        ("node", json!(decoded.node.map(NodeId::get))),
        ("text", json!(decoded.text)),
        ("alarming", json!(decoded.alarming)),
    ]);
    fields.extend(decoded.detail.json());
    json!(fields).to_string()
}

/// In seconds, to the microsecond.
fn seconds(at: Instant) -> Json {
    json!(at.since(Instant::ZERO).as_secs_f64())
}

fn node_device(text: &str) -> Result<(NodeId, String), String> {
    let (node, device) = text.split_once('=').ok_or("write ID=DEVICE, for example 5=siko/ag03-1")?;
    Ok((node_id(node)?, device.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::flood::Flood;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: Args,
    }

    #[test]
    fn a_flood_of_frames_does_not_hold_up_the_end() {
        let Line { args } = Line::parse_from(["monitor", "--bus", "can0", "--for", "1"]);
        let mut flood = Flood::of_heartbeats();
        Watch::new(&args, std::io::sink()).listen(&mut flood, &args).unwrap();
        assert!(flood.now() < Instant::from_micros(2_000_000), "{}", flood.now());
    }
}
