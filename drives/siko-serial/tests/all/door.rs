//! The gateway's door with a script: its commands, the drive's answers, and its reports.

use std::io;

use lexican_driver::Direction;
use lexican_runtime::host::LinkError;
use lexican_runtime::object::Address;
use lexican_runtime::{AbortCode, Duration, Instant, Measured};
use siko::gateway::{Carrier, Door, Facts, Job, Report};
use siko::order::{Braking, Order};
use siko_ag02::od;
use siko_serial::gateway::{SerialDoor, Wire};
use siko_serial::{Line, Settings};

/// A line on which bytes take no time, and a drive that answers within 10 ms.
const SETTINGS: Settings = Settings { baud: u32::MAX, reaction: Duration::from_millis(10), echo: false };
const LOAD: i64 = 0x6461_6F6C;

const A_POS: Address = Address::new(0x2410, 4);
const UP: Order = Order::Inch(Direction::Positive);
const UNKNOWN: Report = Report::Done(Err(AbortCode::HARDWARE_ERROR));

struct Rig {
    door: SerialDoor,
    now: Instant,
    shown: Option<Facts>,
}

impl Rig {
    fn new() -> Self {
        Rig { door: SerialDoor::new(SETTINGS), now: Instant::ZERO, shown: None }
    }

    /// A drive at rest at 100, with the motor released.
    fn connected() -> Self {
        let mut rig = Rig::new();
        let reports = rig.talk("R:0080> R:0080> R:0080> Z:+0000100> V:+000>");
        assert_eq!(reports, [facts(0x80, 100, 0)], "not before they are measured");
        rig
    }

    fn moving() -> Self {
        let mut rig = Rig::connected();
        assert_eq!(rig.talk("R:0010> R:0010> Z:+0000100> V:+000>"), [facts(0x10, 100, 0)]);
        rig
    }

    /// New reports without times. Unchanged facts are left out, except before the end of a job.
    fn reports(&mut self) -> Vec<Report> {
        let reports: Vec<_> = std::iter::from_fn(|| self.door.poll(self.now)).collect();
        let mut news = Vec::new();
        for (number, report) in reports.iter().enumerate() {
            match report {
                Report::Facts(Measured { value, .. }) => {
                    let is_new = self.shown.replace(*value) != Some(*value);
                    let ends = matches!(reports.get(number + 1), Some(Report::Done(_)));
                    news.extend((is_new || ends).then_some(Report::Facts(Measured::new(*value, Instant::ZERO))));
                }
                Report::Lost => {
                    self.shown = None;
                    news.push(Report::Lost);
                }
                Report::Done(_) => news.push(*report),
            }
        }
        news
    }

    /// Waits for the deadline, if there is nothing to send.
    fn wait(&mut self) {
        self.now = self.door.poll_timeout().unwrap_or(self.now).max(self.now);
        self.door.handle_timeout(self.now);
    }

    /// The next telegram.
    #[track_caller]
    fn next(&mut self) -> String {
        for _ in 0..10 {
            self.wait();
            if let Some(telegram) = self.door.poll_transmit(self.now) {
                return String::from_utf8(telegram.as_bytes().to_vec()).unwrap();
            }
        }
        panic!("nothing is sent");
    }

    fn hears(&mut self, answer: &str) {
        let end = if answer.is_empty() { "" } else { "\r" };
        self.door.handle_bytes(self.now, (answer.replace('_', " ") + end).as_bytes());
    }

    /// The reports while each telegram before a colon is sent and answered by the text after it.
    #[track_caller]
    fn talk(&mut self, script: &str) -> Vec<Report> {
        for exchange in script.split_whitespace() {
            let (sent, answer) = exchange.split_once(':').unwrap();
            assert_eq!(self.next(), sent, "{script}");
            self.hears(answer);
            if !answer.ends_with('>') {
                self.wait();
            }
        }
        self.reports()
    }

