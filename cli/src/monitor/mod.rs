//! `lexican monitor`: the frames of a bus, decoded.

mod filter;
mod reader;

use std::io::{BufWriter, Write};

use anstream::adapter::strip_str;
use lexican_eds::model::Device;
use lexican_runtime::host::{Link, LinkError, Listener, Pace, Pump, Turn};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};
use lexican_toolbox::bus::changes::Changes;
use lexican_toolbox::bus::filter::Filter;
use lexican_toolbox::bus::transfers::{End, Transfer, Transfers};
use serde::{Serialize, Serializer};
use serde_json::{Value as Json, json};

use crate::bus::{Bus, BusArgs, KnownArgs};
use crate::output::{Failure, Outcome, colours, missing_frames, note};
use crate::print;
use filter::FilterArgs;
use lexican_toolbox::decode::duplicates::DuplicateNodes;
use lexican_toolbox::decode::{Decoded, Decoder, Detail, Step};
use lexican_toolbox::text::duration;
use lexican_toolbox::values::hex;
use reader::{IdentityListener, Reader};

/// Print every frame of a bus, decoded by name and unit
///
/// Runs until it is interrupted, or until a log ends. Nothing is sent, unless --identify is given. A node is
/// recognised when any client reads its identity (1018h) while the command listens, if lexican knows the device.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    bus: BusArgs,

    #[command(flatten)]
    known: KnownArgs,

    /// Read the identity of each node that is heard, to recognise its device
    ///
    /// Two SDO uploads per node, after its SDO channel has been quiet for a while. Without this, nothing is sent.
    #[arg(long)]
    identify: bool,

    /// Read how the PDOs of each known node are configured, to decode them by their present mapping
    ///
    /// By SDO, one entry at a time, after the node's SDO channel has been quiet for a while. Without this, a mapping is known if
    /// the command has heard it, and is that of the data sheet otherwise.
    #[arg(long)]
    read_mapping: bool,

    /// Print each SDO transfer as one line when it ends, with the time that it took
    #[arg(long)]
    transfers: bool,

    /// Print only what differs: values of PDOs, heartbeats, answers that are not as they were before
    #[arg(long)]
    changes: bool,

    #[command(flatten)]
    filter: FilterArgs,

    /// Stop after so many printed frames
    #[arg(long, value_name = "N")]
    count: Option<u64>,

    /// Stop after this time
    #[arg(long = "for", value_name = "TIME", value_parser = duration::time)]
    span: Option<Duration>,

    /// Print one JSON object per line
    ///
    /// A frame has time (seconds), id, remote, data, service, node, text, alarming, and its content under the name of
    /// its protocol: nmt, sync, time_of_day, emcy, error_control, pdo, sdo or lss. Entries of the object dictionary
    /// have address, index, sub, and if the device is known name, type, value, text, unit and scaled. Identifiers and
    /// codes are strings of hexadecimal digits, values are numbers. Lines that are no frames have event: bus, gap,
    /// two-nodes or identified. cli/README.md lists every field.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican monitor --bus can0 --device 5=siko/ag03-1 --device 7=FILE.eds
    lexican monitor --bus can0 --without sync,heartbeat --transfers
    lexican monitor --bus can0 --device 5=siko/ag03-1 --object Statusword --changes
    lexican monitor --bus log:bus.log --json | jq 'select(.sdo.abort)'
    lexican monitor --bus can0 --json --device 5=siko/ag03-1 | jq -c '.pdo.fields[]? | {name, text}'";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    if (args.identify || args.read_mapping) && args.bus.is_log() {
        return Err(Failure::new("a log takes no frames: its nodes cannot be asked")
            .help("name the devices with --device NODE=DEVICE; the mapping is known if the log has it"));
    }
    // An endless simulation runs in real time, so that users can watch it.
    let pace = if args.span.is_some() { Pace::Virtual } else { Pace::RealTime };
    let Bus { mut link, nodes, .. } = args.bus.open(pace)?;
    let known = args.known.load(nodes)?;
    let mut monitor = Monitor::new(args, std::io::stdout().lock());
    for (node, sheet) in &known {
        monitor.introduce(*node, &sheet.device);
    }
    for node in known.keys().copied().chain(args.known.named()) {
        monitor.identities.settle(node);
    }
    monitor.listen(&mut *link, args)?;
    Ok(Outcome::Clean)
}

