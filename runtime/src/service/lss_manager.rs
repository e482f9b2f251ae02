//! LSS as a manager sees it: finds devices by their identity, and gives them node-ID and bit rate
//! (CiA 305). One operation at a time.

use crate::frame::Frame;
use crate::id::NodeId;
use crate::time::{Duration, Instant};
use crate::wire::lss::{self, Bound, Identity, LssRequest, LssResponse, LssState, Part};

/// How an operation ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Event {
    /// A device was selected by its identity, and is in the state CONFIGURATION.
    Selected,
    /// The device has taken node-ID or bit rate, or has stored them.
    Done,
    /// A part of the identity of the selected device.
    Inquired(Part, u32),
    /// The node-ID of the selected device; `None` when it has none.
    InquiredNode(Option<NodeId>),
    /// At least one device has an identity in the range.
    Identified,
    /// At least one device has no node-ID.
    UnconfiguredExists,
    /// A device without node-ID was found, and is in the state CONFIGURATION.
    Found(Identity),
    /// The operation failed.
    Failed(LssError),
}

/// Why an operation failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum LssError {
    /// No device answered: there is none, or it does not support the operation.
    #[error("no device answers")]
    NoAnswer,
    /// The device refused.
    #[error("the device refuses with error {error} ({specific})")]
    Refused {
        /// As CiA 305 numbers them for the operation.
        error: u8,
        /// The device's own error code, when `error` is 255.
        specific: u8,
    },
    /// A scan found bits that no device has: answers were late or got lost. A device may be selected all the same.
    #[error("the scan for {part:?} ended with {value:08X}h, which no device confirms")]
    ScanFailed { part: Part, value: u32 },
}

/// Another operation is under way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[error("another LSS operation is under way")]
pub struct Busy;

/// Runs LSS operations.
#[derive(Clone, Copy, Debug)]
pub struct LssManager {
    timeout: Duration,
    scan_timeout: Duration,
    state: State,
    /// The request of the state waits for being sent.
    unsent: bool,
    deadline: Instant,
}

#[derive(Clone, Copy, Debug)]
enum State {
    Idle,
    /// A request without an answer.
    Command(LssRequest),
    /// A request with one answer.
    Ask(LssRequest),
    /// A request in several frames, the last of which is answered.
    Select {
        identity: Identity,
        part: Part,
    },
    Identify {
        range: Range,
        at: usize,
    },
    Scan(Scan),
}

/// The identities that [`LssManager::identify`] looks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Range {
    /// Vendor, product, and the lowest revision and serial number.
    pub low: Identity,
    pub revision_high: u32,
    pub serial_high: u32,
}

impl Range {
    fn bound(&self, at: usize) -> Option<(Bound, u32)> {
        let bounds = [
            (Bound::Vendor, self.low.vendor),
            (Bound::Product, self.low.product),
            (Bound::RevisionLow, self.low.revision),
            (Bound::RevisionHigh, self.revision_high),
            (Bound::SerialLow, self.low.serial),
            (Bound::SerialHigh, self.serial_high),
        ];
        bounds.get(at).copied()
    }
}

/// A search for one device without node-ID.
///
/// An answer does not show to which step it belongs, and one that is late would count for the step after it. So a step
/// that is not answered in its time is over only when the devices have answered a request that comes after it, and in
/// other words: [`LssRequest::IdentifyUnconfigured`]. With several devices, or one that does not know this request,
/// an answer may still be too late. Therefore what was found counts when it is read back.
#[derive(Clone, Copy, Debug)]
struct Scan {
    found: Identity,
    part: Part,
    at: ScanStep,
    /// A device has answered this step. Others may answer until its time is over.
    answered: bool,
    /// The devices answer requests for devices without node-ID.
    is_fenced: bool,
    /// The time of the step is over, and the devices are asked whether they have no node-ID.
    at_fence: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum ScanStep {
    /// Is there any device?
    Begin,
    /// Is the bit 0?
    Bit(u8),
    /// Is this the whole number?
    Confirm,
    /// Does the device that was found have this number?
    ReadBack,
}

impl Scan {
    const fn new() -> Self {
        let found = Identity { vendor: 0, product: 0, revision: 0, serial: 0 };
        let (part, at) = (Part::Vendor, ScanStep::Begin);
        Scan { found, part, at, answered: false, is_fenced: false, at_fence: false }
    }