    /// As [`Rig::talk`], after a job, which begins at once.
    #[track_caller]
    fn job(&mut self, job: Job, script: &str) -> Vec<Report> {
        self.door.begin(self.now, job);
        if !script.is_empty() {
            assert!(self.door.poll_timeout().unwrap() <= self.now, "{job:?}");
        }
        self.talk(script)
    }

    /// What is sent to a drive with this status within `ms` milliseconds, and when.
    fn sends_within(&mut self, ms: u64, status: &str) -> String {
        let (begin, mut sent) = (self.now, Vec::new());
        while self.door.poll_timeout().unwrap() <= begin + Duration::from_millis(ms) {
            let telegram = self.next();
            self.hears(match telegram.as_str() {
                "R" => status,
                "Z" => "+0000100>",
                "V" => "+000>",
                _ => "",
            });
            sent.push(format!("{}{telegram}", self.now.since(begin).as_micros() / 1000));
        }
        sent.join(" ")
    }
}

fn facts(system: u16, position: i32, velocity: i32) -> Report {
    Report::Facts(Measured::new(Facts { system, position, velocity }, Instant::ZERO))
}

fn order(order: Order) -> Job {
    Job::Order { order, target: 5000 }
}

#[test]
fn a_status_counts_when_it_has_been_read_twice() {
    let mut rig = Rig::new();
    assert_eq!(rig.talk("R:0080> R:0080>"), [], "the first one shows that there is a drive");
    assert_eq!(rig.talk("R:0080> Z:+0000100>"), [], "its velocity is not known");
    assert_eq!(rig.talk("V:+000>"), [facts(0x80, 100, 0)]);
    assert_eq!(rig.talk("R:0180>"), []);
    assert_eq!(rig.sends_within(100, "0080>"), "0R 100R", "it was noise");
    assert_eq!(rig.talk("R:0180> R:4080>"), []);
    assert_eq!(rig.talk("R:4080>"), [facts(0x4080, 100, 0)]);
    assert_eq!(rig.sends_within(100, "4080>"), "0Z 0V 20R 40R 60R 80R 100R 100Z 100V", "it travels");
    assert_eq!(rig.reports(), []);
}

#[test]
fn each_status_that_counts_is_reported_as_old_as_the_position_beside_it() {
    let mut rig = Rig::connected();
    let measured = rig.now;
    // A new status is read twice; after noise, the first answer only shows that the drive is there.
    let answers = [("0080>", true), ("0180>", false), ("0080>", true), ("!", false), ("0080>", false), ("0080>", true)];
    for (answer, counts) in answers {
        assert_eq!(rig.next(), "R");
        rig.now += Duration::from_millis(7);
        rig.hears(answer);
        rig.wait();
        let report = rig.door.poll(rig.now);
        assert_eq!(report.is_some(), counts, "{answer}: {report:?}");
        if let Some(Report::Facts(facts)) = report {
            assert_eq!(facts.at, measured, "{answer}");
        }
        assert_eq!(rig.door.poll(rig.now), None);
    }
}

/// A client that reads one object after another, as a backup does.
#[test]
fn jobs_that_follow_one_another_do_not_make_facts_old() {
    let mut rig = Rig::connected();
    let (mut fresh, end) = (rig.now, rig.now + Duration::from_secs(20));
    rig.door.begin(rig.now, Job::Read(A_POS));
    while rig.now < end {
        let telegram = rig.next();
        rig.now += Duration::from_millis(9);
        rig.hears(match telegram.as_str() {
            "R" => "0080>",
            "Z" => "+0000100>",
            "V" => "+000>",
            _ => "00050>",
        });
        for report in std::iter::from_fn(|| rig.door.poll(rig.now)).collect::<Vec<_>>() {
            match report {
                Report::Facts(facts) => fresh = facts.at,
                Report::Done(done) => {
                    assert_eq!(done, Ok(50));
                    rig.door.begin(rig.now, Job::Read(A_POS));
                }
                Report::Lost => panic!("it is there"),
            }
        }
        assert!(rig.now.since(fresh) < rig.door.worst_cycle(), "{:?}", rig.now.since(fresh));
    }
}

