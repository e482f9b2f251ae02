//! An LSS manager on a link: selects devices, asks them, and says what to do when they do not answer.

mod search;

use indicatif::ProgressBar;
use lexican_runtime::host::{Link, Pump, StateMachine};
use lexican_runtime::object::Address;
use lexican_runtime::service::lss_manager::{Busy, Event, LssError, LssManager};
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::lss::{self, Identity, LssResponse, LssState, Part};
use lexican_runtime::wire::nmt::{NmtCommand, NmtMessage, NmtState};
use lexican_runtime::wire::sdo::ClientRequest;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

use crate::bus::failure::link_failure;
use crate::bus::let_leave;
use crate::decode::lss::refuses;
use crate::output::Failure;

/// How much later than the first answer a second one may come, of another device.
const GRACE: Duration = Duration::from_millis(50);

/// How long a device may take to write what it stores into its memory.
const STORING: Duration = Duration::from_secs(3);

/// How long a device may take to boot.
const BOOTING: Duration = Duration::from_secs(2);

/// How long to wait for answers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Times {
    pub(super) answer: Duration,
    /// In each step of a fastscan.
    pub(super) step: Duration,
}

/// Which device is meant.
#[derive(Clone, Copy, Debug)]
pub(super) enum Whom {
    /// The only one on the bus.
    Only,
    Identity(Identity),
    /// Any that has no node-ID.
    Unconfigured,
}

/// The device that is in the state CONFIGURATION.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Selected {
    pub(super) identity: Identity,
    /// Its node-ID, if it has one.
    pub(super) node: Option<NodeId>,
}

/// Whether a device has done what it was told; if not, its answer.
pub(super) type Done = Result<(), LssResponse>;

/// Work with LSS on a bus.
pub(super) struct Session<L> {
    link: L,
    pump: Pump,
    times: Times,
    /// All devices were selected at once, so that all of them answer.
    everybody: bool,
    /// The devices may be at another bit rate than the link.
    is_over: bool,
}

