//! Commands and answers: round trips, random bytes, and the time on the line.

use super::random::Random;
use super::serial_rig::Rig;
use lexican_driver::Direction;
use lexican_runtime::{Duration, Instant};
use proptest::prelude::*;
use proptest::sample::select;
use siko_ag02::od::serial::TABLE;
use siko_serial::answer::{Answer, Flags, Reading, Reply};
use siko_serial::client::{Client, Event, Settings};
use siko_serial::command::{Command, Decoder, Identity, Long, Mode, PosType, Setting, Short, Turning};
use siko_serial::error::ErrorNumber;
use siko_serial::parameter;
use siko_serial::sim::SerialDrive;
use siko_serial::telegram::Telegram;

const PLAIN: [Command; 14] = [
    Command::Abort,
    Command::FaultCount,
    Command::Faults,
    Command::Restart,
    Command::Start,
    Command::EmergencyStop,
    Command::Stop,
    Command::Release,
    Command::Flags,
    Command::Status,
    Command::Velocity,
    Command::BinaryPosition,
    Command::Step,
    Command::Position,
];

fn commands() -> impl Strategy<Value = Command> {
    prop_oneof![
        select(&PLAIN),
        select(Identity::ALL).prop_map(Command::Identity),
        select(Long::ALL).prop_map(Command::ReadLong),
        (select(Long::ALL), -Command::LONG..=Command::LONG).prop_map(|(which, value)| Command::WriteLong(which, value)),
        select(Short::ALL).prop_map(Command::ReadShort),
        (select(Short::ALL), 0..=Command::SHORT).prop_map(|(which, value)| Command::WriteShort(which, value)),
        select(PosType::ALL).prop_map(Command::SetPosType),
        select(Setting::ALL).prop_map(Command::Set),
        select(Turning::ALL).prop_map(Command::SetTurning),
        select(Mode::ALL).prop_map(Command::SetMode),
        select(&[Direction::Positive, Direction::Negative]).prop_map(Command::Inch),
    ]
}

fn printable<const N: usize>() -> impl Strategy<Value = [u8; N]> {
    proptest::collection::vec(b' '..=b'~', N).prop_map(|text| text.try_into().unwrap())
}

/// An answer and its form.
fn answers() -> impl Strategy<Value = (Reply, Answer)> {
    let refusals = (select(Reply::ALL), (0..100_u8).prop_map(|number| ErrorNumber::new(number).unwrap()));
    prop_oneof![
        Just((Reply::Done, Answer::Done)),
        refusals.prop_map(|(reply, number)| (reply, Answer::Refused(number))),
        printable().prop_map(|text| (Reply::Text, Answer::Text(text))),
        (-9_999_999..=9_999_999).prop_map(|number| (Reply::Long, Answer::Long(number))),
        (0..=99_999_u32).prop_map(|number| (Reply::Short, Answer::Short(number))),
        (0..=99_u8).prop_map(|count| (Reply::Count, Answer::Count(count))),
        printable().prop_map(|letters| (Reply::Letters, Answer::Letters(letters))),
        any::<u8>().prop_map(|bits| (Reply::Flags, Answer::Flags(Flags(bits)))),
        any::<u16>().prop_map(|word| (Reply::Status, Answer::Status(word))),
        (-999..=999_i16).prop_map(|velocity| (Reply::Velocity, Answer::Velocity(velocity))),
        any::<i32>().prop_map(|position| (Reply::Binary, Answer::Binary(position))),
    ]
}