/// The facts get old if the position cannot be read, however often the status is.
#[test]
fn facts_are_as_old_as_the_oldest_of_them() {
    let mut rig = Rig::connected();
    let measured = rig.now;
    let worst = rig.door.worst_cycle();
    while rig.now.since(measured) < worst {
        match rig.next().as_str() {
            "R" => rig.hears("0080>"),
            "Z" => rig.hears("!"),
            other => panic!("{other}"),
        }
        rig.now += Duration::from_millis(5);
        rig.wait();
        for report in std::iter::from_fn(|| rig.door.poll(rig.now)) {
            assert!(matches!(report, Report::Facts(facts) if facts.at <= measured), "{report:?}");
        }
    }
}

#[test]
fn a_drive_that_counts_as_lost_is_asked_anew_and_for_nothing_of_before() {
    let mut rig = Rig::moving();
    rig.door.begin(rig.now, order(Order::Start));
    assert_eq!(rig.next(), "F0+0005000");
    rig.door.lose(rig.now);
    assert_eq!(rig.talk("R:0080> R:0080> R:0080> Z:+0000100>"), []);
    assert_eq!(rig.talk("V:+000>"), [facts(0x80, 100, 0)]);
    assert_eq!(rig.sends_within(100, "0080>"), "100R");
}

#[test]
fn status_and_values_are_read_more_often_in_motion() {
    let mut rig = Rig::connected();
    let at_rest = "100R 200R 300R 400R 500R 600R 700R 800R 900R 1000R 1000Z 1000V";
    assert_eq!(rig.sends_within(1000, "0080>"), at_rest);
    for (word, moves) in [("4000>", true), ("0000>", false), ("0010>", true)] {
        let first = rig.sends_within(100, word);
        assert_eq!(first, if moves { "100R 100R 100Z 100V" } else { "20R 20R" }, "{word}");
        let in_motion = "20R 40R 60R 80R 100R 100Z 100V";
        assert_eq!(rig.sends_within(100, word), if moves { in_motion } else { "100R" }, "{word}");
    }
    assert_eq!(rig.reports(), [facts(0x4000, 100, 0), facts(0, 100, 0), facts(0x10, 100, 0)]);
    assert_eq!(rig.talk("R:0008> R:0008> Z:+0000200> V:+000>"), [facts(8, 100, 0), facts(8, 200, 0)], "it has ended");
    assert_eq!(rig.sends_within(999, "0008>"), "100R 200R 300R 400R 500R 600R 700R 800R 900R");
}

#[test]
fn an_order_is_its_commands_and_a_look() {
    for (ordered, commands) in [
        (Order::Enable, ""),
        (Order::Hold, "N:>"),
        (Order::Release, "P:>"),
        (Order::Start, "F0+0005000:> E0:+0005000> M:>"),
        (Order::Resume, "M:>"),
        (Order::Interrupt(Braking::Programmed), "O:>"),
        (Order::Interrupt(Braking::Full), "N:>"),
        (Order::Abort(Braking::Full), "I:>"),
        (Order::Step, "Y:>"),
        (Order::StopInching, ""),
        (Order::ResetFault, "S11103:>"),
    ] {
        let mut rig = Rig::connected();
        let reports = rig.job(order(ordered), &format!("{commands} R:0080>"));
        assert_eq!(reports, [facts(0x80, 100, 0), Report::Done(Ok(0))], "{ordered:?}");
        // A new status is read twice here, too.
        let reports = rig.job(order(ordered), &format!("{commands} R:0088> R:0088>"));
        assert_eq!(reports, [facts(0x88, 100, 0), Report::Done(Ok(0))], "{ordered:?}");
    }
    let mut rig = Rig::connected();
    assert_eq!(rig.job(Job::Look, "R:0080>"), [facts(0x80, 100, 0), Report::Done(Ok(0))]);
    // A look that was in progress when an order came does not count after it.
    rig.now = rig.door.poll_timeout().unwrap();
    assert!(rig.door.poll_transmit(rig.now).is_some());
    rig.door.begin(rig.now, order(Order::Resume));
    rig.hears("0080>");
    assert_eq!(rig.reports(), []);
    assert_eq!(rig.talk("M:> R:0080>"), [facts(0x80, 100, 0), Report::Done(Ok(0))]);
    // A position has seven digits.
    let target = Job::Order { order: Order::Start, target: 10_000_000 };
    assert_eq!(rig.job(target, "R:0080>"), [Report::Done(Err(AbortCode::INVALID_VALUE))]);
}

