//! Commands on PROFIBUS-DP: the simulated drive behind a slave at the other end of a pseudo-terminal.
#![cfg(unix)]

use crate::common::{Run, folder, lexican};
use crate::simulation::Simulation;

/// On a busy machine, a run may take longer than the watchdog allows; the command is then run again.
const ATTEMPTS: usize = 20;

/// Runs a command until its result is as expected.
fn until(run: impl Fn() -> Run, is_so: impl Fn(&Run) -> bool) -> Run {
    (1..ATTEMPTS).map(|_| run()).find(|run| is_so(run)).unwrap_or_else(run)
}

#[test]
fn a_drive_on_profibus_is_a_node_for_every_command() {
    let simulate = ["siko/ag03-1", "--bus", "profibus", "--node", "5"];
    let mut drive = Simulation::begin(&folder("sim-profibus"), &simulate);
    let url = &drive.buses[0];
    assert!(url.starts_with("profibus:/dev/") && url.ends_with("?device=siko/ag03-1&address=5"), "{url}");
    let check = |command: &str, args: &[&str], words: &str| {
        until(|| drive.run(command, args), |run| run.code == Some(0) && run.stdout.contains(words)).on_stdout(0, words);
    };
    check("scan", &[], "node   5  siko/ag03-1, CiA 402");
    check("write", &["2412", "2.5 mm"], "Spindle Pitch = 2.50 mm");
    check("read", &["2412", "6041"], "Spindle Pitch = 2.50 mm");
    check("nmt start", &["--node", "5", "--wait", "2s"], "OPERATIONAL");
    check("drive", &["5", "step", "3 mm", "--enable"], "it has reached its target");
    // The drive has the inputs of every simulation, and without power its slave has none either.
    assert_eq!(drive.asks("battery_v = 2.9", "answer")["text"], "battery_v = 2.9");
    drive.asks("power off", "state");
    drive.run("read", &["6064"]).on_stderr(2, "no slave answers at address 5");
    drive.asks("power on", "state");
    let read = || drive.run("read", &["2412"]);
    until(read, |run| run.code == Some(0)).on_stdout(0, "Spindle Pitch");
}

#[test]
fn a_device_that_is_not_known_on_profibus_is_not_put_on_it() {
    let refused = |args: &[&str], words: &str| lexican(&[&["simulate"], args].concat()).on_stderr(2, words);
    refused(&["kollmorgen/akd", "--bus", "profibus"], "it knows siko/ag03-1 and siko/ag02");
    refused(&["siko/ag02", "--bus", "profibus:/dev/ttyUSB0?device=siko/ag02&address=5"], "--bus profibus");
}

#[test]
fn a_url_that_names_no_drive_on_profibus_is_refused_with_a_remedy() {
    let refused = |url: &str, words: &str| lexican(&["read", "--bus", url, "6064"]).on_stderr(2, words);
    refused("profibus:/dev/nothing", "profibus:/dev/nothing?device=siko/ag03-1&address=5");
    refused("profibus:/dev/nothing?device=siko/ag02&address=5", "cannot open /dev/nothing");
    refused("profibus:/dev/nothing?device=kollmorgen/akd&address=5", "it knows siko/ag03-1 and siko/ag02");
    refused("profibus:/dev/nothing?device=siko/ag02&address=0", "1 to 127");
    refused("profibus:/dev/nothing?device=siko/ag02&bitrate=19200", "bitrate=19200 is not 93750, 187500 or 500000");
    refused("profibus:/dev/nothing?node=5", "there is device, address, bitrate, gsd, module");
    refused("profibus:/dev/nothing?device=siko/ag02&address=5&module=PPO", "gsd=FILE&module=PPO");
    refused("profibus:/dev/nothing?device=siko/ag02&address=5&gsd=/dev/nothing.gsd", "/dev/nothing.gsd: ");
    let gsd = concat!(env!("CARGO_MANIFEST_DIR"), "/../eds/devices/siko/ag02/SIKO08C9.GSD");
    refused(&format!("profibus:/dev/nothing?device=siko/ag02&address=5&gsd={gsd}"), "cannot open /dev/nothing");
    refused(&format!("profibus:/dev/nothing?device=siko/ag02&address=5&gsd={gsd}&module=no"), "module=NAME; several");
}

/// None of the reasons is "no answer".
#[test]
fn a_slave_that_exchanges_no_data_says_why() {
    let simulate = ["siko/ag03-1", "--bus", "profibus", "--node", "5"];
    let drive = Simulation::begin(&folder("sim-profibus-trouble"), &simulate);
    let port = drive.buses[0].split_once('?').expect("it says what is there").0;
    for (device, address, words) in [
        ("siko/ag03-1", 6, "do its switches say 6"),
        ("siko/ag03-1", 127, "drives whose switches say 127 have the address 126"),
        ("siko/ag02", 5, "has the ident number 0AC5, and 08C9 is expected"),
    ] {
        let url = format!("{port}?device={device}&address={address}");
        // On a busy machine, an answer may come too late.
        let read = || lexican(&["read", "--bus", &url, "6064"]);
        until(read, |run| run.stderr.contains(words)).on_stderr(2, words);
    }
}
