//! Booting one node: checks that it is the expected device, has the expected configuration, and is alive, and then
//! starts it (CiA 302-2, 6.4).
//!
//! ```text
//! identify --> check configuration --(another)--> configure --> await error control --> start --> await OPERATIONAL --> booted
//!          \--(keep alive)--> check state --(OPERATIONAL)--> booted
//!                                         \--(another)--> reset --> check configuration
//! ```

mod plan;

pub use plan::{BootError, BootPlan};

use super::concise::{ConciseDcf, Position};
use crate::cia301;
use crate::frame::Frame;
use crate::id::NodeId;
use crate::object::Address;
use crate::service::sdo_client::{Event, Payload, Scalar, SdoClient};
use crate::time::{Duration, Instant, earliest};
use crate::wire::heartbeat::ErrorControl;
use crate::wire::lss::Part;
use crate::wire::nmt::{NmtCommand, NmtMessage, NmtState};

/// Boots one node.
#[derive(Clone, Debug)]
pub struct BootNode<C> {
    node: NodeId,
    plan: BootPlan<C>,
    client: SdoClient,
    stage: Stage,
    /// The value read last.
    value: Scalar,
    /// Whether a heartbeat or guarding answer was heard.
    alive: bool,
    /// Whether the node waits until it is released, to be started with the others.
    held: bool,
    /// A command, or a request for the node's state.
    outgoing: Option<Frame>,
}

/// The result of booting a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum BootEvent {
    /// The node is as configured, and OPERATIONAL if it was to be started.
    Booted,
    /// The node is not as planned, or does not answer.
    Failed(BootError),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Begins with the first deadline, which is due at once.
    Begin,
    /// Reads the device type, then each part of the identity with an expected value.
    Identify {
        part: Option<Part>,
    },
    CheckState {
        until: Instant,
    },
    Reset {
        until: Instant,
    },
    /// Reads the date of the configuration (1020h:01), then its time (1020h:02).
    CheckConfiguration {
        sub: u8,
    },
    Configure {
        at: Position,
        entry: usize,
    },
    AwaitErrorControl {
        until: Instant,
    },
    ReadHeartbeatTime,
    Held {
        report: Report,
    },
    AwaitOperational(Starting),
    Over,
}

/// How a node reports its state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Report {
    /// By itself, within this time after a change of state.
    Within(Duration),
    Asked,
}

/// A node that was commanded to start, and has not reported OPERATIONAL yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Starting {
    report: Report,
    /// How often the command was sent.
    starts: u8,
    /// When the command is sent again.
    until: Instant,
    /// When its state is requested again.
    ask: Option<Instant>,
    /// The state reported since the first command.
    state: Option<NmtState>,
}

/// How long a node may take to answer when it is asked for its state.
const STATE_TIMEOUT: Duration = Duration::from_millis(500);
/// How long a node may take to boot.
const BOOT_UP_TIMEOUT: Duration = Duration::from_secs(10);
/// How long a node may take to enter OPERATIONAL.
const START_TIMEOUT: Duration = Duration::from_secs(1);
/// The time between two requests for the state.
const STATE_POLL: Duration = Duration::from_millis(100);
/// How often a node is commanded to start, since the command is not confirmed and may get lost.
const STARTS: u8 = 3;

const DEVICE_TYPE: Address = Address::new(cia301::DEVICE_TYPE, 0);
const HEARTBEAT_TIME: Address = Address::new(cia301::PRODUCER_HEARTBEAT_TIME, 0);

impl<C: AsRef<[u8]>> BootPlan<C> {
    /// The expected value of a part of the identity.
    const fn expected(&self, part: Part) -> Option<u32> {
        match part {
            Part::Vendor => self.vendor,
            Part::Product => self.product,
            Part::Revision => self.revision,
            Part::Serial => self.serial,
        }
    }

    /// The data of an entry of the configuration.
    fn entry(&self, at: Position) -> &[u8] {
        ConciseDcf::at(self.configuration.as_ref(), at).split().map_or(&[], |(_, data, _)| data)
    }
}

impl<C: AsRef<[u8]>> BootNode<C> {
    /// Boots `node` through `client`.
    #[must_use]
    pub fn new(node: NodeId, client: SdoClient, plan: BootPlan<C>) -> Self {
        let value = Scalar::room_for::<u64>();
        BootNode { node, plan, client, stage: Stage::Begin, value, alive: false, held: false, outgoing: None }
    }

