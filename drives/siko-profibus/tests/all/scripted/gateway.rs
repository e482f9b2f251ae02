//! Objects are translated to parameters, and the master's facts to reports.

use lexican_profibus::pkw::{Refusal, Task, Value};
use lexican_runtime::object::Address;
use lexican_runtime::{AbortCode, Duration, Instant, Measured};
use siko::gateway::{Door, Facts, Job, Report};
use siko::order::Order;
use siko_profibus::{AG02, AG03_1, Model};

use super::rig::{Rig, SYSTEM};

const LOAD: i64 = 0x6461_6F6C;
const ORDER: Job = Job::Order { order: Order::Enable, target: 0 };

impl Rig {
    fn known(model: &'static Model, mode: u32) -> Self {
        let mut rig = Rig::offline(model, mode);
        rig.turns(20);
        rig.reports();
        rig
    }

    fn reports(&mut self) -> Vec<Report> {
        let reports: Vec<_> = std::iter::from_fn(|| self.door.poll(self.now)).take(20).collect();
        reports.into_iter().filter_map(|report| self.news(report)).collect()
    }

    /// The report without its time; `None` if nothing in it has changed.
    fn news(&mut self, report: Report) -> Option<Report> {
        let before = match report {
            Report::Facts(facts) => self.shown.replace(facts.value),
            Report::Lost => self.shown.take(),
            Report::Done(_) => return Some(report),
        };
        match report {
            Report::Facts(facts) if before == Some(facts.value) => None,
            Report::Facts(facts) => Some(Report::Facts(Measured::new(facts.value, Instant::ZERO))),
            other => Some(other),
        }
    }

    fn begin(&mut self, job: Job) {
        self.parameters.asked.clear();
        self.door.begin(self.now, job);
    }

    /// The result of a job.
    #[track_caller]
    fn job(&mut self, job: Job) -> Result<i64, AbortCode> {
        self.begin(job);
        for _ in 0..1000 {
            for report in self.reports() {
                if let Report::Done(result) = report {
                    return result;
                }
            }
            self.turn();
        }
        panic!("{job:?} does not end");
    }

    /// The tasks that it has sent, besides those for the status.
    fn asked(&self) -> Vec<Task> {
        self.parameters.asked.iter().copied().filter(|task| *task != Task::Read { number: SYSTEM }).collect()
    }
}

fn facts(system: u16, position: i32) -> Report {
    Report::Facts(Measured::new(Facts { system, position, velocity: 0 }, Instant::ZERO))
}

#[test]
fn objects_are_read_from_parameters_and_facts() {
    let [one, two] = [&AG03_1, &AG02];
    for (model, mode, index, sub, number, raw, value) in [
        (one, 2, 0x6060, 0, Some(930), 2, 1),
        (one, 1, 0x6060, 0, Some(930), 1, 2),
        (one, 2, 0x100A, 0, Some(965), 0x0123, i64::from(u32::from_le_bytes(*b"1.23"))),
        (two, 2, 0x100A, 0, Some(965), 0x0123, i64::from(u32::from_be_bytes(*b"1.23"))),
        (two, 2, 0x1003, 0, Some(952), 3, 3),
        (two, 2, 0x1003, 3, Some(945), 0x42, 0x7121),
        (two, 2, 0x1003, 3, Some(945), 0x5A, 0),
        (one, 2, 0x2410, 5, Some(1004), 30, 30),
        (one, 2, 0x607D, 1, Some(1017), -5, -5),
        (one, 2, 0x2420, 0, Some(1031), 0x91, 0x91),
        (one, 2, 0x2422, 0, Some(1031), 0x91, 1),
        (one, 2, 0x2422, 0, Some(1031), 0x7F, 0),
        (one, 1, 0x6064, 0, Some(1036), 77, 77),
        (one, 2, 0x6064, 0, None, 0, 100),
        (one, 1, 0x606C, 0, None, 0, 100),
        (one, 2, 0x606C, 0, None, 0, 0),
    ] {
        let (mut rig, address) = (Rig::known(model, mode), Address::new(index, sub));
        assert!(rig.door.has(address), "{address:?}");
        if let Some(number) = number {
            rig.parameters.values.insert(number, i32::cast_unsigned(raw));
        }
        assert_eq!(rig.job(Job::Read(address)), Ok(value), "{address:?}");
        let task = number.map(|number| match number {
            945 => Task::ReadElement { number, index: 2 },
            number => Task::Read { number },
        });
        assert_eq!(rig.asked(), Vec::from_iter(task));
    }
    let missing = [(0x5000, 0), (0x1010, 1), (0x1011, 5), (0x1011, 0), (0x2101, 0)];
    for (model, mode, address, code) in missing
        .map(|missing| (one, 2, missing, AbortCode::NO_SUCH_OBJECT))
        .into_iter()
        .chain([(one, 2, (0x1011, 1), AbortCode::WRITE_ONLY), (two, 1, (0x6064, 0), AbortCode::DEVICE_STATE)])
    {
        let (mut rig, address) = (Rig::known(model, mode), Address::new(address.0, address.1));
        assert_eq!(rig.door.has(address), code != AbortCode::NO_SUCH_OBJECT, "{address:?}");
        assert_eq!((rig.job(Job::Read(address)), rig.asked()), (Err(code), vec![]), "{address:?}");
    }
    let mut rig = Rig::offline(one, 2);
    assert_eq!(rig.job(Job::Read(Address::new(0x6064, 0))), Err(AbortCode::HARDWARE_ERROR), "it is not known yet");
}