impl<L: Link> Session<L> {
    /// Does some work, before and after which no device is selected.
    pub(super) fn run<T>(
        link: L,
        times: Times,
        work: impl FnOnce(&mut Session<L>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let mut session = Session { link, pump: Pump::new(), times, everybody: false, is_over: false };
        session.hear(&[lss::RESPONSE])?;
        session.deselect()?;
        let outcome = work(&mut session);
        let left = if session.is_over { Ok(()) } else { session.deselect() };
        let outcome = outcome?;
        left?;
        let_leave(&mut session.link)?;
        Ok(outcome)
    }

    /// Whether a device has no node-ID, as those tell that know no fastscan.
    pub(super) fn somebody_is_unconfigured(&mut self) -> Result<bool, Failure> {
        let event = self.operate(self.times.answer, &ProgressBar::hidden(), LssManager::identify_unconfigured)?;
        Ok(event == Event::UnconfiguredExists)
    }

    /// Selects a device.
    pub(super) fn select(&mut self, whom: Whom) -> Result<Selected, Failure> {
        let identity = match whom {
            Whom::Only => {
                self.switch_all(LssState::Configuration)?;
                self.identity()?
            }
            Whom::Identity(identity) => match self.ask(self.times.answer, |lss| lss.select(identity))? {
                Event::Selected => identity,
                Event::Failed(LssError::NoAnswer) => {
                    return Err(Failure::new("no device with this identity answers").help(
                        "is it on this bus, with power and at this bit rate? All four numbers must be those of \
                             1018h; some older devices answer while they are stopped only: `lexican nmt stop --all`",
                    ));
                }
                other => return Err(unexpected(other)),
            },
            Whom::Unconfigured => {
                let found = self.fastscan()?;
                return match found {
                    Some(identity) => Ok(Selected { identity, node: None }),
                    None if self.somebody_is_unconfigured()? => Err(no_fastscan()),
                    None => Err(Failure::new("no device without node-ID answers")
                        .help("`lexican scan` shows those that have one; is it on this bus, and at this bit rate?")),
                };
            }
        };
        match self.ask(self.times.answer, LssManager::inquire_node)? {
            Event::InquiredNode(node) => Ok(Selected { identity, node }),
            Event::Failed(LssError::NoAnswer) => Err(Failure::new("the device does not tell its node-ID")
                .help("an answer may have been lost: try it again, or give it more time with --wait")),
            other => Err(unexpected(other)),
        }
    }

    /// Selects all devices.
    pub(super) fn select_all(&mut self) -> Result<(), Failure> {
        self.everybody = true;
        self.switch_all(LssState::Configuration)
    }

    /// The identity of the only selected device.
    fn identity(&mut self) -> Result<Identity, Failure> {
        Part::ALL.into_iter().try_fold(Identity::default(), |identity, part| {
            match self.ask(self.times.answer, |lss| lss.inquire(part))? {
                Event::Inquired(part, value) => Ok(identity.with(part, value)),
                Event::Failed(LssError::NoAnswer) => Err(nobody()),
                other => Err(unexpected(other)),
            }
        })
    }

    /// Whether another node has this node-ID: it answers when it is asked for its device type.
    pub(super) fn is_taken(&mut self, node: NodeId) -> Result<bool, Failure> {
        let answer = CobId::of_node(0x580, node);
        let question = ClientRequest::InitiateUpload { address: Address::new(0x1000, 0) };
        self.hear(&[answer])?;
        self.send(&Frame::from_array(CobId::of_node(0x600, node), question.to_bytes()))?;
        let until = self.link.now() + self.times.answer;
        let taken = self.wait_for(until, |frame| frame.id() == answer)?;
        self.hear(&[lss::RESPONSE])?;
        Ok(taken)
    }

    /// Gives the selected device a node-ID, or takes it away.
    pub(super) fn configure_node(&mut self, node: Option<NodeId>) -> Result<Done, Failure> {
        let refusal = |error, specific| LssResponse::ConfigureNode { error, specific };
        self.tell(self.times.answer, refusal, |lss| lss.configure_node(node))
    }

    /// Gives a bit rate to whoever is selected: an entry of the table of CiA 305.
    pub(super) fn configure_bit_rate(&mut self, entry: u8) -> Result<Done, Failure> {
        let refusal = |error, specific| LssResponse::ConfigureBitTiming { error, specific };
        self.tell(self.times.answer, refusal, |lss| lss.configure_bit_timing(0, entry))
    }

    /// Lets whoever is selected store node-ID and bit rate.
    pub(super) fn store(&mut self) -> Result<Done, Failure> {
        let refusal = |error, specific| LssResponse::Store { error, specific };
        self.tell(self.times.answer.max(STORING), refusal, LssManager::store)
    }

    /// Lets whoever is selected change its bit rate, and waits until all have.
    pub(super) fn activate(&mut self, delay_ms: u16) -> Result<(), Failure> {
        self.is_over = true;
        self.begin(|lss| lss.activate_bit_timing(delay_ms))?;
        let delay = Duration::from_millis(delay_ms.into());
        self.wait_for(self.link.now() + delay.times(2), |_| false).map(drop)
    }

    /// Lets a device without node-ID take the one that it was given; whether it boots with it.
    pub(super) fn boot(&mut self, node: NodeId) -> Result<bool, Failure> {
        self.hear(&[ErrorControl::cob_id(node)])?;
        self.deselect()?;
        let boot_up = ErrorControl::heartbeat(NmtState::Initialising).frame(node);
        self.wait_for(self.link.now() + BOOTING, |frame| *frame == boot_up)
    }

    /// Lets a device that has a node-ID take the one that it was given, by a reset of its communication (CiA 305);
    /// whether it boots with it.
    pub(super) fn activate_node(&mut self, old: NodeId, new: Option<NodeId>) -> Result<bool, Failure> {
        self.hear(&new.map(ErrorControl::cob_id).into_iter().collect::<Vec<_>>())?;
        self.deselect()?;
        self.send(&NmtMessage { command: NmtCommand::ResetCommunication, node: Some(old) }.frame())?;
        let boot_up = new.map(|new| ErrorControl::heartbeat(NmtState::Initialising).frame(new));
        self.wait_for(self.link.now() + BOOTING, |frame| Some(*frame) == boot_up)
    }

    /// No device is selected any more.
    fn deselect(&mut self) -> Result<(), Failure> {
        self.switch_all(LssState::Waiting)
    }

    fn switch_all(&mut self, state: LssState) -> Result<(), Failure> {
        self.begin(|lss| lss.switch_global(state))
    }

    /// A request that nobody answers.
    fn begin(&mut self, begin: impl FnOnce(&mut LssManager) -> Result<(), Busy>) -> Result<(), Failure> {
        let mut manager = self.manager(self.times.answer, begin);
        while let Some(frame) = manager.poll_transmit(self.link.now()) {
            self.send(&frame)?;
        }
        Ok(())
    }

    /// A request that is done or refused; of several that answer, one that refuses counts.
    fn tell(
        &mut self,
        patience: Duration,
        refusal: fn(u8, u8) -> LssResponse,
        begin: impl FnOnce(&mut LssManager) -> Result<(), Busy>,
    ) -> Result<Done, Failure> {
        let until = self.link.now() + patience;
        match self.ask(patience, begin)? {
            Event::Done if self.everybody => {
                let mut refused = None;
                self.wait_for(until, |frame| {
                    refused = response(frame).filter(|response| refuses(*response));
                    refused.is_some()
                })?;
                Ok(refused.map_or(Ok(()), Err))
            }
            Event::Done => Ok(Ok(())),
            Event::Failed(LssError::Refused { error, specific }) => Ok(Err(refusal(error, specific))),
            Event::Failed(LssError::NoAnswer) => Err(nobody()),
            other => Err(unexpected(other)),
        }
    }

    /// A request that nobody but the selected device answers.
    fn ask(
        &mut self,
        patience: Duration,
        begin: impl FnOnce(&mut LssManager) -> Result<(), Busy>,
    ) -> Result<Event, Failure> {
        let event = self.operate(patience, &ProgressBar::hidden(), begin)?;
        let until = self.link.now() + GRACE;
        let answered = event != Event::Failed(LssError::NoAnswer);
        if answered && !self.everybody && self.wait_for(until, |frame| response(frame).is_some())? {
            return Err(Failure::new("more than one device answers").help(
                "name the one that is meant by --vendor, --product, --revision and --serial: `lexican lss find` tells \
                 them of those without node-ID, `lexican scan` of the others",
            ));
        }
        Ok(event)
    }

    /// Runs an operation to its end.
    fn operate(
        &mut self,
        patience: Duration,
        progress: &ProgressBar,
        begin: impl FnOnce(&mut LssManager) -> Result<(), Busy>,
    ) -> Result<Event, Failure> {
        let mut operation = Operation { manager: self.manager(patience, begin), progress };
        let event =
            self.pump.run(&mut self.link, &mut operation, Instant::MAX).map_err(|error| link_failure(&error))?;
        Ok(event.expect("each step of an operation has a deadline"))
    }

    fn manager(&self, patience: Duration, begin: impl FnOnce(&mut LssManager) -> Result<(), Busy>) -> LssManager {
        let mut manager = LssManager::new().with_timeouts(patience, self.times.step);
        begin(&mut manager).expect("a new manager is idle");
        manager
    }

    /// Whether there is such a frame before `until`.
    fn wait_for(&mut self, until: Instant, mut wanted: impl FnMut(&Frame) -> bool) -> Result<bool, Failure> {
        while let Some(frame) = self.pump.receive_frame(&mut self.link, until).map_err(|error| link_failure(&error))? {
            if wanted(&frame) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    fn send(&mut self, frame: &Frame) -> Result<(), Failure> {
        self.link.send(frame).map_err(|error| link_failure(&error))
    }

    /// Frames with other identifiers do not matter.
    fn hear(&mut self, ids: &[CobId]) -> Result<(), Failure> {
        self.link.listen_to(ids).map_err(|error| link_failure(&error))
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
        self.progress.inc(1);
        Some(request)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.manager.poll_timeout()
    }
}

fn response(frame: &Frame) -> Option<LssResponse> {
    LssResponse::parse(frame.data()).filter(|_| frame.id() == lss::RESPONSE && !frame.is_remote())
}

fn ms(duration: Duration) -> u64 {
    duration.as_micros() / 1000
}

fn nobody() -> Failure {
    Failure::new("no device answers to LSS").help(
        "is one with LSS on this bus, with power and at this bit rate? Some older devices answer while they are \
         stopped only: `lexican nmt stop --all`",
    )
}

/// A device without node-ID that does not let itself be searched for.
pub(super) fn no_fastscan() -> Failure {
    Failure::new("there is a device without node-ID, but it does not let itself be searched for (LSS fastscan)")
        .help("name it by --vendor, --product, --revision and --serial, or leave it alone on the bus")
}

fn unexpected(event: Event) -> Failure {
    Failure::new(format_args!("an LSS operation ended in another way than it can: {event:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use lexican_runtime::wire::lss::LssRequest;
    use std::sync::{Arc, Mutex};

    use crate::bus::flood::Flood;
    use crate::bus::virtual_device::{Memory, VirtualDevice};
    use lexican_runtime::host::{Fate, Node, VirtualBus, VirtualLink};
    use lexican_runtime::service::lss_device::{LssDevice, LssHost, StoreError};

    const TIMES: Times = Times { answer: Duration::from_millis(500), step: Duration::from_millis(25) };

    fn identity(serial: u32) -> Identity {
        Identity { vendor: 0x195, product: 3, revision: 0x1_0000, serial }
    }

    /// A device that has nothing but LSS, and knows 250 and 500 kbit/s.
    struct Bare {
        lss: LssDevice,
        host: Host,
        knows_fastscan: bool,
        /// How long it thinks before it answers.
        slowness: Duration,
        answers_at: Option<Instant>,
    }

    #[derive(Default)]
    struct Host {
        stored: Option<Option<NodeId>>,
        cannot_store: bool,
    }

    impl LssHost for Host {
        fn configure_bit_timing(&mut self, table: u8, index: u8) -> bool {
            table == 0 && (2..=3).contains(&index)
        }
        fn store(&mut self, node: Option<NodeId>) -> Result<(), StoreError> {
            self.stored = Some(node);
            if self.cannot_store { Err(StoreError::Failed) } else { Ok(()) }
        }
    }

    impl Node for Bare {
        fn handle_frame(&mut self, now: Instant, frame: &Frame) {
            if self.knows_fastscan || frame.data().first() != Some(&0x51) {
                self.lss.handle_frame(now, frame, &mut self.host);
                self.answers_at = Some(now + self.slowness);
            }
        }
        fn handle_timeout(&mut self, _: Instant) {
            self.answers_at = None;
        }
        fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
            if self.answers_at.is_none() { self.lss.poll_transmit(now) } else { None }
        }
        fn poll_timeout(&self) -> Option<Instant> {
            self.answers_at
        }
    }

    /// A bus with devices of these serial numbers and node-IDs, 0 for none.
    fn bus(devices: &[(u32, u8)]) -> (VirtualBus, Vec<Arc<Mutex<Bare>>>) {
        let bus = VirtualBus::with_bit_rate(500);
        let bare = |&(serial, node): &(u32, u8)| {
            let lss = LssDevice::new(identity(serial), NodeId::new(node));
            let (host, slowness) = (Host::default(), Duration::ZERO);
            Arc::new(Mutex::new(Bare { lss, host, knows_fastscan: true, slowness, answers_at: None }))
        };
        let devices: Vec<_> = devices.iter().map(bare).collect();
        devices.iter().for_each(|device| bus.attach(Arc::clone(device)));
        (bus, devices)
    }

    fn work<T>(
        bus: &VirtualBus,
        work: impl FnOnce(&mut Session<VirtualLink>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        Session::run(bus.link(), TIMES, work)
    }

    #[track_caller]
    fn fails<T: std::fmt::Debug>(result: Result<T, Failure>, words: &str, advice: &str) {
        let failure = result.unwrap_err();
        let (said, help) = failure.words();
        assert!(said.contains(words), "{said}");
        assert!(help.unwrap_or_default().contains(advice), "{help:?}");
    }

    #[test]
    fn all_devices_without_node_id_are_found_again_and_again() {
        let (bus, _) = bus(&[(0x8000_0001, 0), (7, 5), (42, 0), (0, 0)]);
        for _ in 0..2 {
            let found = work(&bus, |session| {
                let mut found = Vec::new();
                while let Some(identity) = session.fastscan()? {
                    found.push(identity.serial);
                }
                Ok(found)
            });
            assert_eq!(found.unwrap(), [0, 42, 0x8000_0001]);
        }
    }

    /// A device that answers every search, as CANopenNode's does: also when it was found and is selected.
    struct Stubborn {
        identity: Identity,
        part: Part,
        answers: bool,
    }

    impl Node for Stubborn {
        fn handle_frame(&mut self, _: Instant, frame: &Frame) {
            if frame.id() != lss::REQUEST {
                return;
            }
            match LssRequest::parse(frame.data()) {
                Some(LssRequest::Fastscan { bits_left: 0x80, .. }) => {
                    (self.part, self.answers) = (Part::Vendor, true);
                }
                Some(LssRequest::Fastscan { value, bits_left, part, next }) => {
                    let is_mine = part == self.part && (value ^ self.identity.part(part)) >> bits_left == 0;
                    self.answers |= is_mine;
                    if is_mine && bits_left == 0 {
                        self.part = next;
                    }
                }
                _ => {}
            }
        }
        fn handle_timeout(&mut self, _: Instant) {}
        fn poll_transmit(&mut self, _: Instant) -> Option<Frame> {
            std::mem::take(&mut self.answers).then(|| LssResponse::Identified.frame())
        }
        fn poll_timeout(&self) -> Option<Instant> {
            None
        }
    }

    #[test]
    fn devices_that_answer_every_search_neither_hide_others_nor_keep_it_going() {
        let stubborn = |serial| Stubborn { identity: identity(serial), part: Part::Vendor, answers: false };
        for (stubborn_ones, others) in [
            (&[5][..], &[][..]),
            (&[5], &[0, 7, 0x8000_0000]),
            (&[0x1234, 0x1235, u32::MAX], &[0x1236, 0, 9]),
            (&[u32::MAX], &[u32::MAX - 1]),
        ] {
            let (bus, _) = bus(&others.iter().map(|serial| (*serial, 0)).collect::<Vec<_>>());
            stubborn_ones.iter().for_each(|serial| bus.attach(stubborn(*serial)));
            let another_vendor = Identity { vendor: 7, ..identity(5) };
            bus.attach(Stubborn { identity: another_vendor, part: Part::Vendor, answers: false });
            let mut found = work(&bus, |session| super::super::find::all(session, |_| Ok(true), |_| Ok(()))).unwrap();
            found.sort_by_key(|identity| (identity.vendor, identity.serial));
            let serials = stubborn_ones.iter().chain(others).map(|serial| identity(*serial));
            let mut all: Vec<_> = serials.chain([another_vendor]).collect();
            all.sort_by_key(|identity| (identity.vendor, identity.serial));
            assert_eq!(found, all);
        }
    }

    #[test]
    fn a_node_id_is_activated_by_a_reset() {
        let text = include_str!("../../tests/sensor.eds");
        let sheet = lexican_eds::load(&lexican_eds::Input::new(lexican_eds::Source::new("sensor.eds", text))).0;
        let bus = VirtualBus::with_bit_rate(500);
        bus.attach(VirtualDevice::power_on(bus.now(), NodeId::literal(9), &sheet));
        bus.advance(Duration::from_millis(10));
        let booted = work(&bus, |session| {
            let selected = session.select(Whom::Only)?;
            assert_eq!(session.configure_node(NodeId::new(10))?, Ok(()));
            session.activate_node(selected.node.unwrap(), NodeId::new(10))
        });
        assert!(booted.unwrap());
        assert!(work(&bus, |session| session.is_taken(NodeId::literal(10))).unwrap());
        assert!(!work(&bus, |session| session.is_taken(NodeId::literal(9))).unwrap());
    }

    #[test]
    fn a_device_that_somebody_has_left_selected_is_found_all_the_same() {
        let (bus, devices) = bus(&[(42, 0)]);
        let switch = LssRequest::SwitchGlobal(LssState::Configuration).frame();
        bus.link().send(&switch).unwrap();
        bus.advance(Duration::from_millis(1));
        assert_eq!(devices[0].lock().unwrap().lss.state(), LssState::Configuration);
        assert_eq!(work(&bus, Session::fastscan).unwrap(), Some(identity(42)));
    }

    #[test]
    fn a_scan_that_lost_an_answer_says_what_to_do() {
        let (bus, _) = bus(&[(42, 0)]);
        let mut answers = 0;
        bus.set_fate(move |_, frame| {
            answers += u32::from(frame.id() == lss::RESPONSE);
            if frame.id() == lss::RESPONSE && answers == 20 { Fate::Lose } else { Fate::Deliver }
        });
        fails(work(&bus, Session::fastscan), "which nobody confirms", "--step 100");
    }

    #[test]
    fn a_device_without_fastscan_is_noticed() {
        let (bus, devices) = bus(&[(42, 0)]);
        assert!(!work(&self::bus(&[(7, 5)]).0, Session::somebody_is_unconfigured).unwrap());
        devices[0].lock().unwrap().knows_fastscan = false;
        assert!(work(&bus, Session::somebody_is_unconfigured).unwrap());
        fails(work(&bus, |session| session.select(Whom::Unconfigured)), "searched for", "--vendor");
        let (bus, _) = self::bus(&[(7, 5)]);
        fails(work(&bus, |session| session.select(Whom::Unconfigured)), "without node-ID", "lexican scan");
    }

    #[test]
    fn the_only_device_needs_no_name() {
        let select = |devices: &[(u32, u8)]| work(&bus(devices).0, |session| session.select(Whom::Only));
        assert_eq!(select(&[(42, 5)]).unwrap(), Selected { identity: identity(42), node: NodeId::new(5) });
        assert_eq!(select(&[(42, 0)]).unwrap().node, None);
        fails(select(&[]), "no device answers to LSS", "lexican nmt stop --all");
        fails(select(&[(42, 5), (43, 0)]), "more than one device", "--vendor");
        fails(select(&[(42, 5), (42, 5)]), "more than one device", "--vendor");
    }

    #[test]
    fn a_device_is_told_by_its_identity() {
        let (bus, devices) = bus(&[(42, 5), (43, 6), (44, 0)]);
        let by_serial = |serial| work(&bus, |session| session.select(Whom::Identity(identity(serial))));
        assert_eq!(by_serial(43).unwrap(), Selected { identity: identity(43), node: NodeId::new(6) });
        assert_eq!(devices[1].lock().unwrap().lss.state(), LssState::Waiting, "when all is done");
        fails(by_serial(45), "no device with this identity", "1018h");
        let given_up = work(&bus, |session| {
            session.select(Whom::Identity(identity(43)))?;
            Err::<(), _>(Failure::new("given up"))
        });
        fails(given_up, "given up", "");
        bus.advance(Duration::from_millis(1));
        assert_eq!(devices[1].lock().unwrap().lss.state(), LssState::Waiting, "also when it fails");
    }

    #[test]
    fn a_device_boots_with_its_node_id() {
        let text = include_str!("../../tests/sensor.eds");
        let sheet = lexican_eds::load(&lexican_eds::Input::new(lexican_eds::Source::new("sensor.eds", text))).0;
        let bus = VirtualBus::with_bit_rate(500);
        let (now, memory) = (bus.now(), Memory::default());
        bus.attach(VirtualDevice::power_on(now, NodeId::literal(9), &sheet));
        bus.attach(VirtualDevice::with_memory(now, None, Arc::new(sheet), memory));
        let taken_and_booted = work(&bus, |session| {
            session.select(Whom::Unconfigured)?;
            let taken = [session.is_taken(NodeId::literal(9))?, session.is_taken(NodeId::literal(10))?];
            assert_eq!(session.configure_node(NodeId::new(10))?, Ok(()));
            Ok((taken, session.boot(NodeId::literal(10))?))
        });
        assert_eq!(taken_and_booted.unwrap(), ([true, false], true));
        assert!(work(&bus, |session| session.is_taken(NodeId::literal(10))).unwrap());
    }

    #[test]
    fn a_node_id_is_given_and_stored() {
        let (bus, devices) = bus(&[(42, 0), (43, 6)]);
        let boots = work(&bus, |session| {
            session.select(Whom::Unconfigured)?;
            assert_eq!(session.configure_node(NodeId::new(9))?, Ok(()));
            assert_eq!(session.store()?, Ok(()));
            session.boot(NodeId::literal(9))
        });
        // Nobody there has a boot-up message.
        assert!(!boots.unwrap());
        assert_eq!(devices[0].lock().unwrap().host.stored, Some(NodeId::new(9)));
        assert_eq!(devices[1].lock().unwrap().host.stored, None);
    }

    #[test]
    fn a_heartbeat_is_no_boot_up_message() {
        /// Was there before with the node-ID.
        struct Alive(bool);
        impl Node for Alive {
            fn handle_frame(&mut self, _: Instant, _: &Frame) {
                self.0 = true;
            }
            fn handle_timeout(&mut self, _: Instant) {}
            fn poll_transmit(&mut self, _: Instant) -> Option<Frame> {
                let beat = ErrorControl::heartbeat(NmtState::Operational).frame(NodeId::literal(9));
                std::mem::take(&mut self.0).then_some(beat)
            }
            fn poll_timeout(&self) -> Option<Instant> {
                None
            }
        }
        let (bus, _) = bus(&[(42, 0)]);
        bus.attach(Alive(false));
        assert!(!work(&bus, |session| session.boot(NodeId::literal(9))).unwrap());
    }

    #[test]
    fn storing_may_take_its_time() {
        let (bus, devices) = bus(&[(42, 5)]);
        let stored = work(&bus, |session| {
            session.select(Whom::Only)?;
            devices[0].lock().unwrap().slowness = Duration::from_secs(2);
            session.store()
        });
        assert_eq!(stored.unwrap(), Ok(()));
        fails(work(&bus, |session| session.select(Whom::Only)), "no device answers", "");
    }

    #[test]
    fn a_refusal_is_an_answer() {
        let (bus, devices) = bus(&[(42, 5)]);
        devices[0].lock().unwrap().host.cannot_store = true;
        let (rate, stored) = work(&bus, |session| {
            session.select(Whom::Only)?;
            Ok((session.configure_bit_rate(0)?, session.store()?))
        })
        .unwrap();
        assert_eq!(rate, Err(LssResponse::ConfigureBitTiming { error: 1, specific: 0 }));
        assert_eq!(stored, Err(LssResponse::Store { error: 2, specific: 0 }));
    }

    #[test]
    fn of_all_devices_one_that_refuses_counts() {
        let (bus, devices) = bus(&[(42, 5), (43, 6), (44, 7)]);
        let all = || {
            work(&bus, |session| {
                session.select_all()?;
                Ok((session.configure_bit_rate(3)?, session.store()?))
            })
        };
        assert_eq!(all().unwrap(), (Ok(()), Ok(())));
        devices[1].lock().unwrap().host.cannot_store = true;
        assert_eq!(all().unwrap(), (Ok(()), Err(LssResponse::Store { error: 2, specific: 0 })));
    }

    #[test]
    fn a_bus_at_another_bit_rate_is_left_alone() {
        let (bus, _) = bus(&[(42, 5)]);
        let heard = Arc::new(Mutex::new(Vec::new()));
        let log = Arc::clone(&heard);
        bus.observe(move |at, frame| log.lock().unwrap().push((at, *frame)));
        work(&bus, |session| {
            session.select_all()?;
            session.activate(1000)
        })
        .unwrap();
        let heard = heard.lock().unwrap();
        let (at, last) = heard.last().unwrap();
        assert_eq!(last.to_string(), "7E5#15E8030000000000");
        assert!(bus.now().since(*at) >= Duration::from_secs(2));
    }

    #[test]
    fn other_frames_do_not_hold_up_what_is_overdue() {
        let flooded = Session::run(Flood::of_heartbeats(), TIMES, |session| {
            assert_eq!(session.fastscan()?, None);
            session.select(Whom::Only)
        });
        fails(flooded, "no device answers", "power");
    }
}
