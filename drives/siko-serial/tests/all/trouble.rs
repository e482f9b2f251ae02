//! The client on a line with noise, cuts, foreign bytes, late answers, echo, and other baud rates.

use std::io;

use super::serial_rig::{Connection, Error, Rig};
use lexican_driver::Direction;
use lexican_runtime::{Duration, Instant};
use siko_serial::answer::{Answer, Reply};
use siko_serial::client::{Client, Event, PROBES, Trouble};
use siko_serial::command::{Command, Long, Setting, Short};
use siko_serial::sim::{SerialDrive, VirtualLine};
use siko_serial::{Line, Settings};

/// A line whose bytes pass through a function, each with its number.
struct Damaged<F, G> {
    line: VirtualLine,
    to_drive: F,
    to_client: G,
    sent: usize,
    received: usize,
}

impl<F: FnMut(usize, u8) -> Option<u8>, G: FnMut(usize, u8) -> Option<u8>> Line for Damaged<F, G> {
    fn now(&self) -> Instant {
        self.line.now()
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let first = self.sent;
        self.sent += bytes.len();
        let bytes = bytes.iter().enumerate().filter_map(|(at, byte)| (self.to_drive)(first + at, *byte));
        let bytes: Vec<u8> = bytes.collect();
        self.line.send(&bytes)
    }

    fn receive(&mut self, until: Instant, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            let mut one = [0];
            if self.line.receive(until, &mut one)? == 0 {
                return Ok(0);
            }
            self.received += 1;
            if let Some(byte) = (self.to_client)(self.received - 1, one[0]) {
                buffer[0] = byte;
                return Ok(1);
            }
        }
    }
}

/// The numbers of the bytes before the first command: `R` and its answer.
const PROBE: [usize; 2] = [1, 6];

fn connection<F, G>(to_drive: F, to_client: G) -> Connection<Damaged<F, G>>
where
    F: FnMut(usize, u8) -> Option<u8>,
    G: FnMut(usize, u8) -> Option<u8>,
{
    let line = VirtualLine::new(SerialDrive::default());
    Connection::new(Damaged { line, to_drive, to_client, sent: 0, received: 0 }, Settings::default())
}

#[track_caller]
fn check<T>(result: Result<T, Error>, trouble: Trouble) {
    match result {
        Err(Error::Trouble(got)) => assert_eq!(got, trouble),
        Err(other) => panic!("{other:?}"),
        Ok(_) => panic!("it has succeeded"),
    }
}

#[test]
fn each_byte_of_an_answer_may_be_damaged_lost_or_followed_by_another_one() {
    // The answer to `E1` is "+1000000>\r". A digit replaced by another digit cannot be noticed.
    for at in PROBE[1]..PROBE[1] + 10 {
        let mut damaged =
            connection(|_, byte| Some(byte), move |number, byte| Some(if number == at { !byte } else { byte }));
        check(damaged.number(Command::ReadLong(Long::UpperLimit)), Trouble::Garbled);
        assert_eq!(damaged.number(Command::ReadLong(Long::UpperLimit)).unwrap(), 1_000_000);
        let mut lost = connection(|_, byte| Some(byte), move |number, byte| (number != at).then_some(byte));
        assert!(lost.number(Command::ReadLong(Long::UpperLimit)).is_err());
        assert_eq!(lost.number(Command::ReadLong(Long::UpperLimit)).unwrap(), 1_000_000);
    }
}

#[test]
fn each_byte_of_a_command_may_be_lost_and_nothing_moves_by_what_is_left() {
    let command = Command::WriteLong(Long::Setpoint, 5000);
    for at in PROBE[0]..PROBE[0] + 10 {
        let mut cut = connection(move |number, byte| (number != at).then_some(byte), |_, byte| Some(byte));
        match cut.request(command) {
            // The letter is lost: each digit is answered by an error while the command is still on the line.
            Err(Error::Trouble(Trouble::Garbled)) if at == PROBE[0] => {}
            // The sign is lost: the drive refuses the digit in its place, and some of the following digits.
            Err(Error::Trouble(_)) => {}
            other => panic!("{at}: {other:?}"),
        }
        assert_eq!(cut.number(Command::ReadLong(Long::Setpoint)).unwrap(), 0, "{at}");
        assert_eq!(cut.request(command).unwrap(), Answer::Done);
        assert_eq!(cut.number(Command::ReadLong(Long::Setpoint)).unwrap(), 5000);
    }
}

