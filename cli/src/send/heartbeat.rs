//! `lexican heartbeat`.

use lexican_runtime::host::StateMachine;
use lexican_runtime::service::heartbeat_consumer::{Event, HeartbeatConsumer};
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{Duration, Frame, Instant, NodeId};
use serde_json::json;

use super::schedule::Schedule;
use super::session::Session;
use super::ticker::Ticker;
use crate::bus::{NodeIds, node_id};
use crate::output::{Failure, Outcome, plural, warn};
use lexican_toolbox::text::duration::period;

/// Send the heartbeat of a manager, and watch those of other nodes
///
/// Devices that consume the heartbeat of a manager (1016h) react when it ends, which it does with this command: drives stop. No other
/// node may have the node-ID; one that is heard with it is reported. Exit code 1 if a node that is watched was lost or not heard.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    schedule: Schedule,

    /// The node-ID of the manager
    #[arg(long, value_name = "NODE", value_parser = node_id, default_value = "127")]
    manager: NodeId,

    /// Watch the heartbeats of these nodes: 5, 3,5-9
    #[arg(long, value_name = "NODES")]
    watch: Option<NodeIds>,

    /// How long a watched node may be silent before it is lost
    #[arg(long, value_name = "TIME", value_parser = period, default_value = "1500ms")]
    within: Duration,
}

const EXAMPLES: &str = "\
Examples:
    lexican heartbeat --bus can0 --manager 127 --every 500ms
    lexican heartbeat --bus can0 --every 500ms --watch 5-8 --within 300ms --for 1min";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let mut session = Session::of(&args.schedule)?;
    let began = session.began;
    let heartbeat = ErrorControl::heartbeat(NmtState::Operational).frame(args.manager);
    let ticker = Ticker::new(began, args.schedule.every, args.schedule.count, |_, _| vec![heartbeat]);
    let nodes = args.watch.iter().flat_map(|nodes| &nodes.0);
    let watched = nodes.map(|node| Watched::new(*node, args.within)).collect();
    let mut manager = Manager { node: args.manager, ticker, watched };
    let end = args.schedule.span.map(|span| began + span);
    let mut twins = 0_u64;
    session.run(
        &mut manager,
        |manager, now| {
            let over = manager.ticker.is_over().then_some(now);
            (over.into_iter().chain(end).min(), plural(manager.ticker.sent as usize, "heartbeat"))
        },
        |session, _, said| match said {
            Said::Twin => {
                twins += 1;
                if twins == 1 {
                    warn(format_args!("another node {} is on the bus: is its node-ID taken?", args.manager));
                }
                Ok(())
            }
            Said::Node(node, event) => {
                let (word, state) = match event {
                    Event::BootedUp => ("booted", None),
                    Event::Started(state) => ("heard", Some(state)),
                    Event::StateChanged(state) => ("state", Some(state)),
                    Event::Lost => ("lost", None),
                };
                let text = match (word, state) {
                    ("lost", _) => format!("node {node} is lost: no heartbeat for {} s", args.within.as_secs_f64()),
                    (_, Some(state)) => format!("node {node}: {state}"),
                    _ => format!("node {node} has booted"),
                };
                let state = state.map(|state| state.to_string());
                session.print(word, json!({ "node": node.get(), "state": state }), &text)
            }
        },
    )?;
    let silent = manager.watched.iter().filter(|node| !node.heard);
    let silent: Vec<_> = silent.map(|node| node.consumer.node().get()).collect();
    for node in &silent {
        warn(format_args!("no heartbeat of node {node} was heard: is it set up to send one (1017h)?"));
    }
    let lost: u64 = manager.watched.iter().map(|node| node.lost).sum();
    let text = format!(
        "{} sent in {:.3} s, at most {:.3} ms late; {} lost",
        plural(manager.ticker.sent as usize, "heartbeat"),
        session.elapsed(),
        manager.ticker.latest.as_secs_f64() * 1000.0,
        plural(lost as usize, "time"),
    );
    let fields = json!({ "sent": manager.ticker.sent, "lost": lost, "silent": silent, "same_node_id": twins });
    session.print("summary", fields, &text)?;
    let is_well = lost == 0 && silent.is_empty() && twins == 0;
    Ok(if is_well { session.outcome() } else { Outcome::Found })
}

/// Sends heartbeats, and watches those of other nodes.
struct Manager<F> {
    node: NodeId,
    ticker: Ticker<F>,
    watched: Vec<Watched>,
}

/// A node whose heartbeat is watched. A node that is silent from the beginning counts as not heard, not as lost.
struct Watched {
    consumer: HeartbeatConsumer,
    heard: bool,
    lost: u64,
}

impl Watched {
    fn new(node: NodeId, within: Duration) -> Self {
        Watched { consumer: HeartbeatConsumer::new(node, within), heard: false, lost: 0 }
    }
}

/// The events of a manager.
enum Said {
    /// Another node uses the manager's node-ID.
    Twin,
    Node(NodeId, Event),
}

impl<F: FnMut(u64, Duration) -> Vec<Frame>> StateMachine for Manager<F> {
    type Event = Said;

    fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<Said> {
        if frame.id() == ErrorControl::cob_id(self.node) && !frame.is_remote() {
            return Some(Said::Twin);
        }
        self.watched.iter_mut().find_map(|node| {
            let event = node.consumer.handle_frame(now, frame)?;
            node.heard |= event != Event::BootedUp;
            Some(Said::Node(node.consumer.node(), event))
        })
    }

    fn handle_timeout(&mut self, now: Instant) -> Option<Said> {
        let lost = self.watched.iter_mut().find_map(|node| {
            let event = node.consumer.handle_timeout(now)?;
            node.lost += 1;
            Some(Said::Node(node.consumer.node(), event))
        });
        if lost.is_none() {
            self.ticker.handle_timeout(now);
        }
        lost
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        self.ticker.poll_transmit(now)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let watched = self.watched.iter().filter_map(|node| node.consumer.poll_timeout());
        watched.chain(self.ticker.poll_timeout()).min()
    }
}
