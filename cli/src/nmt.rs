//! `lexican nmt`: NMT commands.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;

use lexican_runtime::host::{Link, Pace, Pump};
use lexican_runtime::object::Address;
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::nmt::{NmtCommand, NmtMessage, NmtState};
use lexican_runtime::wire::sdo::{ClientRequest, Content, ServerResponse};
use lexican_runtime::{Duration, Frame, Instant, NodeId, cia301};
use serde_json::json;

use crate::bus::{BusArgs, NodeIds, let_leave};
use lexican_toolbox::bus::sdo_channel::{request_frame, responder};
use lexican_toolbox::text::duration::{in_milliseconds, milliseconds};

use crate::output::{self, Failure, Outcome, print_result, warn};

/// Send an NMT command to nodes, or to all
///
/// Nodes do not confirm NMT commands; with --wait, the command waits for the new state. Exit code 1 if it is not
/// reached.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES, group = clap::ArgGroup::new("target").required(true).args(["node", "all"]))]
pub(crate) struct Args {
    #[command(flatten)]
    bus: BusArgs,

    /// The command
    #[arg(value_enum)]
    command: Command,

    /// The node-IDs: 5, 0x10, 3,5-9
    #[arg(long, value_name = "NODES")]
    node: Option<NodeIds>,

    /// All nodes
    #[arg(long)]
    all: bool,

    /// Wait up to this long until the node reports the new state, or its boot-up after a reset
    ///
    /// A node without heartbeat is asked by node guarding, and by SDO whether it has a heartbeat at all. With --all,
    /// the nodes that are heard or respond count, and the command always lasts that long.
    #[arg(long, value_name = "TIME", value_parser = milliseconds)]
    wait: Option<Duration>,

    /// Print JSON objects
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican nmt --bus can0 start --node 5 --wait 2s
    lexican nmt --bus can0 stop --node 3,5-9
    lexican nmt --bus can0 reset-node --all";

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum Command {
    /// Enter OPERATIONAL: everything works
    Start,
    /// Enter STOPPED: only NMT and heartbeat work
    Stop,
    /// Enter PRE-OPERATIONAL: everything but PDOs works
    PreOperational,
    /// Begin anew, as after power-on
    ResetNode,
    /// Begin anew with the communication objects only
    ResetCommunication,
}

impl From<Command> for NmtCommand {
    fn from(command: Command) -> NmtCommand {
        match command {
            Command::Start => NmtCommand::Start,
            Command::Stop => NmtCommand::Stop,
            Command::PreOperational => NmtCommand::EnterPreOperational,
            Command::ResetNode => NmtCommand::ResetNode,
            Command::ResetCommunication => NmtCommand::ResetCommunication,
        }
    }
}

/// How long to listen before nodes are asked for their state.
const UNHEARD: Duration = Duration::from_millis(250);

/// The pause between two requests, so that 127 of them leave room for other frames.
const PAUSE: Duration = Duration::from_millis(1);

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let mut link = args.bus.open(Pace::Virtual)?.settled()?.link;
    let (command, targets) = (args.command.into(), args.node.as_ref().map(|nodes| nodes.0.clone()));
    let messages = match &targets {
        None => vec![NmtMessage { command, node: None }],
        Some(nodes) => nodes.iter().map(|node| NmtMessage { command, node: Some(*node) }).collect(),
    };
    for message in &messages {
        link.send(&message.frame())?;
    }
    match args.wait {
        Some(wait) => {
            let mut watch = Watch::new(link, command, targets);
            watch.watch(wait)?;
            print_states(args.json, wait, &watch)
        }
        None => {
            let_leave(&mut link)?;
            messages.into_iter().try_for_each(|message| print_command(args.json, message))?;
            Ok(Outcome::Clean)
        }
    }
}