/// The digits of a command without its letter are refused one by one, but none of these answers counts for the next
/// command.
#[test]
fn what_answers_a_part_of_a_command_answers_no_other_one() {
    let commands =
        [Command::ReadShort(Short::VPos), Command::WriteShort(Short::VPos, 7), Command::Set(Setting::Calibrate)];
    for command in commands {
        let mut lost = connection(|number, byte| (number != PROBE[0]).then_some(byte), |_, byte| Some(byte));
        check(lost.request(command), Trouble::Garbled);
        assert_eq!(lost.number(Command::ReadShort(Short::Window)).unwrap(), 10);
    }
}

#[test]
fn a_drive_that_another_program_left_in_a_command_is_found() {
    for begun in ["F", "F0", "F0+", "F0+000500", "H", "H0", "S1110", "A", "zz", "\r\n", "?", "R", "Z"] {
        let mut rig = Rig::new();
        rig.drive.line().send(begun.as_bytes()).unwrap();
        assert_eq!(rig.number(Command::ReadLong(Long::Setpoint)), 0, "{begun}");
    }
}

#[test]
fn a_line_that_is_cut_is_silent_and_works_again() {
    let mut rig = Rig::new();
    rig.done(Command::WriteLong(Long::Setpoint, 5000));
    rig.drive.line().with_drive(|drive, now| drive.drive_mut().switch_off(now));
    let begin = rig.drive.line().now();
    check(rig.drive.status(), Trouble::TimedOut);
    // Seven bytes of 10 bits at 9600 baud, and 200 ms.
    assert_eq!(rig.drive.line().now().since(begin), Duration::from_micros(200_000 + 7_291));
    let begin = rig.drive.line().now();
    check(rig.drive.status(), Trouble::Silent);
    assert_eq!(rig.drive.line().now().since(begin), Duration::from_micros((200_000 + 7_291) * u64::from(PROBES)));
    rig.drive.line().with_drive(|drive, now| drive.drive_mut().switch_on(now));
    assert_eq!(rig.number(Command::ReadLong(Long::Setpoint)), 0, "it is not kept without power");
}

#[test]
fn foreign_bytes_between_and_in_answers_are_noticed() {
    let mut rig = Rig::new();
    rig.done(Command::WriteLong(Long::Setpoint, 5000));
    for noise in [&b"x"[..], b">\r", b"?04\r", b"+0000001>\r", b"\x00\xFF", &[0x55; 100]] {
        // Between commands: bytes that have come are discarded before the next command.
        rig.drive.line().disturb(noise);
        rig.pass(Duration::from_millis(200));
        assert_eq!(rig.drive.number(Command::ReadLong(Long::Setpoint)).ok(), Some(5000), "{noise:?}");
        // Within the answer.
        rig.drive.line().disturb(noise);
        match rig.drive.request(Command::Velocity) {
            // Noise that forms a whole refusal is taken for one; then the answer comes while none or another one is
            // expected.
            Err(Error::Refused(_)) => check(rig.drive.status(), Trouble::Garbled),
            Err(Error::Trouble(Trouble::Garbled)) => {}
            other => panic!("{noise:?}: {other:?}"),
        }
        assert_eq!(rig.number(Command::ReadLong(Long::Setpoint)), 5000, "{noise:?}");
    }
}

/// According to chapter 6, `W` is not followed by CR; according to table 3, it is.
#[test]
fn a_cr_behind_the_answer_to_w_does_no_harm() {
    let mut rig = Rig::new();
    assert_eq!(rig.number(Command::BinaryPosition), 0);
    let begin = rig.drive.line().now();
    rig.drive.line().disturb(b"\r");
    assert_eq!(rig.number(Command::ReadLong(Long::UpperLimit)), 1_000_000);
    rig.drive.line().disturb(b"\r");
    rig.pass(Duration::from_millis(10));
    assert_eq!(rig.number(Command::Position), 0);
    assert!(rig.drive.line().now().since(begin) < Duration::from_millis(60), "it was not asked for its status");
}

