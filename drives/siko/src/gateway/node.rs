//! The node that stands for a drive.

use std::collections::VecDeque;

use lexican_runtime::device::{Device, Event};
use lexican_runtime::host::Node;
use lexican_runtime::object::Address;
use lexican_runtime::service::rpdo;
use lexican_runtime::wire::emcy::{ErrorCode, ErrorRegister};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::wire::sdo::{Abort, ClientRequest, ServerResponse};
use lexican_runtime::{AbortCode, CobId, Duration, Frame, Instant, Measured, NodeId, cia301};
use simulator::Storage;

use super::face::{Change, Control, Face, Outcome, Step};
use super::objects::{
    Effect, LATEST_FAULT, MODE, Objects, POSITION, Place, STATUS_WORD, SYSTEM_STATUS, TARGET_POSITION, TARGET_VELOCITY,
    VELOCITY, place,
};
use super::{Door, Facts, Job, Report};
use crate::frames::{is_switched_off, with_size_of_object};
use crate::model::Model;
use crate::order::Order;
use crate::state::{Mode, has_torque};
use crate::words::system;

/// How many control words may wait for the line. Only a flood has more; the oldest are dropped.
const MOST_WAITING: usize = 16;

/// A drive behind a [`Door`], as a CANopen node: see [the module](super).
#[derive(Clone, Debug)]
pub struct Gateway<D> {
    model: &'static Model,
    device: Device<4, 4, 1, 0>,
    storage: Box<dyn Storage>,
    door: D,
    face: Face,
    /// The last facts.
    facts: Facts,
    /// Until when the facts are valid; after that the node is silent.
    stale: Instant,
    /// Until when to wait for facts before the drive counts as lost: a program that returns to its link after a pause
    /// has not let the door measure.
    patience: Option<Instant>,
    /// The drive answers.
    connected: bool,
    /// Whether it has answered before.
    known: bool,
    /// Whether it had been ordered to release its motor when it was lost: then a released motor is no sign of a
    /// restart.
    released: bool,
    effects: Vec<Effect>,
    waiting: VecDeque<Task>,
    current: Option<Current>,
    /// Frames to send before those of the device.
    outgoing: VecDeque<Frame>,
}

/// What waits, in the order in which it came.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Task {
    Control(Control),
    Serve(Frame),
    /// NMT, before the node has booted.
    Hear(Frame),
    /// Enters SWITCH ON DISABLED, with the motor released.
    Disable,
    Restart,
    ReadMode,
    ReportFault,
}

/// The job that the door has, and what follows.
#[derive(Clone, Copy, Debug)]
enum Current {
    /// The facts are measured before this control word is judged.
    Judging(Control),
    Ordering(Step),
    Disabling,
    ReadingMode,
    ReadingFault,
    /// An SDO request waits for a value, or for new facts; `None` if its client has given up.
    Reading(Option<Frame>, Option<Address>),
    /// The answer of the device waits until the drive has taken the value; `None` if the client has given up.
    Writing(Option<Frame>, Address, i64),
}

impl<D: Door> Gateway<D> {
    /// A gateway to a drive of this kind. The node is silent until the drive answers, and then boots.
    #[must_use]
    pub fn new(model: &'static Model, node: NodeId, door: D) -> Self {
        Gateway {
            model,
            device: Device::new(node, model.behaviour),
            storage: (model.storage)(node),
            door,
            face: Face::new(),
            facts: Facts::default(),
            stale: Instant::ZERO,
            patience: None,
            connected: false,
            known: false,
            released: false,
            effects: Vec::new(),
            waiting: VecDeque::new(),
            current: None,
            outgoing: VecDeque::new(),
        }
    }

    /// The door.
    #[must_use]
    pub fn door(&self) -> &D {
        &self.door
    }

    /// The door, for its carrier.
    pub fn door_mut(&mut self) -> &mut D {
        &mut self.door
    }

