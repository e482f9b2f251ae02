//! An LSS manager on a link: selects and configures devices.

use lexican_runtime::host::{Link, Pump, StateMachine};
use lexican_runtime::object::Address;
use lexican_runtime::service::lss_manager::{Busy, Event, LssError, LssManager};
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::lss::{self, Identity, LssRequest, LssResponse, LssState, Part};
use lexican_runtime::wire::nmt::{NmtCommand, NmtMessage, NmtState};
use lexican_runtime::wire::sdo::ClientRequest;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId, cia301};

use super::trouble::{Times, Trouble};
use crate::bus::sdo_channel::{request_frame, response_id};
use crate::decode::lss::refuses;

/// How much later a second device may respond.
const GRACE: Duration = Duration::from_millis(50);

/// How long a device may take to store its configuration.
const STORING: Duration = Duration::from_secs(3);

/// How long a device may take to boot.
const BOOTING: Duration = Duration::from_secs(2);

/// How long the last request may take to leave the buffers.
const LEAVING: Duration = Duration::from_millis(20);

/// Which device is meant.
#[derive(Clone, Copy, Debug)]
pub enum Target {
    /// The only one on the bus.
    Only,
    /// The one with it.
    Identity(Identity),
    /// Any without node-ID.
    Unconfigured,
}

/// The device in the state CONFIGURATION.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Selected {
    /// By which it is selected.
    pub identity: Identity,
    /// Its node-ID, if it has one.
    pub node: Option<NodeId>,
}

/// Whether a device has carried out a command; if not, its response.
pub type Done = Result<(), LssResponse>;

/// A conversation with the devices that have LSS.
pub struct Session<L> {
    pub(super) link: L,
    pump: Pump,
    pub(super) times: Times,
    /// All devices are selected, so that all of them respond.
    selects_all: bool,
    /// The devices answer requests for devices without node-ID, which shows that all requests before were answered.
    pub(super) is_fenced: bool,
    /// The devices may have another bit rate than the link.
    is_over: bool,
    on_step: Box<dyn FnMut(u64)>,
}

impl<L: Link> Session<L> {
    /// Runs `work`; no device is selected before and after it.
    pub fn run<T, E: From<Trouble>>(
        link: L,
        times: Times,
        work: impl FnOnce(&mut Session<L>) -> Result<T, E>,
    ) -> Result<T, E> {
        let (pump, on_step) = (Pump::new(), Box::new(|_| {}));
        let mut session = Session { link, pump, times, selects_all: false, is_fenced: false, is_over: false, on_step };
        session.listen_to(&[lss::RESPONSE])?;
        session.deselect()?;
        let outcome = work(&mut session);
        let left = if session.is_over { Ok(()) } else { session.deselect() };
        let outcome = outcome?;
        left?;
        session.wait_for(session.link.now() + LEAVING, |_| false)?;
        // Whoever lent the link hears all again.
        session.listen_to(&[])?;
        Ok(outcome)
    }

    /// Calls this with the number of each step of a search, of which there are [`SCAN_STEPS`](super::SCAN_STEPS), and with 0 at
    /// its end.
    pub fn on_step(&mut self, on_step: impl FnMut(u64) + 'static) {
        self.on_step = Box::new(on_step);
    }

    /// Whether there is a device without node-ID, by the service that precedes fastscan.
    pub fn has_unconfigured(&mut self) -> Result<bool, Trouble> {
        let event = self.operate(self.times.response, LssManager::identify_unconfigured)?;
        Ok(event == Event::UnconfiguredExists)
    }

    /// Selects one device.
    pub fn select(&mut self, target: Target) -> Result<Selected, Trouble> {
        let identity = match target {
            Target::Only => {
                self.switch_all(LssState::Configuration)?;
                self.identity()?
            }
            Target::Identity(identity) => match self.ask(self.times.response, |lss| lss.select(identity))? {
                Event::Selected => identity,
                Event::Failed(LssError::NoAnswer) => return Err(Trouble::NoSuchDevice),
                other => return Err(Trouble::Unexpected(other)),
            },
            Target::Unconfigured => {
                return match self.fastscan()? {
                    Some(identity) => Ok(Selected { identity, node: None }),
                    None if self.has_unconfigured()? => Err(Trouble::NoFastscan),
                    None => Err(Trouble::NoUnconfigured),
                };
            }
        };
        match self.ask(self.times.response, LssManager::inquire_node)? {
            Event::InquiredNode(node) => Ok(Selected { identity, node }),
            Event::Failed(LssError::NoAnswer) => Err(Trouble::NoNodeId),
            other => Err(Trouble::Unexpected(other)),
        }
    }

    /// Selects all devices; what is ordered then is for all of them.
    pub fn select_all(&mut self) -> Result<(), Trouble> {
        self.selects_all = true;
        self.switch_all(LssState::Configuration)
    }