/// A late answer is not taken for the answer to the next command.
#[test]
fn a_late_answer_is_not_that_to_another_command() {
    let mut client = Client::new(Settings::default());
    let mut now = Instant::ZERO;
    let after = |client: &mut Client, now: &mut Instant| {
        *now = client.poll_timeout().unwrap();
        client.handle_timeout(*now)
    };
    client.request(Command::Status).unwrap();
    assert_eq!(client.poll_transmit(now).unwrap().as_bytes(), b"R");
    assert_eq!(client.handle_bytes(now, b"0080>\r"), None);
    assert_eq!(after(&mut client, &mut now), None);
    assert_eq!(client.poll_transmit(now).unwrap().as_bytes(), b"R");
    assert_eq!(after(&mut client, &mut now), Some(Event::Failed(Trouble::TimedOut)));
    client.request(Command::Status).unwrap();
    assert_eq!(client.poll_transmit(now).unwrap().as_bytes(), b"R");
    // The late answer, and the one to the request.
    assert_eq!(client.handle_bytes(now, b"0080>\r0880>\r"), None);
    assert_eq!((after(&mut client, &mut now), client.poll_transmit(now).unwrap().as_bytes()), (None, &b"R"[..]));
    assert_eq!(client.handle_bytes(now, b"0880>\r"), None);
    assert_eq!((after(&mut client, &mut now), client.poll_transmit(now).unwrap().as_bytes()), (None, &b"R"[..]));
    assert_eq!(client.handle_bytes(now, b"0880>\r"), Some(Event::Answered(Answer::Status(0x0880))));
}

/// A client that has found its drive, and is idle.
fn synchronised() -> (Client, Instant) {
    let (mut client, now) = (Client::new(Settings::default()), Instant::from_micros(1_000_000));
    client.request(Command::Status).unwrap();
    assert_eq!(sent(&mut client, now), b"R");
    client.handle_bytes(now, b"0080>\r");
    let now = client.poll_timeout().unwrap();
    client.handle_timeout(now);
    assert_eq!(sent(&mut client, now), b"R");
    let now = now + client.settings().on_line(7);
    assert_eq!(client.handle_bytes(now, b"0080>\r"), Some(Event::Answered(Answer::Status(0x80))));
    (client, now)
}

fn sent(client: &mut Client, now: Instant) -> Vec<u8> {
    client.poll_transmit(now).unwrap().as_bytes().to_vec()
}

#[test]
fn after_a_foreign_byte_or_an_abandoned_command_the_status_is_asked_for() {
    let (mut client, now) = synchronised();
    client.request(Command::Velocity).unwrap();
    assert_eq!(sent(&mut client, now), b"V");
    client.abandon();
    client.request(Command::Velocity).unwrap();
    assert_eq!(sent(&mut client, now), b"R");
    let (mut client, now) = synchronised();
    assert_eq!(client.handle_bytes(now, b"x"), None);
    client.request(Command::Velocity).unwrap();
    assert_eq!(sent(&mut client, now), b"R");
}

/// While a command is still on the line, only a part of it can have been answered.
#[test]
fn an_answer_to_a_command_that_is_still_on_its_way_counts_if_nothing_follows() {
    for (answer, follows) in [(&b">\r"[..], &b""[..]), (b">\r", b"?01\r"), (b"?01\r", b""), (b"?01\r", b"?01\r")] {
        let (mut client, now) = synchronised();
        client.request(Command::WriteShort(Short::VPos, 7)).unwrap();
        assert_eq!(sent(&mut client, now), b"H0400007");
        assert_eq!(client.handle_bytes(now, answer), None);
        // The last byte is sent after seven others, and an answer has at least two bytes.
        let due = client.poll_timeout().unwrap();
        let bytes = |count| now + client.settings().on_line(count);
        assert_eq!(due.since(bytes(7)), client.settings().on_line(2));
        assert_eq!(client.handle_bytes(bytes(7), follows), None);
        let due = client.poll_timeout().unwrap();
        let event = client.handle_timeout(due).unwrap();
        assert_eq!(matches!(event, Event::Failed(Trouble::Garbled)), !follows.is_empty(), "{event:?}");
    }
}