    fn request(&self) -> LssRequest {
        if self.at_fence {
            return LssRequest::IdentifyUnconfigured;
        }
        let (bits_left, next) = match self.at {
            ScanStep::Begin => (0x80, Part::Vendor),
            ScanStep::Bit(bit) => (bit, self.part),
            ScanStep::Confirm => (0, self.part.next()),
            ScanStep::ReadBack => return LssRequest::Inquire(self.part),
        };
        LssRequest::Fastscan { value: self.found.part(self.part), bits_left, part: self.part, next }
    }

    /// The scan after a response, and whether it goes on at once.
    fn hear(mut self, response: LssResponse) -> (Scan, bool) {
        match response {
            LssResponse::Identified => self.answered = true,
            LssResponse::Unconfigured if self.at_fence => {
                self.is_fenced = true;
                return (self, true);
            }
            // Devices that were found before answer as well.
            LssResponse::Inquired(part, value) if self.at == ScanStep::ReadBack => {
                return (self, part == self.part && value == self.found.part(part));
            }
            _ => {}
        }
        (self, false)
    }

    /// The scan after the time for a response; or its end.
    fn time_out(mut self) -> Result<Scan, Event> {
        let is_first = self.at == ScanStep::Begin;
        if self.at == ScanStep::ReadBack || self.at_fence && !is_first {
            return Err(self.failed());
        }
        if !self.at_fence && (is_first || self.is_fenced && !self.answered) {
            self.at_fence = true;
            return Ok(self);
        }
        self.advance()
    }

    /// The scan after a step; or its end.
    fn advance(mut self) -> Result<Scan, Event> {
        let answered = core::mem::take(&mut self.answered);
        self.at_fence = false;
        match self.at {
            ScanStep::Begin if !answered => return Err(Event::Failed(LssError::NoAnswer)),
            ScanStep::Begin => self.at = ScanStep::Bit(31),
            ScanStep::Bit(bit) => {
                if !answered {
                    let value = self.found.part(self.part) | 1 << bit;
                    self.found = self.found.with(self.part, value);
                }
                self.at = bit.checked_sub(1).map_or(ScanStep::Confirm, ScanStep::Bit);
            }
            ScanStep::Confirm if !answered => return Err(self.failed()),
            ScanStep::Confirm => {
                self.at = if self.part == Part::Serial { ScanStep::ReadBack } else { ScanStep::Bit(31) };
                self.part = self.part.next();
            }
            ScanStep::ReadBack if self.part == Part::Serial => return Err(Event::Found(self.found)),
            ScanStep::ReadBack => self.part = self.part.next(),
        }
        Ok(self)
    }

    const fn failed(&self) -> Event {
        Event::Failed(LssError::ScanFailed { part: self.part, value: self.found.part(self.part) })
    }
}

impl LssManager {
    /// A manager that waits 100 ms for an answer, and 20 ms for each step of a scan.
    #[must_use]
    pub const fn new() -> Self {
        LssManager {
            timeout: Duration::from_millis(100),
            scan_timeout: Duration::from_millis(20),
            state: State::Idle,
            unsent: false,
            deadline: Instant::ZERO,
        }
    }

    /// With other times.
    #[must_use]
    pub const fn with_timeouts(self, timeout: Duration, scan_timeout: Duration) -> Self {
        LssManager { timeout, scan_timeout, ..self }
    }

    /// Whether an operation is under way.
    #[must_use]
    pub const fn is_busy(&self) -> bool {
        !matches!(self.state, State::Idle)
    }

