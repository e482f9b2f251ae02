//! Booting one node: is it the expected device, does it have the expected configuration, and is it
//! alive? Then it may start (CiA 302-2, 6.4).
//!
//! ```text
//! identify --> check configuration --(another)--> configure --> await error control --> start --> await OPERATIONAL --> booted
//!          \--(keep alive)--> check state --(OPERATIONAL)--> booted
//!                                         \--(another)--> reset --> check configuration
//! ```

mod plan;

pub use plan::{BootError, BootPlan};

use super::concise::{ConciseDcf, Position};
use super::runner::{self, Runner, StepError};
use super::step::Step;
use crate::frame::Frame;
use crate::id::NodeId;
use crate::object::Address;
use crate::service::sdo_client::{self, SdoClient};
use crate::time::{Duration, Instant};
use crate::wire::heartbeat::ErrorControl;
use crate::wire::lss::Part;
use crate::wire::nmt::{NmtCommand, NmtMessage, NmtState};

/// Boots one node.
#[derive(Clone, Debug)]
pub struct BootNode<C> {
    plan: BootPlan<C>,
    /// Writes the configuration; the runner has a client of its own.
    client: SdoClient,
    runner: Runner<'static, Steps>,
    stage: Stage,
    /// A heartbeat or guarding answer was heard.
    alive: bool,
    /// The node is started with the others, when it is released.
    held: bool,
    /// A command, or a request for the node's state.
    outgoing: Option<Frame>,
}

/// What became of the node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BootEvent {
    /// It is what it shall be, and OPERATIONAL if it was to be started.
    Booted,
    /// It is not.
    Failed(BootError),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Identify,
    CheckState { until: Instant },
    Reset,
    CheckConfiguration,
    Configure { at: Position, entry: usize },
    AwaitErrorControl { until: Instant },
    ReadHeartbeatTime,
    Held { report: Report },
    AwaitOperational(Starting),
    Over,
}

/// How a node reports its state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Report {
    /// By itself, within this time after a change.
    Within(Duration),
    /// When it is asked.
    Asked,
}

/// A node that was started, and has not reported that it is OPERATIONAL.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Starting {
    report: Report,
    /// How often it was commanded.
    starts: u8,
    /// When it is commanded again.
    until: Instant,
    /// When it is asked again.
    ask: Option<Instant>,
    /// What it has reported since the first command.
    state: Option<NmtState>,
}

/// The steps of a stage.
#[derive(Clone, Debug)]
enum Steps {
    Identify { expected: [(Address, Option<u32>); 5], at: usize },
    CheckConfiguration { expected: [(Address, u32); 2], at: usize },
    Reset { at: u8 },
    ReadHeartbeatTime { begun: bool },
}

/// How long a node may take to tell its state when it is asked for it.
const STATE_TIMEOUT: Duration = Duration::from_millis(500);
/// How long a node may take to boot.
const BOOT_UP_TIMEOUT: Duration = Duration::from_secs(10);
/// How long a node may take to enter OPERATIONAL.
const START_TIMEOUT: Duration = Duration::from_secs(1);
/// From one request for the state to the next.
const STATE_POLL: Duration = Duration::from_millis(100);
/// How often a node is commanded to start: the command is not confirmed, and may get lost.
const STARTS: u8 = 3;

const DEVICE_TYPE: Address = Address::new(0x1000, 0);
const HEARTBEAT_TIME: Address = Address::new(0x1017, 0);

impl Steps {
    fn identify<C>(plan: &BootPlan<C>) -> Self {
        let part = |part: Part| Address::new(0x1018, 1 + part.number());
        let expected = [
            (DEVICE_TYPE, plan.device_type),
            (part(Part::Vendor), plan.vendor),
            (part(Part::Product), plan.product),
            (part(Part::Revision), plan.revision),
            (part(Part::Serial), plan.serial),
        ];
        Steps::Identify { expected, at: 0 }
    }
}

impl Iterator for Steps {
    type Item = Step<'static>;

    fn next(&mut self) -> Option<Step<'static>> {
        match self {
            Steps::Identify { expected, at } => loop {
                let &(address, value) = expected.get(*at)?;
                *at += 1;
                match value {
                    Some(value) => return Some(Step::expect(address, value.into())),
                    // The device type is read in any case: it shows whether the node is there.
                    None if address == DEVICE_TYPE => return Some(Step::Expect { address, mask: 0, value: 0 }),
                    None => {}
                }
            },
            Steps::CheckConfiguration { expected, at } => {
                let &(address, value) = expected.get(*at)?;
                *at += 1;
                Some(Step::expect(address, value.into()))
            }
            Steps::Reset { at } => {
                *at += 1;
                match *at {
                    1 => Some(Step::Nmt(NmtCommand::ResetCommunication)),
                    2 => Some(Step::AwaitBootUp { timeout: BOOT_UP_TIMEOUT }),
                    _ => None,
                }
            }
            // Another value than 0 fails the step, which reports it.
            Steps::ReadHeartbeatTime { begun } => {
                (!core::mem::replace(begun, true)).then_some(Step::expect(HEARTBEAT_TIME, 0))
            }
        }
    }
}