#[test]
fn what_is_refused_is_not_gone_on_with() {
    for (number, code) in [
        ("01", AbortCode::NO_SUCH_OBJECT),
        ("02", AbortCode::INVALID_VALUE),
        ("03", AbortCode::LOCAL_CONTROL),
        ("04", AbortCode::DEVICE_STATE),
        ("08", AbortCode::DEVICE_STATE),
        ("09", AbortCode::INVALID_VALUE),
        ("10", AbortCode::DEVICE_STATE),
    ] {
        let mut rig = Rig::connected();
        let reports = rig.job(order(Order::Start), &format!("F0+0005000:?{number} R:0080>"));
        assert_eq!(reports, [facts(0x80, 100, 0), Report::Done(Err(code))]);
        assert_eq!(rig.job(Job::Write(A_POS, 50), &format!("H0300050:?{number}")), [Report::Done(Err(code))]);
    }
    // The drive has accepted another value than intended.
    let mut rig = Rig::connected();
    let reports = rig.job(order(Order::Start), "F0+0005000:> E0:+0005001> R:0080>");
    assert_eq!(reports, [facts(0x80, 100, 0), UNKNOWN]);
    assert_eq!(rig.job(Job::Write(A_POS, 50), "H0300050:> G03:00051>"), [UNKNOWN]);
}

#[test]
fn objects_are_read_by_commands() {
    let gear = |gear: od::GearReduction| i64::from(gear.0);
    for (index, sub, exchange, value) in [
        (0x6064, 0, "Z:-0001234>", -1234),
        (0x606C, 0, "V:-030>", -30),
        (0x100A, 0, "A1:02.00___>", 0x322E_3030),
        (0x100A, 0, "A1:12.00___>", 0x3132_2E30),
        (0x100A, 0, "A1:0.1_____>", 0x302E_3100),
        (0x2102, 0, "A3:55:1____>", gear(od::GearReduction::GEAR_55_1)),
        (0x2102, 0, "A3:62:1____>", gear(od::GearReduction::GEAR_62_1)),
        (0x2102, 0, "A3:135:1___>", gear(od::GearReduction::GEAR_135_1)),
        (0x2102, 0, "A3:________>", 0),
        (0x1003, 0, "J0:03>", 3),
        (0x1003, 1, "J1:ABX------->", 0x1000),
        (0x1003, 2, "J1:ABX------->", 0x7121),
        (0x1003, 3, "J1:ABX------->", 0x3120),
        (0x1003, 4, "J1:ABX------->", 0),
        (0x1003, 10, "J1:ABBBBBBBBB>", 0x3120),
        (0x2410, 4, "G03:00050>", 50),
        (0x607D, 2, "E1:+0001000>", 1000),
        (0x607A, 0, "E0:-0000001>", -1),
        (0x6060, 0, "Q:10>", 2),
        (0x6060, 0, "Q:01>", 1),
        (0x607E, 0, "Q:01>", 1),
        (0x2413, 0, "Q:02>", 1),
    ] {
        let mut rig = Rig::connected();
        let address = Address::new(index, sub);
        assert!(rig.door.has(address), "{address:?}");
        let reports = rig.job(Job::Read(address), exchange);
        assert_eq!(reports, [Report::Done(Ok(value))], "{exchange}");
    }
    let mut rig = Rig::connected();
    for (index, sub) in [(0x2420, 0), (0x1010, 1), (0x1003, 11), (0x1011, 5), (0x2410, 7)] {
        let address = Address::new(index, sub);
        assert!(!rig.door.has(address));
        let missing = [Report::Done(Err(AbortCode::NO_SUCH_OBJECT))];
        assert_eq!(rig.job(Job::Read(address), ""), missing);
        assert_eq!(rig.job(Job::Write(address, 1), ""), missing);
    }
}