    /// The node-ID.
    #[must_use]
    pub fn node(&self) -> NodeId {
        self.device.node()
    }

    /// Whether the drive has answered, and has not been lost since.
    #[must_use]
    pub fn is_connected(&self) -> bool {
        self.connected
    }

    /// How long an SDO client has to wait before it may take the drive for silent. The door may have a job, and a
    /// control word that takes two more (a look, and its order), before the job of the request.
    #[must_use]
    pub fn answers_within(&self) -> Duration {
        self.door.worst_job().times(4)
    }

    /// Whether an order or a request is on its way.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.current.is_some() || !self.waiting.is_empty()
    }

    /// Handles what has come over the line. To be called after each event of the carrier.
    pub fn advance(&mut self, now: Instant) {
        while let Some(report) = self.door.poll(now) {
            match report {
                Report::Facts(facts) => self.see(now, facts),
                Report::Done(result) => self.conclude(now, result),
                Report::Lost => self.lose(),
            }
        }
        if self.connected && self.stale <= now && *self.patience.get_or_insert(now + self.door.worst_cycle()) <= now {
            self.door.lose(now);
            self.lose();
        }
        self.work(now);
        self.settle();
    }

    fn lose(&mut self) {
        let disables = matches!(self.current, Some(Current::Disabling)) || self.waiting.contains(&Task::Disable);
        let releases = matches!(self.current, Some(Current::Ordering(Step { order: Order::Release, .. })));
        self.released |= disables || releases;
        self.connected = false;
        self.current = None;
        self.waiting.clear();
        // Only this job takes the torque away.
        self.waiting.extend(disables.then_some(Task::Disable));
        self.outgoing.clear();
    }

    fn see(&mut self, now: Instant, measured: Measured<Facts>) {
        let facts = measured.value;
        self.facts = facts;
        (self.stale, self.patience) = (measured.at + self.door.worst_cycle(), None);
        let came = !std::mem::replace(&mut self.connected, true);
        let is_releasing = matches!(self.current, Some(Current::Ordering(Step { order: Order::Release, .. })));
        let change = self.face.see(&facts, is_releasing);
        let was_released = came && std::mem::take(&mut self.released);
        let restarted = change == Some(Change::Released) && !was_released;
        if came && (!std::mem::replace(&mut self.known, true) || restarted) {
            self.restart(now);
        } else if came {
            self.waiting.push_back(Task::ReadMode);
        }
        match change {
            Some(Change::Fault) => self.waiting.push_back(Task::ReportFault),
            Some(Change::NoFault) => {
                self.with_device(|device, od| device.clear(ErrorRegister(0xFF), od));
            }
            Some(Change::Released) | None => {}
        }
    }

    /// Restarts the node, at power-on or after a reset: the communication objects get their defaults.
    fn restart(&mut self, now: Instant) {
        let node = self.device.node();
        self.storage = (self.model.storage)(node);
        for (address, value) in self.model.constants {
            self.storage.set_raw(*address, *value);
        }
        self.with_device(|device, od| device.restart_as(node, now, od));
        self.waiting.push_front(Task::ReadMode);
    }

    /// Goes on with the waiting tasks, until the door has a job.
    fn work(&mut self, now: Instant) {
        while self.connected && self.current.is_none() {
            let Some(task) = self.waiting.pop_front() else { return };
            match task {
                Task::Control(control) if self.face.needs_look(control) => {
                    self.begin(now, Current::Judging(control), Job::Look);
                }
                Task::Control(control) => self.judge(now, control),
                Task::Serve(frame) => self.serve(now, frame),
                Task::Hear(frame) => self.hear(now, &frame),
                Task::Disable => {
                    self.begin(now, Current::Disabling, Job::Order { order: Order::Release, target: 0 });
                }
                Task::Restart => self.restart(now),
                Task::ReadMode => self.begin(now, Current::ReadingMode, Job::Read(MODE)),
                Task::ReportFault => self.begin(now, Current::ReadingFault, Job::Read(LATEST_FAULT)),
            }
        }
    }

    fn begin(&mut self, now: Instant, current: Current, job: Job) {
        self.current = Some(current);
        self.door.begin(now, job);
    }

    fn judge(&mut self, now: Instant, control: Control) {
        if let Some(step) = self.face.take(control, &self.facts) {
            let Step { order, target, .. } = step;
            self.begin(now, Current::Ordering(step), Job::Order { order, target });
        }
    }

    /// Handles the end of the door's job.
    fn conclude(&mut self, now: Instant, result: Result<i64, AbortCode>) {
        match self.current.take() {
            None => {}
            // If the look fails, the last facts count.
            Some(Current::Judging(control)) => self.judge(now, control),
            Some(Current::Ordering(step)) => {
                let outcome = match result {
                    Ok(_) => Outcome::Done,
                    Err(AbortCode::LOCAL_CONTROL) => Outcome::Overruled,
                    Err(AbortCode::HARDWARE_ERROR) => Outcome::Unknown,
                    Err(_) => Outcome::Refused,
                };
                self.face.conclude(step, outcome, &self.facts);
            }
            // Repeated, since only this job takes the torque away.
            Some(Current::Disabling) if result == UNKNOWN && !self.facts.has(system::MOTOR_RELEASED) => {
                self.waiting.push_front(Task::Disable);
            }
            Some(Current::Disabling) => self.face.disable(),
            Some(Current::ReadingMode) if result == UNKNOWN => self.waiting.push_front(Task::ReadMode),
            Some(Current::ReadingMode) => self.take_mode(result.unwrap_or_default()),
            Some(Current::ReadingFault) => self.report_fault(result.unwrap_or_default() as u16),
            Some(Current::Reading(frame, address)) => {
                if let (Ok(value), Some(address)) = (result, address) {
                    self.keep(address, value);
                }
                if let Some(frame) = frame {
                    self.answer(now, &frame, result.err());
                }
            }
            Some(Current::Writing(answer, address, value)) => {
                if result.is_ok() {
                    self.keep(address, value);
                    self.waiting.extend((address.index() == RESTORE).then_some(Task::ReadMode));
                }
                let refused = result.err().map(|code| ServerResponse::Abort(Abort { address, code }));
                let frame = |response: ServerResponse| Frame::from_array(self.answers(), response.to_bytes());
                self.outgoing.extend(answer.map(|answer| refused.map_or(answer, frame)));
            }
        }
    }

    fn keep(&mut self, address: Address, value: i64) {
        self.storage.set_raw(address, value as u64);
        match address {
            MODE => self.take_mode(value),
            POSITION => self.facts.position = value as i32,
            VELOCITY => self.facts.velocity = value as i32,
            _ => {}
        }
    }

    fn take_mode(&mut self, value: i64) {
        self.face.set_mode(match value {
            1 => Some(Mode::Positioning),
            2 => Some(Mode::Velocity),
            _ => None,
        });
    }

    fn report_fault(&mut self, code: u16) {
        let fault = self.model.faults.iter().find(|fault| fault.code.number == code);
        let register = fault.map_or(ErrorRegister::GENERIC, |fault| ErrorRegister(fault.register));
        self.with_device(|device, od| device.emergency_unrecorded(ErrorCode(code), register, [0; 5], od));
    }

    fn hear(&mut self, now: Instant, frame: &Frame) {
        let event = self.with_device(|device, od| device.handle_frame(now, frame, od));
        self.follow(event);
        self.take_effects();
    }

    /// Serves an SDO request, at once or when the door has answered.
    fn serve(&mut self, now: Instant, frame: Frame) {
        let read = match ClientRequest::parse(frame.data()) {
            Some(ClientRequest::InitiateUpload { address } | ClientRequest::InitiateBlockUpload { address, .. }) => {
                self.storage.entry(address).ok().filter(|entry| entry.access.is_readable()).map(|_| address)
            }
            _ => None,
        };
        let Some(address) = read else { return self.answer(now, &frame, None) };
        match place(&self.door, address, self.target()) {
            Place::Door => self.begin(now, Current::Reading(Some(frame), Some(address)), Job::Read(address)),
            Place::Fact => self.begin(now, Current::Reading(Some(frame), None), Job::Look),
            Place::Own | Place::Missing => self.answer(now, &frame, None),
        }
    }

    /// Lets the device answer an SDO request; if it writes an object of the door, the answer waits.
    fn answer(&mut self, now: Instant, frame: &Frame, refusal: Option<AbortCode>) {
        self.settle();
        self.with_objects(true, refusal, |device, od| device.handle_frame(now, frame, od));
        let writes = self.effects.iter().find_map(|effect| match *effect {
            Effect::Write(address, value) => Some((address, value)),
            Effect::Control(_) | Effect::ControlWithoutTarget(_) => None,
        });
        self.take_effects();
        let Some((address, value)) = writes else { return };
        let answers = self.answers();
        let mut answer = None;
        while let Some(frame) = self.with_device(|device, od| device.poll_transmit(now, od)) {
            if frame.id() == answers {
                answer = Some(frame);
                break;
            }
            self.outgoing.push_back(frame);
        }
        self.begin(now, Current::Writing(answer, address, value), Job::Write(address, value));
    }

    fn follow(&mut self, event: Option<Event>) {
        match event {
            // As the drive on CAN: taking command finds the motor released, and giving it up releases the motor.
            Some(Event::StateChanged(_)) => self.disable(),
            Some(Event::Reset(_)) => {
                self.disable();
                self.waiting.push_back(Task::Restart);
            }
            Some(Event::RpdoRefused { .. }) => self.miss_target(),
            Some(Event::Sync { .. })
                if self.device.applied().any(|(_, event)| matches!(event, rpdo::Event::Refused { .. })) =>
            {
                self.miss_target();
            }
            _ => {}
        }
    }

    fn disable(&mut self) {
        self.waiting.retain(|task| !matches!(task, Task::Control(_)));
        if let Some(Current::Judging(_)) = self.current {
            self.current = Some(Current::Reading(None, None));
        }
        if has_torque(self.face.state()) || !self.facts.has(system::MOTOR_RELEASED) {
            self.waiting.push_back(Task::Disable);
        } else {
            self.face.disable();
        }
    }

    /// Notes that the target of a control word is out of range.
    fn miss_target(&mut self) {
        for effect in &mut self.effects {
            if let Effect::Control(word) = *effect {
                *effect = Effect::ControlWithoutTarget(word);
            }
        }
    }

    /// Takes control words, which are valid in OPERATIONAL only.
    fn take_effects(&mut self) {
        let effects = std::mem::take(&mut self.effects);
        if self.device.nmt_state() != NmtState::Operational {
            return;
        }
        let number = |address| self.storage.number(address).unwrap_or_default() as i32;
        let (position, velocity) = (number(TARGET_POSITION), number(TARGET_VELOCITY));
        for effect in effects {
            let (word, has_target) = match effect {
                Effect::Control(word) => (word, true),
                Effect::ControlWithoutTarget(word) => (word, false),
                Effect::Write(..) => continue,
            };
            let task = Task::Control(Control { word, has_target, position, velocity });
            if self.waiting.back() == Some(&task) {
                continue;
            }
            let waiting = self.waiting.iter().filter(|task| matches!(task, Task::Control(_))).count();
            if waiting >= MOST_WAITING
                && let Some(oldest) = self.waiting.iter().position(|task| matches!(task, Task::Control(_)))
            {
                self.waiting.remove(oldest);
            }
            self.waiting.push_back(task);
        }
    }

    /// Brings the dictionary up to date.
    fn settle(&mut self) {
        let remote = self.device.nmt_state() != NmtState::PreOperational;
        let status_word = self.face.status_word(self.model, &self.facts, remote);
        for (address, value) in [
            (STATUS_WORD, i64::from(status_word)),
            (SYSTEM_STATUS, self.facts.system.into()),
            (POSITION, self.facts.position.into()),
            (VELOCITY, self.facts.velocity.into()),
        ] {
            self.storage.set_raw(address, value as u64);
        }
        self.with_device(|device, od| device.compare(od));
    }

    fn target(&self) -> Option<Address> {
        Some(match self.face.mode()? {
            Mode::Positioning => TARGET_POSITION,
            Mode::Velocity => TARGET_VELOCITY,
        })
    }

    fn answers(&self) -> CobId {
        CobId::of_node(SDO_ANSWER, self.device.node())
    }

    fn with_device<T>(&mut self, call: impl FnOnce(&mut Device<4, 4, 1, 0>, &mut Objects<'_, D>) -> T) -> T {
        self.with_objects(false, None, call)
    }

    fn with_objects<T>(
        &mut self,
        by_sdo: bool,
        refusal: Option<AbortCode>,
        call: impl FnOnce(&mut Device<4, 4, 1, 0>, &mut Objects<'_, D>) -> T,
    ) -> T {
        let target = self.target();
        let mut od = Objects {
            storage: &mut *self.storage,
            door: &self.door,
            target,
            by_sdo,
            refusal,
            effects: &mut self.effects,
        };
        call(&mut self.device, &mut od)
    }
}

/// COB-IDs of the SDO server, without the node-ID.
const SDO_REQUEST: u16 = 0x600;
const SDO_ANSWER: u16 = 0x580;

/// A write to 1011h may change the mode.
const RESTORE: u16 = cia301::RESTORE_DEFAULT_PARAMETERS;

/// The door does not know whether its job was carried out.
const UNKNOWN: Result<i64, AbortCode> = Err(AbortCode::HARDWARE_ERROR);

impl<D: Door> Node for Gateway<D> {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        self.advance(now);
        let asks = frame.id() == CobId::of_node(SDO_REQUEST, self.device.node());
        // A program that has just started sends requests and commands before the drive has answered for the first time.
        if !self.connected && (self.known || !asks) {
            let waits = !self.known && frame.id() == CobId::NMT && self.waiting.len() < MOST_WAITING;
            self.waiting.extend(waits.then_some(Task::Hear(*frame)));
            return;
        }
        if asks {
            // A client has one request at a time: a new one means that it has given up the previous one.
            self.waiting.retain(|task| !matches!(task, Task::Serve(_)));
            if let Some(Current::Reading(held, _) | Current::Writing(held, ..)) = &mut self.current {
                *held = None;
            }
            self.waiting.push_back(Task::Serve(with_size_of_object(self.model, &*self.storage, frame)));
        } else {
            self.hear(now, frame);
        }
        self.work(now);
        self.settle();
    }

    fn handle_timeout(&mut self, now: Instant) {
        if self.door.poll_timeout().is_some_and(|deadline| deadline <= now) {
            self.door.handle_timeout(now);
        }
        if self.connected {
            self.with_device(|device, od| device.handle_timeout(now, od));
        }
        self.advance(now);
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        if !self.connected || self.stale <= now {
            return None;
        }
        loop {
            let next = self.outgoing.pop_front();
            let frame = next.or_else(|| self.with_device(|device, od| device.poll_transmit(now, od)))?;
            if !is_switched_off(self.model, &*self.storage, &frame) {
                return Some(frame);
            }
        }
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let own = [self.device.poll_timeout(), self.patience.or(Some(self.stale))]
            .map(|deadline| deadline.filter(|_| self.connected));
        own.into_iter().chain([self.door.poll_timeout()]).flatten().min()
    }
}
