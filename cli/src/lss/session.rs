//! An LSS manager on a link: selects and configures devices, and advises the user if they do not respond.

use indicatif::ProgressBar;
use lexican_runtime::host::{Link, Pump, StateMachine};
use lexican_runtime::object::Address;
use lexican_runtime::service::lss_manager::{Busy, Event, LssError, LssManager};
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::lss::{self, Identity, LssRequest, LssResponse, LssState, Part};
use lexican_runtime::wire::nmt::{NmtCommand, NmtMessage, NmtState};
use lexican_runtime::wire::sdo::ClientRequest;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId, cia301};

use crate::bus::let_leave;
use crate::bus::sdo::{request_frame, response_id};
use crate::output::Failure;
use lexican_toolbox::decode::lss::refuses;

/// How much later a second device may respond.
const GRACE: Duration = Duration::from_millis(50);

/// How long a device may take to store its configuration.
const STORING: Duration = Duration::from_secs(3);

/// How long a device may take to boot.
const BOOTING: Duration = Duration::from_secs(2);

/// How long to wait for responses.
#[derive(Clone, Copy, Debug)]
pub(super) struct Times {
    pub(super) response: Duration,
    /// In each step of a fastscan.
    pub(super) step: Duration,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Target {
    /// The only one on the bus.
    Only,
    Identity(Identity),
    /// Any without node-ID.
    Unconfigured,
}

/// The device in the state CONFIGURATION.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Selected {
    pub(super) identity: Identity,
    /// Its node-ID, if it has one.
    pub(super) node: Option<NodeId>,
}

/// Whether a device has carried out a command; if not, its response.
pub(super) type Done = Result<(), LssResponse>;

pub(super) struct Session<L> {
    pub(super) link: L,
    pump: Pump,
    pub(super) times: Times,
    /// All devices are selected, so that all of them respond.
    selects_all: bool,
    /// The devices answer requests for devices without node-ID, which shows that all requests before were answered.
    pub(super) is_fenced: bool,
    /// The devices may have another bit rate than the link.
    is_over: bool,
}