#[test]
fn objects_are_written_by_commands_and_read_back() {
    for (index, sub, value, exchanges, read) in [
        (0x2410, 4, 50, "H0300050:> G03:00050>", 50),
        (0x607D, 2, -5, "F1-0000005:> E1:-0000005>", -5),
        (0x6060, 0, 2, "X1:> Q:10>", 2),
        (0x607E, 0, 1, "T1:> Q:01>", 1),
        (0x2413, 0, 1, "L1:> Q:02>", 1),
        (0x1003, 0, 0, "S11105:> J0:00>", 0),
        (0x1011, 1, LOAD, "S11100:>", 0),
        (0x1011, 2, LOAD, "S11101:>", 0),
        (0x1011, 3, LOAD, "S11102:>", 0),
        (0x1011, 4, LOAD, "S11104:>", 0),
    ] {
        let mut rig = Rig::connected();
        let address = Address::new(index, sub);
        assert!(rig.door.has(address));
        let reports = rig.job(Job::Write(address, value), exchanges);
        assert_eq!(reports, [Report::Done(Ok(read))], "{exchanges}");
        // The write may have changed the position or its window.
        assert!(rig.door.poll_timeout().unwrap() <= rig.now);
        assert_eq!(rig.talk("R:0080>"), []);
    }
    let mut rig = Rig::connected();
    let invalid = [Report::Done(Err(AbortCode::INVALID_VALUE))];
    for (index, sub, value) in [(0x1003, 0, 1), (0x1011, 1, 1), (0x6060, 0, 3), (0x2410, 4, -1), (0x2413, 0, 3)] {
        assert_eq!(rig.job(Job::Write(Address::new(index, sub), value), ""), invalid);
    }
    assert_eq!(rig.sends_within(100, "0080>"), "100R", "nothing of that is sent");
}

