//! A drive behind PROFIBUS as a CANopen node: objects are read and written as parameters (PNU), orders are sent as
//! control words.

use lexican_driver::ByteOrder;
use lexican_profibus::pkw::{Access, Format, Refusal, Reply, Task, Value};
use lexican_runtime::object::Address;
use lexican_runtime::{AbortCode, Duration, Instant, Measured};
use siko::gateway::{Door, Facts, Job, Report};
use siko::state::Mode;
use siko::words::generic;

use crate::master::{DriveMaster, Event, REACTION};
use crate::model::Model;
use crate::table::{Content, Row};

/// How often facts are reported if at most the position has changed.
const REPORTS: Duration = Duration::from_millis(10);

/// What is written to 1011h to restore parameters (CiA 301, 7.5.2.14).
const LOAD: i64 = u32::from_le_bytes(*b"load") as i64;

const FAULTS: u16 = 0x1003;
const VERSION: Address = Address::new(0x100A, 0);
const RESTORE: u16 = 0x1011;
const POSITION: Address = Address::new(0x6064, 0);
const VELOCITY: Address = Address::new(0x606C, 0);
const GENERIC_STATUS: Address = Address::new(0x2420, 0);
const TORQUE_DEACTIVATION_STATE: Address = Address::new(0x2422, 0);

/// A drive on PROFIBUS, as the door of a [`Gateway`](siko::gateway::Gateway).
///
/// | object | here |
/// |---|---|
/// | 1002h, and what 6041h is made of | PNU 1020, read whenever no other task is under way, and the fault bit of ZSW |
/// | 1003h | PNU 952 and 945, whose letters become codes; writing 0 is PNU 970 = 4 |
/// | 100Ah | the version of the PROFIBUS firmware (PNU 965), as text |
/// | 1011h | PNU 970 |
/// | 6060h | PNU 930, where 1 and 2 change places |
/// | 6064h | HIW in positioning mode; in velocity mode PNU 1036, which the AG02 does not have: 0800 0022h |
/// | 606Ch | HIW in velocity mode; in positioning mode measured, see [`master::Facts`](crate::master::Facts) |
/// | 607Ah, 60FFh | HSW, with the order |
/// | 2422h | bit 7 of PNU 1031, which is 2420h |
/// | others | the parameter whose row has the object; without one, 0602 0000h before anything is sent |
#[derive(Clone, Debug)]
pub struct ProfibusDoor {
    model: &'static Model,
    master: DriveMaster,
    job: Option<Job>,
    end: Option<Result<i64, AbortCode>>,
    lost: bool,
    shown: Option<Shown>,
}

/// The last report.
#[derive(Clone, Copy, Debug)]
struct Shown {
    at: Instant,
    facts: Measured<Facts>,
}

impl ProfibusDoor {
    /// A door to a drive that does not exchange data yet.
    #[must_use]
    pub fn new(model: &'static Model) -> Self {
        ProfibusDoor { model, master: DriveMaster::new(), job: None, end: None, lost: false, shown: None }
    }

    /// The master's side of the drive.
    #[must_use]
    pub fn master(&self) -> &DriveMaster {
        &self.master
    }

    /// The master's side of the drive, for its carrier.
    pub fn master_mut(&mut self) -> &mut DriveMaster {
        &mut self.master
    }

    /// The parameter that holds an object, and the index in it.
    fn row(&self, address: Address) -> Option<(&'static Row, u16)> {
        let object_or_part = if address == TORQUE_DEACTIVATION_STATE { GENERIC_STATUS } else { address };
        let holds = |row: &&Row| match row.content {
            Content::Object(_) => row.parameter.element_of(object_or_part).is_some(),
            Content::Version => address == VERSION,
            Content::Load => address.index() == RESTORE && (1..=4).contains(&address.sub()),
            Content::Address | Content::InchingStop => false,
        };
        let row = self.model.table.iter().find(holds)?;
        Some((row, row.parameter.element_of(object_or_part).map_or(0, u16::from)))
    }

