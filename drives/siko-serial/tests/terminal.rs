//! The client on a serial port of the operating system.
#![cfg(all(feature = "serialport", unix))]

#[path = "all/serial_rig.rs"]
mod serial_rig;

use std::io::{Read, Write};

use serial_rig::{Connection, Error};
use serialport::{SerialPort, TTYPort};
use siko_serial::answer::Answer;
use siko_serial::client::Trouble;
use siko_serial::command::{Command, Long, Short};
use siko_serial::sim::SerialDrive;
use siko_serial::{Port, Settings};

#[test]
fn a_drive_answers_over_a_terminal_until_it_is_gone() {
    let (mut near, far) = TTYPort::pair().unwrap();
    let path = far.name().unwrap();
    near.set_timeout(std::time::Duration::from_millis(1)).unwrap();
    // The drive is at the controlling end, and ends when it is asked for its bit rate.
    let served = std::thread::spawn(move || {
        let (mut drive, mut buffer) = (SerialDrive::default(), [0; 64]);
        loop {
            let Ok(len) = near.read(&mut buffer) else { continue };
            if buffer[..len].starts_with(b"G12") {
                return near;
            }
            drive.handle_bytes(lexican_runtime::Instant::ZERO, &buffer[..len]);
            while let Some(answer) = drive.poll_transmit() {
                near.write_all(answer.as_bytes()).unwrap();
            }
        }
    });
    let mut drive = Connection::new(Port::open(&path, 9600).unwrap(), Settings::default());
    assert_eq!(drive.request(Command::WriteLong(Long::Setpoint, -7)).unwrap(), Answer::Done);
    assert_eq!(drive.number(Command::ReadLong(Long::Setpoint)).unwrap(), -7);
    let silent = drive.request(Command::ReadShort(Short::BitRate));
    assert!(matches!(silent, Err(Error::Trouble(Trouble::TimedOut))), "{silent:?}");
    drop(served.join().unwrap());
    drop(far);
    assert!(matches!(drive.request(Command::Status), Err(Error::Line(_))), "a line that is gone is an error");
    assert!(Port::open("/dev/nonexistent", 9600).is_err());
}
