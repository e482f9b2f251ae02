//! Every way in which a program can end while its drive moves, and the drive's reaction.
//!
//! The program is this executable, started again as a separate process. The simulated drive runs here, in real time in
//! a thread, with a socket as the bus between them. The drive inches, which never ends unless it is stopped.
#![cfg(unix)]

use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration as Wall, Instant as WallInstant};

use lexican_runtime::host::{Incoming, Link, LinkError, Participant};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};
use siko_ag03_1::Direction;
use siko_ag03_1::driver::{Drive, Error, Supervision};
use siko_ag03_1::sim::MODEL;
use siko_ag03_1::sim::{Setup, SimulatedDrive};
use siko_ag03_1::state::State;

const NODE: NodeId = NodeId::literal(5);
const TEST: &str = "the_program";
/// How the program is to end, and the address of the bus.
const ENDING: &str = "LEXICAN_ENDING";
const BUS: &str = "LEXICAN_BUS";
/// The program prints this when the drive moves, and the program may be ended.
const MOVES: &str = "the drive moves";
/// Long enough for any busy machine.
const PATIENCE: Wall = Wall::from_secs(60);

/// A bus of two nodes: each frame is a line in the notation of candump.
struct Socket {
    stream: TcpStream,
    heard: Vec<u8>,
    origin: WallInstant,
}

impl Socket {
    #[expect(clippy::disallowed_methods, reason = "two processes have real time in common, and nothing else")]
    fn new(stream: TcpStream) -> Self {
        stream.set_nodelay(true).unwrap();
        Socket { stream, heard: Vec::new(), origin: WallInstant::now() }
    }

    /// The first complete line of the received text, as a frame.
    fn next_frame(&mut self) -> Option<Frame> {
        let end = self.heard.iter().position(|byte| *byte == b'\n')?;
        let line: Vec<u8> = self.heard.drain(..=end).collect();
        let text = std::str::from_utf8(&line).unwrap().trim_end();
        let (id, data) = text.split_once('#').unwrap();
        let id = CobId::standard(u16::from_str_radix(id, 16).unwrap()).unwrap();
        if let Some(len) = data.strip_prefix('R') {
            return Frame::remote(id, len.parse().unwrap_or(0));
        }
        let byte = |at: usize| u8::from_str_radix(&data[at..at + 2], 16).unwrap();
        Frame::new(id, &(0..data.len()).step_by(2).map(byte).collect::<Vec<_>>())
    }
}

impl Link for Socket {
    fn now(&self) -> Instant {
        Instant::ZERO + self.origin.elapsed().into()
    }

    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        match writeln!(self.stream, "{frame}") {
            // Nobody receives the frame.
            Err(error) if matches!(error.kind(), ErrorKind::BrokenPipe | ErrorKind::ConnectionReset) => Ok(()),
            sent => Ok(sent?),
        }
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        loop {
            if let Some(frame) = self.next_frame() {
                return Ok(Some(Incoming::Frame(frame)));
            }
            let patience = Wall::from(until.since(self.now())).max(Wall::from_micros(100));
            self.stream.set_read_timeout(Some(patience))?;
            let mut buffer = [0; 256];
            match self.stream.read(&mut buffer) {
                // The other end is closed: silence, as on a bus.
                Ok(0) => {
                    self.pause(until);
                    return Ok(None);
                }
                Ok(len) => self.heard.extend_from_slice(&buffer[..len]),
                Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                    if self.now() >= until {
                        return Ok(None);
                    }
                }
                Err(error) if matches!(error.kind(), ErrorKind::ConnectionReset | ErrorKind::Interrupted) => {
                    self.pause(until);
                    return Ok(None);
                }
                Err(error) => return Err(error.into()),
            }
        }
    }
}

impl Socket {
    fn pause(&self, until: Instant) {
        sleep(until.since(self.now()).into());
    }
}

#[expect(clippy::disallowed_methods, reason = "two processes have real time in common, and nothing else")]
fn sleep(span: Wall) {
    std::thread::sleep(span);
}

