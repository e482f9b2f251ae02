//! A node that a network boots.

use super::assignment::Assignment;
use super::event::NetworkEvent;
use super::pace::Pace;
use super::table::{Entry, IDS, MARKS};
use super::watch::Watch;
use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::procedure::{BootEvent, BootNode, BootPlan};
use crate::service::node_guard;
use crate::time::{Instant, earliest};
use crate::wire::heartbeat::ErrorControl;
use crate::wire::nmt::{NmtCommand, NmtMessage, NmtState};

#[derive(Clone, Debug)]
pub(super) struct Member<C> {
    node: NodeId,
    assignment: Assignment<C>,
    watch: Watch,
    phase: Phase<C>,
    /// How often it may yet not answer before it has failed.
    retries: u8,
    command: Option<NmtCommand>,
    /// Whether it went silent, and has not booted since.
    lost: bool,
    /// Whether it was reset, and its boot-up message is still to come.
    reset: bool,
    pace: Pace,
}

/// What the network is doing with a node.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "nothing is allocated, and every node boots")]
enum Phase<C> {
    /// Nothing: the network has not started, or is stopped.
    Idle,
    /// Boots it, or has failed to, and may still have an abort to send.
    Booting(BootNode<C>),
    /// Waits to recover it.
    Paused { until: Instant },
    /// Monitors it.
    Booted,
    /// It was lost, and is not booted by itself: waits for its boot-up message.
    Down,
}

/// The result of a frame or a deadline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Report {
    Lost(NodeId, Loss),
    Event(NetworkEvent),
}

/// How a node is lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Loss {
    /// It has stopped sending heartbeats or answering.
    Silent,
    /// It has booted by itself.
    Rebooted,
}

/// How often a node that does not answer in time is asked again before it has failed.
const RETRIES: u8 = 3;

impl<C: AsRef<[u8]> + Clone> Member<C> {
    pub(super) fn new(node: NodeId, assignment: Assignment<C>) -> Self {
        let watch = watch(node, &assignment);
        Member {
            node,
            assignment,
            watch,
            phase: Phase::Idle,
            retries: 0,
            command: None,
            lost: false,
            reset: false,
            pace: Pace::default(),
        }
    }

    pub(super) const fn is_mandatory(&self) -> bool {
        self.assignment.mandatory
    }

    pub(super) const fn is_kept_alive(&self) -> bool {
        self.assignment.plan.keep_alive
    }

    pub(super) const fn is_to_be_started(&self) -> bool {
        self.assignment.plan.start
    }

    pub(super) const fn has_booted(&self) -> bool {
        matches!(self.phase, Phase::Booted)
    }

    /// Whether the network is not ready without it.
    pub(super) const fn is_missing(&self) -> bool {
        self.is_mandatory() && !self.has_booted()
    }

    /// Whether it is being booted, or will be after a pause.
    pub(super) fn is_booting(&self) -> bool {
        match &self.phase {
            Phase::Booting(boot) => !boot.is_over(),
            Phase::Paused { .. } => true,
            _ => false,
        }
    }

    /// Whether it has booted, or waits to be started with the others.
    pub(super) fn is_startable(&self) -> bool {
        self.has_booted() || matches!(&self.phase, Phase::Booting(boot) if boot.is_held())
    }

    /// Boots it along with all others; `spared` is whether some are not reset, so that no one command resets all.
    pub(super) fn start(&mut self, held: bool, spared: bool) {
        (self.lost, self.reset) = (false, false);
        let reset = spared && !self.is_kept_alive();
        self.command = reset.then_some(NmtCommand::ResetCommunication);
        self.retries = RETRIES;
        self.forget();
        self.begin(self.is_kept_alive(), held);
    }

    /// Resets the pace, since events before the start do not count.
    pub(super) fn forgive(&mut self) {
        self.pace = Pace::default();
    }

    /// Boots it from the beginning, after it was reset or has booted by itself.
    pub(super) fn boot(&mut self, held: bool) {
        self.retries = RETRIES;
        self.forget();
        self.begin(false, held);
    }

