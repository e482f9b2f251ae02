//! `lexican scan`: finds the nodes of a bus.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;

use indicatif::ProgressBar;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{Link, Pace, Pump};
use lexican_runtime::object::Address;
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::wire::sdo::{Abort, ClientRequest, Content, ServerResponse};
use lexican_runtime::{AbortCode, Duration, Frame, NodeId, cia301};
use serde_json::json;

use crate::bus::BusArgs;
use crate::output::{self, Failure, Outcome, progress, styled};
use lexican_toolbox::bus::sdo_channel::{request_frame, responder};
use lexican_toolbox::decode::Decoder;
use lexican_toolbox::decode::duplicates::{DuplicateNodes, Evidence};
use lexican_toolbox::node::identity::{recognise, words};
use lexican_toolbox::node::stored;
use lexican_toolbox::text::duration::milliseconds;

/// Find the nodes of a bus
///
/// Reads the device type of every node-ID by SDO, and the identity of those that answer. Nothing is changed.
/// Two nodes with one node-ID are suspected if there are more responses than requests. Exit code 1 if no node
/// answers, and for such a suspicion.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    bus: BusArgs,

    /// How long to wait for answers
    #[arg(long, value_name = "TIME", default_value = "500ms", value_parser = milliseconds)]
    timeout: Duration,

    /// Print one JSON object per line
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican scan --bus can0
    lexican scan --bus slcan:/dev/ttyACM0?bitrate=500000 --json";

/// The pause between two requests, so that 127 of them leave room for other frames.
const PAUSE: Duration = Duration::from_millis(1);
/// How much later a second node with the same node-ID may respond.
const GRACE: Duration = Duration::from_millis(30);
const DEVICE_TYPE: Address = Address::new(cia301::DEVICE_TYPE, 0);

/// A node that was found.
#[derive(Debug, Default)]
pub(crate) struct Found {
    numbers: BTreeMap<Address, u32>,
    /// Second responses that differ from the first.
    others: BTreeMap<Address, u32>,
    state: Option<NmtState>,
    /// Signs of two nodes with the same node-ID.
    pub(crate) evidence: BTreeSet<Evidence>,
}

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let link = args.bus.open(Pace::Virtual)?.link;
    let (found, _) = nodes(link, args.timeout)?;
    print(args.json, &found)?;
    let suspicious = found.values().any(|found| !found.evidence.is_empty());
    Ok(if found.is_empty() || suspicious { Outcome::Found } else { Outcome::Clean })
}

/// Finds the nodes of a bus; also returns the network on the link.
pub(crate) fn nodes<L: Link>(link: L, wait: Duration) -> Result<(BTreeMap<NodeId, Found>, Network<L>), Failure> {
    Scanner::new(link, wait).scan()
}

struct Scanner<L> {
    link: L,
    pump: Pump,
    wait: Duration,
    found: BTreeMap<NodeId, Found>,
    /// How many nodes were sent the current request; then, those that have responded.
    asked: usize,
    answered: BTreeSet<NodeId>,
    /// Entries with segmented responses, to be read in full at the end.
    segmented: BTreeSet<(NodeId, Address)>,
    decoder: Decoder<'static>,
    duplicates: DuplicateNodes,
    progress: ProgressBar,
}

impl<L: Link> Scanner<L> {
    fn new(link: L, wait: Duration) -> Self {
        Scanner {
            wait: wait + link.latency(),
            link,
            pump: Pump::new(),
            found: BTreeMap::new(),
            asked: 0,
            answered: BTreeSet::new(),
            segmented: BTreeSet::new(),
            decoder: Decoder::new(),
            duplicates: DuplicateNodes::default(),
            progress: progress("{msg} {wide_bar} {pos}/{len}", NodeId::all().count() as u64),
        }
    }

    fn scan(mut self) -> Result<(BTreeMap<NodeId, Found>, Network<L>), Failure> {
        self.progress.set_message("reading device types");
        self.ask(NodeId::all(), DEVICE_TYPE)?;
        self.listen(self.wait, false)?;
        for sub in 1..=4 {
            self.progress.set_message("reading identities");
            let nodes: Vec<_> = self.found.keys().copied().collect();
            self.ask(nodes.into_iter(), Address::new(cia301::IDENTITY, sub))?;
            self.listen(self.wait, true)?;
            self.listen(GRACE, false)?;
        }
        let unknown = self.found.iter().filter(|(_, found)| found.device().is_none());
        let unknown: Vec<_> = unknown.map(|(node, _)| *node).collect();
        self.ask(unknown.into_iter(), stored::FORM)?;
        self.listen(self.wait, true)?;
        self.progress.finish_and_clear();
        let mut network = Network::new(self.link);
        // A node that sends segments without end, or repeats itself, gets no more than this time.
        network.set_patience(Some(self.wait));
        for (node, address) in self.segmented {
            if let Ok(data) = network.read_bytes(node, address) {
                self.found.entry(node).or_default().numbers.insert(address, number(&data));
            }
        }
        Ok((self.found, network))
    }

