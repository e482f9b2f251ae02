//! The AG02 behind its serial port as a CANopen node: a [`Door`] of [`siko::gateway`].
//!
//! # Translation
//!
//! | on CAN | on the line |
//! |---|---|
//! | Enable Operation | nothing: `M`, `Y`, `,` and `.` take the motor into control, and until then it has no torque |
//! | New Setpoint, or the falling edge of Stop in velocity mode | `F0` with the target, `E0` to compare, `M` |
//! | Stop / its falling edge in a travel | `O` / `M` |
//! | bit 13; bits 14, 15 | `Y`; `,` or `.` every 50 ms |
//! | Quick Stop; any way out of OPERATION ENABLED | `N`; `P` |
//! | Fault Reset | `S11103` |
//! | 6041h, 1002h | `R`: before it is answered, after every order, every 20 ms in motion, every 100 ms otherwise |
//! | an object of chapter 8 | `E`, `G` or `Q`; `F`, `H`, `L`, `T` or `X`, and read back |
//! | 1003h | `J0`, `J1`, `S11105` |
//! | 1011h | `S11100` to `S11102`, `S11104` |
//! | 100Ah, 2102h | `A1`, `A3` |
//! | EMCY | `J1` when bit 8 of `R` rises |
//!
//! Refusals become abort codes: 01 is 0602 0000h, 02 and 09 are 0609 0030h, 03 is 0800 0021h, all others are 0800
//! 0022h. A command that was not answered, or a value that was not read back as written, is 0606 0000h: it is not known
//! whether the drive has carried it out.
//!
//! # Without a checksum
//!
//! A changed status word counts once it has been read twice, a set-point once it has been read back. Two things cannot
//! be noticed: noise that changes a digit of a position, and noise that turns the letter of a command into another one,
//! which the drive then carries out.

mod objects;

use std::collections::VecDeque;

use lexican_runtime::host::LinkError;
use lexican_runtime::object::Address;
use lexican_runtime::{AbortCode, Duration, Instant, Measured, NodeId};
use siko::gateway::{Carrier, Door, Facts, Gateway, GatewayLink, GatewayNode, Job, Report};
use siko::order::{Braking, Order};
use siko::words::system;
use siko_ag02::model::MODEL;

use crate::answer::{Answer, Reply};
use crate::client::{Client, Event, NotTaken, PROBES, Settings, Trouble};
use crate::command::{Command, Long, Setting};
use crate::error::ErrorNumber;
use crate::line::Line;
use crate::telegram::Telegram;

/// The node-ID of a new AG02 on CAN. The line has no node-ID, so any other will do.
pub const NODE: NodeId = NodeId::literal(127);

/// How often the status is read in motion, and at rest.
const IN_MOTION: Duration = Duration::from_millis(20);
const AT_REST: Duration = Duration::from_millis(100);
/// How often position and velocity are read in motion, and at rest.
const VALUES_IN_MOTION: Duration = Duration::from_millis(100);
const VALUES_AT_REST: Duration = Duration::from_secs(1);
/// How much later either is read at the latest, whatever else there is to do.
const OVERDUE: Duration = Duration::from_millis(500);
/// The pause between two attempts to reach a drive that does not answer.
const PAUSE: Duration = Duration::from_millis(500);
/// How often in a row a repeatable command is sent.
const ATTEMPTS: u8 = 3;

/// An AG02 behind its serial port, as a link.
pub type SerialLink<L> = GatewayLink<SerialDoor, Wire<L>>;
/// An AG02 behind a simulated line, as a node of a virtual bus.
pub type SerialNode<L> = GatewayNode<SerialDoor, Wire<L>>;

/// A link to a drive at the end of a line, under any node-ID, such as [`NODE`].
#[must_use]
pub fn link<L: Line>(line: L, settings: Settings, node: NodeId) -> SerialLink<L> {
    GatewayLink::new(Gateway::new(&MODEL, node, SerialDoor::new(settings)), Wire(line))
}

/// A drive at the end of a simulated line, as a node of a virtual bus.
#[must_use]
pub fn node<L: Line>(line: L, settings: Settings, node: NodeId) -> SerialNode<L> {
    GatewayNode::new(Gateway::new(&MODEL, node, SerialDoor::new(settings)), Wire(line))
}

/// A link to a drive at a port of the operating system, such as `/dev/ttyUSB0` or `COM3`.
#[cfg(feature = "serialport")]
pub fn open(
    path: &str,
    settings: Settings,
    node: NodeId,
) -> std::io::Result<SerialLink<crate::Port<Box<dyn serialport::SerialPort>>>> {
    Ok(link(crate::Port::open(path, settings.baud)?, settings, node))
}