    /// The value of an object that is among the facts.
    fn fact(&self, address: Address) -> Option<i64> {
        let facts = self.master.facts()?.value;
        match (address, facts.mode) {
            (POSITION, Mode::Positioning) => Some(facts.position.into()),
            (VELOCITY, _) => Some(facts.velocity.into()),
            _ => None,
        }
    }

    fn read(&self, address: Address) -> Result<Asked, AbortCode> {
        self.master.facts().ok_or(AbortCode::HARDWARE_ERROR)?;
        if self.fact(address).is_some() {
            return Ok(Asked::Fact);
        }
        let Some((row, index)) = self.row(address) else {
            let is_elsewhere = address == POSITION;
            return Err(if is_elsewhere { AbortCode::DEVICE_STATE } else { AbortCode::NO_SUCH_OBJECT });
        };
        let number = row.wire.number;
        match (row.wire.access, row.wire.format.elements()) {
            (Access::Write, _) => Err(AbortCode::WRITE_ONLY),
            (_, Some(_)) => Ok(Asked::Task(Task::ReadElement { number, index })),
            (_, None) => Ok(Asked::Task(Task::Read { number })),
        }
    }

    fn write(&self, address: Address, value: i64) -> Result<Task, AbortCode> {
        // PNU 952 counts the faults, and is cleared by PNU 970.
        let load = match address.index() {
            FAULTS if address.sub() == 0 && value == 0 => Some(4),
            RESTORE if value == LOAD => Some(match address.sub() {
                // Calibrating is number 5, after clearing the faults.
                4 => 5,
                set => u32::from(set),
            }),
            FAULTS => return Err(AbortCode::INVALID_VALUE),
            RESTORE => return Err(AbortCode::CANNOT_TRANSFER),
            _ => None,
        };
        let rows = self.model.table.iter();
        let row = match load {
            Some(_) => rows.into_iter().find(|row| row.content == Content::Load),
            None => self.row(address).map(|(row, _)| row),
        };
        let row = row.ok_or(AbortCode::NO_SUCH_OBJECT)?;
        if row.wire.access == Access::Read {
            return Err(AbortCode::READ_ONLY);
        }
        let value = match load {
            Some(load) => load.into(),
            None => row.parameter.of_object(value).ok_or(AbortCode::INVALID_VALUE)?,
        };
        let value = match row.wire.format {
            Format::Word | Format::Words(_) => u16::try_from(value).map(Value::Word),
            Format::DoubleWord | Format::DoubleWords(_) => {
                i32::try_from(value).map(|value| Value::DoubleWord(value.cast_unsigned()))
            }
        };
        Ok(Task::Write { number: row.wire.number, value: value.map_err(|_| AbortCode::INVALID_VALUE)? })
    }

    /// The value of an object, from the value of its parameter.
    fn value(&self, address: Address, value: Value) -> i64 {
        let raw = value.number();
        let Some((row, _)) = self.row(address) else { return raw };
        match row.content {
            Content::Object(_) if address == TORQUE_DEACTIVATION_STATE => {
                i64::from(raw & i64::from(generic::TORQUE_DEACTIVATED) != 0)
            }
            // A letter that means no fault gives 0.
            Content::Object(_) => row.parameter.in_object(raw).unwrap_or(0),
            Content::Version => {
                let mut text = [b'.'; 4];
                let [major, minor] = (raw as u16).to_be_bytes();
                (text[0], text[2], text[3]) = (digit(major), digit(minor >> 4), digit(minor));
                let number = match self.model.description.identity.characters {
                    ByteOrder::HighFirst => u32::from_be_bytes(text),
                    ByteOrder::LowFirst | ByteOrder::Either => u32::from_le_bytes(text),
                };
                number.into()
            }
            _ => raw,
        }
    }

    fn conclude(&mut self, event: Event) {
        let result = match (event, self.job.take()) {
            (Event::Lost, _) => {
                (self.lost, self.end, self.shown) = (true, None, None);
                return;
            }
            (Event::Answered(reply), Some(Job::Read(address))) => match reply {
                Reply::Value(value) | Reply::Element(value) => Ok(self.value(address, value)),
                reply => Err(abort_of(reply)),
            },
            (Event::Looked, Some(Job::Read(address))) => self.fact(address).ok_or(AbortCode::HARDWARE_ERROR),
            (Event::Answered(Reply::Value(_)) | Event::Followed | Event::Looked, Some(_)) => Ok(0),
            (Event::Answered(reply), Some(_)) => Err(abort_of(reply)),
            // The drive has received the telegrams, and gives no reason.
            (Event::NotFollowed, Some(_)) => Err(AbortCode::DEVICE_STATE),
            (Event::Silent, Some(_)) => Err(AbortCode::HARDWARE_ERROR),
            (_, None) => return,
        };
        self.end = Some(result);
    }