    /// Reads an entry of several nodes.
    fn ask(&mut self, nodes: impl Iterator<Item = NodeId>, address: Address) -> Result<(), Failure> {
        self.answered.clear();
        let nodes: Vec<_> = nodes.collect();
        self.asked = nodes.len();
        self.progress.set_position(0);
        self.progress.set_length(nodes.len() as u64);
        for node in nodes {
            self.progress.inc(1);
            self.send(&request_frame(node, ClientRequest::InitiateUpload { address }))?;
            self.listen(PAUSE, false)?;
        }
        Ok(())
    }

    fn send(&mut self, frame: &Frame) -> Result<(), Failure> {
        self.link.send(frame)?;
        self.suspect(frame);
        Ok(())
    }

    /// Listens for `span`, or until all asked nodes have responded.
    fn listen(&mut self, span: Duration, until_answered: bool) -> Result<(), Failure> {
        let until = self.link.now() + span;
        while !until_answered || self.answered.len() < self.asked {
            match self.pump.receive_frame(&mut self.link, until)? {
                Some(frame) => self.hear(&frame)?,
                None => break,
            }
        }
        Ok(())
    }

    fn hear(&mut self, frame: &Frame) -> Result<(), Failure> {
        self.suspect(frame);
        if let Some(node) = ErrorControl::node(frame.id()).filter(|_| !frame.is_remote()) {
            // A boot-up message is followed by PRE-OPERATIONAL.
            let state = ErrorControl::parse(frame.data()).map(|message| match message.state {
                NmtState::Initialising => NmtState::PreOperational,
                state => state,
            });
            self.found.entry(node).or_default().state = state;
        } else if let Some(node) = responder(frame) {
            self.found.entry(node).or_default();
            self.answered.insert(node);
            if let Some(ServerResponse::InitiateUpload { address, content }) = ServerResponse::parse(frame.data()) {
                self.take(node, address, content)?;
            }
        }
        Ok(())
    }

    fn take(&mut self, node: NodeId, address: Address, content: Content) -> Result<(), Failure> {
        match content {
            Content::Expedited(expedited) => {
                let number = number(expedited.data());
                let found = self.found.entry(node).or_default();
                if *found.numbers.entry(address).or_insert(number) != number {
                    found.others.insert(address, number);
                }
                Ok(())
            }
            Content::Segmented { .. } => {
                // If the node keeps sending, do not abort for each frame.
                if !self.segmented.insert((node, address)) {
                    return Ok(());
                }
                let abort = ClientRequest::Abort(Abort { address, code: AbortCode::GENERAL });
                self.send(&request_frame(node, abort))
            }
        }
    }

    /// Looks for signs of two nodes with the same node-ID.
    fn suspect(&mut self, frame: &Frame) {
        let decoded = self.decoder.decode(frame);
        if let Some((node, evidence)) = self.duplicates.observe(self.link.now(), &decoded) {
            self.found.entry(node).or_default().evidence.insert(evidence);
        }
    }
}

/// The first four bytes as a number.
fn number(data: &[u8]) -> u32 {
    data.iter().take(4).rev().fold(0, |number, byte| number << 8 | u32::from(*byte))
}

fn print(as_json: bool, found: &BTreeMap<NodeId, Found>) -> Result<(), Failure> {
    let mut stdout = output::stdout();
    for (node, found) in found {
        if as_json {
            let others: BTreeMap<_, _> =
                found.others.iter().map(|(address, number)| (address.to_string(), number)).collect();
            let line = json!({
                "node": node.get(),
                "device_type": found.numbers.get(&DEVICE_TYPE),
                "state": found.state.map(|state| state.to_string()),
                "vendor": found.identity(1),
                "product": found.identity(2),
                "revision": found.identity(3),
                "serial": found.identity(4),
                "device": found.device(),
                "data_sheet": found.numbers.contains_key(&stored::FORM),
                "two_nodes": found.evidence,
                "other_answers": others,
            });
            writeln!(stdout, "{line}")?;
        } else {
            let name = styled(anstyle::Style::new().bold(), format_args!("node {node:>3}"));
            writeln!(stdout, "{name}  {}", found.describe())?;
            if found.numbers.contains_key(&stored::FORM) {
                writeln!(stdout, "          its data sheet is in it: `lexican eds fetch {node}` reads it")?;
            }
            for evidence in &found.evidence {
                let text = format!("are there two nodes {node}? {evidence}{}", found.difference());
                writeln!(stdout, "          {}", crate::print::notice(&text))?;
            }
        }
    }
    if found.is_empty() && !as_json {
        writeln!(stdout, "no node answers; are they on this bus, with power and at this bit rate?")?;
        writeln!(stdout, "`lexican lss find` finds nodes that have no node-ID yet")?;
    }
    stdout.flush()?;
    Ok(())
}