#[test]
fn what_may_be_done_twice_is_sent_three_times_and_the_rest_once() {
    let mut rig = Rig::connected();
    let (read, garbled) = (Job::Read(A_POS), "!");
    for trouble in ["", garbled] {
        let once = format!("G03:{trouble} R:0080>");
        let [value, failed] = [[Report::Done(Ok(50))], [UNKNOWN]];
        for _ in 0..2 {
            assert_eq!(rig.job(read, &format!("{once} {once} G03:00050>")), value);
            assert_eq!(rig.job(read, &format!("{once} {once} G03:{trouble}")), failed);
            assert_eq!(rig.talk(&format!("R:0080> R:{trouble} R:0080> R:0080>")), []);
        }
        let reports = rig.job(order(Order::Resume), &format!("M:{trouble} R:0080> R:0080>"));
        assert_eq!(reports, [facts(0x80, 100, 0), UNKNOWN]);
        for (ordered, sent) in [(Order::Start, "F0+0005000"), (Order::Hold, "N"), (Order::Release, "P")] {
            let once = format!("{sent}:{trouble} R:0080>");
            let reports = rig.job(order(ordered), &format!("{once} {once} {sent}:{trouble} R:0080> R:0080>"));
            assert_eq!(reports, [facts(0x80, 100, 0), UNKNOWN]);
        }
        let setpoint = format!("F0+0005000:{trouble} R:0080>");
        let reports = rig.job(order(Order::Start), &format!("{setpoint} F0+0005000:> E0:+0005000> M:> R:0080>"));
        assert_eq!(reports, [facts(0x80, 100, 0), Report::Done(Ok(0))]);
        let write = format!("H0300050:{trouble} R:0080>");
        assert_eq!(rig.job(Job::Write(A_POS, 50), &format!("{write} {write} H0300050:> G03:00050>")), value);
        assert_eq!(rig.job(Job::Write(A_POS, 50), &format!("{write} {write} H0300050:{trouble}")), failed);
        let calibrate = Job::Write(Address::new(0x1011, 4), LOAD);
        assert_eq!(rig.job(calibrate, &format!("R:0080> S11104:{trouble}")), failed);
        // The same holds for a status, whatever was asked before.
        assert_eq!(rig.talk(&format!("R:{trouble} R:0080> R:{trouble} R:0080> R:0080>")), []);
        assert_eq!(rig.talk(&format!("R:{trouble} R:0080> R:{trouble} R:0080> R:{trouble}")), [Report::Lost]);
        let begin = rig.now;
        assert_eq!(rig.talk("R:0080> R:0080>"), []);
        assert_eq!(rig.now.since(begin), Duration::from_millis(510), "it is left alone, and then asked for a sign");
        assert_eq!(rig.talk("R:0080> Z:+0000100> V:+000>"), [facts(0x80, 100, 0)]);
        assert_eq!(rig.talk(&format!("R:{trouble} R:0080> R:{trouble}")), []);
        assert_eq!(rig.job(read, &format!("R:0080> {once} {once} G03:00050>")), value);
        assert_eq!(rig.talk("R:0080>"), []);
    }
}

#[test]
fn values_are_read_in_turn_and_are_no_part_of_a_job_that_comes_meanwhile() {
    let mut rig = Rig::moving();
    assert_eq!(rig.sends_within(80, "0010>"), "20R 40R 60R 80R");
    assert_eq!(rig.talk("R:0010> Z:+0000100>"), []);
    rig.now += Duration::from_millis(200);
    assert_eq!(rig.job(Job::Look, "R:0010>"), [facts(0x10, 100, 0), Report::Done(Ok(0))]);
    assert_eq!(rig.next(), "V");
    rig.door.begin(rig.now, Job::Read(A_POS));
    rig.hears("!");
    rig.wait();
    assert_eq!(rig.talk("R:0010> G03:00050>"), [Report::Done(Ok(50))]);
    assert_eq!(rig.talk("R:0010> V:+030>"), [facts(0x10, 100, 30)]);
    // A drive that comes back is at another position.
    assert_eq!(rig.talk("R:! R:0080> R:! R:0080> R:!"), [Report::Lost]);
    let reports = rig.talk("R:0080> R:0080> R:0080> Z:+0000007> V:+000>");
    assert_eq!(reports, [facts(0x80, 7, 0)]);
}

#[test]
fn a_silent_drive_is_lost_with_what_was_under_way() {
    for job in [Job::Read(A_POS), order(Order::Resume), Job::Look, order(UP)] {
        let mut rig = Rig::moving();
        // The values are due, and a status is uncertain.
        assert_eq!(rig.sends_within(80, "0010>"), "20R 40R 60R 80R");
        assert_eq!(rig.talk("R:0080>"), []);
        rig.door.begin(rig.now, job);
        let mut reports = Vec::new();
        for _ in 0..20 {
            rig.next();
            rig.wait();
            reports.extend(rig.reports());
            if reports.last() == Some(&Report::Lost) {
                break;
            }
        }
        assert!(matches!(reports[..], [Report::Lost] | [UNKNOWN, Report::Lost]), "{job:?}: {reports:?}");
        let begin = rig.now;
        assert_eq!(rig.talk("R: R: R: R: R: R: R: R: R: R: R:"), [], "{job:?}");
        assert_eq!(rig.now.since(begin), Duration::from_millis(610));
        assert_eq!(rig.talk("R:0080> R:0080>"), []);
        assert_eq!(rig.talk("R:0080> Z:+0000000>"), []);
        assert_eq!(rig.talk("V:+000>"), [facts(0x80, 0, 0)]);
        assert_eq!(rig.sends_within(100, "0080>"), "100R", "{job:?} is over");
    }
}

