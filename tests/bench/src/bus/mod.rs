//! SDO over a bus that the operating system carries: pseudo-terminals (slcan) or vcan.
//!
//! Each side is a process of its own, so that the processor time of one is not that of the other. A client reads
//! 1000h, one read after the other; the contenders take turns of a second, so that whatever else the machine does
//! meets all of them alike. A round trip is two frames.

mod client;
mod device;
mod nodes;
mod python;
mod table;
mod wire;

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, ExitCode, Stdio};

use client::Figure;
use wire::Wire;

/// The node-ID of the device that the clients read from.
const NODE: u8 = 5;

/// How often everybody has a turn.
const ROUNDS: usize = 7;

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

/// Who reads, and who answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Pair {
    client: Party,
    device: Party,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Party {
    Blocking,
    Tokio,
    Lexican,
    Python,
}

impl Party {
    const fn name(self) -> &'static str {
        match self {
            Party::Blocking => "lexican, blocking",
            Party::Tokio => "lexican, tokio",
            Party::Lexican => "lexican",
            Party::Python => "python-canopen",
        }
    }
}

const PAIRS: [Pair; 4] = [
    Pair { client: Party::Blocking, device: Party::Lexican },
    Pair { client: Party::Tokio, device: Party::Lexican },
    Pair { client: Party::Python, device: Party::Lexican },
    Pair { client: Party::Blocking, device: Party::Python },
];

/// Measures on one kind of link, prints the tables and writes them to a file.
pub(crate) fn run(link: &str, python: &str, table: &str) -> ExitCode {
    done(measure(link, python).and_then(|text| {
        println!("{text}");
        Ok(std::fs::write(table, text)?)
    }))
}

/// One side of a measurement.
pub(crate) fn play(part: &[&str]) -> ExitCode {
    done(match *part {
        ["wire"] => wire::cross(),
        ["device", url, first, count] => device::run(url, first, count),
        ["blocking", url] => client::blocking(url),
        ["tokio", url] => client::tokio(url),
        ["nodes", url, seconds, every_ms] => nodes::run(url, seconds, every_ms),
        _ => Err("this is for the benchmark itself".into()),
    })
}

fn done(outcome: Outcome<()>) -> ExitCode {
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("lexican-bench: {error}");
            ExitCode::FAILURE
        }
    }
}

fn measure(link: &str, python: &str) -> Outcome<String> {
    let wire = Wire::new(link)?;
    let mut figures = vec![Vec::new(); PAIRS.len()];
    for round in 0..ROUNDS {
        for turn in 0..PAIRS.len() {
            // Nobody always follows the same one.
            let at = (turn + round) % PAIRS.len();
            figures[at].push(race(&wire, PAIRS[at], python)?);
            eprint!(".");
        }
    }
    let mut rows = Vec::new();
    for (pair, figures) in PAIRS.iter().zip(&figures) {
        rows.push((*pair, Figure::middle(figures)));
    }
    let nodes = nodes::measure(&wire)?;
    eprintln!();
    Ok(table::text(&wire, &rows, &nodes))
}

/// One turn of one pair.
fn race(wire: &Wire, pair: Pair, python: &str) -> Outcome<Figure> {
    let mut device = match pair.device {
        Party::Python => Player::start(python::device(python, wire))?,
        _ => Player::start(ourselves(&["device", &wire.near, &NODE.to_string(), "1"])?)?,
    };
    device.line()?;
    let mut client = Player::start(match pair.client {
        Party::Python => python::client(python, wire),
        Party::Tokio => ourselves(&["tokio", &wire.far])?,
        _ => ourselves(&["blocking", &wire.far])?,
    })?;
    // It has warmed up, which took some time of the device's, too.
    client.line()?;
    let before = device.processor_s()?;
    let figure: Figure = client.line()?.parse()?;
    let device_s = device.processor_s()? - before;
    Ok(Figure { device_us: device_s * 1e6 / figure.frames(), ..figure })
}

/// This program again, in another part.
fn ourselves(part: &[&str]) -> Outcome<Command> {
    let mut command = Command::new(std::env::current_exe()?);
    command.arg("play").args(part);
    Ok(command)
}

/// Another process, until the end of the scope. It ends when its standard input does.
struct Player {
    child: Child,
    output: BufReader<std::process::ChildStdout>,
}

impl Player {
    fn start(mut command: Command) -> Outcome<Self> {
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let output = BufReader::new(child.stdout.take().expect("it is piped"));
        Ok(Player { child, output })
    }

    fn line(&mut self) -> Outcome<String> {
        let mut line = String::new();
        self.output.read_line(&mut line)?;
        if line.is_empty() { Err("a process ended before its time".into()) } else { Ok(line.trim().to_owned()) }
    }

    /// The processor time of the process so far.
    fn processor_s(&self) -> Outcome<f64> {
        // In ticks, of which a turn has some hundred.
        const TICKS_PER_S: f64 = 100.0;
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.child.id()))?;
        let fields = stat.rsplit(')').next().unwrap_or_default().split_ascii_whitespace();
        let ticks = fields.skip(11).take(2).map(str::parse::<f64>).sum::<Result<f64, _>>()?;
        Ok(ticks / TICKS_PER_S)
    }
}

impl Drop for Player {
    fn drop(&mut self) {
        drop(self.child.stdin.take());
        // Whoever was measured has nothing to say any more.
        let _ = self.child.wait();
    }
}
