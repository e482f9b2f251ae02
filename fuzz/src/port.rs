//! No bytes on a drive's serial port make either side panic, and after any of them the next command works.

use lexican_runtime::{Duration, Instant};
use siko_serial::answer::{Reading, Reply};
use siko_serial::client::{Client, Event, PROBES, Settings};
use siko_serial::command::Command;
use siko_serial::sim::SerialDrive;

/// Bytes on the serial port, for both of its sides.
pub fn siko_serial(data: &[u8]) {
    let (mut drive, mut client, mut now) = (SerialDrive::default(), Client::new(Settings::default()), Instant::ZERO);
    for part in data.chunks(12) {
        now += Duration::from_millis(10);
        round_trips(part);
        if let Ok(command) = Command::parse(part) {
            let _busy = client.request(command);
        }
        client.handle_bytes(now, part);
        drive.handle_bytes(now, part);
        turn(&mut drive, &mut client, now);
    }
    client.abandon();
    client.request(Command::Flags).expect("nothing is under way");
    for _ in 0..=2 * PROBES {
        if let Some(event) = turn(&mut drive, &mut client, now) {
            assert!(matches!(event, Event::Answered(_)), "{event:?}");
            return;
        }
        now = client.poll_timeout().map_or(now, |deadline| now.max(deadline));
    }
    panic!("the next command has no end");
}

/// What was parsed is written so that it parses to the same value.
fn round_trips(bytes: &[u8]) {
    if let Ok(command) = Command::parse(bytes) {
        let again = command.encode().expect("what was read fits");
        assert_eq!(Command::parse(again.as_bytes()), Ok(command));
    }
    for reply in Reply::ALL {
        if let Reading::Whole(answer) = reply.read(bytes) {
            let again = answer.encode().expect("what was read fits");
            assert_eq!(reply.read(again.as_bytes()), Reading::Whole(answer));
        }
    }
}

/// Exchanges what both sides have to send.
fn turn(drive: &mut SerialDrive, client: &mut Client, now: Instant) -> Option<Event> {
    let mut event = client.handle_timeout(now);
    drive.handle_timeout(now);
    while let Some(telegram) = client.poll_transmit(now) {
        drive.handle_bytes(now, telegram.as_bytes());
    }
    while let Some(answer) = drive.poll_transmit() {
        let next = client.handle_bytes(now, answer.as_bytes());
        event = event.or(next);
    }
    event
}