/// The program: moves the drive, and ends. Without an ending in the environment, this test does nothing.
#[test]
fn the_program() {
    let Ok(ending) = std::env::var(ENDING) else { return };
    let link = Socket::new(TcpStream::connect(std::env::var(BUS).unwrap()).unwrap());
    match run(link, &ending) {
        Ok(()) => {}
        Err(error) => eprintln!("{error}"),
    }
}

fn run(link: Socket, ending: &str) -> Result<(), Error> {
    let within = Supervision::within(Duration::from_millis(1500));
    let mut drive = match ending.strip_prefix("protected ") {
        Some(_) => Drive::connect_protected(link, NODE, within)?,
        None if ending == "connected as usual" => Drive::connect(link, NODE)?,
        None => Drive::connect_unprotected(link, NODE)?,
    };
    if ending.ends_with("with a handler") {
        let handle = drive.cancel_handle();
        ctrlc::set_handler(move || handle.cancel()).unwrap();
    }
    drive.enable()?;
    drive.inch(Direction::Positive)?;
    drive.pass(Duration::from_millis(300))?;
    println!("{MOVES}");
    match ending.trim_start_matches("protected ") {
        "return" => return Ok(()),
        "error" => return Err(drive.move_to(0).unwrap_err()),
        "panic" => panic!("of the program"),
        "exit" => std::process::exit(0),
        "abort" => std::process::abort(),
        "cable" | "SIGINT with a handler" | "SIGTERM with a handler" => drive.pass(Duration::from_secs(60))?,
        // Some long work unrelated to the drive.
        _ => sleep(PATIENCE),
    }
    Ok(())
}

/// The drive's reaction when its program ends.
#[derive(Debug, PartialEq)]
enum Then {
    /// It was stopped, and keeps its torque.
    Stands,
    /// It continues its order.
    Moves,
    /// It has noticed, and released its motor.
    Released,
}

/// This executable, with the default action for SIGINT: a shell lets its background jobs ignore it, and they pass this
/// on to the processes that they start.
fn program() -> Command {
    let this = std::env::current_exe().unwrap();
    if cfg!(target_os = "linux") {
        let mut command = Command::new("env");
        command.arg("--default-signal=INT").arg(this);
        return command;
    }
    Command::new(this)
}

struct Running {
    child: Child,
    drive: Arc<Mutex<SimulatedDrive>>,
    origin: WallInstant,
    cable: TcpStream,
}

impl Running {
    /// Starts the program, and waits until its drive moves.
    fn start(ending: &str) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let mut child = program()
            .args(["--exact", TEST, "--nocapture"])
            .env(ENDING, ending)
            .env(BUS, listener.local_addr().unwrap().to_string())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let cable = listener.accept().unwrap().0;
        let socket = Socket::new(cable.try_clone().unwrap());
        let origin = socket.origin;
        let drive = Arc::new(Mutex::new(SimulatedDrive::power_on(socket.now(), Setup::new(&MODEL, NODE))));
        let participant = Participant::new(socket, Arc::clone(&drive));
        std::thread::spawn(move || serve(participant));
        let said = BufReader::new(child.stdout.as_mut().unwrap()).lines();
        let moves = said.map_while(Result::ok).any(|line| line.contains(MOVES));
        let running = Running { child, drive, origin, cable };
        if !moves {
            panic!("{ending}: it does not move: {:?}", running.end(&Then::Moves));
        }
        running
    }

    fn velocity(&self) -> i32 {
        self.drive.lock().unwrap().velocity(Instant::ZERO + self.origin.elapsed().into())
    }

    fn signal(&self, signal: &str) {
        let status = Command::new("kill").args(["-s", signal, &self.child.id().to_string()]).status();
        assert!(status.unwrap().success());
    }

    fn becomes(&self) -> Then {
        let state = self.drive.lock().unwrap().state();
        match (self.velocity(), state) {
            (0, State::OperationEnabled) => Then::Stands,
            (0, State::SwitchOnDisabled) => Then::Released,
            _ => Then::Moves,
        }
    }

    /// The drive's reaction, of which `expected` is awaited, and the program's output.
    fn end(mut self, expected: &Then) -> (Then, String) {
        let mut said = String::new();
        self.child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
        self.child.wait().unwrap();
        // Longer than a protected drive waits, if the machine is not too busy.
        sleep(Wall::from_millis(2500));
        let mut then = self.becomes();
        let until = self.origin.elapsed() + PATIENCE;
        while then != *expected && self.origin.elapsed() < until {
            sleep(Wall::from_millis(50));
            then = self.becomes();
        }
        (then, said)
    }
}