/// The carrier of a [`SerialDoor`] over a line.
#[derive(Clone, Debug)]
pub struct Wire<L>(pub L);

impl<L: Line> Carrier<SerialDoor> for Wire<L> {
    fn now(&self) -> Instant {
        self.0.now()
    }

    fn carry(&mut self, door: &mut SerialDoor, until: Instant) -> Result<(), LinkError> {
        let now = self.0.now();
        while let Some(telegram) = door.poll_transmit(now) {
            self.0.send(telegram.as_bytes())?;
        }
        let mut buffer = [0; 64];
        let until = door.poll_timeout().map_or(until, |deadline| deadline.min(until));
        let len = self.0.receive(until, &mut buffer)?;
        door.handle_bytes(self.0.now(), buffer.get(..len).unwrap_or_default());
        Ok(())
    }

    fn is_real_time(&self) -> bool {
        self.0.is_real_time()
    }

    fn next_event(&self) -> Option<Instant> {
        self.0.next_event()
    }
}

/// The door to a serial port, without I/O.
#[derive(Clone, Debug)]
pub struct SerialDoor {
    client: Client,
    /// With the time of the status word; `None` while the drive does not answer.
    facts: Option<Measured<Facts>>,
    /// The time of position and velocity; `None` until both are known, and facts are not reported before.
    measured: Option<Instant>,
    /// A changed status word that has been read once.
    candidate: Option<u16>,
    job: Option<Active>,
    /// The command under way, and whether it belongs to the job.
    asked: Option<(Command, bool)>,
    sent: Instant,
    /// How often in a row it has been sent.
    attempts: u8,
    /// When the status is due; kept until a status word counts.
    next_status: Instant,
    /// When the last reading of position and velocity was due.
    values_since: Option<Instant>,
    /// The commands still to be sent for it.
    values: &'static [Command],
    reports: VecDeque<Report>,
}

/// A job, and its remaining commands.
#[derive(Clone, Debug)]
struct Active {
    job: Job,
    commands: VecDeque<Command>,
    /// The value that its last command should read.
    expected: Option<i64>,
    /// Whether the status has to be read before the job ends.
    looks: bool,
    result: Result<i64, AbortCode>,
}

