//! Booting one node: is it the expected device, does it have the expected configuration, and is it
//! alive? Then it may start (CiA 302-2, 6.4).
//!
//! ```text
//! identify --> check configuration --(another)--> configure --> await error control --> start --> booted
//!          \--(keep alive)--> check state --(OPERATIONAL)--> booted
//!                                         \--(another)--> reset --> check configuration
//! ```

use super::concise::{ConciseDcf, ConciseDcfError};
use super::runner::{self, Runner, StepError};
use super::step::Step;
use crate::frame::Frame;
use crate::id::NodeId;
use crate::object::{Address, ObjectDictionary};
use crate::service::objects;
use crate::service::sdo_client::{SdoClient, SdoError};
use crate::time::{Duration, Instant};
use crate::wire::heartbeat::ErrorControl;
use crate::wire::lss::Part;
use crate::wire::nmt::{NmtCommand, NmtState};

/// What a node is expected to be, and to be made. `None` and empty mean: whatever it is.
#[derive(Clone, Copy, Debug, Default)]
pub struct BootPlan<'a> {
    /// Device type, 1000h (1F84h of the manager).
    pub device_type: Option<u32>,
    /// Vendor-ID, 1018h:01 (1F85h).
    pub vendor: Option<u32>,
    /// Product code, 1018h:02 (1F86h).
    pub product: Option<u32>,
    /// Revision number, 1018h:03 (1F87h).
    pub revision: Option<u32>,
    /// Serial number, 1018h:04 (1F88h).
    pub serial: Option<u32>,
    /// Date and time of the configuration, 1020h:01 and :02 (1F26h, 1F27h). A node that has them is not
    /// configured again.
    pub configured: Option<(u32, u32)>,
    /// The configuration as a concise DCF (1F22h).
    pub configuration: &'a [u8],
    /// The heartbeat, or an answer to guarding, must be heard within this time; zero not to wait for it.
    pub error_control: Duration,
    /// Whether the node is started at the end.
    pub start: bool,
    /// A node that is OPERATIONAL already is left as it is, and any other one reset first (1F81h bit 4). It tells
    /// its state within `error_control`, or is asked for it when that is zero.
    pub keep_alive: bool,
}

impl<'a> BootPlan<'a> {
    /// The plan that the dictionary of the manager has for a node: 1F84h to 1F88h, 1F26h and 1F27h, each
    /// with the node-ID as its sub-index, where 0 means "whatever it is"; 1F80h bit 3, which leaves starting
    /// the node to the application; and 1F81h bit 4. `configuration` is what 1F22h holds for the node.
    #[must_use]
    pub fn load(node: NodeId, configuration: &'a [u8], od: &mut dyn ObjectDictionary) -> Self {
        let mut expected = |index| objects::read_u32(od, index, node.get()).filter(|&value| value != 0);
        let configured = expected(0x1F26).zip(expected(0x1F27));
        BootPlan {
            device_type: expected(0x1F84),
            vendor: expected(0x1F85),
            product: expected(0x1F86),
            revision: expected(0x1F87),
            serial: expected(0x1F88),
            configured,
            configuration,
            error_control: Duration::ZERO,
            start: objects::read_u32(od, 0x1F80, 0).unwrap_or(0) & START_BY_APPLICATION == 0,
            keep_alive: objects::read_u32(od, 0x1F81, node.get()).unwrap_or(0) & KEEP_ALIVE != 0,
        }
    }
}

/// 1F80h: the application starts the nodes.
const START_BY_APPLICATION: u32 = 1 << 3;
/// 1F81h: the node is not reset while it is OPERATIONAL.
const KEEP_ALIVE: u32 = 1 << 4;

/// Boots one node.
#[derive(Clone, Debug)]
pub struct BootNode<'a> {
    plan: BootPlan<'a>,
    client: SdoClient,
    runner: Runner<'a, Steps<'a>>,
    stage: Stage,
    /// A heartbeat or guarding answer was heard.
    alive: bool,
    /// The node is to be asked for its state.
    asks: bool,
}