/// Runs the drive until it has no other owner. It must not wait for what the test waits for.
fn serve(mut participant: Participant<Socket, Arc<Mutex<SimulatedDrive>>>) {
    while Arc::strong_count(participant.node()) > 1 {
        let until = participant.now() + Duration::from_millis(50);
        while participant.run(until).unwrap().is_some() {}
    }
}

/// Checks endings of programs, by a signal or by themselves: the drive's reaction, and the program's output. All run at
/// the same time, because they mostly wait.
fn check(endings: &[(&str, Option<&str>, Then, &[&str])]) {
    std::thread::scope(|scope| {
        for (ending, signal, then, words) in endings {
            scope.spawn(move || {
                let running = Running::start(ending);
                match signal {
                    Some("cable") => running.cable.shutdown(Shutdown::Both).unwrap(),
                    Some(signal) => running.signal(signal),
                    None => {}
                }
                let (seen, said) = running.end(then);
                assert_eq!(seen, *then, "{ending}: {said}");
                assert!(words.iter().all(|words| said.contains(words)), "{ending}: {said}");
            });
        }
    });
}

const LET_GO: &str = "the drive at node 5 was let go while it may be moving: it has been stopped";
const LOST: [&str; 2] =
    ["; the drive at node 5 may still be moving", "a stop has been sent, and nothing shows that it has arrived"];
const CANCELLED: &str = "cancelled: the drive at node 5 has been stopped";

#[test]
fn a_program_that_ends_by_itself_or_handles_its_signals_stops_its_drive() {
    check(&[
        ("return", None, Then::Stands, &[LET_GO]),
        ("error", None, Then::Stands, &[LET_GO]),
        ("panic", None, Then::Stands, &[LET_GO]),
        ("SIGINT with a handler", Some("INT"), Then::Stands, &[CANCELLED]),
        ("SIGTERM with a handler", Some("TERM"), Then::Stands, &[CANCELLED]),
    ]);
}

#[test]
fn a_program_that_is_gone_at_once_or_does_not_handle_its_signals_leaves_its_drive_moving() {
    check(&[
        ("exit", None, Then::Moves, &[]),
        ("abort", None, Then::Moves, &[]),
        ("SIGKILL", Some("KILL"), Then::Moves, &[]),
        ("SIGINT", Some("INT"), Then::Moves, &[]),
        ("SIGTERM", Some("TERM"), Then::Moves, &[]),
    ]);
}

#[test]
fn a_program_without_its_cable_says_that_its_drive_may_be_moving() {
    check(&[("cable", Some("cable"), Then::Moves, &LOST), ("protected cable", Some("cable"), Then::Released, &LOST)]);
}

/// As when the program's computer loses its power: nothing is sent any more.
#[test]
fn a_protected_drive_notices_that_its_program_is_gone() {
    check(&[
        ("protected abort", None, Then::Released, &[]),
        ("protected SIGKILL", Some("KILL"), Then::Released, &[]),
        ("connected as usual", Some("KILL"), Then::Released, &[]),
        ("protected SIGTERM", Some("TERM"), Then::Released, &[]),
    ]);
}

#[test]
fn a_protected_drive_is_kept_going_while_its_program_does_something_else() {
    let mut running = Running::start("protected idle");
    sleep(Wall::from_millis(3500));
    assert_ne!(running.velocity(), 0);
    running.child.kill().unwrap();
    assert_eq!(running.end(&Then::Released).0, Then::Released);
}