    /// The identity of the only selected device.
    fn identity(&mut self) -> Result<Identity, Trouble> {
        Part::ALL.into_iter().try_fold(Identity::default(), |identity, part| {
            match self.ask(self.times.response, |lss| lss.inquire(part))? {
                Event::Inquired(part, value) => Ok(identity.with(part, value)),
                Event::Failed(LssError::NoAnswer) => Err(Trouble::NoDevice),
                other => Err(Trouble::Unexpected(other)),
            }
        })
    }

    /// Whether another node has this node-ID: it responds to an upload of its device type.
    pub fn is_taken(&mut self, node: NodeId) -> Result<bool, Trouble> {
        let request = ClientRequest::InitiateUpload { address: Address::new(cia301::DEVICE_TYPE, 0) };
        self.listen_to(&[response_id(node)])?;
        self.send(&request_frame(node, request))?;
        let until = self.link.now() + self.times.response;
        let taken = self.wait_for(until, |frame| frame.id() == response_id(node))?;
        self.listen_to(&[lss::RESPONSE])?;
        Ok(taken)
    }

    /// Gives the selected device a node-ID, or removes it.
    pub fn configure_node(&mut self, node: Option<NodeId>) -> Result<Done, Trouble> {
        let refusal = |error, specific| LssResponse::ConfigureNode { error, specific };
        self.command(self.times.response, refusal, |lss| lss.configure_node(node))
    }

    /// Gives the device with an identity a node-ID, which it stores with `store`; `None` if there is no such device.
    ///
    /// Errors: also [`Trouble::Refused`].
    pub fn name(&mut self, identity: Identity, node: NodeId, store: bool) -> Result<Option<Selected>, Trouble> {
        match self.give(Target::Identity(identity), node, store) {
            Err(Trouble::NoSuchDevice) => Ok(None),
            given => given.map(Some),
        }
    }

    /// Gives one device a node-ID, which it stores with `store`: what was selected.
    ///
    /// Errors: also [`Trouble::Refused`].
    pub fn give(&mut self, target: Target, node: NodeId, store: bool) -> Result<Selected, Trouble> {
        let selected = self.select(target)?;
        let is_given = self.configure_node(Some(node))?.is_ok() && (!store || self.store()?.is_ok());
        if is_given { Ok(selected) } else { Err(Trouble::Refused(node)) }
    }

    /// Gives the selected devices a bit rate: an entry of the table of CiA 305.
    pub fn configure_bit_rate(&mut self, entry: u8) -> Result<Done, Trouble> {
        let refusal = |error, specific| LssResponse::ConfigureBitTiming { error, specific };
        self.command(self.times.response, refusal, |lss| lss.configure_bit_timing(0, entry))
    }

    /// Lets the selected devices store node-ID and bit rate.
    pub fn store(&mut self) -> Result<Done, Trouble> {
        let refusal = |error, specific| LssResponse::Store { error, specific };
        self.command(self.times.response.max(STORING), refusal, LssManager::store)
    }

    /// Lets the selected devices change their bit rate, and waits until they have.
    pub fn activate(&mut self, delay_ms: u16) -> Result<(), Trouble> {
        self.is_over = true;
        self.begin(|lss| lss.activate_bit_timing(delay_ms))?;
        let delay = Duration::from_millis(delay_ms.into());
        self.wait_for(self.link.now() + delay.times(2), |_| false).map(drop)
    }

    /// Lets a device without node-ID take its new one; returns whether it boots with it.
    pub fn boot(&mut self, node: NodeId) -> Result<bool, Trouble> {
        self.listen_to(&[ErrorControl::cob_id(node)])?;
        self.deselect()?;
        let boot_up = ErrorControl::heartbeat(NmtState::Initialising).frame(node);
        self.wait_for(self.link.now() + BOOTING, |frame| *frame == boot_up)
    }

    /// Lets a device that has a node-ID take its new one, by a reset of its communication (CiA 305); returns whether it
    /// boots with it.
    pub fn activate_node(&mut self, old: NodeId, new: Option<NodeId>) -> Result<bool, Trouble> {
        self.listen_to(&new.map(ErrorControl::cob_id).into_iter().collect::<Vec<_>>())?;
        self.deselect()?;
        self.send(&NmtMessage { command: NmtCommand::ResetCommunication, node: Some(old) }.frame())?;
        let boot_up = new.map(|new| ErrorControl::heartbeat(NmtState::Initialising).frame(new));
        self.wait_for(self.link.now() + BOOTING, |frame| Some(*frame) == boot_up)
    }

    /// Lets a device take its node-ID; returns whether it has booted with it.
    pub fn take(&mut self, old: Option<NodeId>, new: Option<NodeId>, activate: bool) -> Result<bool, Trouble> {
        match (old, new) {
            // Some wait for a reset, which they hear at the node-ID that they have got.
            (None, Some(node)) => Ok(self.boot(node)? || activate && self.activate_node(node, new)?),
            (Some(old), new) if activate && new != Some(old) => self.activate_node(old, new),
            _ => Ok(false),
        }
    }

