//! An LSS manager on a link, which selects and configures devices.

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

/// The time that further devices get to respond after the first.
const GRACE: Duration = Duration::from_millis(50);

/// The time that a device may take to store its configuration.
const STORING: Duration = Duration::from_secs(3);

/// How long a device may take to boot.
const BOOTING: Duration = Duration::from_secs(2);

/// The time that the last request may take to leave the transmit buffers.
const LEAVING: Duration = Duration::from_millis(20);

/// The device to select.
#[derive(Clone, Copy, Debug)]
pub enum Target {
    /// The only device on the bus with LSS.
    Only,
    /// The device with this identity.
    Identity(Identity),
    /// Any device without node-ID.
    Unconfigured,
}

/// The selected device, in the state CONFIGURATION.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Selected {
    /// By which it is selected.
    pub identity: Identity,
    /// `None` if it has none.
    pub node: Option<NodeId>,
}

/// `Ok` if the devices have carried out a command, else the response of one that refuses.
pub type Done = Result<(), LssResponse>;

/// An LSS session: a conversation with all devices that have LSS.
pub struct Session<L> {
    pub(super) link: L,
    pump: Pump,
    pub(super) times: Times,
    /// Whether all devices are selected, so that each of them responds.
    selects_all: bool,
    /// Whether devices respond to the request for devices without node-ID. As they respond in order, that response
    /// shows that all earlier requests were handled.
    pub(super) is_fenced: bool,
    /// Whether the devices may have another bit rate than the link by now.
    is_over: bool,
    on_step: Box<dyn FnMut(u64)>,
}