proptest! {
    #[test]
    fn a_command_reads_as_it_was_written(command in commands(), small in any::<bool>()) {
        let bytes = command.encode().unwrap();
        let bytes = if small { bytes.as_bytes().to_ascii_lowercase() } else { bytes.as_bytes().to_vec() };
        prop_assert_eq!(Command::parse(&bytes), Ok(command));
        let mut decoder = Decoder::default();
        let (last, begun) = bytes.split_last().unwrap();
        prop_assert!(begun.iter().all(|byte| decoder.take(*byte).is_none()));
        prop_assert_eq!(decoder.take(*last), Some(Ok(command)));
        for cut in 0..bytes.len() {
            prop_assert!(Command::parse(&bytes[..cut]).is_err());
        }
    }

    #[test]
    fn an_answer_reads_as_it_was_written((reply, answer) in answers()) {
        // A binary position that looks like a refusal is not encoded.
        let Some(bytes) = answer.encode() else {
            prop_assert!(matches!(answer, Answer::Binary(position) if position > 1_000_000_000));
            return Ok(());
        };
        let bytes = bytes.as_bytes();
        prop_assert_eq!(reply.read(bytes), Reading::Whole(answer));
        for cut in 0..bytes.len() {
            let begun = reply.is_empty() && cut == 0;
            prop_assert_eq!(reply.read(&bytes[..cut]), if begun { Reading::Foreign } else { Reading::Begun });
        }
        prop_assert_eq!(reply.read(&[bytes, b"\r"].concat()), Reading::Foreign);
    }

    #[test]
    fn any_bytes_are_read(bytes in proptest::collection::vec(any::<u8>(), 0..16), reply in select(Reply::ALL)) {
        if let Ok(command) = Command::parse(&bytes) {
            let again = command.encode().unwrap();
            prop_assert_eq!(Command::parse(again.as_bytes()), Ok(command));
        }
        if let Reading::Whole(answer) = reply.read(&bytes) {
            prop_assert_eq!(reply.read(answer.encode().unwrap().as_bytes()), Reading::Whole(answer));
        }
    }
}

#[test]
fn what_is_too_long_for_its_telegram_is_none() {
    for command in [
        Command::WriteLong(Long::Setpoint, 10_000_000),
        Command::WriteLong(Long::Setpoint, i32::MIN),
        Command::WriteShort(Short::Window, 100_000),
    ] {
        assert_eq!(command.encode(), None);
    }
    for answer in [
        Answer::Long(-10_000_000),
        Answer::Short(100_000),
        Answer::Count(100),
        Answer::Velocity(1000),
        Answer::Text(*b"AG02\0\0\0\0"),
        Answer::Letters(*b"AB--\0-----"),
        Answer::Binary(i32::from_be_bytes(*b"?00\r")),
    ] {
        assert_eq!(answer.encode(), None, "{answer:?}");
    }
    assert_eq!(ErrorNumber::new(100), None);
}

#[test]
fn the_longest_that_fits_is_sent() {
    let of = |telegram: Option<Telegram>| telegram.map(|telegram| telegram.as_bytes().to_vec());
    for (command, bytes) in [
        (Command::WriteLong(Long::Setpoint, 9_999_999), &b"F0+9999999"[..]),
        (Command::WriteLong(Long::Setpoint, -9_999_999), b"F0-9999999"),
        (Command::WriteShort(Short::Window, 99_999), b"H0999999"),
    ] {
        assert_eq!(of(command.encode()).as_deref(), Some(bytes));
    }
    for (answer, bytes) in [
        (Answer::Long(-9_999_999), &b"-9999999>\r"[..]),
        (Answer::Short(99_999), b"99999>\r"),
        (Answer::Count(99), b"99>\r"),
        (Answer::Velocity(-999), b"-999>\r"),
    ] {
        assert_eq!(of(answer.encode()).as_deref(), Some(bytes));
    }
}

#[test]
fn the_first_byte_that_cannot_belong_to_a_command_ends_it() {
    use Command::{Start, Status, WriteLong};
    let (number, range) = (Err(ErrorNumber::PARAMETER_NUMBER), Err(ErrorNumber::VALUE_RANGE));
    for (bytes, commands) in [
        ("\r\n R", &[Ok(Status)][..]),
        ("\r\nF0+0005000\rM", &[Ok(WriteLong(Long::Setpoint, 5000)), Ok(Start)]),
        ("f0-0000001m", &[Ok(WriteLong(Long::Setpoint, -1)), Ok(Start)]),
        // No line end, sign or letter is accepted in a number, and no digit in place of the sign.
        ("F0\rR", &[range, Ok(Status)]),
        ("E+R", &[range, Ok(Status)]),
        ("F-R", &[range, Ok(Status)]),
        ("F00R", &[range, Ok(Status)]),
        ("F0+0-R", &[range, Ok(Status)]),
        ("H0 R", &[range, Ok(Status)]),
        ("EaR", &[range, Ok(Status)]),
        ("#5R", &[number, number, Ok(Status)]),
    ] {
        let mut decoder = Decoder::default();
        let taken: Vec<_> = bytes.bytes().filter_map(|byte| decoder.take(byte)).collect();
        assert_eq!(taken, commands, "{bytes:?}");
    }
    let mut decoder = Decoder::default();
    assert_eq!(decoder.take(b'F'), None);
    decoder.reset();
    assert_eq!(decoder.take(b'R'), Some(Ok(Status)));
}