    /// All devices enter a state. No event follows.
    pub fn switch_global(&mut self, state: LssState) -> Result<(), Busy> {
        self.begin(State::Command(LssRequest::SwitchGlobal(state)))
    }

    /// Selects the device of an identity: [`Event::Selected`].
    pub fn select(&mut self, identity: Identity) -> Result<(), Busy> {
        self.begin(State::Select { identity, part: Part::Vendor })
    }

    /// Asks whether a device has an identity in a range: [`Event::Identified`].
    pub fn identify(&mut self, range: Range) -> Result<(), Busy> {
        self.begin(State::Identify { range, at: 0 })
    }

    /// Asks whether a device has no node-ID: [`Event::UnconfiguredExists`].
    pub fn identify_unconfigured(&mut self) -> Result<(), Busy> {
        self.begin(State::Ask(LssRequest::IdentifyUnconfigured))
    }

    /// Finds one device without node-ID: [`Event::Found`], when it has reported the identity that was found.
    pub fn fastscan(&mut self) -> Result<(), Busy> {
        self.begin(State::Scan(Scan::new()))
    }

    /// Gives the selected device a node-ID, or takes it away: [`Event::Done`].
    pub fn configure_node(&mut self, node: Option<NodeId>) -> Result<(), Busy> {
        self.begin(State::Ask(LssRequest::ConfigureNode(node)))
    }

    /// Gives the selected device a bit rate, entry `index` of `table` (0: that of CiA 305): [`Event::Done`].
    pub fn configure_bit_timing(&mut self, table: u8, index: u8) -> Result<(), Busy> {
        self.begin(State::Ask(LssRequest::ConfigureBitTiming { table, index }))
    }

    /// All selected devices change to their new bit rate after `delay_ms`. No event follows.
    pub fn activate_bit_timing(&mut self, delay_ms: u16) -> Result<(), Busy> {
        self.begin(State::Command(LssRequest::ActivateBitTiming { delay_ms }))
    }

    /// The selected device stores node-ID and bit rate: [`Event::Done`].
    pub fn store(&mut self) -> Result<(), Busy> {
        self.begin(State::Ask(LssRequest::Store))
    }

    /// Asks the selected device for a part of its identity: [`Event::Inquired`].
    pub fn inquire(&mut self, part: Part) -> Result<(), Busy> {
        self.begin(State::Ask(LssRequest::Inquire(part)))
    }

    /// Asks the selected device for its node-ID: [`Event::InquiredNode`].
    pub fn inquire_node(&mut self) -> Result<(), Busy> {
        self.begin(State::Ask(LssRequest::InquireNode))
    }

    fn begin(&mut self, state: State) -> Result<(), Busy> {
        if self.is_busy() {
            return Err(Busy);
        }
        self.state = state;
        self.unsent = true;
        Ok(())
    }

    /// Takes a response.
    pub fn handle_frame(&mut self, _now: Instant, frame: &Frame) -> Option<Event> {
        if frame.id() != lss::RESPONSE || frame.is_remote() || self.unsent {
            return None;
        }
        let response = LssResponse::parse(frame.data())?;
        match self.state {
            State::Ask(request) => self.end(answer(request, response)?),
            State::Select { .. } if response == LssResponse::Selected => self.end(Event::Selected),
            State::Identify { .. } if response == LssResponse::Identified => self.end(Event::Identified),
            State::Scan(scan) => {
                let (scan, is_over) = scan.hear(response);
                self.state = State::Scan(scan);
                if is_over { self.scan_on(scan.advance()) } else { None }
            }
            _ => None,
        }
    }

    fn scan_on(&mut self, scan: Result<Scan, Event>) -> Option<Event> {
        match scan {
            Ok(scan) => {
                self.state = State::Scan(scan);
                self.unsent = true;
                None
            }
            Err(event) => self.end(event),
        }
    }

    fn end(&mut self, event: Event) -> Option<Event> {
        self.state = State::Idle;
        Some(event)
    }