    /// Waits with starting the node until [`BootNode::release`].
    #[must_use]
    pub fn held(self) -> Self {
        BootNode { held: true, ..self }
    }

    /// The node.
    #[must_use]
    pub const fn node(&self) -> NodeId {
        self.node
    }

    /// Whether the node has booted, or failed to.
    #[must_use]
    pub const fn is_over(&self) -> bool {
        matches!(self.stage, Stage::Over)
    }

    /// The expected identity of the node, and its configuration.
    #[must_use]
    pub const fn plan(&self) -> &BootPlan<C> {
        &self.plan
    }

    /// Whether it has reset the node, so that a boot-up message is expected.
    #[must_use]
    pub const fn resets(&self) -> bool {
        matches!(self.stage, Stage::Reset { .. })
    }

    /// Whether the node has its configuration, and may be guarded.
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

    /// Whether it asks the node for its state, so that the answer is not a heartbeat.
    #[must_use]
    pub const fn asks(&self) -> bool {
        match self.stage {
            Stage::CheckState { .. } => self.plan.error_control.is_zero(),
            Stage::AwaitOperational(Starting { ask, .. }) => ask.is_some(),
            _ => false,
        }
    }

    /// Whether the node is ready to start, and waits for [`BootNode::release`].
    #[must_use]
    pub const fn is_held(&self) -> bool {
        matches!(self.stage, Stage::Held { .. })
    }

    /// Starts the node as soon as possible; `commanded` is whether a command to all nodes starts it.
    pub fn release(&mut self, now: Instant, commanded: bool) {
        self.held = false;
        if let Stage::Held { report } = self.stage {
            self.command_start(now, report, !commanded);
        }
    }

    /// Takes a frame.
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<BootEvent> {
        if frame.id() == ErrorControl::cob_id(self.node) && !frame.is_remote() {
            let message = ErrorControl::parse(frame.data())?;
            return match self.stage {
                Stage::Reset { .. } if message != ErrorControl::heartbeat(NmtState::Initialising) => None,
                Stage::Reset { .. } => self.check_configuration(now),
                _ => self.handle_state(now, message.state),
            };
        }
        let event = self.transfer(|client, payload| client.handle_frame(now, frame, payload))?;
        self.handle_transfer(now, event)
    }

    /// Calls the client with the payload of the present stage.
    fn transfer<R>(&mut self, call: impl FnOnce(&mut SdoClient, &mut dyn Payload) -> R) -> R {
        match self.stage {
            Stage::Configure { at, .. } => call(&mut self.client, &mut self.plan.entry(at)),
            _ => call(&mut self.client, &mut self.value),
        }
    }

    fn handle_state(&mut self, now: Instant, state: NmtState) -> Option<BootEvent> {
        self.alive |= state != NmtState::Initialising;
        match &mut self.stage {
            Stage::CheckState { .. } if state == NmtState::Operational => self.end(BootEvent::Booted),
            Stage::CheckState { .. } => {
                self.reset(now);
                None
            }
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
            Stage::Begin => self.identify(now, None),
            Stage::AwaitErrorControl { until } if until <= now => {
                self.fail(BootError::NoErrorControl(self.plan.error_control))
            }
            Stage::CheckState { until } if until <= now => {
                self.reset(now);
                None
            }
            Stage::Reset { until } if until <= now => self.fail(BootError::NoBootUp(BOOT_UP_TIMEOUT)),
            Stage::AwaitOperational(starting) => self.handle_start_timeout(now, starting),
            // The client has no deadline between its transfers.
            _ => {
                let event = self.client.handle_timeout(now)?;
                self.handle_transfer(now, event)
            }
        }
    }

    /// Whether [`BootNode::poll_transmit`] has a frame.
    pub(crate) const fn has_outgoing(&self) -> bool {
        self.outgoing.is_some() || self.client.has_outgoing()
    }