/// Receives the frames of a bus, and prints frames and events.
struct Monitor<'a, W: Write> {
    decoder: Decoder<'a>,
    duplicates: DuplicateNodes,
    identities: IdentityListener,
    reader: Reader,
    reads_identities: bool,
    reads_mappings: bool,
    filter: Filter,
    transfers: Option<Transfers>,
    changes: Option<Changes>,
    is_silent: bool,
    json: bool,
    styled: bool,
    /// Flushed whenever the link is empty. Flushing each line would lose frames on a busy bus.
    out: BufWriter<W>,
}

impl<'a, W: Write> Monitor<'a, W> {
    fn new(args: &Args, out: W) -> Self {
        Monitor {
            decoder: Decoder::new(),
            duplicates: DuplicateNodes::default(),
            identities: IdentityListener::default(),
            reader: Reader::default(),
            reads_identities: args.identify,
            reads_mappings: args.read_mapping,
            filter: args.filter.filter(),
            transfers: args.transfers.then(Transfers::default),
            changes: args.changes.then(Changes::default),
            is_silent: true,
            json: args.json,
            styled: colours(),
            out: BufWriter::with_capacity(BUFFER, out),
        }
    }

    fn introduce(&mut self, node: NodeId, device: &'a Device) {
        self.decoder.introduce(node, device);
        if self.reads_mappings {
            self.reader.read_mapping(node, device);
        }
    }

    fn listen(&mut self, link: &mut dyn Link, args: &Args) -> Result<(), Failure> {
        let (mut pump, end) = (Pump::new(), args.span.map(|span| link.now() + span));
        let mut left = args.count.unwrap_or(u64::MAX);
        while left > 0 {
            let now = link.now();
            self.forget(now)?;
            let request = self.reader.poll_transmit(now);
            // If a request cannot be sent, the node stays unknown; `turn` reports trouble of the bus.
            if let Some(request) = request.filter(|request| link.send(request).is_ok()) {
                self.frame(now, &request)?;
            }
            // Some links cannot wait without a limit; an hour is as good.
            let hour = now + Duration::from_secs(3600);
            let request = self.reader.poll_timeout();
            let until = [end, request].into_iter().flatten().fold(hour, Instant::min);
            // Waiting for a log or a simulation takes no time, so that its output need not be flushed.
            let may_wait = self.out.buffer().is_empty() || !link.is_real_time();
            match pump.turn(link, &mut Listener, if may_wait { until } else { now }) {
                Ok(Turn::Event(frame)) => left -= u64::from(self.frame(link.now(), &frame)?),
                Ok(Turn::Bus(state)) => {
                    let fields = json!({ "event": "bus", "state": state.to_string() });
                    self.event(link.now(), fields, &format!("the bus is {state}"))?;
                }
                Ok(Turn::Gap(frames)) => {
                    let fields = json!({ "event": "gap", "frames": frames });
                    self.event(link.now(), fields, &missing_frames(frames))?;
                }
                Ok(Turn::Over) if end.is_some_and(|end| link.now() >= end) => break,
                // The link is empty. `Over` may also mean that it is never empty.
                Ok(Turn::Idle) if link.is_real_time() => self.out.flush()?,
                Ok(Turn::Idle | Turn::Over) => {}
                Err(LinkError::Ended) => break,
                Err(error) => return Err(error.into()),
            }
        }
        self.forget(link.now() + Duration::from_secs(3600))?;
        self.out.flush()?;
        if self.is_silent && !args.bus.is_log() {
            note("no frame was heard: are others on this bus, with power and at this bit rate?");
        }
        Ok(())
    }