#[test]
fn inching_is_a_character_every_50_ms_until_another_order_or_the_drive_ends_it() {
    let inching = || {
        let mut rig = Rig::connected();
        assert_eq!(rig.job(order(UP), "R:0080>"), [facts(0x80, 100, 0), Report::Done(Ok(0))]);
        assert_eq!(rig.sends_within(60, "0010>"), "0, 20R 20R 40R 50, 60R");
        assert_eq!(rig.reports(), [facts(0x10, 100, 0)]);
        rig
    };
    for (ordered, commands) in [
        (Order::StopInching, "R:0010>"),
        (Order::Release, "P:> R:0010>"),
        (Order::Hold, "N:> R:0010>"),
        (Order::Interrupt(Braking::Programmed), "O:> R:0010>"),
        (Order::ResetFault, "S11103:> R:0010>"),
    ] {
        let mut rig = inching();
        assert_eq!(rig.job(order(ordered), commands), [facts(0x10, 100, 0), Report::Done(Ok(0))], "{ordered:?}");
        assert!(!rig.sends_within(100, "0010>").contains(','), "{ordered:?}");
    }
    // If the characters went on, they would move the drive again after a reset of the fault.
    for word in ["0100", "0080"] {
        let mut rig = inching();
        assert_eq!(rig.talk(&format!("R:{word}> R:{word}>")).len(), 1);
        assert_eq!(rig.talk("Z:+0000100> V:+000>"), []);
        assert_eq!(rig.sends_within(100, &format!("{word}>")), "100R", "{word}");
    }
    let mut rig = Rig::connected();
    rig.job(order(Order::Inch(Direction::Negative)), "R:0080>");
    assert_eq!(rig.sends_within(20, "0080>"), "0. 20R", "the status is read as in motion");
}

/// A line that records until when it waits.
struct Noted {
    sent: Vec<u8>,
    until: Option<Instant>,
}

impl Line for Noted {
    fn now(&self) -> Instant {
        Instant::ZERO
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.sent.extend(bytes);
        Ok(())
    }

    fn receive(&mut self, until: Instant, buffer: &mut [u8]) -> io::Result<usize> {
        self.until = Some(until);
        buffer[..6].copy_from_slice(b"0080>\r");
        Ok(6)
    }
}

#[test]
fn a_wire_waits_until_the_next_deadline_and_hands_over_what_has_come() -> Result<(), LinkError> {
    let mut rig = Rig::new();
    let mut wire = Wire(Noted { sent: Vec::new(), until: None });
    let ms = |ms| Instant::ZERO + Duration::from_millis(ms);
    wire.carry(&mut rig.door, ms(5))?;
    assert_eq!((wire.0.sent.as_slice(), wire.0.until), (&b"R"[..], Some(ms(5))));
    wire.carry(&mut rig.door, ms(1000))?;
    assert_eq!((wire.0.sent.as_slice(), wire.0.until), (&b"R"[..], Some(ms(10))), "the drive has that long to answer");
    let mut rig = Rig::new();
    rig.talk("R:0080>");
    rig.wait();
    (0..2).try_for_each(|_| wire.carry(&mut rig.door, ms(1000)))?;
    assert_eq!(rig.talk("Z:+0000007> V:+000>"), [facts(0x80, 7, 0)]);
    Ok(())
}
