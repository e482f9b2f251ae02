//! SDO over a bus that the operating system carries: pseudo-terminals (slcan) or vcan.
//!
//! Each side is a process of its own, so that the processor time of one is not that of the other. A client reads
//! 1000h, one read after the other; the contenders take turns of a second, so that other work of the machine
//! meets all of them alike. A round trip is two frames.

mod calls;
mod client;
mod device;
mod nodes;
mod player;
mod python;
mod table;
mod wire;

use std::process::ExitCode;

use client::Figure;
use player::{NODE, Outcome, Pair, Party, Player, ourselves};
use wire::Wire;

/// The number of turns of each pair.
const ROUNDS: usize = 7;

const PAIRS: [Pair; 5] = [
    Pair { client: Party::Blocking, device: Party::Lexican },
    Pair { client: Party::Tokio, device: Party::Lexican },
    Pair { client: Party::TokioTask, device: Party::Lexican },
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
        ["blocking", url, ref trips @ ..] => client::blocking(url, trips),
        ["tokio", url, ref trips @ ..] => client::tokio(url, trips),
        ["tokio-task", url, ref trips @ ..] => client::tokio_task(url, trips),
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
            // No pair always follows the same other.
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
    let calls = calls::measure(&wire)?;
    Ok(table::text(&wire, &rows, calls.as_deref(), &nodes))
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
        party => ourselves(&[party.part(), &wire.far])?,
    })?;
    // It has warmed up, which took some time of the device's, too.
    client.line()?;
    let before = device.processor_s()?;
    let figure: Figure = client.line()?.parse()?;
    let device_s = device.processor_s()? - before;
    Ok(Figure { device_us: device_s * 1e6 / figure.frames(), ..figure })
}
