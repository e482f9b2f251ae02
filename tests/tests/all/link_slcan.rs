//! The slcan link over pseudo-terminals: against an adapter, and against itself.
#![cfg(unix)]

use std::io::{ErrorKind, Read, Write};
use std::thread::JoinHandle;

use crate::link_support::{self, DEVICE_TYPE, Serving};
use lexican_runtime::host::slcan::{Decoder, Message, Settings, Slcan, SlcanError, line};
use lexican_runtime::host::tokio::{Event, Network};
use lexican_runtime::host::{BusState, Incoming, Link, LinkError};
use lexican_runtime::{CobId, Duration, Frame, NodeId};
use serialport::{SerialPort, TTYPort};

const LONG: Duration = Duration::from_secs(5);

fn frame(id: u16, data: &[u8]) -> Frame {
    Frame::new(CobId::standard(id).unwrap(), data).unwrap()
}

fn settings(bit_rate: u32) -> Settings {
    Settings { bit_rate: Some(bit_rate), baud: 0 }
}

#[track_caller]
fn hears(link: &mut Slcan, expected: Incoming) {
    let until = link.now() + LONG;
    assert_eq!(link.receive(until).unwrap(), Some(expected));
}

/// A terminal whose far end the test plays.
fn terminal() -> (TTYPort, TTYPort, String) {
    let (mut far, near) = TTYPort::pair().unwrap();
    far.set_timeout(std::time::Duration::from_secs(5)).unwrap();
    let path = near.name().unwrap();
    (far, near, path)
}

/// Answers the commands with which a link opens the adapter, each with `answer`; returns the commands.
fn play_adapter(mut far: TTYPort, answer: fn(&str) -> &'static [u8]) -> JoinHandle<(TTYPort, Vec<String>)> {
    std::thread::spawn(move || {
        let mut commands = Vec::new();
        let mut command = String::new();
        let mut byte = [0];
        while commands.last().is_none_or(|command| command != "O") && far.read_exact(&mut byte).is_ok() {
            match byte[0] {
                b'\r' => {
                    far.write_all(answer(&command)).unwrap();
                    commands.push(std::mem::take(&mut command));
                }
                other => command.push(char::from(other)),
            }
        }
        (far, commands)
    })
}

#[test]
fn an_adapter_is_set_up_and_carries_frames() {
    let (far, _near, path) = terminal();
    let adapter = play_adapter(far, |command| if command == "C" { b"\x07" } else { b"\r" });
    let mut link = Slcan::open(&path, settings(500_000)).unwrap();
    let (mut far, commands) = adapter.join().unwrap();
    assert_eq!(commands, ["", "", "", "C", "S6", "O"]);

    far.write_all(b"t58584B00100092010200\rz\rT0000012321122\r").unwrap();
    hears(&mut link, Incoming::Frame(frame(0x585, &[0x4B, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00])));
    hears(&mut link, Incoming::Frame(Frame::new(CobId::extended(0x123).unwrap(), &[0x11, 0x22]).unwrap()));
    link.send(&Frame::remote(CobId::standard(0x705).unwrap(), 1).unwrap()).unwrap();
    drop(link);
    let mut heard = [0; 8];
    far.read_exact(&mut heard).unwrap();
    assert_eq!(&heard, b"r7051\rC\r", "the channel is closed at the end");
}

#[test]
fn answers_to_an_earlier_user_are_not_taken_for_those_to_the_opening() {
    let (mut far, _near, path) = terminal();
    // Bytes come before the commands, and late.
    far.write_all(b"\x07t12\x07\x07\x07").unwrap();
    let adapter = play_adapter(far, |command| match command {
        "" | "C" => b"\x07\x07",
        _ => b"\r",
    });
    drop(Slcan::open(&path, settings(500_000)).unwrap());
    let (_far, commands) = adapter.join().unwrap();
    assert_eq!(commands, ["", "", "", "C", "S6", "O"]);
}