    /// No device answered in time, or the time of a scan's step is over.
    pub fn handle_timeout(&mut self, now: Instant) -> Option<Event> {
        if self.poll_timeout()? > now {
            return None;
        }
        match self.state {
            State::Scan(scan) => self.scan_on(scan.time_out()),
            _ => self.end(Event::Failed(LssError::NoAnswer)),
        }
    }

    /// The next request.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        if !core::mem::take(&mut self.unsent) {
            return None;
        }
        let request = match self.state {
            State::Idle => return None,
            State::Command(request) => {
                self.state = State::Idle;
                request
            }
            State::Ask(request) => request,
            State::Select { identity, part } => {
                self.unsent = part != Part::Serial;
                self.state = State::Select { identity, part: part.next() };
                LssRequest::SwitchSelective(part, identity.part(part))
            }
            State::Identify { range, at } => {
                let (bound, value) = range.bound(at)?;
                self.unsent = bound != Bound::SerialHigh;
                self.state = State::Identify { range, at: at + 1 };
                LssRequest::Identify(bound, value)
            }
            State::Scan(scan) => scan.request(),
        };
        let is_step = matches!(request, LssRequest::Fastscan { .. });
        self.deadline = now + if is_step { self.scan_timeout } else { self.timeout };
        Some(request.frame())
    }

    /// When the time for an answer is over.
    #[must_use]
    pub const fn poll_timeout(&self) -> Option<Instant> {
        if self.is_busy() && !self.unsent { Some(self.deadline) } else { None }
    }
}

impl Default for LssManager {
    fn default() -> Self {
        Self::new()
    }
}