/// The last exchange may be long ago: without an exchange there is no answer.
#[test]
fn a_position_is_read_after_it_was_asked_for() {
    for address in [0x6064, 0x606C].map(|index| Address::new(index, 0)) {
        let mut rig = Rig::known(&AG03_1, 2);
        rig.begin(Job::Read(address));
        let done = |rig: &mut Rig| {
            let reports = std::iter::from_fn(|| rig.door.poll(rig.now)).collect::<Vec<_>>();
            reports.into_iter().find(|report| matches!(report, Report::Done(_)))
        };
        assert_eq!(done(&mut rig), None, "{address}");
        rig.actual = 321;
        rig.turns(60);
        let seen = done(&mut rig);
        let is_now = |value| if address.index() == 0x6064 { value == 321 } else { value != 0 };
        assert!(matches!(seen, Some(Report::Done(Ok(value))) if is_now(value)), "{address}: {seen:?}");
    }
}

#[test]
fn objects_are_written_to_parameters() {
    let write = |number, value: i32| Task::Write { number, value: Value::DoubleWord(value.cast_unsigned()) };
    for (index, sub, value, number, raw) in [
        (0x6060, 0, 1, 930, 2),
        (0x6060, 0, 2, 930, 1),
        (0x2410, 5, 30, 1004, 30),
        (0x607D, 1, -5, 1017, -5),
        (0x1003, 0, 0, 970, 4),
        (0x1011, 1, LOAD, 970, 1),
        (0x1011, 2, LOAD, 970, 2),
        (0x1011, 3, LOAD, 970, 3),
        (0x1011, 4, LOAD, 970, 5),
    ] {
        let mut rig = Rig::known(&AG02, 2);
        assert_eq!(rig.job(Job::Write(Address::new(index, sub), value)), Ok(0), "{index:04X}");
        assert_eq!(rig.asked()[0], write(number, raw), "{index:04X}");
    }
    for (index, sub, value, code) in [
        (0x6060, 0, 3, AbortCode::INVALID_VALUE),
        (0x2410, 5, 70_000, AbortCode::INVALID_VALUE),
        (0x607D, 1, 1 << 40, AbortCode::INVALID_VALUE),
        (0x1003, 0, 1, AbortCode::INVALID_VALUE),
        (0x1003, 1, 0, AbortCode::INVALID_VALUE),
        (0x1011, 1, 1, AbortCode::CANNOT_TRANSFER),
        (0x100A, 0, 1, AbortCode::READ_ONLY),
        (0x1018, 4, 1, AbortCode::NO_SUCH_OBJECT),
        (0x6064, 0, 1, AbortCode::NO_SUCH_OBJECT),
    ] {
        let mut rig = Rig::known(&AG02, 2);
        let job = Job::Write(Address::new(index, sub), value);
        rig.begin(job);
        assert_eq!(rig.reports(), [Report::Done(Err(code))], "{index:04X}: nothing is sent");
    }
}

#[test]
fn a_refusal_is_an_abort_code() {
    for (refusal, code) in [
        (Refusal::NO_SUCH_PARAMETER, AbortCode::NO_SUCH_OBJECT),
        (Refusal::READ_ONLY, AbortCode::READ_ONLY),
        (Refusal::OUT_OF_RANGE, AbortCode::INVALID_VALUE),
        (Refusal::NO_SUCH_ELEMENT, AbortCode::NO_SUCH_SUB_INDEX),
        (Refusal::NO_ARRAY, AbortCode::NO_SUCH_SUB_INDEX),
        (Refusal::WRONG_TYPE, AbortCode::LENGTH_MISMATCH),
        (Refusal::RESET_ONLY, AbortCode::INVALID_VALUE),
        (Refusal::NO_CONTROL, AbortCode::LOCAL_CONTROL),
        (Refusal::WRONG_STATE, AbortCode::DEVICE_STATE),
        (Refusal::OTHER, AbortCode::GENERAL),
    ] {
        let mut rig = Rig::known(&AG02, 2);
        rig.parameters.refusal = Some(refusal);
        for job in [Job::Read(Address::new(0x2410, 5)), Job::Write(Address::new(0x2410, 5), 30)] {
            assert_eq!(rig.job(job), Err(code), "{refusal:?}");
        }
    }
    let mut rig = Rig::known(&AG02, 2);
    rig.parameters.is_authorised = false;
    assert_eq!(rig.job(Job::Read(Address::new(0x2410, 5))), Err(AbortCode::LOCAL_CONTROL));
    // An order without an answer may have been carried out; one that is not followed has not.
    let mut rig = Rig::known(&AG02, 2);
    rig.follows = false;
    assert_eq!(rig.job(ORDER), Err(AbortCode::DEVICE_STATE));
    rig.answers = false;
    assert_eq!(rig.job(Job::Read(Address::new(0x2410, 5))), Err(AbortCode::HARDWARE_ERROR));
}