#[test]
fn an_adapter_that_refuses_is_named_with_the_command() {
    let (far, _near, path) = terminal();
    let adapter = play_adapter(far, |command| if command == "S7" { b"\x07" } else { b"\r" });
    let error = Slcan::open(&path, settings(800_000)).err().unwrap();
    assert!(matches!(&error, SlcanError::Refused { command, .. } if command == "S7"), "{error}");
    drop(adapter);
}

#[test]
fn a_bell_makes_the_link_ask_for_the_state() {
    let (far, _near, path) = terminal();
    let adapter = play_adapter(far, |_| b"\r");
    let mut link = Slcan::open(&path, settings(125_000)).unwrap();
    let (mut far, _) = adapter.join().unwrap();
    // 20h: error passive, as a controller reports whose frames are not acknowledged.
    let far = std::thread::spawn(move || {
        let mut question = [0; 2];
        far.write_all(b"\x07").unwrap();
        far.read_exact(&mut question).unwrap();
        far.write_all(b"F20\r").unwrap();
        far.read_exact(&mut question).unwrap();
        far.write_all(b"F00\r").unwrap();
        far
    });
    hears(&mut link, Incoming::State(BusState::Passive));
    hears(&mut link, Incoming::State(BusState::Active));
    drop(far.join().unwrap());
}

#[test]
fn a_terminal_that_nobody_reads_is_full_and_then_goes_on_with_whole_lines() {
    let (mut far, _near, path) = terminal();
    let mut link = Slcan::open(&path, settings(1_000_000)).unwrap();
    let mut sent: Vec<Frame> = Vec::new();
    let refused = (0..100_000u32).find_map(|number| {
        let frame = frame(0x200, &number.to_le_bytes());
        let refusal = link.send(&frame).err();
        if refusal.is_none() {
            sent.push(frame);
        }
        refusal
    });
    assert!(matches!(refused, Some(LinkError::Full)), "{refused:?}");

    // All frames that were not refused arrive whole, and so do the following ones.
    let reader = std::thread::spawn(move || {
        let mut decoder = Decoder::default();
        let mut heard = Vec::new();
        let mut buffer = [0; 4096];
        while heard.last() != Some(&frame(0x201, &[])) {
            let len = far.read(&mut buffer).unwrap();
            heard.extend(buffer[..len].iter().filter_map(|byte| match decoder.take(*byte) {
                Some(Message::Frame(frame)) => Some(frame),
                _ => None,
            }));
        }
        heard
    });
    sent.push(frame(0x201, &[]));
    while link.send(&frame(0x201, &[])).is_err() {}
    assert_eq!(reader.join().unwrap(), sent);
}