/// Follows the states of nodes after a command.
struct Watch<L> {
    link: L,
    pump: Pump,
    command: NmtCommand,
    /// The addressed nodes; `None` for all.
    targets: Option<Vec<NodeId>>,
    /// The last state of each node. After a reset, INITIALISING stands for the boot-up message and is kept.
    heard: BTreeMap<NodeId, NmtState>,
    /// The heartbeat time (1017h) in ms of silent nodes, read by SDO; `None` if they lack the object.
    heartbeats: BTreeMap<NodeId, Option<u16>>,
    /// The nodes whose heartbeat time was requested.
    asked: BTreeSet<NodeId>,
}

/// 1017h; 0 means no heartbeat.
const HEARTBEAT_TIME: Address = Address::new(cia301::PRODUCER_HEARTBEAT_TIME, 0);

impl<L: Link> Watch<L> {
    fn new(link: L, command: NmtCommand, targets: Option<Vec<NodeId>>) -> Self {
        let (heard, heartbeats, asked) = (BTreeMap::new(), BTreeMap::new(), BTreeSet::new());
        Watch { link, pump: Pump::new(), command, targets, heard, heartbeats, asked }
    }

    /// Listens until the nodes have reached their state, or for the whole span if all nodes are addressed.
    fn watch(&mut self, span: Duration) -> Result<(), Failure> {
        let end = self.link.now() + span;
        let patience = UNHEARD.min(Duration::from_micros(span.as_micros() / 2));
        let mut is_first = true;
        while self.link.now() < end && !self.is_over() {
            self.listen(end.min(self.link.now() + patience))?;
            if self.link.now() < end && !self.is_over() {
                self.ask(is_first)?;
                is_first = false;
            }
        }
        Ok(())
    }

    fn listen(&mut self, until: Instant) -> Result<(), Failure> {
        while !self.is_over()
            && let Some(frame) = self.pump.receive_frame(&mut self.link, until)?
        {
            self.hear(&frame);
        }
        Ok(())
    }

    /// Whether the nodes have reached their state.
    fn is_over(&self) -> bool {
        self.targets.as_ref().is_some_and(|nodes| nodes.iter().all(|node| self.has_reached(*node)))
    }

    fn concerns(&self, node: NodeId) -> bool {
        self.targets.as_ref().is_none_or(|nodes| nodes.contains(&node))
    }

    fn hear(&mut self, frame: &Frame) {
        let node = ErrorControl::node(frame.id()).filter(|node| !frame.is_remote() && self.concerns(*node));
        if let (Some(node), Some(message)) = (node, ErrorControl::parse(frame.data()))
            && !(self.is_reset() && self.has_reached(node))
        {
            self.heard.insert(node, message.state);
        }
        if let Some(node) = responder(frame).filter(|node| self.asked.contains(node)) {
            match ServerResponse::parse(frame.data()) {
                Some(ServerResponse::InitiateUpload { address, content: Content::Expedited(value) })
                    if address == HEARTBEAT_TIME =>
                {
                    let ms = value.data().first_chunk().map(|bytes| u16::from_le_bytes(*bytes));
                    self.heartbeats.insert(node, ms);
                }
                Some(ServerResponse::Abort(abort)) if abort.address == HEARTBEAT_TIME => {
                    self.heartbeats.insert(node, None);
                }
                _ => {}
            }
        }
    }

    /// Asks for states by node guarding (CiA 301, 7.2.8.2.2), to which heartbeat producers need not respond. Once, it
    /// also reads the heartbeat time of silent nodes by SDO, because a node may have neither. Not after a reset, which
    /// nodes report by a boot-up message.
    fn ask(&mut self, all: bool) -> Result<(), Failure> {
        if self.is_reset() {
            return Ok(());
        }
        let concerned = NodeId::all().filter(|node| self.concerns(*node) && !self.has_reached(*node));
        let asked: Vec<_> =
            concerned.filter(|node| all || self.targets.is_some() || self.heard.contains_key(node)).collect();
        for node in asked {
            self.link.send(&ErrorControl::request(node))?;
            self.listen(self.link.now() + PAUSE)?;
            if !self.heard.contains_key(&node) && self.asked.insert(node) {
                let request = request_frame(node, ClientRequest::InitiateUpload { address: HEARTBEAT_TIME });
                self.link.send(&request)?;
                self.listen(self.link.now() + PAUSE)?;
            }
        }
        Ok(())
    }

