//! The program is killed while a drive travels: the drive notices, and stands.
//!
//! The simulated drive is here, in real time; a pseudo-terminal is the serial adapter (slcan) of the program.
#![cfg(unix)]

use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::AsFd;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::Instant as WallInstant;

use lexican_runtime::host::slcan::{Decoder, Message, line};
use lexican_runtime::host::{Incoming, Link, LinkError, Participant};
use lexican_runtime::{Duration, Frame, Instant, NodeId};
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};
use siko_ag03_1::sim::{MODEL, Setup, SimulatedDrive};

const NODE: NodeId = NodeId::literal(5);
/// A travel of minutes.
const RECIPE: &str =
    "name = \"Killed\"\nmachine = \"killed.machine.toml\"\n[[drive]]\nnode = \"rail\"\nposition.increments = 100000\n";
const MACHINE: &str = "[node.rail]\nid = 5\nsheet = \"siko/ag03-1\"\n";

/// The adapter, seen from its other end.
struct Adapter {
    port: File,
    decoder: Decoder,
    heard: Vec<u8>,
    origin: WallInstant,
}

impl Link for Adapter {
    fn now(&self) -> Instant {
        Instant::ZERO + self.origin.elapsed().into()
    }

    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        Ok(self.port.write_all((line(frame) + "\r").as_bytes())?)
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        loop {
            while !self.heard.is_empty() {
                match self.decoder.take(self.heard.remove(0)) {
                    Some(Message::Frame(frame)) => {
                        self.port.write_all(b"z\r")?;
                        return Ok(Some(Incoming::Frame(frame)));
                    }
                    Some(_) => self.port.write_all(b"\r")?,
                    None => {}
                }
            }
            let left = until.since(self.now());
            if left.is_zero() {
                return Ok(None);
            }
            let patience = PollTimeout::try_from(left.as_micros().div_ceil(1000) as i32).unwrap_or(PollTimeout::MAX);
            if poll(&mut [PollFd::new(self.port.as_fd(), PollFlags::POLLIN)], patience).is_ok_and(|ready| ready > 0) {
                let mut buffer = [0; 256];
                let len = self.port.read(&mut buffer)?;
                self.heard.extend_from_slice(&buffer[..len]);
            }
        }
    }

    fn is_real_time(&self) -> bool {
        true
    }
}

#[test]
#[expect(clippy::disallowed_methods, reason = "two processes have real time in common, and nothing else")]
fn a_drive_whose_program_is_killed_stands_within_its_dead_man_time() {
    let pair = nix::pty::openpty(None, None).unwrap();
    let mut settings = tcgetattr(&pair.slave).unwrap();
    cfmakeraw(&mut settings);
    tcsetattr(&pair.slave, SetArg::TCSANOW, &settings).unwrap();
    let port = nix::unistd::ttyname(&pair.slave).unwrap();
    let origin = WallInstant::now();
    let adapter = Adapter { port: pair.master.into(), decoder: Decoder::default(), heard: Vec::new(), origin };
    let drive = SimulatedDrive::power_on(adapter.now(), Setup::new(&MODEL, NODE));
    let drive = Arc::new(Mutex::new(drive));
    let mut bus = Participant::new(adapter, Arc::clone(&drive));

    let recipe = Path::new(env!("CARGO_TARGET_TMPDIR")).join("killed.toml");
    std::fs::write(&recipe, RECIPE).unwrap();
    std::fs::write(recipe.with_extension("machine.toml"), MACHINE).unwrap();
    let mut program = Command::new(env!("CARGO_BIN_EXE_changeover"))
        .arg(recipe)
        .args(["--bus", &format!("slcan:{}?bitrate=500000", port.display())])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::inherit())
        .spawn()
        .unwrap();

    let mut moves_until = |moves: bool, within: Duration| {
        let until = bus.now() + within;
        while bus.now() < until {
            let next = bus.now() + Duration::from_millis(10);
            while bus.run(next).unwrap().is_some() {}
            if (drive.lock().unwrap().velocity(bus.now()) != 0) == moves {
                return true;
            }
        }
        false
    };
    let sets_off = moves_until(true, Duration::from_secs(60));
    program.kill().unwrap();
    program.wait().unwrap();
    assert!(sets_off, "it travels");
    // A second, and what it takes to brake; the machine may be busy, but not for as long as the travel lasts.
    assert!(moves_until(false, Duration::from_secs(10)), "it has not noticed");
}