    fn begin(&mut self, keep_alive: bool, held: bool) {
        let plan = BootPlan { keep_alive, ..self.assignment.plan.clone() };
        let boot = BootNode::new(self.node, self.assignment.client.clone(), plan);
        self.phase = Phase::Booting(if held { boot.held() } else { boot });
    }

    /// Starts monitoring anew, so that the node may be silent for as long as a reset takes.
    fn forget(&mut self) {
        self.watch = watch(self.node, &self.assignment);
    }

    pub(super) fn stop(&mut self) {
        self.phase = Phase::Idle;
        self.command = None;
    }

    pub(super) fn lose(&mut self, now: Instant, silent: bool) {
        self.lost = silent;
        self.pace.note(now);
    }

    /// What to do after it was lost.
    pub(super) fn recover(&mut self, now: Instant, stopped: bool, held: bool) {
        if stopped || self.assignment.boots_again {
            self.retry(now, stopped, held);
        } else {
            self.phase = Phase::Down;
        }
    }

    /// Boots it again, after a reset if it is lost, or stops it with the others; after a pause if need be.
    fn retry(&mut self, now: Instant, stopped: bool, held: bool) {
        if let Err(until) = self.pace.attempt(now) {
            self.pause(until);
        } else if stopped {
            self.command = Some(NmtCommand::Stop);
            self.phase = Phase::Idle;
        } else {
            self.command = self.lost.then_some(NmtCommand::ResetNode);
            self.boot(held);
        }
    }

    /// Begins an attempt to recover it along with all others, or returns when that is allowed.
    pub(super) fn attempt(&mut self, now: Instant) -> Result<(), Instant> {
        self.pace.attempt(now)
    }

    pub(super) fn pause(&mut self, until: Instant) {
        self.forget();
        self.command = None;
        self.phase = Phase::Paused { until };
    }

    /// Notes that the node was commanded to reset. A pause continues after its boot-up message.
    pub(super) fn note_reset(&mut self) {
        self.forget();
        self.reset = !matches!(self.phase, Phase::Paused { .. });
    }

    /// Starts the node, unless a command to all does (`at_once`).
    pub(super) fn release(&mut self, now: Instant, at_once: bool) {
        if let Phase::Booting(boot) = &mut self.phase {
            boot.release(now, at_once);
        }
    }

    pub(super) fn handle_frame(&mut self, now: Instant, frame: &Frame, stopped: bool, held: bool) -> Option<Report> {
        if frame.id() == ErrorControl::cob_id(self.node)
            && let Some(report) = self.hear(now, frame, stopped, held)
        {
            return Some(report);
        }
        let Phase::Booting(boot) = &mut self.phase else { return None };
        let event = boot.handle_frame(now, frame);
        self.handle_boot(now, event, held)
    }

    /// Handles a heartbeat, a guarding answer or a boot-up message.
    fn hear(&mut self, now: Instant, frame: &Frame, stopped: bool, held: bool) -> Option<Report> {
        if matches!(self.phase, Phase::Idle) && !stopped {
            return None;
        }
        let is_answer = matches!(&self.phase, Phase::Booting(boot) if boot.asks());
        if is_answer && *frame != ErrorControl::heartbeat(NmtState::Initialising).frame(self.node) {
            return None;
        }
        let waits = Some(Report::Event(NetworkEvent::BootedUp(self.node)));
        match self.watch.handle_frame(now, frame)? {
            node_guard::Event::BootedUp => {
                self.lost = false;
                let awaited = core::mem::take(&mut self.reset);
                match &self.phase {
                    Phase::Booted => return Some(Report::Lost(self.node, Loss::Rebooted)),
                    Phase::Down => return waits,
                    Phase::Booting(boot) if boot.is_over() && !self.assignment.boots_again => return waits,
                    Phase::Booting(boot) if boot.resets() => {}
                    // It begins anew in any phase.
                    Phase::Booting(_) | Phase::Paused { .. } if awaited => self.boot(held),
                    _ => {
                        self.pace.note(now);
                        self.retry(now, stopped, held);
                    }
                }
            }
            // It was away without noticing, so the command did not reach it. A frame sent before the reset may also
            // arrive after it, so this is limited by the pace.
            node_guard::Event::Started(_) if self.lost && (stopped || self.assignment.boots_again) => {
                if self.pace.allows(now) {
                    self.pace.note(now);
                }
                self.retry(now, stopped, held);
            }
            node_guard::Event::StateChanged(state) if self.has_booted() => {
                return Some(Report::Event(NetworkEvent::StateChanged { node: self.node, state }));
            }
            _ => {}
        }
        None
    }