    pub(super) fn deselect(&mut self) -> Result<(), Trouble> {
        self.switch_all(LssState::Waiting)
    }

    fn switch_all(&mut self, state: LssState) -> Result<(), Trouble> {
        self.begin(|lss| lss.switch_global(state))
    }

    /// Sends a request without response.
    fn begin(&mut self, begin: impl FnOnce(&mut LssManager) -> Result<(), Busy>) -> Result<(), Trouble> {
        let mut manager = self.manager(self.times.response, begin);
        while let Some(frame) = manager.poll_transmit(self.link.now()) {
            self.send(&frame)?;
        }
        Ok(())
    }

    /// Sends a request that is carried out or refused. Of several devices, one that refuses counts.
    fn command(
        &mut self,
        patience: Duration,
        refusal: fn(u8, u8) -> LssResponse,
        begin: impl FnOnce(&mut LssManager) -> Result<(), Busy>,
    ) -> Result<Done, Trouble> {
        let until = self.link.now() + patience;
        match self.ask(patience, begin)? {
            Event::Done if self.selects_all => {
                let mut refused = None;
                self.wait_for(until, |frame| {
                    refused = response(frame).filter(|response| refuses(*response));
                    refused.is_some()
                })?;
                Ok(refused.map_or(Ok(()), Err))
            }
            Event::Done => Ok(Ok(())),
            Event::Failed(LssError::Refused { error, specific }) => Ok(Err(refusal(error, specific))),
            Event::Failed(LssError::NoAnswer) => Err(Trouble::NoDevice),
            other => Err(Trouble::Unexpected(other)),
        }
    }

    /// Sends a request to which only the selected device responds.
    fn ask(
        &mut self,
        patience: Duration,
        begin: impl FnOnce(&mut LssManager) -> Result<(), Busy>,
    ) -> Result<Event, Trouble> {
        let event = self.operate(patience, begin)?;
        let until = self.link.now() + GRACE;
        let answered = event != Event::Failed(LssError::NoAnswer);
        if answered && !self.selects_all && self.wait_for(until, |frame| response(frame).is_some())? {
            return Err(Trouble::Several);
        }
        Ok(event)
    }

    /// Runs an operation to its end.
    pub(super) fn operate(
        &mut self,
        patience: Duration,
        begin: impl FnOnce(&mut LssManager) -> Result<(), Busy>,
    ) -> Result<Event, Trouble> {
        let manager = self.manager(patience, begin);
        let mut operation = Operation { manager, steps: 0, on_step: &mut self.on_step };
        let event = self.pump.run(&mut self.link, &mut operation, Instant::MAX);
        if operation.steps > 0 {
            (self.on_step)(0);
        }
        let event = event?;
        Ok(event.expect("each step of an operation has a deadline"))
    }

    fn manager(&self, patience: Duration, begin: impl FnOnce(&mut LssManager) -> Result<(), Busy>) -> LssManager {
        let mut manager = LssManager::new().with_timeouts(patience, self.times.step);
        begin(&mut manager).expect("a new manager is idle");
        manager
    }

    /// Whether a wanted frame arrives before `until`.
    pub(super) fn wait_for(&mut self, until: Instant, mut wanted: impl FnMut(&Frame) -> bool) -> Result<bool, Trouble> {
        while let Some(frame) = self.pump.receive_frame(&mut self.link, until)? {
            if wanted(&frame) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    pub(super) fn send(&mut self, frame: &Frame) -> Result<(), Trouble> {
        Ok(self.link.send(frame)?)
    }

    /// Filters the frames by their identifiers.
    fn listen_to(&mut self, ids: &[CobId]) -> Result<(), Trouble> {
        Ok(self.link.listen_to(ids)?)
    }
}

/// An operation whose steps are counted.
struct Operation<'a> {
    manager: LssManager,
    steps: u64,
    on_step: &'a mut dyn FnMut(u64),
}

impl StateMachine for Operation<'_> {
    type Event = Event;

    fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<Event> {
        self.manager.handle_frame(now, frame)
    }
    fn handle_timeout(&mut self, now: Instant) -> Option<Event> {
        self.manager.handle_timeout(now)
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        let request = self.manager.poll_transmit(now)?;
        if matches!(LssRequest::parse(request.data()), Some(LssRequest::Fastscan { .. })) {
            self.steps += 1;
            (self.on_step)(self.steps);
        }
        Some(request)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.manager.poll_timeout()
    }
}

pub(super) fn response(frame: &Frame) -> Option<LssResponse> {
    LssResponse::parse(frame.data()).filter(|_| frame.id() == lss::RESPONSE && !frame.is_remote())
}
