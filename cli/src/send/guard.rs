//! `lexican guard`.

use lexican_runtime::host::{Pace, StateMachine};
use lexican_runtime::service::node_guard::{Event, NodeGuard};
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::{Duration, Frame, Instant, NodeId};
use serde_json::json;

use super::session::Session;
use crate::bus::{BusArgs, node_id};
use crate::output::{Failure, Outcome, note, plural};
use lexican_toolbox::text::duration::{period, time};

/// Guard a node: request its state again and again (node guarding)
///
/// The way of devices that are older than the heartbeat: a remote frame asks for the state, and a bit of the answer toggles. A
/// node whose life guarding is set up (100Ch, 100Dh) notices when the command ends. Exit code 1 if the node was lost, or its bit did not toggle.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    bus: BusArgs,

    /// The node-ID: 1 to 127, or 0x1 to 0x7F
    #[arg(value_name = "NODE", value_parser = node_id)]
    node: NodeId,

    /// The guard time: how far apart the requests are (100Ch)
    #[arg(long, value_name = "TIME", value_parser = period, default_value = "500ms")]
    every: Duration,

    /// The life time factor: after so many guard times without an answer the node is lost (100Dh)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..), default_value = "3")]
    factor: u8,

    /// Stop after so many requests
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    count: Option<u64>,

    /// Stop after this time; without --count or this, at Ctrl-C
    #[arg(long = "for", value_name = "TIME", value_parser = time)]
    span: Option<Duration>,

    /// Print JSON objects
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican guard --bus can0 5
    lexican guard --bus can0 5 --every 100ms --factor 2 --for 1min --json";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let pace = if args.span.is_some() || args.count.is_some() { Pace::Virtual } else { Pace::RealTime };
    let mut session = Session::new(args.bus.open(pace)?.settled()?, args.json)?;
    let mut guard = NodeGuard::new(args.node, args.every, args.factor);
    guard.start(session.began);
    let mut guarding = Guarding { guard, requests: 0, answers: 0 };
    // Wait for the answer to the last request as for any other.
    let by_count = args.count.and_then(|count| Some(args.every.times(u32::try_from(count).ok()?)));
    let end = by_count.into_iter().chain(args.span).min().map(|span| session.began + span);
    let (mut lost, mut errors) = (0_u64, 0_u64);
    session.run(
        &mut guarding,
        |guarding, _| {
            (end, format!("{} of {} answered", guarding.answers, plural(guarding.requests as usize, "request")))
        },
        |session, _, event| {
            let (word, state, text) = match event {
                Event::BootedUp => ("booted", None, "has booted".to_owned()),
                Event::Started(state) if lost > 0 => ("back", Some(state), format!("is back: {state}")),
                Event::Started(state) => ("heard", Some(state), format!("is {state}")),
                Event::StateChanged(state) => ("state", Some(state), format!("is {state} now")),
                Event::ToggleError => ("toggle", None, "has not toggled its bit".to_owned()),
                Event::Lost => ("lost", None, "is lost".to_owned()),
            };
            lost += u64::from(event == Event::Lost);
            errors += u64::from(event == Event::ToggleError);
            let state = state.map(|state| state.to_string());
            let fields = json!({ "node": args.node.get(), "state": state });
            session.print(word, fields, &format!("node {} {text}", args.node))
        },
    )?;
    if errors > 0 {
        note("a node that sends a heartbeat (1017h) does not toggle, and cannot be guarded as well");
    }
    let Guarding { guard, requests, answers } = &guarding;
    let state = guard.state().map(|state| state.to_string());
    let now = state.as_deref().unwrap_or("nothing is known of its state");
    let text = format!(
        "node {}: {}, {}, {} without toggling, {} lost; {now}",
        args.node,
        plural(*requests as usize, "request"),
        plural(*answers as usize, "answer"),
        errors,
        plural(lost as usize, "time"),
    );
    let fields = json!({
        "node": args.node.get(),
        "requests": requests,
        "answers": answers,
        "toggle_errors": errors,
        "lost": lost,
        "state": state,
    });
    session.print("summary", fields, &text)?;
    Ok(if lost == 0 && errors == 0 && *answers > 0 { session.outcome() } else { Outcome::Found })
}

/// A node guard, with counters.
struct Guarding {
    guard: NodeGuard,
    requests: u64,
    answers: u64,
}

impl StateMachine for Guarding {
    type Event = Event;

    fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<Event> {
        self.answers += u64::from(frame.id() == ErrorControl::cob_id(self.guard.node()) && !frame.is_remote());
        self.guard.handle_frame(now, frame)
    }

    fn handle_timeout(&mut self, now: Instant) -> Option<Event> {
        self.guard.handle_timeout(now)
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        let request = self.guard.poll_transmit(now)?;
        self.requests += 1;
        Some(request)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.guard.poll_timeout()
    }
}