impl<L: Link> Session<L> {
    /// Runs `work`; no device is selected before and after it.
    pub(super) fn run<T>(
        link: L,
        times: Times,
        work: impl FnOnce(&mut Session<L>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let mut session =
            Session { link, pump: Pump::new(), times, selects_all: false, is_fenced: false, is_over: false };
        session.listen_to(&[lss::RESPONSE])?;
        session.deselect()?;
        let outcome = work(&mut session);
        let left = if session.is_over { Ok(()) } else { session.deselect() };
        let outcome = outcome?;
        left?;
        let_leave(&mut session.link)?;
        Ok(outcome)
    }

    /// Whether there is a device without node-ID, by the service that precedes fastscan.
    pub(super) fn has_unconfigured(&mut self) -> Result<bool, Failure> {
        let event = self.operate(self.times.response, &ProgressBar::hidden(), LssManager::identify_unconfigured)?;
        Ok(event == Event::UnconfiguredExists)
    }

    pub(super) fn select(&mut self, target: Target) -> Result<Selected, Failure> {
        let identity = match target {
            Target::Only => {
                self.switch_all(LssState::Configuration)?;
                self.identity()?
            }
            Target::Identity(identity) => match self.ask(self.times.response, |lss| lss.select(identity))? {
                Event::Selected => identity,
                Event::Failed(LssError::NoAnswer) => {
                    return Err(Failure::new("no device with this identity answers").help(
                        "is it on this bus, with power and at this bit rate? All four numbers must be those of \
                         1018h; some older devices answer only while they are stopped: `lexican nmt stop --all`",
                    ));
                }
                other => return Err(unexpected(other)),
            },
            Target::Unconfigured => {
                let found = self.fastscan()?;
                return match found {
                    Some(identity) => Ok(Selected { identity, node: None }),
                    None if self.has_unconfigured()? => Err(no_fastscan()),
                    None => Err(Failure::new("no device without node-ID answers")
                        .help("`lexican scan` shows those that have one; is it on this bus, and at this bit rate?")),
                };
            }
        };
        match self.ask(self.times.response, LssManager::inquire_node)? {
            Event::InquiredNode(node) => Ok(Selected { identity, node }),
            Event::Failed(LssError::NoAnswer) => Err(Failure::new("the device does not report its node-ID")
                .help("a response may have been lost: try again, or give it more time with --timeout")),
            other => Err(unexpected(other)),
        }
    }

    pub(super) fn select_all(&mut self) -> Result<(), Failure> {
        self.selects_all = true;
        self.switch_all(LssState::Configuration)
    }

    /// The identity of the only selected device.
    fn identity(&mut self) -> Result<Identity, Failure> {
        Part::ALL.into_iter().try_fold(Identity::default(), |identity, part| {
            match self.ask(self.times.response, |lss| lss.inquire(part))? {
                Event::Inquired(part, value) => Ok(identity.with(part, value)),
                Event::Failed(LssError::NoAnswer) => Err(no_device()),
                other => Err(unexpected(other)),
            }
        })
    }

    /// Whether another node has this node-ID: it responds to an upload of its device type.
    pub(super) fn is_taken(&mut self, node: NodeId) -> Result<bool, Failure> {
        let request = ClientRequest::InitiateUpload { address: Address::new(cia301::DEVICE_TYPE, 0) };
        self.listen_to(&[response_id(node)])?;
        self.send(&request_frame(node, request))?;
        let until = self.link.now() + self.times.response;
        let taken = self.wait_for(until, |frame| frame.id() == response_id(node))?;
        self.listen_to(&[lss::RESPONSE])?;
        Ok(taken)
    }

    /// Gives the selected device a node-ID, or removes it.
    pub(super) fn configure_node(&mut self, node: Option<NodeId>) -> Result<Done, Failure> {
        let refusal = |error, specific| LssResponse::ConfigureNode { error, specific };
        self.command(self.times.response, refusal, |lss| lss.configure_node(node))
    }

    /// Gives the selected devices a bit rate: an entry of the table of CiA 305.
    pub(super) fn configure_bit_rate(&mut self, entry: u8) -> Result<Done, Failure> {
        let refusal = |error, specific| LssResponse::ConfigureBitTiming { error, specific };
        self.command(self.times.response, refusal, |lss| lss.configure_bit_timing(0, entry))
    }

    /// Lets the selected devices store node-ID and bit rate.
    pub(super) fn store(&mut self) -> Result<Done, Failure> {
        let refusal = |error, specific| LssResponse::Store { error, specific };
        self.command(self.times.response.max(STORING), refusal, LssManager::store)
    }

    /// Lets the selected devices change their bit rate, and waits until they have.
    pub(super) fn activate(&mut self, delay_ms: u16) -> Result<(), Failure> {
        self.is_over = true;
        self.begin(|lss| lss.activate_bit_timing(delay_ms))?;
        let delay = Duration::from_millis(delay_ms.into());
        self.wait_for(self.link.now() + delay.times(2), |_| false).map(drop)
    }

    /// Lets a device without node-ID take its new one; returns whether it boots with it.
    pub(super) fn boot(&mut self, node: NodeId) -> Result<bool, Failure> {
        self.listen_to(&[ErrorControl::cob_id(node)])?;
        self.deselect()?;
        let boot_up = ErrorControl::heartbeat(NmtState::Initialising).frame(node);
        self.wait_for(self.link.now() + BOOTING, |frame| *frame == boot_up)
    }

    /// Lets a device that has a node-ID take its new one, by a reset of its communication (CiA 305); returns whether it
    /// boots with it.
    pub(super) fn activate_node(&mut self, old: NodeId, new: Option<NodeId>) -> Result<bool, Failure> {
        self.listen_to(&new.map(ErrorControl::cob_id).into_iter().collect::<Vec<_>>())?;
        self.deselect()?;
        self.send(&NmtMessage { command: NmtCommand::ResetCommunication, node: Some(old) }.frame())?;
        let boot_up = new.map(|new| ErrorControl::heartbeat(NmtState::Initialising).frame(new));
        self.wait_for(self.link.now() + BOOTING, |frame| Some(*frame) == boot_up)
    }

    pub(super) fn deselect(&mut self) -> Result<(), Failure> {
        self.switch_all(LssState::Waiting)
    }

    fn switch_all(&mut self, state: LssState) -> Result<(), Failure> {
        self.begin(|lss| lss.switch_global(state))
    }

    /// Sends a request without response.
    fn begin(&mut self, begin: impl FnOnce(&mut LssManager) -> Result<(), Busy>) -> Result<(), Failure> {
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
    ) -> Result<Done, Failure> {
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
            Event::Failed(LssError::NoAnswer) => Err(no_device()),
            other => Err(unexpected(other)),
        }
    }