/// Why a node does not boot. The letters are those of CiA 302-2, table 4.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BootError {
    /// B: no answer about the device type.
    #[error("the node does not tell its device type: {0}")]
    NoDeviceType(SdoError),
    /// C: another device type.
    #[error("the device type is {got:08X}h")]
    DeviceType {
        /// 1000h of the node.
        got: u32,
    },
    /// D, M, N, O: another identity.
    #[error("the {part:?} in the identity is {got:08X}h")]
    Identity {
        /// Which number of it.
        part: Part,
        /// What the node has.
        got: u32,
    },
    /// D, M, N, O: the identity cannot be read.
    #[error("the node does not tell its identity: {0}")]
    NoIdentity(SdoError),
    /// J: the configuration failed.
    #[error("entry {entry} of the configuration failed: {error}")]
    Configuration {
        /// Counted from 1.
        entry: usize,
        /// Why.
        error: SdoError,
    },
    /// J: the configuration itself is cut off.
    #[error(transparent)]
    BadConfiguration(#[from] ConciseDcfError),
    /// K: error control did not start.
    #[error("no heartbeat or guarding answer within {0}")]
    NoErrorControl(Duration),
    /// It was reset, since it was not OPERATIONAL, and does not boot.
    #[error("no boot-up message within {0} after a reset")]
    NoBootUp(Duration),
}

impl BootError {
    /// Whether the node did not answer in time. It may do so when it is asked again.
    #[must_use]
    pub const fn is_time_out(&self) -> bool {
        matches!(
            self,
            BootError::NoDeviceType(SdoError::TimedOut { .. })
                | BootError::NoIdentity(SdoError::TimedOut { .. })
                | BootError::Configuration { error: SdoError::TimedOut { .. }, .. }
        )
    }
}

/// What became of the node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BootEvent {
    /// It is what it shall be, and was started if it was to be.
    Booted,
    /// It is not; it was not started.
    Failed(BootError),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Identify,
    CheckState { until: Instant },
    Reset,
    CheckConfiguration,
    Configure,
    AwaitErrorControl { until: Instant },
    Start,
    Over,
}

/// The steps of a stage.
#[derive(Clone, Debug)]
enum Steps<'a> {
    Identify { expected: [(Address, Option<u32>); 5], at: usize },
    CheckConfiguration { expected: [(Address, u32); 2], at: usize },
    Configure(ConciseDcf<'a>),
    Reset { at: u8 },
    Start { begun: bool },
}

/// How long a node may take to tell its state when it is asked for it.
const STATE_TIMEOUT: Duration = Duration::from_millis(500);
/// How long a node may take to boot.
const BOOT_UP_TIMEOUT: Duration = Duration::from_secs(10);

const DEVICE_TYPE: Address = Address::new(0x1000, 0);

impl<'a> Steps<'a> {
    fn identify(plan: &BootPlan<'a>) -> Self {
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

impl<'a> Iterator for Steps<'a> {
    type Item = Step<'a>;

    fn next(&mut self) -> Option<Step<'a>> {
        match self {
            Steps::Identify { expected, at } => loop {
                let &(address, value) = expected.get(*at)?;
                *at += 1;
                match value {
                    Some(value) => return Some(Step::expect(address, value.into())),
                    // The device type is read in any case: it tells whether the node is there.
                    None if address == DEVICE_TYPE => return Some(Step::Expect { address, mask: 0, value: 0 }),
                    None => {}
                }
            },
            Steps::CheckConfiguration { expected, at } => {
                let &(address, value) = expected.get(*at)?;
                *at += 1;
                Some(Step::expect(address, value.into()))
            }
            Steps::Configure(entries) => entries.next(),
            Steps::Reset { at } => {
                *at += 1;
                match *at {
                    1 => Some(Step::Nmt(NmtCommand::ResetCommunication)),
                    2 => Some(Step::AwaitBootUp { timeout: BOOT_UP_TIMEOUT }),
                    _ => None,
                }
            }
            Steps::Start { begun } => (!core::mem::replace(begun, true)).then_some(Step::Nmt(NmtCommand::Start)),
        }
    }
}

impl<'a> BootNode<'a> {
    /// Boots `node` through `client`.
    #[must_use]
    pub fn new(node: NodeId, client: SdoClient, plan: BootPlan<'a>) -> Self {
        let runner = Runner::new(node, client.clone(), Steps::identify(&plan));
        BootNode { plan, client, runner, stage: Stage::Identify, alive: false, asks: false }
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
    pub const fn plan(&self) -> &BootPlan<'a> {
        &self.plan
    }

    /// Whether it has reset the node, and the boot-up message that follows is no news.
    #[must_use]
    pub const fn resets(&self) -> bool {
        matches!(self.stage, Stage::Reset)
    }

    /// Takes a frame.
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<BootEvent> {
        let is_error_control = frame.id() == ErrorControl::cob_id(self.node()) && !frame.is_remote();
        if is_error_control && !self.resets() {
            let message = ErrorControl::parse(frame.data())?;
            self.alive |= message.state != NmtState::Initialising;
            if let Stage::CheckState { .. } = self.stage {
                return self.check_state(message.state);
            }
            let awaited = self.alive && matches!(self.stage, Stage::AwaitErrorControl { .. });
            return if awaited { self.start() } else { None };
        }
        let event = self.runner.handle_frame(now, frame)?;
        self.handle_end(now, event)
    }