    /// Does what is due.
    pub(super) fn handle_timeout(&mut self, now: Instant, stopped: bool, held: bool) -> Option<Report> {
        if self.pace.take_loop() {
            return Some(Report::Event(NetworkEvent::BootLoop(self.node)));
        }
        if self.watch.handle_timeout(now).is_some() {
            return Some(Report::Lost(self.node, Loss::Silent));
        }
        match &mut self.phase {
            Phase::Booting(boot) => {
                let event = boot.handle_timeout(now);
                self.handle_boot(now, event, held)
            }
            // It was reset during the pause.
            Phase::Paused { until } if *until <= now && self.reset => {
                self.boot(held);
                None
            }
            Phase::Paused { until } if *until <= now => {
                self.retry(now, stopped, held);
                None
            }
            _ => None,
        }
    }

    fn handle_boot(&mut self, now: Instant, event: Option<BootEvent>, held: bool) -> Option<Report> {
        let Phase::Booting(boot) = &self.phase else { return None };
        let may_be_guarded = boot.is_configured() || event == Some(BootEvent::Booted);
        if may_be_guarded && self.watch.poll_timeout().is_none() {
            self.watch.start(now);
        }
        match event? {
            BootEvent::Booted => {
                self.phase = Phase::Booted;
                self.reset = false;
                Some(Report::Event(NetworkEvent::Booted(self.node)))
            }
            BootEvent::Failed(error) if error.is_time_out() && self.retries > 0 => {
                self.retries -= 1;
                self.begin(boot.plan().keep_alive, held);
                None
            }
            BootEvent::Failed(error) => {
                let mandatory = self.is_mandatory();
                Some(Report::Event(NetworkEvent::Failed { node: self.node, mandatory, error }))
            }
        }
    }

    pub(super) fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        if let Some(command) = self.command.take() {
            if matches!(command, NmtCommand::ResetNode | NmtCommand::ResetCommunication) {
                self.note_reset();
            }
            return Some(NmtMessage { command, node: Some(self.node) }.frame());
        }
        if let Some(frame) = self.watch.poll_transmit(now) {
            return Some(frame);
        }
        match &mut self.phase {
            Phase::Booting(boot) => boot.poll_transmit(now),
            _ => None,
        }
    }
}

/// The questions for the marks of a network's table: which nodes have a frame to send?
pub(super) const SENDING: usize = 0;
/// Which mandatory nodes have not booted?
pub(super) const MISSING: usize = 1;
/// Which mandatory nodes cannot be started yet?
pub(super) const AWAITED: usize = 2;

impl<C: AsRef<[u8]> + Clone> Entry for Member<C> {
    fn node(&self) -> NodeId {
        self.node
    }

    fn cob_ids(&self) -> [Option<CobId>; IDS] {
        [Some(self.assignment.client.response_id()), None]
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let next = match &self.phase {
            _ if self.pace.is_loop() => Some(Instant::ZERO),
            Phase::Booting(boot) => boot.poll_timeout(),
            Phase::Paused { until } => Some(*until),
            _ => None,
        };
        earliest([self.watch.poll_timeout(), next])
    }

    fn marks(&self) -> [bool; MARKS] {
        let boots = matches!(&self.phase, Phase::Booting(boot) if boot.has_outgoing());
        let sends = self.command.is_some() || self.watch.has_outgoing() || boots;
        [sends, self.is_missing(), self.is_mandatory() && !self.is_startable()]
    }
}

fn watch<C>(node: NodeId, assignment: &Assignment<C>) -> Watch {
    match assignment.guarding {
        Some(guarding) => Watch::guarding(node, guarding.guard_time, guarding.retry_factor),
        None => Watch::heartbeat(node, assignment.heartbeat),
    }
}