    /// Prints a frame if it passes the filter, and the events that follow from it; returns whether it was printed.
    fn frame(&mut self, at: Instant, frame: &Frame) -> Result<bool, Failure> {
        self.is_silent = false;
        let decoded = self.decoder.decode(frame);
        let evidence = self.duplicates.observe(at, &decoded);
        self.reader.observe(at, &decoded);
        if let Some(node) = decoded.node.filter(|_| self.reads_identities && decoded.is_from_node())
            && !self.identities.is_settled(node)
        {
            self.reader.read_identity(node);
        }
        let identity = self.identities.observe(&decoded);
        let is_printed = self.print(at, frame, decoded)?;
        if let Some((node, evidence)) = evidence {
            let fields = json!({ "event": "two-nodes", "node": node.get(), "evidence": evidence });
            self.event(at, fields, &format!("are there two nodes {node}? {evidence}"))?;
        }
        if let Some((node, shipped)) = identity {
            self.introduce(node, &shipped.device);
            let fields = json!({ "event": "identified", "node": node.get(), "device": shipped.id });
            self.event(at, fields, &format!("node {node} is a {} by its identity (1018h)", shipped.id))?;
        }
        Ok(is_printed)
    }

    /// Prints a frame, or the SDO transfer that it ends, if that passes the filter.
    fn print(&mut self, at: Instant, frame: &Frame, decoded: Decoded) -> Result<bool, Failure> {
        if let (Some(transfers), Detail::Sdo(sdo)) = (&mut self.transfers, &decoded.detail)
            && sdo.step != Step::Unknown
        {
            let Some(transfer) = transfers.observe(at, &decoded) else { return Ok(false) };
            return self.transfer(&transfer);
        }
        if !self.filter.matches(frame, &decoded) {
            return Ok(false);
        }
        let decoded = match &mut self.changes {
            Some(changes) => changes.observe(frame, decoded),
            None => Some(decoded),
        };
        let Some(decoded) = decoded else { return Ok(false) };
        if self.json {
            let detail = Some(&decoded.detail).filter(|detail| **detail != Detail::None);
            let (id, data, remote) = (frame.id(), hex(frame.data()), frame.is_remote());
            let Decoded { alarming, name: service, text, .. } = &decoded;
            let (node, time) = (decoded.node.map(NodeId::get), seconds(at));
            let more = FrameFields { data, id, remote, detail };
            self.object(&Line { alarming: *alarming, node, service, text, time, more })?;
        } else {
            self.line(&print::line(at, frame, &decoded))?;
        }
        Ok(true)
    }

    /// Prints an SDO transfer if it passes the filter.
    fn transfer(&mut self, transfer: &Transfer) -> Result<bool, Failure> {
        let is_new = self.changes.as_mut().is_none_or(|changes| changes.observe_transfer(transfer));
        if !is_new || !self.filter.matches_transfer(transfer) {
            return Ok(false);
        }
        if self.json {
            let (alarming, node, text) = (transfer.end != End::Done, Some(transfer.node.get()), transfer.to_string());
            let (time, more) = (seconds(transfer.began), TransferField { transfer });
            self.object(&Line { alarming, node, service: "SDO transfer", text: &text, time, more })?;
        } else {
            self.line(&print::transfer(transfer))?;
        }
        Ok(true)
    }

    /// Prints transfers that have been silent for too long.
    fn forget(&mut self, now: Instant) -> Result<(), Failure> {
        while let Some(transfer) = self.transfers.as_mut().and_then(|transfers| transfers.forget(now)) {
            self.transfer(&transfer)?;
        }
        Ok(())
    }

    fn event(&mut self, at: Instant, mut fields: Json, text: &str) -> Result<(), Failure> {
        if !self.json {
            return self.line(&format!("{:>12}  {}", at.to_string(), print::notice(text)));
        }
        fields["time"] = json!(seconds(at));
        fields["text"] = json!(text);
        self.line(&fields.to_string())
    }

    /// Writes a JSON line directly into the buffer.
    fn object(&mut self, object: &impl Serialize) -> Result<(), Failure> {
        serde_json::to_writer(&mut self.out, object).map_err(std::io::Error::from)?;
        Ok(self.out.write_all(b"\n")?)
    }