    /// Does what is due.
    pub fn handle_timeout(&mut self, now: Instant) -> Option<BootEvent> {
        match self.stage {
            Stage::Over => None,
            Stage::AwaitErrorControl { until } if until <= now => {
                self.fail(BootError::NoErrorControl(self.plan.error_control))
            }
            Stage::CheckState { until } if until <= now => self.reset(),
            Stage::AwaitErrorControl { .. } | Stage::CheckState { .. } => None,
            _ => {
                let event = self.runner.handle_timeout(now)?;
                self.handle_end(now, event)
            }
        }
    }

    /// The next frame to send.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        if core::mem::take(&mut self.asks) {
            return Some(ErrorControl::request(self.node()));
        }
        self.runner.poll_transmit(now)
    }

    /// When to call [`BootNode::handle_timeout`].
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        match self.stage {
            Stage::Over => None,
            Stage::AwaitErrorControl { until } | Stage::CheckState { until } => Some(until),
            _ => self.runner.poll_timeout(),
        }
    }

    fn run(&mut self, stage: Stage, steps: Steps<'a>) -> Option<BootEvent> {
        self.stage = stage;
        self.runner = Runner::new(self.node(), self.client.clone(), steps);
        None
    }

    fn handle_end(&mut self, now: Instant, event: runner::Event<'a>) -> Option<BootEvent> {
        match (self.stage, event) {
            (Stage::Identify, runner::Event::Finished { .. }) if self.plan.keep_alive => self.await_state(now),
            (Stage::Identify | Stage::Reset, runner::Event::Finished { .. }) => self.check_configuration(),
            (Stage::CheckConfiguration, runner::Event::Finished { .. }) => self.await_error_control(now),
            // Another configuration, or none that it could tell: it gets ours.
            (Stage::CheckConfiguration, runner::Event::Failed(_)) => self.configure(),
            (Stage::Configure, runner::Event::Finished { .. }) => self.await_error_control(now),
            (Stage::Start, runner::Event::Finished { .. }) => self.end(BootEvent::Booted),
            (stage, runner::Event::Failed(failure)) => self.fail(boot_error(stage, failure)?),
            _ => None,
        }
    }

    fn await_state(&mut self, now: Instant) -> Option<BootEvent> {
        self.asks = self.plan.error_control.is_zero();
        let patience = if self.asks { STATE_TIMEOUT } else { self.plan.error_control };
        self.stage = Stage::CheckState { until: now + patience };
        None
    }

    fn check_state(&mut self, state: NmtState) -> Option<BootEvent> {
        if state == NmtState::Operational { self.end(BootEvent::Booted) } else { self.reset() }
    }

    /// From here on, it has told nothing.
    fn reset(&mut self) -> Option<BootEvent> {
        self.alive = false;
        self.asks = false;
        self.run(Stage::Reset, Steps::Reset { at: 0 })
    }

    fn check_configuration(&mut self) -> Option<BootEvent> {
        let Some((date, time)) = self.plan.configured else { return self.configure() };
        let expected = [(Address::new(0x1020, 1), date), (Address::new(0x1020, 2), time)];
        self.run(Stage::CheckConfiguration, Steps::CheckConfiguration { expected, at: 0 })
    }

    fn configure(&mut self) -> Option<BootEvent> {
        let dcf = ConciseDcf::new(self.plan.configuration);
        match dcf.check() {
            Ok(()) => self.run(Stage::Configure, Steps::Configure(dcf)),
            Err(error) => self.fail(error.into()),
        }
    }

    fn await_error_control(&mut self, now: Instant) -> Option<BootEvent> {
        if self.plan.error_control.is_zero() || self.alive {
            return self.start();
        }
        self.stage = Stage::AwaitErrorControl { until: now + self.plan.error_control };
        None
    }

    fn start(&mut self) -> Option<BootEvent> {
        if !self.plan.start {
            return self.end(BootEvent::Booted);
        }
        self.run(Stage::Start, Steps::Start { begun: false })
    }

    fn fail(&mut self, error: BootError) -> Option<BootEvent> {
        self.end(BootEvent::Failed(error))
    }

    fn end(&mut self, event: BootEvent) -> Option<BootEvent> {
        self.stage = Stage::Over;
        Some(event)
    }
}

fn boot_error(stage: Stage, failure: runner::Failure<'_>) -> Option<BootError> {
    match (stage, failure.error) {
        (Stage::Reset, StepError::TimedOut { within }) => Some(BootError::NoBootUp(within)),
        (Stage::Configure, StepError::Sdo(error)) => Some(BootError::Configuration { entry: failure.number, error }),
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