impl SerialDoor {
    /// The port of a drive.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        SerialDoor {
            client: Client::new(settings),
            facts: None,
            measured: None,
            candidate: None,
            job: None,
            asked: None,
            sent: Instant::ZERO,
            attempts: 0,
            next_status: Instant::ZERO,
            values_since: None,
            values: &[],
            reports: VecDeque::new(),
        }
    }

    /// The next bytes to send.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Telegram> {
        self.ask(now);
        self.client.poll_transmit(now).inspect(|_| self.sent = now)
    }

    /// Takes bytes of the drive.
    pub fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) {
        let event = self.client.handle_bytes(now, bytes);
        self.take(now, event);
    }

    /// Gives the client its next command, if it is free and there is one.
    fn ask(&mut self, now: Instant) {
        let Some(asked) = self.next(now) else { return };
        match self.client.request(asked.0) {
            Ok(()) => {
                self.take_from_job(asked);
                self.asked = Some(asked);
            }
            Err(NotTaken::Busy) => {}
            Err(NotTaken::TooManyDigits) => self.end_job(Err(AbortCode::INVALID_VALUE)),
        }
    }

    /// The next command, and whether it belongs to the job.
    fn next(&self, now: Instant) -> Option<(Command, bool)> {
        // A sequence of jobs must not keep it from reading the status.
        if self.next_status + OVERDUE <= now {
            return Some((Command::Status, false));
        }
        if let Some(command) = self.values.first()
            && self.values_since.is_some_and(|since| since + OVERDUE <= now)
        {
            return Some((*command, false));
        }
        if let Some(command) = self.job.as_ref().and_then(|job| job.commands.front()) {
            return Some((*command, true));
        }
        let is_due = self.job.is_some() || self.next_status <= now;
        let command = if is_due { Some(Command::Status) } else { self.values.first().copied() };
        command.map(|command| (command, false))
    }

    fn take_from_job(&mut self, (_, of_job): (Command, bool)) {
        if let Some(job) = self.job.as_mut().filter(|_| of_job) {
            job.commands.pop_front();
        }
    }

    fn take(&mut self, now: Instant, event: Option<Event>) {
        let Some(event) = event else { return };
        // Without a command it is trouble of inching, which ends then; the facts show it.
        let Some((command, of_job)) = self.asked.take() else { return };
        if let Event::Answered(_) = event {
            self.attempts = 0;
        }
        match event {
            Event::Answered(Answer::Status(word)) => self.see(now, word),
            Event::Failed(Trouble::Silent) => self.give_up(now),
            Event::Failed(_) => {
                self.attempts += 1;
                if command == Command::Status && self.attempts >= ATTEMPTS {
                    self.give_up(now);
                } else if of_job {
                    self.fail(command);
                }
            }
            Event::Answered(answer) if of_job => self.go_on(now, command, answer),
            Event::Answered(answer) => {
                let (Some(number), Some(facts)) = (answer.number(), &mut self.facts) else { return };
                let shown = &mut facts.value;
                let place = if command == Command::Position { &mut shown.position } else { &mut shown.velocity };
                let has_changed = std::mem::replace(place, number) != number;
                self.values = self.values.get(1..).unwrap_or_default();
                let are_all = self.values.is_empty();
                if are_all {
                    self.measured = self.values_since;
                }
                if has_changed || are_all {
                    self.report_facts();
                }
            }
            Event::Sent => {}
        }
    }

    /// Goes on with the job after one of its commands was answered.
    fn go_on(&mut self, now: Instant, command: Command, answer: Answer) {
        let Some(job) = &mut self.job else { return };
        let address = match job.job {
            Job::Read(address) | Job::Write(address, _) => Some(address),
            Job::Order { .. } | Job::Look => None,
        };
        let value = match address {
            Some(address) => objects::value(address, answer),
            None => answer.number().map(i64::from),
        };
        match (answer, job.expected) {
            (Answer::Refused(number), _) => {
                job.result = Err(abort_code(number));
                job.commands.clear();
            }
            (_, Some(expected)) if command.is_read() && value != Some(expected) => {
                job.result = Err(AbortCode::HARDWARE_ERROR);
                job.commands.clear();
            }
            _ if command.is_read() && address.is_some() => job.result = value.ok_or(AbortCode::HARDWARE_ERROR),
            _ => {}
        }
        if job.commands.is_empty() && !job.looks {
            let result = job.result;
            // The write may have changed the position, or the window around it.
            self.next_status = self.next_status.min(now);
            self.end_job(result);
        }
    }

    /// Handles a command of the job that was not answered: a repeatable one is sent again.
    fn fail(&mut self, command: Command) {
        let Some(job) = &mut self.job else { return };
        if command.may_be_repeated() && self.attempts < ATTEMPTS {
            job.commands.push_front(command);
            return;
        }
        job.result = Err(AbortCode::HARDWARE_ERROR);
        job.commands.clear();
        if !job.looks {
            let result = job.result;
            self.end_job(result);
        }
    }

    fn end_job(&mut self, result: Result<i64, AbortCode>) {
        self.job = None;
        self.attempts = 0;
        self.reports.push_back(Report::Done(result));
    }

    /// Takes a status word. A changed one counts once it has been read twice.
    fn see(&mut self, now: Instant, word: u16) {
        let before = self.facts.map(|facts| facts.value.system);
        if before != Some(word) && self.candidate.replace(word) != Some(word) {
            return;
        }
        self.candidate = None;
        if word & !before.unwrap_or(word) & (system::FAULT | system::MOTOR_RELEASED) != 0 {
            // If inching went on, the drive would move again as soon as it could.
            self.client.stop_inching();
        }
        let moves = word & (system::MOVING | system::POSITIONING) != 0 || self.client.is_inching();
        let (status, values) = if moves { (IN_MOTION, VALUES_IN_MOTION) } else { (AT_REST, VALUES_AT_REST) };
        self.next_status = now + status;
        let ended = before.is_some_and(|before| before & !word & system::MOVING != 0);
        if self.values.is_empty() && (ended || self.values_since.is_none_or(|since| now >= since + values)) {
            self.values = VALUES;
            self.values_since = Some(now);
        }
        let known = self.facts.map(|facts| facts.value).unwrap_or_default();
        self.facts = Some(Measured::new(Facts { system: word, ..known }, self.sent));
        self.report_facts();
        let looks = self.job.as_ref().filter(|job| job.commands.is_empty()).map(|job| job.result);
        if let Some(result) = looks {
            self.end_job(result);
        }
    }

    /// Reports the facts, with the time of the oldest of them.
    fn report_facts(&mut self) {
        if let (Some(facts), Some(measured)) = (self.facts, self.measured) {
            self.reports.push_back(Report::Facts(Measured::new(facts.value, facts.at.min(measured))));
        }
    }

    /// The longest time that a command takes.
    fn exchange(&self) -> Duration {
        self.client.settings().exchange(Telegram::MOST, Reply::Letters)
    }

    /// Gives up on a drive that does not answer.
    fn give_up(&mut self, now: Instant) {
        (self.job, self.candidate, self.attempts) = (None, None, 0);
        (self.values, self.values_since) = (&[], None);
        self.next_status = now + PAUSE;
        let was_known = self.measured.take().is_some();
        if self.facts.take().is_some() && was_known {
            self.reports.push_back(Report::Lost);
        }
    }

    fn order(&mut self, now: Instant, order: Order, target: i32) -> Vec<Command> {
        // The characters of inching are orders, too.
        self.client.stop_inching();
        match order {
            Order::Enable | Order::StopInching => vec![],
            Order::Hold => vec![Command::EmergencyStop],
            Order::Release => vec![Command::Release],
            Order::Start => {
                let setpoint = Long::Setpoint;
                vec![Command::WriteLong(setpoint, target), Command::ReadLong(setpoint), Command::Start]
            }
            Order::Resume => vec![Command::Start],
            Order::Interrupt(Braking::Programmed) => vec![Command::Stop],
            Order::Interrupt(Braking::Full) => vec![Command::EmergencyStop],
            Order::Abort(_) => vec![Command::Abort],
            Order::Step => vec![Command::Step],
            Order::Inch(direction) => {
                self.client.start_inching(now, direction);
                vec![]
            }
            Order::ResetFault => vec![Command::Set(Setting::ResetFault)],
        }
    }
}