impl Found {
    /// A number of its identity (1018h).
    pub(crate) fn identity(&self, sub: u8) -> Option<u32> {
        self.numbers.get(&Address::new(cia301::IDENTITY, sub)).copied()
    }

    fn device(&self) -> Option<&'static str> {
        Some(recognise(self.identity(1)?, self.identity(2))?.id)
    }

    fn describe(&self) -> String {
        let mut parts = Vec::new();
        parts.extend(self.device().map(str::to_owned));
        parts.extend(self.numbers.get(&DEVICE_TYPE).map(|number| match number & 0xFFFF {
            0 => "device type 0: no profile".to_owned(),
            profile => format!("CiA {profile} (device type {number:08X}h)"),
        }));
        parts.extend(words([1, 2, 3, 4].map(|sub| self.identity(sub))));
        parts.extend(self.state.map(|state| state.to_string()));
        if parts.is_empty() { "answers, but has no device type".to_owned() } else { parts.join(", ") }
    }

    /// The difference between two responses to the same request.
    fn difference(&self) -> String {
        let differ = self.others.iter().filter_map(|(address, other)| {
            Some(format!("{address} is {:X}h and {other:X}h", self.numbers.get(address)?))
        });
        let differ: Vec<_> = differ.collect();
        if differ.is_empty() { String::new() } else { format!(": {}", differ.join(", ")) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::testing::Flood;
    use crate::device::samples;
    use lexican_eds::model::{Device, Value};
    use lexican_runtime::host::{Incoming, LinkError, VirtualBus};
    use lexican_runtime::{CobId, Instant};
    use lexican_simulation::VirtualDevice;

    /// A data sheet with this serial number.
    fn sheet(serial: i128) -> Device {
        let mut device = samples::drive();
        let identity = device.objects.iter_mut().find(|object| object.index == cia301::IDENTITY).unwrap();
        let entry = identity.entries.iter_mut().find(|entry| entry.sub == 4).unwrap();
        entry.default = Some(Value::Integer(serial));
        device
    }

    /// Scans a bus with nodes of these node-IDs and serial numbers.
    fn scan(nodes: &[(u8, i128)]) -> BTreeMap<NodeId, Found> {
        let bus = VirtualBus::with_bit_rate(500);
        for &(node, serial) in nodes {
            bus.attach(VirtualDevice::power_on(bus.now(), NodeId::literal(node), &sheet(serial)));
        }
        // Wait until the boot-up messages are over.
        let mut link = bus.link();
        let until = link.now() + Duration::from_secs(1);
        while link.receive(until).unwrap().is_some() {}
        Scanner::new(link, Duration::from_millis(500)).scan().unwrap().0
    }

    #[test]
    fn the_progress_never_passes_its_end() {
        let bus = VirtualBus::with_bit_rate(500);
        bus.attach(VirtualDevice::power_on(bus.now(), NodeId::literal(5), &sheet(42)));
        let scanner = Scanner::new(bus.link(), Duration::from_millis(500));
        let progress = scanner.progress.clone();
        bus.observe(move |_, _| assert!(progress.position() <= progress.length().unwrap(), "{}", progress.position()));
        assert_eq!(scanner.scan().unwrap().0.len(), 1);
    }

    #[test]
    fn nodes_are_recognised_by_their_identity() {
        let found = scan(&[(5, 42), (127, 7)]);
        assert_eq!(found.keys().map(|node| node.get()).collect::<Vec<_>>(), [5, 127]);
        let one = &found[&NodeId::literal(5)];
        assert_eq!((one.identity(4), one.device()), (Some(42), Some("siko/ag03-1")));
        assert!(found.values().all(|found| found.evidence.is_empty() && found.others.is_empty()), "{found:?}");
    }

    #[test]
    fn two_nodes_with_one_id_are_suspected_and_their_difference_is_shown() {
        let found = scan(&[(5, 42), (5, 43), (6, 1)]);
        let duplicates = &found[&NodeId::literal(5)];
        assert!(duplicates.evidence.contains(&Evidence::SecondAnswer));
        assert_eq!(duplicates.others.get(&Address::new(cia301::IDENTITY, 4)), Some(&43));
        assert_eq!(duplicates.difference(), ": 1018:04 is 2Ah and 2Bh");
        assert!(found[&NodeId::literal(6)].evidence.is_empty());
    }

    #[test]
    fn two_nodes_with_equal_responses_are_suspected() {
        let found = scan(&[(5, 42), (5, 42)]);
        let duplicates = &found[&NodeId::literal(5)];
        assert!(duplicates.evidence.contains(&Evidence::SecondAnswer) && duplicates.others.is_empty());
    }

    /// Node 9 answers at once, begins a segmented upload that never ends, and repeats each answer.
    struct Endless {
        now: Instant,
        request: Option<Frame>,
        sent: usize,
    }

    impl Link for Endless {
        fn now(&self) -> Instant {
            self.now
        }
        fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
            self.sent += 1;
            if frame.id() == CobId::of_node(0x600, NodeId::literal(9)) {
                self.request = Some(*frame);
            }
            Ok(())
        }
        fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
            assert!(self.now < Instant::from_micros(30_000_000), "the scan does not end");
            self.now += Duration::from_millis(1);
            let Some(request) = self.request.as_ref() else {
                self.now = self.now.max(until);
                return Ok(None);
            };
            let [command, low, high, sub, ..] = *request.data().first_chunk::<8>().unwrap();
            let response = match command {
                // Announces 4 GB.
                0x40 => [0x41, low, high, sub, 0xFF, 0xFF, 0xFF, 0xFF],
                // An abort does not stop it, either.
                0x80 => [0x41, low, high, sub, 0xFF, 0xFF, 0xFF, 0xFF],
                toggle => [toggle & 0x10, 0, 0, 0, 0, 0, 0, 0],
            };
            Ok(Some(Incoming::Frame(Frame::from_array(CobId::of_node(0x580, NodeId::literal(9)), response))))
        }
    }

    #[test]
    fn a_node_that_answers_without_end_does_not_hold_up_the_end() {
        let link = Endless { now: Instant::ZERO, request: None, sent: 0 };
        let found = Scanner::new(link, Duration::from_millis(500)).scan().unwrap().0;
        assert_eq!(found.keys().copied().collect::<Vec<_>>(), [NodeId::literal(9)]);
    }

    /// A link whose node 9 answers uploads after two seconds, and sends nothing else.
    struct Far {
        now: Instant,
        answers: Vec<(Instant, Frame)>,
    }

    impl Link for Far {
        fn now(&self) -> Instant {
            self.now
        }
        fn latency(&self) -> Duration {
            Duration::from_secs(2)
        }
        fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
            if frame.id() == CobId::of_node(0x600, NodeId::literal(9)) {
                let [_, low, high, sub, ..] = *frame.data().first_chunk::<8>().unwrap();
                let answer =
                    Frame::from_array(CobId::of_node(0x580, NodeId::literal(9)), [0x43, low, high, sub, sub, 0, 0, 0]);
                self.answers.push((self.now + Duration::from_secs(2), answer));
            }
            Ok(())
        }
        fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
            let is_due = self.answers.first().is_some_and(|(at, _)| *at <= until);
            let due = is_due.then(|| self.answers.remove(0));
            self.now = self.now.max(due.map_or(until, |(at, _)| at));
            Ok(due.map(|(_, frame)| Incoming::Frame(frame)))
        }
    }

    #[test]
    fn nodes_behind_a_latency_are_waited_for() {
        let far = Far { now: Instant::ZERO, answers: Vec::new() };
        let found = Scanner::new(far, Duration::from_millis(500)).scan().unwrap().0;
        let identity = [1, 2, 3, 4].map(|sub| found[&NodeId::literal(9)].identity(sub));
        assert_eq!(identity, [1, 2, 3, 4].map(Some));
    }

    #[test]
    fn a_flood_of_frames_does_not_hold_up_the_end() {
        let found = Scanner::new(Flood::of_heartbeats(), Duration::from_millis(500)).scan().unwrap().0;
        assert_eq!(found.keys().copied().collect::<Vec<_>>(), [NodeId::literal(9)]);
    }
}