/// What a response means to a request; `None` if it answers another request.
fn answer(request: LssRequest, response: LssResponse) -> Option<Event> {
    match (request, response) {
        (LssRequest::ConfigureNode(_), LssResponse::ConfigureNode { error, specific })
        | (LssRequest::ConfigureBitTiming { .. }, LssResponse::ConfigureBitTiming { error, specific })
        | (LssRequest::Store, LssResponse::Store { error, specific }) => Some(match error {
            0 => Event::Done,
            _ => Event::Failed(LssError::Refused { error, specific }),
        }),
        (LssRequest::Inquire(asked), LssResponse::Inquired(part, value)) if asked == part => {
            Some(Event::Inquired(part, value))
        }
        (LssRequest::InquireNode, LssResponse::InquiredNode(node)) => Some(Event::InquiredNode(node)),
        (LssRequest::IdentifyUnconfigured, LssResponse::Unconfigured) => Some(Event::UnconfiguredExists),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::service::lss_device::{self, LssDevice, LssHost, StoreError};
    use proptest::prelude::*;
    use std::vec::Vec;

    #[derive(Default)]
    struct Host {
        stored: Option<Option<NodeId>>,
        bit_rate: Option<u8>,
    }

    impl LssHost for Host {
        fn configure_bit_timing(&mut self, table: u8, index: u8) -> bool {
            let supported = table == 0 && index < 9 && index != 5;
            self.bit_rate = supported.then_some(index);
            supported
        }
        fn store(&mut self, node: Option<NodeId>) -> Result<(), StoreError> {
            self.stored = Some(node);
            Ok(())
        }
    }

    struct Network {
        manager: LssManager,
        devices: Vec<LssDevice>,
        host: Host,
        now: Instant,
        events: Vec<lss_device::Event>,
    }

    impl Network {
        fn new(devices: &[LssDevice]) -> Self {
            let manager = LssManager::new();
            Network {
                manager,
                devices: devices.to_vec(),
                host: Host::default(),
                now: Instant::ZERO,
                events: Vec::new(),
            }
        }

        /// Runs an operation to its end.
        fn run(&mut self, begin: impl FnOnce(&mut LssManager) -> Result<(), Busy>) -> Option<Event> {
            begin(&mut self.manager).unwrap();
            for _ in 0..1000 {
                while let Some(request) = self.manager.poll_transmit(self.now) {
                    for device in &mut self.devices {
                        self.events.extend(device.handle_frame(self.now, &request, &mut self.host));
                    }
                    for device in &mut self.devices {
                        let response = device.poll_transmit(self.now);
                        let event = response.and_then(|frame| self.manager.handle_frame(self.now, &frame));
                        if event.is_some() {
                            return event;
                        }
                    }
                }
                self.now = self.manager.poll_timeout()?;
                let event = self.manager.handle_timeout(self.now);
                if event.is_some() {
                    return event;
                }
            }
            panic!("the operation does not end");
        }
    }

    /// Runs a scan with devices that take their time: of each request, device `n` answers `lag(n)` ms after it has come and
    /// after the answers to those before it. Not all devices know the request for devices without node-ID: CANopenNode does not.
    fn scan_slow_devices(
        devices: &[LssDevice],
        mut lag: impl FnMut(usize) -> u64,
        knows_unconfigured: bool,
    ) -> Option<Event> {
        let (mut host, mut now) = (Host::default(), Instant::ZERO);
        let mut manager = LssManager::new().with_timeouts(Duration::from_millis(1000), Duration::from_millis(20));
        let mut devices: Vec<_> = devices.iter().map(|device| (*device, Vec::<(Instant, Frame)>::new())).collect();
        manager.fastscan().unwrap();
        loop {
            while let Some(request) = manager.poll_transmit(now) {
                let is_known = knows_unconfigured || request != LssRequest::IdentifyUnconfigured.frame();
                for (number, (device, answers)) in devices.iter_mut().enumerate().filter(|_| is_known) {
                    device.handle_frame(now, &request, &mut host);
                    let before = answers.last().map_or(now, |&(at, _)| at.max(now));
                    let at = before + Duration::from_millis(lag(number));
                    answers.extend(device.poll_transmit(now).map(|answer| (at, answer)));
                }
            }
            let next =
                devices.iter().enumerate().filter_map(|(number, (_, answers))| Some((answers.first()?.0, number)));
            let deadline = manager.poll_timeout().unwrap();
            let event = match next.min() {
                Some((at, number)) if at <= deadline => {
                    now = at;
                    let (_, answer) = devices[number].1.remove(0);
                    manager.handle_frame(now, &answer)
                }
                _ => {
                    now = deadline;
                    manager.handle_timeout(now)
                }
            };
            if event.is_some() {
                return event;
            }
        }
    }

    const IDENTITY: Identity = Identity { vendor: 0x195, product: 3, revision: 0x0001_0002, serial: 0x8000_0001 };
    const NODE: NodeId = NodeId::literal(5);

    #[test]
    fn a_device_is_selected_asked_configured_and_stored() {
        let other = Identity { serial: 2, ..IDENTITY };
        let devices = [LssDevice::new(IDENTITY, Some(NODE)), LssDevice::new(other, NodeId::new(6))];
        let mut network = Network::new(&devices);
        assert_eq!(network.run(|lss| lss.select(IDENTITY)), Some(Event::Selected));
        assert_eq!(network.devices[1].state(), LssState::Waiting);
        for part in Part::ALL {
            let event = network.run(|lss| lss.inquire(part));
            assert_eq!(event, Some(Event::Inquired(part, IDENTITY.part(part))));
        }
        assert_eq!(network.run(LssManager::inquire_node), Some(Event::InquiredNode(Some(NODE))));
        assert_eq!(network.run(|lss| lss.configure_node(NodeId::new(9))), Some(Event::Done));
        assert_eq!(network.run(|lss| lss.configure_bit_timing(0, 2)), Some(Event::Done));
        let refused = Event::Failed(LssError::Refused { error: 1, specific: 0 });
        assert_eq!(network.run(|lss| lss.configure_bit_timing(0, 5)), Some(refused));
        assert_eq!(network.run(LssManager::store), Some(Event::Done));
        assert_eq!(network.host.stored, Some(NodeId::new(9)));
        // It runs with its old node-ID until it is reset.
        assert_eq!(network.run(LssManager::inquire_node), Some(Event::InquiredNode(Some(NODE))));
        assert_eq!(network.run(|lss| lss.switch_global(LssState::Waiting)), None);
        assert_eq!((network.devices[0].reset(), &network.events[..]), (NodeId::new(9), &[][..]));
    }

    #[test]
    fn no_device_answers_for_an_identity_that_differs_in_any_part() {
        let mut network = Network::new(&[LssDevice::new(IDENTITY, None)]);
        for part in Part::ALL {
            let other = IDENTITY.with(part, 7);
            assert_eq!(network.run(|lss| lss.select(other)), Some(Event::Failed(LssError::NoAnswer)), "{part:?}");
        }
        assert_eq!(network.run(LssManager::store), Some(Event::Failed(LssError::NoAnswer)));
    }

    #[test]
    fn a_device_without_node_id_is_found_and_boots_with_the_one_it_gets() {
        let mut network = Network::new(&[LssDevice::new(IDENTITY, None), LssDevice::new(IDENTITY, Some(NODE))]);
        assert_eq!(network.run(LssManager::identify_unconfigured), Some(Event::UnconfiguredExists));
        assert_eq!(network.run(LssManager::fastscan), Some(Event::Found(IDENTITY)));
        assert_eq!(network.devices[0].state(), LssState::Configuration);
        assert_eq!(network.run(|lss| lss.configure_node(NodeId::new(7))), Some(Event::Done));
        assert_eq!(network.run(|lss| lss.switch_global(LssState::Waiting)), None);
        assert_eq!(network.events, [lss_device::Event::NodeIdGiven(NodeId::literal(7))]);
        assert_eq!(network.run(LssManager::identify_unconfigured), Some(Event::Failed(LssError::NoAnswer)));
        assert_eq!(network.run(LssManager::fastscan), Some(Event::Failed(LssError::NoAnswer)));
    }

    #[test]
    fn a_second_answer_to_a_step_of_a_scan_is_not_taken_for_one_to_the_next() {
        let at = |ms| Instant::ZERO + Duration::from_millis(ms);
        let answer = Frame::from_array(lss::RESPONSE, [0x4F, 0, 0, 0, 0, 0, 0, 0]);
        let mut manager = LssManager::new();
        manager.fastscan().unwrap();
        assert!(manager.poll_transmit(at(0)).is_some());
        for ms in [1, 2, 19] {
            assert_eq!(manager.handle_frame(at(ms), &answer), None);
            assert_eq!(manager.poll_transmit(at(ms)), None);
        }
        assert_eq!((manager.poll_timeout(), manager.handle_timeout(at(20))), (Some(at(20)), None));
        assert_eq!(manager.poll_transmit(at(20)), Some(LssRequest::IdentifyUnconfigured.frame()));
        assert_eq!((manager.poll_timeout(), manager.handle_timeout(at(120))), (Some(at(120)), None));
        assert!(manager.poll_transmit(at(120)).is_some());
        assert_eq!(manager.handle_timeout(at(140)), None);
        let State::Scan(scan) = manager.state else { panic!() };
        assert_eq!(scan.found.vendor, 1 << 31, "no device has bit 31 as 0");
    }

    #[test]
    fn a_late_answer_to_the_last_bit_does_not_confirm_it() {
        // Bit 0 of the serial number is step 132 of 133.
        let (mut step, even) = (0, Identity { serial: 2, ..IDENTITY });
        let lag = |_| {
            step += 1;
            if step == 132 { 25 } else { 1 }
        };
        let event = scan_slow_devices(&[LssDevice::new(even, None)], lag, false);
        // The device was not selected by this identity, and reports nothing.
        assert_eq!(event, Some(Event::Failed(LssError::ScanFailed { part: Part::Vendor, value: 0x195 })));
    }

    #[test]
    fn devices_are_identified_by_ranges() {
        let mut network = Network::new(&[LssDevice::new(IDENTITY, Some(NODE))]);
        let all = Range {
            low: Identity { revision: 0, serial: 0, ..IDENTITY },
            revision_high: u32::MAX,
            serial_high: u32::MAX,
        };
        assert_eq!(network.run(|lss| lss.identify(all)), Some(Event::Identified));
        let none = Event::Failed(LssError::NoAnswer);
        assert_eq!(network.run(|lss| lss.identify(Range { serial_high: 0x8000_0000, ..all })), Some(none));
        assert_eq!(network.run(|lss| lss.identify(Range { revision_high: 0x0001_0001, ..all })), Some(none));
    }

    #[test]
    fn an_impossible_node_id_is_refused() {
        let mut device = LssDevice::new(IDENTITY, None);
        let mut host = Host::default();
        let mut send = |data: [u8; 8]| {
            device.handle_frame(Instant::ZERO, &Frame::from_array(lss::REQUEST, data), &mut host);
            device.poll_transmit(Instant::ZERO).map(|frame| std::format!("{frame}"))
        };
        assert_eq!(send([0x11, 200, 0, 0, 0, 0, 0, 0]), None);
        send([0x04, 1, 0, 0, 0, 0, 0, 0]);
        assert_eq!(send([0x11, 200, 0, 0, 0, 0, 0, 0]).as_deref(), Some("7E4#1101000000000000"));
    }

    proptest! {
        #[test]
        fn a_late_answer_in_a_scan_is_waited_for(lags in prop::collection::vec(0_u64..300, 1..200)) {
            let mut lags = lags.iter().copied().cycle();
            let device = LssDevice::new(IDENTITY, None);
            let event = scan_slow_devices(&[device], |_| lags.next().unwrap(), true);
            prop_assert_eq!(event, Some(Event::Found(IDENTITY)));
        }

        #[test]
        fn no_late_answers_make_a_scan_find_what_does_not_exist(
            serials in prop::collection::vec(any::<u32>(), 1..4),
            lags in prop::collection::vec(0_u64..70, 1..200),
            knows_unconfigured: bool,
        ) {
            let mut lags = lags.iter().copied().cycle();
            let devices: Vec<_> =
                serials.iter().map(|&serial| LssDevice::new(Identity { serial, ..IDENTITY }, None)).collect();
            match scan_slow_devices(&devices, |_| lags.next().unwrap(), knows_unconfigured) {
                Some(Event::Found(found)) => {
                    prop_assert!(serials.contains(&found.serial));
                    prop_assert_eq!(Identity { serial: 0, ..found }, Identity { serial: 0, ..IDENTITY });
                }
                event => prop_assert!(matches!(event, Some(Event::Failed(_)))),
            }
        }

        #[test]
        fn a_scan_finds_one_of_the_devices(
            identities in prop::collection::vec(any::<[u32; 4]>(), 1..4)
        ) {
            let identities: Vec<Identity> = identities
                .into_iter()
                .map(|[vendor, product, revision, serial]| Identity { vendor, product, revision, serial })
                .collect();
            let devices: Vec<LssDevice> = identities.iter().map(|&identity| LssDevice::new(identity, None)).collect();
            let Some(Event::Found(found)) = Network::new(&devices).run(LssManager::fastscan) else {
                return Err(TestCaseError::fail("no device was found"));
            };
            prop_assert!(identities.contains(&found));
        }

        #[test]
        fn any_requests_leave_a_device_that_can_be_selected(frames in prop::collection::vec(any::<[u8; 8]>(), 0..50)) {
            let mut network = Network::new(&[LssDevice::new(IDENTITY, None)]);
            for data in frames {
                let frame = Frame::from_array(lss::REQUEST, data);
                network.devices[0].handle_frame(network.now, &frame, &mut network.host);
                network.devices[0].poll_transmit(network.now);
            }
            network.run(|lss| lss.switch_global(LssState::Waiting));
            prop_assert_eq!(network.run(|lss| lss.select(IDENTITY)), Some(Event::Selected));
        }
    }
}