    /// The next frame to send.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        // After a failure, the client may have an abort.
        self.outgoing.take().or_else(|| self.transfer(|client, payload| client.poll_transmit(now, payload)))
    }

    /// When to call [`BootNode::handle_timeout`].
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        match self.stage {
            Stage::Begin => Some(Instant::ZERO),
            Stage::AwaitErrorControl { until } | Stage::CheckState { until } | Stage::Reset { until } => Some(until),
            Stage::AwaitOperational(Starting { until, ask, .. }) => earliest([Some(until), ask]),
            _ => self.client.poll_timeout(),
        }
    }

    fn handle_transfer(&mut self, now: Instant, event: Event) -> Option<BootEvent> {
        let read = match event {
            Event::Done { .. } => Ok(self.value.number()),
            Event::Failed(error) => Err(error),
        };
        match (self.stage, read) {
            (Stage::Identify { part: None }, Err(error)) => self.fail(BootError::NoDeviceType(error)),
            (Stage::Identify { part: Some(_) }, Err(error)) => self.fail(BootError::NoIdentity(error)),
            (Stage::Identify { part }, Ok(got)) => self.handle_identity(now, part, got),
            (Stage::CheckConfiguration { sub }, read) => self.handle_configured(now, sub, read.ok()),
            (Stage::Configure { entry, .. }, Err(error)) => self.fail(BootError::Configuration { entry, error }),
            (Stage::Configure { at, entry }, Ok(_)) => {
                let mut dcf = ConciseDcf::at(self.plan.configuration.as_ref(), at);
                dcf.next();
                self.write_entry(now, dcf.position(), entry + 1)
            }
            (Stage::ReadHeartbeatTime, Ok(ms @ 1..)) => self.start(now, Report::Within(Duration::from_millis(ms))),
            (Stage::ReadHeartbeatTime, _) => self.start(now, Report::Asked),
            _ => None,
        }
    }

    fn read(&mut self, now: Instant, stage: Stage, address: Address) -> Option<BootEvent> {
        self.stage = stage;
        self.value = Scalar::room_for::<u64>();
        // The client is idle, since each entry takes one transfer.
        let _ = self.client.read(now, address);
        None
    }

    /// Reads the device type, which also shows whether the node is there, and then the parts of the identity.
    fn identify(&mut self, now: Instant, part: Option<Part>) -> Option<BootEvent> {
        let address = part.map_or(DEVICE_TYPE, |part| Address::new(cia301::IDENTITY, 1 + part.number()));
        self.read(now, Stage::Identify { part }, address)
    }

    fn handle_identity(&mut self, now: Instant, part: Option<Part>, got: u64) -> Option<BootEvent> {
        let expected = part.map_or(self.plan.device_type, |part| self.plan.expected(part));
        let is_later = |expected| part == Some(Part::Revision) && self.plan.or_later && got > expected;
        if let Some(expected) = expected.filter(|&expected| got != expected.into() && !is_later(expected.into())) {
            let got = got as u32;
            return self.fail(match part {
                None => BootError::DeviceType { expected, got },
                Some(part) => BootError::Identity { part, expected, got },
            });
        }
        let mut parts = Part::ALL.into_iter().filter(|&next| Some(next) > part);
        match parts.find(|&next| self.plan.expected(next).is_some()) {
            None if self.plan.keep_alive => self.await_state(now),
            None => self.check_configuration(now),
            next => self.identify(now, next),
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
        self.outgoing = Some(ErrorControl::request(self.node));
    }

    /// Resets the node, and forgets its reported state.
    fn reset(&mut self, now: Instant) {
        self.alive = false;
        self.command(NmtCommand::ResetCommunication);
        self.stage = Stage::Reset { until: now + BOOT_UP_TIMEOUT };
    }

    fn command(&mut self, command: NmtCommand) {
        self.outgoing = Some(NmtMessage { command, node: Some(self.node) }.frame());
    }

    fn check_configuration(&mut self, now: Instant) -> Option<BootEvent> {
        match self.plan.configured {
            Some(_) => self.read_configured(now, 1),
            None => self.configure(now),
        }
    }

    fn read_configured(&mut self, now: Instant, sub: u8) -> Option<BootEvent> {
        let address = Address::new(cia301::VERIFY_CONFIGURATION, sub);
        self.read(now, Stage::CheckConfiguration { sub }, address)
    }

    /// Configures the node if it has another configuration, or reports none.
    fn handle_configured(&mut self, now: Instant, sub: u8, got: Option<u64>) -> Option<BootEvent> {
        let expected = self.plan.configured.map(|(date, time)| if sub == 1 { date } else { time }.into());
        match sub {
            _ if got != expected => self.configure(now),
            1 => self.read_configured(now, 2),
            _ => self.await_error_control(now),
        }
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
        // The client is idle, since each entry takes one transfer.
        let _ = self.client.write(now, address, len);
        self.stage = Stage::Configure { at, entry };
        None
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
            return self.read(now, Stage::ReadHeartbeatTime, HEARTBEAT_TIME);
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
            self.command(NmtCommand::Start);
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
            // The command is sent first.
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