    /// The facts if they are to be reported: at once when 1002h has changed or a job ends, otherwise periodically.
    fn news(&self, now: Instant) -> Option<Measured<Facts>> {
        let facts = self.master.facts()?.map(|facts| Facts {
            system: facts.system,
            position: facts.position,
            velocity: facts.velocity,
        });
        let Some(Shown { at, facts: shown }) = self.shown else { return Some(facts) };
        let is_due = facts.value.system != shown.value.system || self.end.is_some() || now.since(at) >= REPORTS;
        (is_due && facts != shown).then_some(facts)
    }
}

enum Asked {
    /// The value is among the facts, once they have been measured anew.
    Fact,
    Task(Task),
}

impl Door for ProfibusDoor {
    fn has(&self, address: Address) -> bool {
        matches!(address, POSITION | VELOCITY) || self.row(address).is_some()
    }

    fn begin(&mut self, now: Instant, job: Job) {
        self.job = Some(job);
        match job {
            Job::Read(address) => match self.read(address) {
                Ok(Asked::Task(task)) => self.master.ask(task),
                Ok(Asked::Fact) => self.master.look(),
                Err(code) => self.end = Some(Err(code)),
            },
            Job::Write(address, value) => match self.write(address, value) {
                Ok(task) => self.master.ask(task),
                Err(code) => self.end = Some(Err(code)),
            },
            Job::Order { order, target } => self.master.order(now, order, target),
            Job::Look => self.master.look(),
        }
    }

    /// Covers one task of an application, and all tasks of the master itself: PNU 1020, operating mode and units.
    fn worst_cycle(&self) -> Duration {
        REACTION.times(6)
    }

    /// Covers a task of the master, the job, and a reading of PNU 1020.
    fn worst_job(&self) -> Duration {
        REACTION.times(3)
    }

    fn lose(&mut self, _: Instant) {
        self.master.handle_offline();
        while self.master.poll().is_some() {}
        (self.job, self.end, self.shown) = (None, None, None);
    }

    fn poll(&mut self, now: Instant) -> Option<Report> {
        while let Some(event) = self.master.poll() {
            self.conclude(event);
        }
        if core::mem::take(&mut self.lost) {
            return Some(Report::Lost);
        }
        if let Some(facts) = self.news(now) {
            self.shown = Some(Shown { at: now, facts });
            return Some(Report::Facts(facts));
        }
        self.end.take().map(Report::Done)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.master.poll_timeout()
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.master.handle_timeout(now);
    }
}

const fn digit(bcd: u8) -> u8 {
    b'0' + (bcd & 0x0F)
}

/// The abort code for a reply without a value.
fn abort_of(reply: Reply) -> AbortCode {
    match reply {
        Reply::Refused(Refusal::NO_SUCH_PARAMETER) => AbortCode::NO_SUCH_OBJECT,
        Reply::Refused(Refusal::NO_SUCH_ELEMENT | Refusal::NO_ARRAY) => AbortCode::NO_SUCH_SUB_INDEX,
        Reply::Refused(Refusal::READ_ONLY) => AbortCode::READ_ONLY,
        Reply::Refused(Refusal::OUT_OF_RANGE | Refusal::RESET_ONLY) => AbortCode::INVALID_VALUE,
        Reply::Refused(Refusal::WRONG_TYPE) => AbortCode::LENGTH_MISMATCH,
        Reply::Refused(Refusal::NO_CONTROL) | Reply::NoAuthority => AbortCode::LOCAL_CONTROL,
        Reply::Refused(Refusal::WRONG_STATE) => AbortCode::DEVICE_STATE,
        _ => AbortCode::GENERAL,
    }
}