/// Sends a command to the drive and returns its answer, without delay. Returns the event, and the number of telegrams.
fn exchange(client: &mut Client, drive: &mut SerialDrive, now: &mut Instant, command: Command) -> (Event, u32) {
    client.request(command).unwrap();
    for telegrams in 0.. {
        let Some(telegram) = client.poll_transmit(*now) else {
            *now = (*now).max(client.poll_timeout().unwrap());
            match client.handle_timeout(*now) {
                Some(event) => return (event, telegrams),
                None => continue,
            }
        };
        drive.handle_bytes(*now, telegram.as_bytes());
        while let Some(answer) = drive.poll_transmit() {
            if let Some(event) = client.handle_bytes(*now, answer.as_bytes()) {
                return (event, telegrams);
            }
        }
    }
    unreachable!()
}

#[test]
fn after_a_million_random_bytes_the_next_command_works() {
    let (mut noise, mut now) = (Random(0x5EED), Instant::ZERO);
    let (mut client, mut drive) = (Client::new(Settings::default()), SerialDrive::default());
    for _ in 0..1000 {
        let bytes: Vec<u8> = (0..1000).map(|_| noise.next() as u8).collect();
        now += Duration::from_millis(1000);
        drive.handle_bytes(now, &bytes);
        while drive.poll_transmit().is_some() {}
        assert_eq!(client.handle_bytes(now, &bytes), None);
        let (event, telegrams) = exchange(&mut client, &mut drive, &mut now, Command::Flags);
        assert!(matches!(event, Event::Answered(Answer::Flags(_))), "{event:?}");
        assert!(telegrams <= 2 * u32::from(siko_serial::client::PROBES), "{telegrams}");
    }
}

#[test]
fn a_hundred_thousand_damaged_telegrams_take_bounded_time() {
    let (mut noise, mut now) = (Random(0xB17), Instant::ZERO);
    let (mut client, mut drive) = (Client::new(Settings::default()), SerialDrive::default());
    let telegrams: Vec<_> = [
        Command::WriteLong(Long::Setpoint, -5000),
        Command::WriteShort(Short::Window, 10),
        Command::Set(Setting::ResetFault),
        Command::ReadLong(Long::UpperLimit),
        Command::Identity(Identity::Gear),
        Command::Faults,
        Command::Position,
        Command::Start,
    ]
    .into_iter()
    .map(|command| command.encode().unwrap().as_bytes().to_vec())
    .collect();
    for _ in 0..100_000 {
        let mut bytes = telegrams[noise.below(telegrams.len())].clone();
        if noise.below(4) == 0 {
            bytes.truncate(noise.below(bytes.len()));
        } else {
            noise.alter(&mut bytes);
        }
        now += Duration::from_millis(20);
        drive.handle_bytes(now, &bytes);
        drive.handle_timeout(now);
        while let Some(answer) = drive.poll_transmit() {
            client.handle_bytes(now, answer.as_bytes());
        }
    }
    let begin = now;
    let (event, _) = exchange(&mut client, &mut drive, &mut now, Command::Status);
    assert!(matches!(event, Event::Answered(Answer::Status(_))));
    assert!(now.since(begin) < Duration::from_secs(3), "in the time of the line");
}

/// Each row of the overlay has commands that the drive carries out, and their numbers there and back.
#[test]
fn every_parameter_has_commands_that_the_drive_carries_out() {
    for row in TABLE {
        let mut rig = Rig::new();
        if row.when.is_some_and(|when| !when.holds(1)) {
            rig.done(Command::SetMode(Mode::Velocity));
        }
        let number = match parameter::reading(row) {
            Some(command) => parameter::answered(row, rig.drive.request(command).unwrap()).unwrap(),
            None => row.codes[0].0,
        };
        assert_eq!(parameter::reading(row).is_some(), row.access.is_readable(), "{row:?}");
        assert!(row.in_object(number).is_some(), "{row:?}");
        // A parameter of a few bits in the register of flags has few values.
        let in_range = |number: i64| row.range.is_none_or(|(low, high)| (low..=high).contains(&number));
        let few = |number: &i64| in_range(*number) && parameter::writing(row, *number).is_some();
        let own = if row.number.starts_with('Q') { (0..10).filter(few).collect() } else { vec![number] };
        for number in own {
            rig.done(parameter::writing(row, number).unwrap_or_else(|| panic!("{row:?}")));
            if let Some(command) = parameter::reading(row) {
                let answer = rig.drive.request(command).unwrap();
                assert_eq!(parameter::answered(row, answer), Some(number), "{row:?}");
            }
        }
    }
}