    fn line(&mut self, text: &str) -> Result<(), Failure> {
        if self.styled {
            writeln!(self.out, "{text}")?;
        } else {
            writeln!(self.out, "{}", strip_str(text))?;
        }
        Ok(())
    }
}

/// The most bytes of output that wait; if the command is killed, they are lost.
const BUFFER: usize = 16 * 1024;

/// A frame or a transfer in JSON; `more` are the fields that only one of them has.
#[derive(Serialize)]
struct Line<'a, M> {
    alarming: bool,
    node: Option<u8>,
    service: &'a str,
    text: &'a str,
    time: f64,
    #[serde(flatten)]
    more: M,
}

#[derive(Serialize)]
struct FrameFields<'a> {
    data: String,
    #[serde(serialize_with = "cob_id")]
    id: CobId,
    remote: bool,
    #[serde(flatten)]
    detail: Option<&'a Detail>,
}

#[derive(Serialize)]
struct TransferField<'a> {
    transfer: &'a Transfer,
}

fn cob_id<S: Serializer>(id: &CobId, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(id)
}

fn seconds(at: Instant) -> f64 {
    at.since(Instant::ZERO).as_secs_f64()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::testing::Flood;
    use clap::Parser;
    use lexican_runtime::host::Incoming;
    use std::sync::{Arc, Mutex};

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: Args,
    }

    fn args(more: &[&str]) -> Args {
        Line::parse_from([&["monitor", "--bus", "can0"], more].concat()).args
    }

    #[test]
    fn a_flood_of_frames_does_not_hold_up_the_end() {
        let mut flood = Flood::of_heartbeats();
        let args = args(&["--for", "1s"]);
        Monitor::new(&args, std::io::sink()).listen(&mut flood, &args).unwrap();
        assert!(flood.now() < Instant::from_micros(2_000_000), "{}", flood.now());
    }

    /// A buffer as stdout, with the number of writes to it.
    #[derive(Clone, Default)]
    struct Output(Arc<Mutex<(Vec<u8>, usize)>>);

    impl Output {
        fn lines(&self) -> usize {
            self.0.lock().unwrap().0.iter().filter(|byte| **byte == b'\n').count()
        }
    }

    impl Write for Output {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            let mut output = self.0.lock().unwrap();
            output.0.extend(bytes);
            output.1 += 1;
            Ok(bytes.len())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    /// A link with this many frames at once and then silence, before which everything must be flushed. If it is not in
    /// real time, each frame comes only while it is waited for.
    struct Burst {
        flood: Flood,
        is_real_time: bool,
        frames: usize,
        left: usize,
        output: Output,
    }

    impl Link for Burst {
        fn now(&self) -> Instant {
            self.flood.now()
        }
        fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
            self.flood.send(frame)
        }
        fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
            let is_waited_for = until > self.now();
            if self.left > 0 && (is_waited_for || self.is_real_time) {
                self.left -= 1;
                return self.flood.receive(until);
            }
            if !is_waited_for {
                return Ok(None);
            }
            if self.is_real_time {
                assert_eq!(self.output.lines(), self.frames, "before the link is waited for");
            }
            Err(LinkError::Ended)
        }
        fn is_real_time(&self) -> bool {
            self.is_real_time
        }
    }

    #[test]
    fn output_is_written_at_once_when_the_link_is_empty_and_not_before() {
        for more in [&[][..], &["--json"]] {
            for (frames, is_real_time) in [(1, true), (5000, true), (5000, false)] {
                let (output, args) = (Output::default(), args(more));
                let flood = Flood::of_heartbeats();
                let mut burst = Burst { flood, is_real_time, frames, left: frames, output: output.clone() };
                Monitor::new(&args, output.clone()).listen(&mut burst, &args).unwrap();
                assert_eq!(output.lines(), frames);
                let (text, writes) = &*output.0.lock().unwrap();
                assert!(*writes <= 1 + text.len() / (BUFFER / 2), "{writes} writes of {} bytes", text.len());
            }
        }
    }
}