/// This holds when nothing changes, too, but not when only the telegrams go on.
#[test]
fn facts_are_as_old_as_the_reading_of_the_status() {
    let mut rig = Rig::known(&AG02, 2);
    let worst = rig.door.worst_cycle();
    let newest = |rig: &mut Rig| {
        let mut newest = None;
        for _ in 0..100 {
            rig.turn();
            while let Some(report) = rig.door.poll(rig.now) {
                newest = Some(match report {
                    Report::Facts(facts) => facts,
                    other => panic!("{other:?}"),
                });
            }
        }
        newest
    };
    let facts = newest(&mut rig).expect("it is reported that nothing has changed");
    assert!(facts.age(rig.now) < Duration::from_millis(20), "{:?}", facts.age(rig.now));
    rig.answers = false;
    newest(&mut rig);
    rig.actual += 1;
    for _ in 0..30 {
        newest(&mut rig);
    }
    let facts = rig.master().facts().unwrap();
    assert_eq!((facts.value.position, facts.fresh(rig.now, worst)), (101, None));
    // A drive that counts as lost starts anew, and is not reported again.
    rig.begin(ORDER);
    rig.door.lose(rig.now);
    rig.answers = true;
    assert_eq!((rig.reports(), rig.door.master().facts(), rig.door.master().outputs()), (vec![], None, [0; 14]));
    let facts = newest(&mut rig).unwrap();
    assert!(facts.fresh(rig.now, worst).is_some());
}

#[test]
fn what_is_new_is_reported_a_position_every_10_ms() {
    let mut rig = Rig::offline(&AG02, 2);
    assert_eq!(rig.reports(), []);
    rig.turns(20);
    assert_eq!(rig.reports(), [facts(0x80, 100)]);
    let begin = rig.now;
    for turn in 1..=25 {
        rig.actual += 1;
        rig.turn();
        let expected = if turn % 10 == 0 { vec![facts(0x80, 100 + turn)] } else { vec![] };
        assert_eq!(rig.reports(), expected, "after {turn}");
    }
    assert_eq!(rig.now.since(begin), Duration::from_millis(25));
    // The status is known at once, and with it the position.
    rig.status |= 8;
    rig.turn();
    assert_eq!(rig.reports(), [facts(0x180, 125)]);
    // A velocity is not known before it has been measured.
    rig.turns(120);
    rig.reports();
    rig.turns(30);
    assert_eq!(rig.reports(), [], "nothing is new");
    // The facts at the end of a job are also reported.
    rig.begin(Job::Look);
    let mut reports = Vec::new();
    for _ in 0..20 {
        if reports.contains(&Report::Done(Ok(0))) {
            break;
        }
        rig.actual += 1;
        rig.turn();
        reports.extend(rig.reports());
    }
    assert!(reports.ends_with(&[facts(0x180, rig.actual), Report::Done(Ok(0))]), "{reports:?}");
    rig.actual += 1;
    rig.turn();
    assert_eq!(rig.reports(), [], "once");
    // The loss of the drive ends the job in progress.
    rig.begin(ORDER);
    rig.turn();
    rig.master().handle_offline();
    assert_eq!((rig.reports(), rig.reports()), (vec![Report::Lost], vec![]));
    rig.turns(20);
    assert_eq!(rig.reports(), [facts(0x180, rig.actual)]);
    rig.turns(500);
    assert_eq!(rig.reports(), []);
    // The door has the deadlines of the master.
    rig.answers = false;
    rig.begin(Job::Read(Address::new(0x2410, 5)));
    let due = rig.door.poll_timeout().unwrap();
    rig.door.handle_timeout(due);
    rig.now = due;
    let later = rig.door.poll_timeout().unwrap();
    rig.door.handle_timeout(later);
    assert_eq!(rig.reports(), [Report::Done(Err(AbortCode::HARDWARE_ERROR))]);
}