impl<C: AsRef<[u8]>> BootPlan<C> {
    /// The data of an entry of the configuration.
    fn entry(&self, at: Position) -> &[u8] {
        ConciseDcf::at(self.configuration.as_ref(), at).split().map_or(&[], |(_, data, _)| data)
    }
}

impl<C: AsRef<[u8]>> BootNode<C> {
    /// Boots `node` through `client`.
    #[must_use]
    pub fn new(node: NodeId, client: SdoClient, plan: BootPlan<C>) -> Self {
        let runner = Runner::new(node, client.clone(), Steps::identify(&plan));
        BootNode { plan, client, runner, stage: Stage::Identify, alive: false, held: false, outgoing: None }
    }

    /// Does not start the node until [`BootNode::release`].
    #[must_use]
    pub fn held(self) -> Self {
        BootNode { held: true, ..self }
    }

    /// The node.
    #[must_use]
    pub const fn node(&self) -> NodeId {
        self.runner.node()
    }

    /// Whether the node has booted, or failed to.
    #[must_use]
    pub const fn is_over(&self) -> bool {
        matches!(self.stage, Stage::Over)
    }

    /// What the node is expected to be, and to be made.
    #[must_use]
    pub const fn plan(&self) -> &BootPlan<C> {
        &self.plan
    }

    /// Whether it has reset the node, and the boot-up message that follows is no news.
    #[must_use]
    pub const fn resets(&self) -> bool {
        matches!(self.stage, Stage::Reset)
    }

    /// Whether the node has its configuration, so that it may be guarded.
    #[must_use]
    pub const fn is_configured(&self) -> bool {
        matches!(
            self.stage,
            Stage::AwaitErrorControl { .. }
                | Stage::ReadHeartbeatTime
                | Stage::Held { .. }
                | Stage::AwaitOperational(_)
        )
    }

    /// Whether it asks the node for its state: what comes then is no heartbeat.
    #[must_use]
    pub const fn asks(&self) -> bool {
        match self.stage {
            Stage::CheckState { .. } => self.plan.error_control.is_zero(),
            Stage::AwaitOperational(Starting { ask, .. }) => ask.is_some(),
            _ => false,
        }
    }

    /// Whether the node could be started, and waits for [`BootNode::release`].
    #[must_use]
    pub const fn is_held(&self) -> bool {
        matches!(self.stage, Stage::Held { .. })
    }

    /// Starts the node as soon as it may; `commanded` when a command to all nodes does.
    pub fn release(&mut self, now: Instant, commanded: bool) {
        self.held = false;
        if let Stage::Held { report } = self.stage {
            self.command_start(now, report, !commanded);
        }
    }

    /// Takes a frame.
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<BootEvent> {
        let is_error_control = frame.id() == ErrorControl::cob_id(self.node()) && !frame.is_remote();
        if is_error_control && !self.resets() {
            return self.handle_state(now, ErrorControl::parse(frame.data())?.state);
        }
        if let Stage::Configure { at, .. } = self.stage {
            let mut data = self.plan.entry(at);
            let event = self.client.handle_frame(now, frame, &mut data)?;
            return self.handle_entry(now, event);
        }
        let event = self.runner.handle_frame(now, frame)?;
        self.handle_end(now, event)
    }

    fn handle_state(&mut self, now: Instant, state: NmtState) -> Option<BootEvent> {
        self.alive |= state != NmtState::Initialising;
        match &mut self.stage {
            Stage::CheckState { .. } if state == NmtState::Operational => self.end(BootEvent::Booted),
            Stage::CheckState { .. } => self.reset(),
            Stage::AwaitErrorControl { .. } if self.alive => self.prepare_start(now),
            Stage::AwaitOperational(_) if state == NmtState::Operational => self.end(BootEvent::Booted),
            Stage::AwaitOperational(starting) => {
                starting.state = Some(state);
                None
            }
            _ => None,
        }
    }