    fn is_reset(&self) -> bool {
        self.command.target() == NmtState::Initialising
    }

    fn has_reached(&self, node: NodeId) -> bool {
        self.heard.get(&node) == Some(&self.command.target())
    }
}

fn print_command(as_json: bool, message: NmtMessage) -> Result<(), Failure> {
    let target = message.node.map_or("all nodes".to_owned(), |node| format!("node {node}"));
    let what = match message.command.target() {
        NmtState::Initialising => message.command.to_string(),
        state => format!("enter {state}"),
    };
    let object = json!({ "node": message.node.map(NodeId::get), "command": message.command.to_string() });
    print_result(as_json, object, format_args!("{target}: {what}"))
}

fn print_states<L: Link>(as_json: bool, wait: Duration, watch: &Watch<L>) -> Result<Outcome, Failure> {
    let wait_ms = in_milliseconds(wait);
    let mut stdout = output::stdout();
    let heard = watch.heard.keys().chain(watch.heartbeats.keys());
    let nodes: BTreeSet<_> = heard.copied().chain(watch.targets.iter().flatten().copied()).collect();
    for &node in &nodes {
        let (state, reached) = (watch.heard.get(&node), watch.has_reached(node));
        if as_json {
            let state = state.map(ToString::to_string);
            let command = watch.command.to_string();
            let mut line = json!({ "node": node.get(), "command": command, "state": state, "reached": reached });
            if let Some(heartbeat) = watch.heartbeats.get(&node) {
                line["heartbeat_ms"] = json!(heartbeat);
            }
            writeln!(stdout, "{line}")?;
            continue;
        }
        match state {
            Some(NmtState::Initialising) if reached => writeln!(stdout, "node {node}: has booted")?,
            Some(state) if reached => writeln!(stdout, "node {node}: {state}")?,
            Some(_) if watch.is_reset() => warn(format_args!("node {node} has not booted within {wait_ms} ms")),
            Some(state) => warn(format_args!("node {node} is {state} after {wait_ms} ms")),
            None => match watch.heartbeats.get(&node) {
                None => warn(format_args!("nothing was heard of node {node} within {wait_ms} ms")),
                Some(None | Some(0)) => warn(format_args!(
                    "node {node} answers, but does not report its state: it has no heartbeat (1017h), and does not \
                     respond to guarding. Where it has 1017h, `lexican write --node {node} 1017 500` gives it a \
                     heartbeat of 500 ms"
                )),
                Some(Some(ms)) => warn(format_args!(
                    "node {node} has a heartbeat of {ms} ms (1017h), of which none came within {wait_ms} ms"
                )),
            },
        }
    }
    if nodes.is_empty() && !as_json {
        warn(format_args!("no node was heard within {wait_ms} ms"));
    }
    stdout.flush()?;
    let reached = !nodes.is_empty() && nodes.iter().all(|node| watch.has_reached(*node));
    Ok(if reached { Outcome::Clean } else { Outcome::Found })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::testing::Flood;
    use lexican_runtime::CobId;
    use lexican_runtime::cia301::connection;
    use lexican_runtime::host::{Node, VirtualBus};
    use lexican_runtime::wire::nmt::NmtCommand::{EnterPreOperational, ResetNode, Start, Stop};
    use lexican_toolbox::bus::sdo_channel::response_id;
    use std::collections::VecDeque;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// A node that changes its state with a delay.
    struct Slow {
        node: NodeId,
        state: NmtState,
        delay: Duration,
        /// Zero for none.
        heartbeat: Duration,
        /// Whether it responds to guarding when it has no heartbeat.
        knows_guarding: bool,
        next_beat: Option<Instant>,
        change: Option<(Instant, NmtState)>,
        unsent: VecDeque<Frame>,
    }

    impl Slow {
        fn new(node: u8, delay_ms: u64, heartbeat_ms: u64) -> Self {
            let heartbeat = Duration::from_millis(heartbeat_ms);
            Slow {
                node: NodeId::literal(node),
                state: NmtState::PreOperational,
                delay: Duration::from_millis(delay_ms),
                heartbeat,
                knows_guarding: true,
                next_beat: (!heartbeat.is_zero()).then_some(Instant::ZERO),
                change: None,
                unsent: VecDeque::new(),
            }
        }

        fn report(&mut self, state: NmtState) {
            self.unsent.push_back(ErrorControl::heartbeat(state).frame(self.node));
        }
    }

    impl Node for Slow {
        fn handle_frame(&mut self, now: Instant, frame: &Frame) {
            if let Some(message) = NmtMessage::parse(frame.data()).filter(|_| frame.id() == CobId::NMT)
                && message.concerns(self.node)
            {
                self.change = Some((now + self.delay, message.command.target()));
            } else if *frame == ErrorControl::request(self.node) && self.heartbeat.is_zero() && self.knows_guarding {
                self.report(self.state);
            } else if frame.id() == CobId::of_node(connection::SDO_REQUEST, self.node) {
                assert_eq!(frame.data(), [0x40, 0x17, 0x10, 0, 0, 0, 0, 0]);
                let [low, high, ..] = (self.heartbeat.as_micros() / 1000).to_le_bytes();
                let answer = [0x4B, 0x17, 0x10, 0, low, high, 0, 0];
                self.unsent.push_back(Frame::from_array(response_id(self.node), answer));
            }
        }
        fn handle_timeout(&mut self, now: Instant) {
            if let Some((_, state)) = self.change.take_if(|(at, _)| *at <= now) {
                self.state = state;
                if state == NmtState::Initialising {
                    self.report(state);
                    self.state = NmtState::PreOperational;
                }
            }
            if let Some(beat) = self.next_beat.filter(|beat| *beat <= now) {
                self.next_beat = Some(beat + self.heartbeat);
                self.report(self.state);
            }
        }
        fn poll_transmit(&mut self, _: Instant) -> Option<Frame> {
            self.unsent.pop_front()
        }
        fn poll_timeout(&self) -> Option<Instant> {
            [self.next_beat, self.change.map(|(at, _)| at)].into_iter().flatten().min()
        }
    }

    #[derive(Debug, PartialEq)]
    struct Seen {
        reached: Vec<u8>,
        others: Vec<u8>,
        /// The heartbeat times that were read by SDO.
        heartbeats: Vec<(u8, Option<u16>)>,
        after_ms: u64,
        /// The number of guarding requests.
        questions: usize,
    }

    fn wait(nodes: Vec<Slow>, command: NmtCommand, node: u8, wait_ms: u64) -> Seen {
        let bus = VirtualBus::with_bit_rate(500);
        for node in nodes {
            bus.attach(node);
        }
        let questions = Arc::new(AtomicUsize::new(0));
        let count = Arc::clone(&questions);
        bus.observe(move |_, frame| {
            count.fetch_add(usize::from(frame.is_remote()), Ordering::Relaxed);
        });
        let mut link = bus.link();
        let message = NmtMessage { command, node: NodeId::new(node) };
        link.send(&message.frame()).unwrap();
        let mut watch = Watch::new(link, command, message.node.map(|node| vec![node]));
        watch.watch(Duration::from_millis(wait_ms)).unwrap();
        let nodes = watch.heard.keys();
        let (reached, others) = nodes.partition::<Vec<_>, _>(|node| watch.has_reached(**node));
        let numbers = |nodes: Vec<&NodeId>| nodes.into_iter().map(|node| node.get()).collect();
        Seen {
            reached: numbers(reached),
            others: numbers(others),
            heartbeats: watch.heartbeats.iter().map(|(node, heartbeat)| (node.get(), *heartbeat)).collect(),
            after_ms: bus.now().as_micros() / 1000,
            questions: questions.load(Ordering::Relaxed),
        }
    }

    #[track_caller]
    fn check(seen: &Seen, reached: &[u8], others: &[u8], after_ms: std::ops::RangeInclusive<u64>) {
        assert_eq!((seen.reached.as_slice(), seen.others.as_slice()), (reached, others));
        assert!(after_ms.contains(&seen.after_ms), "{seen:?}");
    }

    #[test]
    fn a_heartbeat_reports_the_state() {
        let seen = wait(vec![Slow::new(5, 730, 100), Slow::new(6, 0, 100)], Start, 5, 5000);
        check(&seen, &[5], &[], 730..=830);
    }

    #[test]
    fn a_node_without_heartbeat_is_asked() {
        for command in [Start, Stop] {
            let seen = wait(vec![Slow::new(5, 730, 0)], command, 5, 5000);
            check(&seen, &[5], &[], 730..=1010);
            assert_eq!(seen.questions, 3);
        }
        // With little time, nodes are asked early.
        check(&wait(vec![Slow::new(5, 0, 0)], Start, 5, 100), &[5], &[], 50..=51);
    }

    #[test]
    fn a_node_that_does_not_report_its_state_is_asked_whether_it_has_a_heartbeat() {
        let mute = |node| Slow { knows_guarding: false, ..Slow::new(node, 0, 0) };
        for all in [0, 5] {
            let seen = wait(vec![mute(5)], Start, all, 2000);
            check(&seen, &[], &[], 2000..=2000);
            assert_eq!(seen.heartbeats, [(5, Some(0))]);
        }
        // The next heartbeat is due in a minute.
        let rare = Slow { next_beat: Some(Instant::from_micros(60_000_000)), ..Slow::new(5, 0, 60_000) };
        assert_eq!(wait(vec![rare], Start, 5, 2000).heartbeats, [(5, Some(60_000))]);
        // After a reset, a node reports by itself.
        assert_eq!(wait(vec![mute(5)], ResetNode, 5, 2000).heartbeats, []);
    }

    #[test]
    fn a_reset_is_over_with_the_boot_up_message() {
        let seen = wait(vec![Slow::new(5, 730, 100)], ResetNode, 5, 5000);
        check(&seen, &[5], &[], 730..=731);
        assert_eq!(seen.questions, 0);
        check(&wait(vec![Slow::new(5, 7300, 100)], ResetNode, 5, 5000), &[], &[5], 5000..=5000);
    }

    #[test]
    fn a_node_that_is_late_or_silent_has_not_reached_its_state() {
        check(&wait(vec![Slow::new(5, 6000, 100)], Start, 5, 5000), &[], &[5], 5000..=5000);
        let silent = wait(vec![Slow::new(6, 0, 100)], Start, 5, 5000);
        check(&silent, &[], &[], 5000..=5000);
        assert_eq!(silent.questions, 19, "it may be slow");
    }

    #[test]
    fn of_all_nodes_those_that_are_heard_count() {
        let nodes = || vec![Slow::new(5, 0, 0), Slow::new(6, 1500, 1000), Slow::new(7, 9000, 0)];
        let seen = wait(nodes(), Start, 0, 5000);
        check(&seen, &[5, 6], &[7], 5000..=5000);
        assert!(seen.questions < 127 + 30, "a node that was never heard is asked once: {seen:?}");
        check(&wait(nodes(), EnterPreOperational, 0, 5000), &[5, 6, 7], &[], 5000..=5000);
        check(&wait(nodes(), ResetNode, 0, 20_000), &[5, 6, 7], &[], 20_000..=20_000);
    }

    #[test]
    fn a_flood_of_frames_holds_up_neither_questions_nor_the_end() {
        for node in [NodeId::new(5), None] {
            let mut watch = Watch::new(Flood::of_heartbeats(), Stop, node.map(|node| vec![node]));
            watch.watch(Duration::from_secs(2)).unwrap();
            assert!(watch.link.now() < Instant::from_micros(3_000_000), "{}", watch.link.now());
            assert!(watch.link.sent > 1, "{} questions", watch.link.sent);
        }
    }
}