#[test]
fn what_is_foreign_is_listened_to_until_the_line_is_quiet_or_the_time_is_over() {
    // A CR is skipped before an answer, but not within it.
    let (mut client, now) = synchronised();
    client.request(Command::Status).unwrap();
    sent(&mut client, now);
    assert_eq!(client.handle_bytes(now, b"\r00\r0080>\r"), None);
    let quiet = now + client.settings().on_line(12);
    assert_eq!(client.poll_timeout(), Some(quiet));
    assert_eq!(client.handle_timeout(quiet - Duration::from_micros(1)), None);
    let until = now + client.settings().exchange(1, Reply::Status);
    let late = until - Duration::from_millis(1);
    assert_eq!((client.handle_bytes(late, b"x"), client.poll_timeout()), (None, Some(until)));
    assert_eq!(client.handle_timeout(until), Some(Event::Failed(Trouble::Garbled)));
}

#[test]
fn a_wait_for_a_status_ends_in_time() {
    let mut rig = Rig::new();
    rig.done(Command::Release);
    let begin = rig.drive.line().now();
    assert_eq!(rig.drive.await_status(Duration::from_millis(100), |_| false).unwrap(), None);
    let spent = rig.drive.line().now().since(begin);
    // The status five times, with 20 ms in between.
    assert_eq!(spent.as_micros() / 1000, 80 + 5 * 7 * 10_000 / 9600);
}

/// Even while such a character is on the line.
#[test]
fn a_command_between_characters_of_inching_is_taken_at_any_time() {
    let mut rig = Rig::new();
    rig.drive.start_inching(Direction::Positive);
    for micros in 0..100 {
        rig.pass(Duration::from_micros(700 * micros));
        rig.drive.status().unwrap();
    }
}

#[test]
fn a_command_that_is_under_way_keeps_others_out_until_it_is_abandoned() {
    let mut client = Client::new(Settings::default());
    client.request(Command::Status).unwrap();
    assert!(client.request(Command::Status).is_err());
    client.abandon();
    assert_eq!((client.poll_timeout(), client.poll_transmit(Instant::ZERO)), (None, None));
    assert!(client.request(Command::WriteLong(Long::Setpoint, 10_000_000)).is_err());
    assert!(client.request(Command::Status).is_ok());
}

#[test]
fn an_adapter_that_returns_what_is_sent_is_understood() {
    let settings = Settings { echo: true, ..Settings::default() };
    let mut rig = Rig::with(SerialDrive::default(), settings);
    rig.done(Command::WriteLong(Long::Setpoint, 5000));
    assert_eq!(rig.number(Command::ReadLong(Long::Setpoint)), 5000);
    rig.drive.start_inching(Direction::Positive);
    rig.pass(Duration::from_secs(1));
    assert!(rig.number(Command::Velocity) > 0);
    // A client that does not expect an echo, and one that expects an echo that does not come.
    for (line, client) in [(settings, Settings::default()), (Settings::default(), settings)] {
        let line = VirtualLine::with_settings(SerialDrive::default(), line);
        let mut drive = Connection::new(line, client);
        let outcome = drive.status();
        assert_eq!(outcome.is_ok(), client.echo, "an echo may be missing");
    }
}

#[test]
fn an_exchange_takes_as_long_as_its_bytes_and_no_longer_than_its_time_out() {
    for baud in [1200, 9600, 115_200] {
        let settings = Settings { baud, ..Settings::default() };
        let mut rig = Rig::with(SerialDrive::default(), settings);
        rig.done(Command::Release);
        let begin = rig.drive.line().now();
        assert_eq!(rig.number(Command::Position), 0);
        let spent = rig.drive.line().now().since(begin);
        assert!(spent + Duration::from_micros(2) >= settings.on_line(11) && spent <= settings.on_line(11), "{spent:?}");
        assert_eq!(settings.exchange(1, Reply::Long), settings.on_line(11) + settings.reaction);
    }
    // Ten bits for a byte.
    assert_eq!(Settings { baud: 10, ..Settings::default() }.on_line(100), Duration::from_secs(100));
}