    /// Does what is due.
    pub fn handle_timeout(&mut self, now: Instant) -> Option<BootEvent> {
        match self.stage {
            Stage::Over | Stage::Held { .. } => None,
            Stage::AwaitErrorControl { until } if until <= now => {
                self.fail(BootError::NoErrorControl(self.plan.error_control))
            }
            Stage::CheckState { until } if until <= now => self.reset(),
            Stage::AwaitErrorControl { .. } | Stage::CheckState { .. } => None,
            Stage::AwaitOperational(starting) => self.handle_start_timeout(now, starting),
            Stage::Configure { .. } => {
                let event = self.client.handle_timeout(now)?;
                self.handle_entry(now, event)
            }
            _ => {
                let event = self.runner.handle_timeout(now)?;
                self.handle_end(now, event)
            }
        }
    }

    /// Whether [`BootNode::poll_transmit`] has a frame.
    pub(crate) const fn has_outgoing(&self) -> bool {
        let runs = !matches!(self.stage, Stage::Configure { .. });
        self.outgoing.is_some() || self.client.has_outgoing() || runs && self.runner.has_outgoing()
    }

    /// The next frame to send.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        if let Some(frame) = self.outgoing.take() {
            return Some(frame);
        }
        if let Stage::Configure { at, .. } = self.stage {
            let mut data = self.plan.entry(at);
            return self.client.poll_transmit(now, &mut data);
        }
        // What is left of a configuration that failed: an abort.
        self.client.poll_transmit(now, &mut [0; 0]).or_else(|| self.runner.poll_transmit(now))
    }

    /// When to call [`BootNode::handle_timeout`].
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        match self.stage {
            Stage::Over | Stage::Held { .. } => None,
            Stage::AwaitErrorControl { until } | Stage::CheckState { until } => Some(until),
            Stage::AwaitOperational(Starting { until, ask, .. }) => Some(ask.map_or(until, |ask| ask.min(until))),
            Stage::Configure { .. } => self.client.poll_timeout(),
            _ => self.runner.poll_timeout(),
        }
    }

    fn run(&mut self, stage: Stage, steps: Steps) {
        self.stage = stage;
        self.runner = Runner::new(self.node(), self.client.clone(), steps);
    }

    fn handle_end(&mut self, now: Instant, event: runner::Event<'static>) -> Option<BootEvent> {
        match (self.stage, event) {
            (Stage::Identify, runner::Event::Finished { .. }) if self.plan.keep_alive => self.await_state(now),
            (Stage::Identify | Stage::Reset, runner::Event::Finished { .. }) => self.check_configuration(now),
            (Stage::CheckConfiguration, runner::Event::Finished { .. }) => self.await_error_control(now),
            // Another configuration, or none that it could tell: it gets ours.
            (Stage::CheckConfiguration, runner::Event::Failed(_)) => self.configure(now),
            (Stage::ReadHeartbeatTime, event) => self.start(now, report(&event)),
            (stage, runner::Event::Failed(failure)) => self.fail(boot_error(stage, failure)?),
            _ => None,
        }
    }

    fn await_state(&mut self, now: Instant) -> Option<BootEvent> {
        let asks = self.plan.error_control.is_zero();
        if asks {
            self.ask();
        }
        let patience = if asks { STATE_TIMEOUT } else { self.plan.error_control };
        self.stage = Stage::CheckState { until: now + patience };
        None
    }

    fn ask(&mut self) {
        self.outgoing = Some(ErrorControl::request(self.node()));
    }

    /// From here on, it has reported nothing.
    fn reset(&mut self) -> Option<BootEvent> {
        self.alive = false;
        self.outgoing = None;
        self.run(Stage::Reset, Steps::Reset { at: 0 });
        None
    }

    fn check_configuration(&mut self, now: Instant) -> Option<BootEvent> {
        let Some((date, time)) = self.plan.configured else { return self.configure(now) };
        let expected = [(Address::new(0x1020, 1), date), (Address::new(0x1020, 2), time)];
        self.run(Stage::CheckConfiguration, Steps::CheckConfiguration { expected, at: 0 });
        None
    }

    fn configure(&mut self, now: Instant) -> Option<BootEvent> {
        let dcf = ConciseDcf::new(self.plan.configuration.as_ref());
        match dcf.check() {
            Ok(()) => self.write_entry(now, dcf.position(), 1),
            Err(error) => self.fail(error.into()),
        }
    }

    fn write_entry(&mut self, now: Instant, at: Position, entry: usize) -> Option<BootEvent> {
        let dcf = ConciseDcf::at(self.plan.configuration.as_ref(), at);
        let Some((address, data, _)) = dcf.split() else { return self.await_error_control(now) };
        let len = u32::try_from(data.len()).unwrap_or(u32::MAX);
        // The client is idle: one entry, one transfer.
        let _ = self.client.write(now, address, len);
        self.stage = Stage::Configure { at, entry };
        None
    }

    fn handle_entry(&mut self, now: Instant, event: sdo_client::Event) -> Option<BootEvent> {
        let Stage::Configure { at, entry } = self.stage else { return None };
        match event {
            sdo_client::Event::Done { .. } => {
                let mut dcf = ConciseDcf::at(self.plan.configuration.as_ref(), at);
                dcf.next();
                self.write_entry(now, dcf.position(), entry + 1)
            }
            sdo_client::Event::Failed(error) => self.fail(BootError::Configuration { entry, error }),
        }
    }

    fn await_error_control(&mut self, now: Instant) -> Option<BootEvent> {
        if self.plan.error_control.is_zero() || self.alive {
            return self.prepare_start(now);
        }
        self.stage = Stage::AwaitErrorControl { until: now + self.plan.error_control };
        None
    }

    /// Finds out how the node reports its state.
    fn prepare_start(&mut self, now: Instant) -> Option<BootEvent> {
        if !self.plan.start {
            return self.end(BootEvent::Booted);
        }
        if self.plan.error_control.is_zero() {
            self.run(Stage::ReadHeartbeatTime, Steps::ReadHeartbeatTime { begun: false });
            return None;
        }
        self.start(now, Report::Within(self.plan.error_control))
    }

    fn start(&mut self, now: Instant, report: Report) -> Option<BootEvent> {
        if self.held {
            self.stage = Stage::Held { report };
        } else {
            self.command_start(now, report, true);
        }
        None
    }

    fn command_start(&mut self, now: Instant, report: Report, alone: bool) {
        let starting = Starting { report, starts: 0, until: now, ask: None, state: None };
        self.command_again(now, starting, alone);
    }

    fn command_again(&mut self, now: Instant, starting: Starting, alone: bool) {
        if alone {
            self.outgoing = Some(NmtMessage { command: NmtCommand::Start, node: Some(self.node()) }.frame());
        }
        let (patience, ask) = match starting.report {
            Report::Within(time) => (START_TIMEOUT + time, None),
            Report::Asked => (START_TIMEOUT, Some(now + STATE_POLL)),
        };
        let starts = starting.starts + 1;
        self.stage = Stage::AwaitOperational(Starting { starts, until: now + patience, ask, ..starting });
    }

    fn handle_start_timeout(&mut self, now: Instant, starting: Starting) -> Option<BootEvent> {
        if starting.until <= now {
            return match starting.state {
                _ if starting.starts < STARTS => {
                    self.command_again(now, starting, true);
                    None
                }
                Some(state) => self.fail(BootError::NotStarted { state, starts: starting.starts }),
                None => self.fail(BootError::NoState),
            };
        }
        if starting.ask.is_some_and(|ask| ask <= now) {
            // The command goes first.
            if self.outgoing.is_none() {
                self.ask();
            }
            self.stage = Stage::AwaitOperational(Starting { ask: Some(now + STATE_POLL), ..starting });
        }
        None
    }

    fn fail(&mut self, error: BootError) -> Option<BootEvent> {
        self.end(BootEvent::Failed(error))
    }

    fn end(&mut self, event: BootEvent) -> Option<BootEvent> {
        self.stage = Stage::Over;
        Some(event)
    }
}

/// A node with a heartbeat reports its state in it.
fn report(event: &runner::Event<'_>) -> Report {
    match event {
        runner::Event::Failed(runner::Failure { error: StepError::Mismatch { got, .. }, .. }) => {
            Report::Within(Duration::from_millis(*got))
        }
        _ => Report::Asked,
    }
}

fn boot_error(stage: Stage, failure: runner::Failure<'_>) -> Option<BootError> {
    match (stage, failure.error) {
        (Stage::Reset, StepError::TimedOut { within }) => Some(BootError::NoBootUp(within)),
        (_, StepError::Sdo(error)) if error.address() == DEVICE_TYPE => Some(BootError::NoDeviceType(error)),
        (_, StepError::Sdo(error)) => Some(BootError::NoIdentity(error)),
        (_, StepError::Mismatch { address: DEVICE_TYPE, got }) => Some(BootError::DeviceType { got: got as u32 }),
        (_, StepError::Mismatch { address, got }) => {
            let part = Part::ALL.into_iter().find(|part| part.number() + 1 == address.sub())?;
            Some(BootError::Identity { part, got: got as u32 })
        }
        _ => None,
    }
}