/// Read in addition to the status.
const VALUES: &[Command] = &[Command::Position, Command::Velocity];

impl Door for SerialDoor {
    fn has(&self, address: Address) -> bool {
        objects::has(address)
    }

    fn begin(&mut self, now: Instant, job: Job) {
        let (commands, expected) = match job {
            Job::Read(address) => match objects::read(address) {
                Some(command) => (vec![command], None),
                None => return self.end_job(Err(AbortCode::NO_SUCH_OBJECT)),
            },
            Job::Write(address, value) => match (objects::write(address, value), objects::read(address)) {
                (Err(code), _) => return self.end_job(Err(code)),
                (Ok(write), Some(read)) => (vec![write, read], Some(value)),
                (Ok(write), None) => (vec![write], None),
            },
            Job::Order { order, target } => (self.order(now, order, target), Some(target.into())),
            Job::Look => (vec![], None),
        };
        let looks = matches!(job, Job::Order { .. } | Job::Look);
        self.attempts = 0;
        self.job = Some(Active { job, commands: commands.into(), expected, looks, result: Ok(0) });
    }

    /// At rest, position and velocity are due with the next status; they are read after a job, or before it if they are
    /// overdue. If an answer is lost, the client first has to recover.
    fn worst_cycle(&self) -> Duration {
        VALUES_AT_REST + AT_REST + OVERDUE.times(2) + self.worst_job() + self.exchange().times((PROBES + 3).into())
    }

    /// A start takes four commands: set-point, reading it back, start, and the status, which has to be read twice.
    /// Another command may be under way before.
    fn worst_job(&self) -> Duration {
        self.exchange().times(6)
    }

    fn lose(&mut self, now: Instant) {
        self.client.abandon();
        self.client.stop_inching();
        self.asked = None;
        self.give_up(now);
        self.reports.clear();
    }

    fn poll(&mut self, _: Instant) -> Option<Report> {
        self.reports.pop_front()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let at_once = self.job.is_some() || !self.values.is_empty();
        let due = if at_once { Instant::ZERO } else { self.next_status };
        self.client.poll_timeout().into_iter().chain((!self.client.is_busy()).then_some(due)).min()
    }

    fn handle_timeout(&mut self, now: Instant) {
        let event = self.client.handle_timeout(now);
        self.take(now, event);
    }
}

/// The abort code for a refusal of table 4.
fn abort_code(number: ErrorNumber) -> AbortCode {
    match number {
        ErrorNumber::PARAMETER_NUMBER => AbortCode::NO_SUCH_OBJECT,
        ErrorNumber::VALUE_RANGE | ErrorNumber::SETPOINT_BEYOND_LIMIT => AbortCode::INVALID_VALUE,
        ErrorNumber::NO_AUTHORITY => AbortCode::LOCAL_CONTROL,
        _ => AbortCode::DEVICE_STATE,
    }
}