#[test]
fn a_drive_that_restarts_is_asked_for_its_status_first() {
    let mut rig = Rig::new();
    rig.done(Command::WriteLong(Long::Setpoint, 5000));
    rig.done(Command::Restart);
    assert_eq!(rig.number(Command::ReadLong(Long::Setpoint)), 0);
    let (mut client, now) = (Client::new(Settings::default()), Instant::from_micros(1_000_000));
    for (command, sent) in [(Command::Restart, [&b"R"[..], b"K"]), (Command::Flags, [b"R", b"Q"])] {
        client.request(command).unwrap();
        assert_eq!(client.poll_transmit(now).unwrap().as_bytes(), sent[0], "{command:?}");
        client.handle_bytes(now, b"0080>\r");
        client.handle_timeout(Instant::MAX);
        assert_eq!(client.poll_transmit(now).unwrap().as_bytes(), sent[1], "{command:?}");
        client.handle_timeout(Instant::MAX);
    }
}

/// A probe would take longer than the 100 ms after which the drive stops.
#[test]
fn a_command_right_behind_a_character_of_inching_needs_no_probe() {
    let (mut client, mut now) = (Client::new(Settings::default()), Instant::ZERO);
    client.start_inching(now, Direction::Positive);
    assert_eq!(sent(&mut client, now), b"R");
    client.handle_bytes(now, b"0080>\r");
    now = client.poll_timeout().unwrap();
    assert_eq!(client.handle_timeout(now), None);
    assert_eq!(sent(&mut client, now), b",");
    client.abandon();
    client.request(Command::Velocity).unwrap();
    assert_eq!(sent(&mut client, now), b"V");
    assert_eq!(client.handle_bytes(now, b"+030>\r"), Some(Event::Answered(Answer::Velocity(30))));
    now = client.poll_timeout().unwrap();
    assert_eq!(sent(&mut client, now), b",");
    let next = now + Duration::from_millis(50);
    now = client.poll_timeout().unwrap();
    assert_eq!(client.handle_timeout(now), None, "a character has no event");
    assert_eq!(client.poll_timeout(), Some(next));
}

#[test]
fn trouble_ends_inching() {
    let mut rig = Rig::new();
    rig.drive.start_inching(Direction::Positive);
    rig.pass(Duration::from_secs(1));
    rig.drive.line().with_drive(|drive, now| drive.drive_mut().switch_off(now));
    check(rig.drive.status(), Trouble::TimedOut);
    rig.drive.line().with_drive(|drive, now| drive.drive_mut().switch_on(now));
    rig.pass(Duration::from_secs(1));
    assert_eq!(rig.number(Command::Velocity), 0);
    // Before the command, the client checks that the drive is there.
    rig.drive.line().with_drive(|drive, now| drive.drive_mut().switch_off(now));
    check(rig.drive.status(), Trouble::TimedOut);
    rig.drive.start_inching(Direction::Positive);
    check(rig.drive.wait(Duration::from_secs(5)), Trouble::Silent);
}

#[test]
fn bytes_of_a_simulated_line_come_one_behind_the_other() {
    let mut line = VirtualLine::new(SerialDrive::default());
    let begin = line.now();
    line.disturb(b"ab");
    line.disturb(b"cd");
    line.with_drive(|drive, now| drive.handle_bytes(now, b"R"));
    let (mut buffer, mut came) = ([0; 64], Vec::new());
    while came.len() < 10 {
        let len = line.receive(Instant::MAX, &mut buffer).unwrap();
        came.extend_from_slice(&buffer[..len]);
    }
    assert!(came.starts_with(b"abcd") && came.ends_with(b">\r"), "{came:?}");
    let spent = line.now().since(begin);
    assert!(spent + Duration::from_micros(5) >= Settings::default().on_line(10), "{spent:?}");
}
