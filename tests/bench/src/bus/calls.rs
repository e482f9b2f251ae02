//! How many system calls a client makes for each round trip, as strace counts them.

use std::collections::BTreeMap;

use super::player::{NODE, Outcome, Party, Player, ourselves};
use super::wire::Wire;

/// The same client twice: what both do besides round trips cancels out.
const TRIPS: [u32; 2] = [100, 600];

/// System calls of each round trip, by name.
pub(super) struct Calls {
    pub(super) client: &'static str,
    pub(super) each: BTreeMap<String, f64>,
}

/// `None` without strace.
pub(super) fn measure(wire: &Wire) -> Outcome<Option<Vec<Calls>>> {
    if std::process::Command::new("strace").arg("-V").output().is_err() {
        return Ok(None);
    }
    let mut device = Player::start(ourselves(&["device", &wire.near, &NODE.to_string(), "1"])?)?;
    device.line()?;
    let mut all = Vec::new();
    for party in [Party::Blocking, Party::Tokio, Party::TokioTask] {
        let [few, many] = TRIPS.map(|trips| count(wire, party, trips));
        let (few, mut each) = (few?, many?);
        for (name, calls) in &mut each {
            *calls = (*calls - few.get(name).unwrap_or(&0.0)) / f64::from(TRIPS[1] - TRIPS[0]);
        }
        each.retain(|_, calls| *calls >= 0.05);
        all.push(Calls { client: party.name(), each });
    }
    Ok(Some(all))
}

fn count(wire: &Wire, party: Party, trips: u32) -> Outcome<BTreeMap<String, f64>> {
    let table = std::env::temp_dir().join(format!("lexican-calls-{}", std::process::id()));
    let client = ourselves(&[party.part(), &wire.far, &trips.to_string()])?;
    let mut strace = std::process::Command::new("strace");
    strace.args(["-f", "-c", "-U", "calls,name", "-o"]).arg(&table).arg(client.get_program()).args(client.get_args());
    let status = strace.stdout(std::process::Stdio::null()).status()?;
    let text = std::fs::read_to_string(&table)?;
    std::fs::remove_file(&table)?;
    if !status.success() {
        return Err(format!("strace: {status}").into());
    }
    let row = |line: &str| {
        let mut words = line.split_ascii_whitespace();
        let calls = words.next()?.parse().ok()?;
        Some((words.next()?.to_owned(), calls)).filter(|(name, _)| name != "total")
    };
    Ok(text.lines().filter_map(row).collect())
}