#[test]
fn an_adapter_that_is_unplugged_is_told_and_comes_back() {
    let folder = std::env::temp_dir().join(format!("lexican-slcan-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let plug = folder.join("adapter");
    let (far, near, path) = terminal();
    std::os::unix::fs::symlink(&path, &plug).unwrap();
    let mut link = Slcan::open(plug.to_str().unwrap(), settings(500_000)).unwrap();

    std::fs::remove_file(&plug).unwrap();
    drop((far, near));
    hears(&mut link, Incoming::State(BusState::Removed));
    assert!(matches!(link.send(&frame(1, &[])), Err(error @ LinkError::NoBus(BusState::Removed)) if !error.is_final()));

    let (mut far, _near, path) = terminal();
    std::os::unix::fs::symlink(&path, &plug).unwrap();
    hears(&mut link, Incoming::State(BusState::Active));
    far.write_all(format!("{}\r", line(&frame(2, &[]))).as_bytes()).unwrap();
    hears(&mut link, Incoming::Frame(frame(2, &[])));
    std::fs::remove_dir_all(&folder).unwrap();
}

#[cfg(target_os = "linux")]
#[test]
fn waiting_for_an_adapter_that_is_gone_costs_no_time_of_the_processor() {
    // A name of its own, because another test may get the number of a closed terminal.
    let plug = std::env::temp_dir().join(format!("lexican-gone-{}", std::process::id()));
    let (far, near, path) = terminal();
    std::os::unix::fs::symlink(&path, &plug).unwrap();
    let mut link = Slcan::open(plug.to_str().unwrap(), settings(500_000)).unwrap();
    std::fs::remove_file(&plug).unwrap();
    drop((far, near));
    hears(&mut link, Incoming::State(BusState::Removed));
    let before = link_support::processor_ticks();
    let until = link.now() + Duration::from_secs(1);
    assert_eq!(link.receive(until).unwrap(), None);
    let used = link_support::processor_ticks() - before;
    assert!(used <= 20, "{used} of 100 ticks");
}

/// Two terminals back to back: what is written to one is read from the other, until one of them is closed.
fn crossing() -> [(TTYPort, String); 2] {
    let [(one, one_near, one_path), (other, other_near, other_path)] = [terminal(), terminal()];
    let carry = |mut from: TTYPort, mut to: TTYPort| {
        std::thread::spawn(move || {
            let mut buffer = [0; 4096];
            loop {
                match from.read(&mut buffer) {
                    Ok(len) if to.write_all(&buffer[..len]).is_ok() => {}
                    Err(error) if error.kind() == ErrorKind::TimedOut => {}
                    _ => return,
                }
            }
        })
    };
    carry(one.try_clone_native().unwrap(), other.try_clone_native().unwrap());
    carry(other, one);
    [(one_near, one_path), (other_near, other_path)]
}

#[test]
fn a_silent_node_holds_up_nobody_on_the_tokio_shell() {
    let [(_one, near), (_other, far)] = crossing();
    let [devices, link] = [near, far].map(|path| Slcan::open(&path, Settings::default()).unwrap());
    link_support::a_silent_node_holds_up_nobody(devices, link);
}

#[test]
fn a_tokio_shell_goes_on_when_its_adapter_is_plugged_in_again() {
    let folder = std::env::temp_dir().join(format!("lexican-replug-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let plug = folder.join("adapter");
    let node = NodeId::literal(5);
    let (far, near, path) = terminal();
    std::os::unix::fs::symlink(&path, &plug).unwrap();
    let link = Slcan::open(plug.to_str().unwrap(), settings(500_000)).unwrap();
    link_support::run(async {
        let network = Network::spawn(link).unwrap();
        let mut events = network.events();
        std::fs::remove_file(&plug).unwrap();
        drop((far, near));
        assert_eq!(events.recv().await.unwrap(), Event::Bus(BusState::Removed));
        assert!(network.read(node, DEVICE_TYPE).await.is_err());

        let [(_one, near), (_other, far)] = crossing();
        let _serving = Serving::nodes(&[node], Slcan::open(&near, Settings::default()).unwrap());
        std::os::unix::fs::symlink(&far, &plug).unwrap();
        while events.recv().await.unwrap() != Event::Bus(BusState::Active) {}
        assert_eq!(network.read(node, DEVICE_TYPE).await.unwrap(), 0x0002_0192);
    });
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn what_cannot_be_opened_says_why() {
    let error = |path: &str, bit_rate| Slcan::open(path, settings(bit_rate)).err().unwrap();
    assert!(matches!(error("/dev/no-such-port", 500_000), SlcanError::Missing { .. }));
    let (_far, _near, path) = terminal();
    assert_eq!(
        error(&path, 750_000).to_string(),
        "the slcan protocol has no bit rate of 750000 bit/s; it has 10000, 20000, 50000, 100000, 125000, 250000, \
         500000, 800000, 1000000"
    );
    let _first = Slcan::open(&path, settings(500_000)).unwrap();
    assert!(matches!(error(&path, 500_000), SlcanError::Busy { .. }));
}