    /// Sends a request to which only the selected device responds.
    fn ask(
        &mut self,
        patience: Duration,
        begin: impl FnOnce(&mut LssManager) -> Result<(), Busy>,
    ) -> Result<Event, Failure> {
        let event = self.operate(patience, &ProgressBar::hidden(), begin)?;
        let until = self.link.now() + GRACE;
        let answered = event != Event::Failed(LssError::NoAnswer);
        if answered && !self.selects_all && self.wait_for(until, |frame| response(frame).is_some())? {
            return Err(Failure::new("more than one device answers").help(
                "select one by --vendor, --product, --revision and --serial: `lexican lss find` shows them for devices \
                 without node-ID, `lexican scan` for the others",
            ));
        }
        Ok(event)
    }

    /// Runs an operation to its end.
    pub(super) fn operate(
        &mut self,
        patience: Duration,
        progress: &ProgressBar,
        begin: impl FnOnce(&mut LssManager) -> Result<(), Busy>,
    ) -> Result<Event, Failure> {
        let mut operation = Operation { manager: self.manager(patience, begin), progress };
        let event = self.pump.run(&mut self.link, &mut operation, Instant::MAX)?;
        Ok(event.expect("each step of an operation has a deadline"))
    }

    fn manager(&self, patience: Duration, begin: impl FnOnce(&mut LssManager) -> Result<(), Busy>) -> LssManager {
        let mut manager = LssManager::new().with_timeouts(patience, self.times.step);
        begin(&mut manager).expect("a new manager is idle");
        manager
    }

    /// Whether a wanted frame arrives before `until`.
    pub(super) fn wait_for(&mut self, until: Instant, mut wanted: impl FnMut(&Frame) -> bool) -> Result<bool, Failure> {
        while let Some(frame) = self.pump.receive_frame(&mut self.link, until)? {
            if wanted(&frame) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    pub(super) fn send(&mut self, frame: &Frame) -> Result<(), Failure> {
        Ok(self.link.send(frame)?)
    }

    /// Filters the frames by their identifiers.
    fn listen_to(&mut self, ids: &[CobId]) -> Result<(), Failure> {
        Ok(self.link.listen_to(ids)?)
    }
}

/// An operation that shows its progress.
struct Operation<'a> {
    manager: LssManager,
    progress: &'a ProgressBar,
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
        let is_step = matches!(LssRequest::parse(request.data()), Some(LssRequest::Fastscan { .. }));
        self.progress.inc(u64::from(is_step));
        Some(request)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.manager.poll_timeout()
    }
}

pub(super) fn response(frame: &Frame) -> Option<LssResponse> {
    LssResponse::parse(frame.data()).filter(|_| frame.id() == lss::RESPONSE && !frame.is_remote())
}

fn no_device() -> Failure {
    Failure::new("no device answers to LSS").help(
        "is one with LSS on this bus, with power and at this bit rate? Some older devices answer only while they are \
         stopped: `lexican nmt stop --all`",
    )
}

/// There is a device without node-ID that does not support the search.
pub(super) fn no_fastscan() -> Failure {
    Failure::new("there is a device without node-ID, but it cannot be searched for: it has no LSS fastscan")
        .help("select it by --vendor, --product, --revision and --serial, or leave it alone on the bus")
}

pub(super) fn unexpected(event: Event) -> Failure {
    Failure::new(format_args!("an LSS operation ended unexpectedly: {event:?}"))
}