impl<L: Link> Session<L> {
    /// Runs `work`. Before and after it, all devices are in the state WAITING.
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
        // Remove the filter, so that the owner of the link receives all frames.
        session.listen_to(&[])?;
        Ok(outcome)
    }

    /// Sets a callback for the steps of a search: it gets the number of each of the [`SCAN_STEPS`](super::SCAN_STEPS),
    /// and 0 at the end.
    pub fn on_step(&mut self, on_step: impl FnMut(u64) + 'static) {
        self.on_step = Box::new(on_step);
    }

    /// Whether there is a device without node-ID, by the service that has to precede fastscan.
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

    /// Selects all devices; the following requests apply to each of them.
    pub fn select_all(&mut self) -> Result<(), Trouble> {
        self.selects_all = true;
        self.switch_all(LssState::Configuration)
    }

    /// The identity of the selected device, which must be the only one.
    fn identity(&mut self) -> Result<Identity, Trouble> {
        Part::ALL.into_iter().try_fold(Identity::default(), |identity, part| {
            match self.ask(self.times.response, |lss| lss.inquire(part))? {
                Event::Inquired(part, value) => Ok(identity.with(part, value)),
                Event::Failed(LssError::NoAnswer) => Err(Trouble::NoDevice),
                other => Err(Trouble::Unexpected(other)),
            }
        })
    }

    /// Whether another node uses this node-ID: it responds to an upload of 1000h.
    pub fn is_taken(&mut self, node: NodeId) -> Result<bool, Trouble> {
        let request = ClientRequest::InitiateUpload { address: Address::new(cia301::DEVICE_TYPE, 0) };
        self.listen_to(&[response_id(node)])?;
        self.send(&request_frame(node, request))?;
        let until = self.link.now() + self.times.response;
        let taken = self.wait_for(until, |frame| frame.id() == response_id(node))?;
        self.listen_to(&[lss::RESPONSE])?;
        Ok(taken)
    }

    /// Gives the selected device a node-ID, or takes it away.
    pub fn configure_node(&mut self, node: Option<NodeId>) -> Result<Done, Trouble> {
        let refusal = |error, specific| LssResponse::ConfigureNode { error, specific };
        self.command(self.times.response, refusal, |lss| lss.configure_node(node))
    }

    /// Gives the device with this identity a node-ID, and has it stored if `store` is set; `None` if there is no such
    /// device. Errors: also [`Trouble::Refused`].
    pub fn name(&mut self, identity: Identity, node: NodeId, store: bool) -> Result<Option<Selected>, Trouble> {
        match self.give(Target::Identity(identity), node, store) {
            Err(Trouble::NoSuchDevice) => Ok(None),
            given => given.map(Some),
        }
    }

    /// Gives a device a node-ID, and has it stored if `store` is set; returns the device. Errors: also
    /// [`Trouble::Refused`].
    pub fn give(&mut self, target: Target, node: NodeId, store: bool) -> Result<Selected, Trouble> {
        let selected = self.select(target)?;
        let is_given = self.configure_node(Some(node))?.is_ok() && (!store || self.store()?.is_ok());
        if is_given { Ok(selected) } else { Err(Trouble::Refused(node)) }
    }

    /// Gives the selected devices a bit rate, as an entry of CiA 305's table.
    pub fn configure_bit_rate(&mut self, entry: u8) -> Result<Done, Trouble> {
        let refusal = |error, specific| LssResponse::ConfigureBitTiming { error, specific };
        self.command(self.times.response, refusal, |lss| lss.configure_bit_timing(0, entry))
    }

    /// Has the selected devices store node-ID and bit rate.
    pub fn store(&mut self) -> Result<Done, Trouble> {
        let refusal = |error, specific| LssResponse::Store { error, specific };
        self.command(self.times.response.max(STORING), refusal, LssManager::store)
    }

    /// Has the selected devices switch to their new bit rate, and waits until they have. `delay_ms` is the switch
    /// delay.
    pub fn activate(&mut self, delay_ms: u16) -> Result<(), Trouble> {
        self.is_over = true;
        self.begin(|lss| lss.activate_bit_timing(delay_ms))?;
        let delay = Duration::from_millis(delay_ms.into());
        self.wait_for(self.link.now() + delay.times(2), |_| false).map(drop)
    }

    /// Makes a device without node-ID use its new one; returns whether it boots with that.
    pub fn boot(&mut self, node: NodeId) -> Result<bool, Trouble> {
        self.listen_to(&[ErrorControl::cob_id(node)])?;
        self.deselect()?;
        let boot_up = ErrorControl::heartbeat(NmtState::Initialising).frame(node);
        self.wait_for(self.link.now() + BOOTING, |frame| *frame == boot_up)
    }

    /// Makes a device with a node-ID use its new one, by a reset of its communication (CiA 305); returns whether it
    /// boots with that.
    pub fn activate_node(&mut self, old: NodeId, new: Option<NodeId>) -> Result<bool, Trouble> {
        self.listen_to(&new.map(ErrorControl::cob_id).into_iter().collect::<Vec<_>>())?;
        self.deselect()?;
        self.send(&NmtMessage { command: NmtCommand::ResetCommunication, node: Some(old) }.frame())?;
        let boot_up = new.map(|new| ErrorControl::heartbeat(NmtState::Initialising).frame(new));
        self.wait_for(self.link.now() + BOOTING, |frame| Some(*frame) == boot_up)
    }

    /// Makes a device use its new node-ID; returns whether it has booted with that.
    pub fn take(&mut self, old: Option<NodeId>, new: Option<NodeId>, activate: bool) -> Result<bool, Trouble> {
        match (old, new) {
            // Some devices wait for a reset, which they receive at their new node-ID.
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

    /// Sends a request that has no response.
    fn begin(&mut self, begin: impl FnOnce(&mut LssManager) -> Result<(), Busy>) -> Result<(), Trouble> {
        let mut manager = self.manager(self.times.response, begin);
        while let Some(frame) = manager.poll_transmit(self.link.now()) {
            self.send(&frame)?;
        }
        Ok(())
    }

    /// Sends a request that is carried out or refused. If several devices respond, a refusal prevails.
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

    /// Has the link pass on only frames with these COB-IDs.
    fn listen_to(&mut self, ids: &[CobId]) -> Result<(), Trouble> {
        Ok(self.link.listen_to(ids)?)
    }
}

/// An LSS operation that reports its steps.
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
