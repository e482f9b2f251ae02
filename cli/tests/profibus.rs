//! Commands on PROFIBUS-DP: the simulated drive behind a slave at the other end of a pseudo-terminal.
#![cfg(unix)]

#[path = "common/mod.rs"]
mod common;

use std::time::Duration as StdDuration;

use common::lexican;
use lexican_profibus::{BitRate, Slave, serial_line};
use lexican_runtime::{Duration, Instant};
use serialport::{SerialPort, TTYPort};
use siko_profibus::{AG03_1, Door};

/// A machine under load may take longer than the watchdog allows: then a command is run again.
const ATTEMPTS: usize = 20;

#[test]
fn a_drive_on_profibus_is_a_node_for_every_command() {
    let (mut there, mut here) = TTYPort::pair().expect("the system has pseudo-terminals");
    there.set_timeout(StdDuration::from_millis(1)).expect("a time-out can be set");
    here.set_exclusive(false).expect("another process may open it");
    let port = here.name().expect("it has a path");
    // Kept open, so that reading does not fail between two commands, and without the lock of `here`.
    let _open = std::fs::File::open(&port).expect("it is open");
    drop(here);
    // It ends with the test.
    std::thread::spawn(move || {
        let slave = Slave::new(5, AG03_1.identity, BitRate(500_000), Door::new(Instant::ZERO, &AG03_1, 5));
        let mut slave = slave.with_idle(Duration::from_millis(2));
        serial_line::serve(&mut slave, &mut there, || true)
    });
    let url = format!("profibus:{port}?device=siko/ag03-1&address=5");
    let check = |args: &[&str], words: &str| {
        let mut runs = (0..ATTEMPTS).map(|_| lexican(&[args, &["--bus", &url]].concat()));
        let well = runs.find(|run| run.code == Some(0)).unwrap_or_else(|| lexican(&[args, &["--bus", &url]].concat()));
        well.on_stdout(0, words);
    };
    check(&["scan"], "node   5  siko/ag03-1, CiA 402");
    check(&["write", "2412", "2.5 mm"], "Spindle Pitch = 2.50 mm");
    check(&["read", "2412", "6041"], "Spindle Pitch = 2.50 mm");
    check(&["nmt", "start", "--node", "5", "--wait", "2s"], "OPERATIONAL");
    check(&["drive", "5", "step", "3 mm", "--enable"], "it has reached its target");
}

#[test]
fn a_url_that_names_no_drive_on_profibus_is_refused_with_a_remedy() {
    let refused = |url: &str, words: &str| lexican(&["read", "--bus", url, "6064"]).on_stderr(2, words);
    refused("profibus:/dev/nothing", "profibus:/dev/nothing?device=siko/ag03-1&address=5");
    refused("profibus:/dev/nothing?device=siko/ag02&address=5", "cannot open /dev/nothing");
    refused("profibus:/dev/nothing?device=kollmorgen/akd&address=5", "it knows siko/ag03-1 and siko/ag02");
    refused("profibus:/dev/nothing?device=siko/ag02&address=0", "1 to 127");
    refused("profibus:/dev/nothing?device=siko/ag02&bitrate=19200", "there is 93750, 187500, 500000");
    refused("profibus:/dev/nothing?node=5", "there is device, address, bitrate, gsd, module");
    refused("profibus:/dev/nothing?device=siko/ag02&address=127", "drives whose switches say 127 have the address 126");
    refused("profibus:/dev/nothing?device=siko/ag02&address=5&module=PPO", "gsd=FILE&module=PPO");
    refused("profibus:/dev/nothing?device=siko/ag02&address=5&gsd=/dev/nothing.gsd", "/dev/nothing.gsd: ");
    let gsd = concat!(env!("CARGO_MANIFEST_DIR"), "/../eds/devices/siko/ag02/SIKO08C9.GSD");
    refused(&format!("profibus:/dev/nothing?device=siko/ag02&address=5&gsd={gsd}"), "cannot open /dev/nothing");
    refused(&format!("profibus:/dev/nothing?device=siko/ag02&address=5&gsd={gsd}&module=no"), "module=NAME; several");
}

/// Not one of them is "no answer".
#[test]
fn a_slave_that_exchanges_no_data_says_why() {
    let (mut there, mut here) = TTYPort::pair().expect("the system has pseudo-terminals");
    there.set_timeout(StdDuration::from_millis(1)).expect("a time-out can be set");
    here.set_exclusive(false).expect("another process may open it");
    let port = here.name().expect("it has a path");
    let _open = std::fs::File::open(&port).expect("it is open");
    drop(here);
    std::thread::spawn(move || {
        let slave = Slave::new(5, AG03_1.identity, BitRate(500_000), Door::new(Instant::ZERO, &AG03_1, 5));
        let mut slave = slave.with_idle(Duration::from_millis(2));
        serial_line::serve(&mut slave, &mut there, || true)
    });
    for (device, address, words) in [
        ("siko/ag03-1", 6, "do its switches say 6"),
        ("siko/ag02", 5, "has the ident number 0AC5, and 08C9 is expected"),
    ] {
        let url = format!("profibus:{port}?device={device}&address={address}");
        // Under load an answer may come too late.
        let mut runs = (0..ATTEMPTS).map(|_| lexican(&["read", "--bus", &url, "6064"]));
        let says = runs.find(|run| run.stderr.contains(words));
        says.unwrap_or_else(|| lexican(&["read", "--bus", &url, "6064"])).on_stderr(2, words);
    }
}
