//! Instructions: what a frame costs the core. Valgrind counts them, so that a busy machine does not matter.
//!
//! Each case runs in a process of its own, [`ROUNDS`] times and then twice as often: the difference is what the rounds
//! took. A round is what a shell calls for one frame or deadline: `handle_frame` or `handle_timeout`, `poll_transmit`
//! until there is nothing more to send, and `poll_timeout`.

mod device;
mod manager;

use std::process::Command;

use lexican_runtime::manager::{Manager, Network};

/// Each of 127 nodes has the same number of turns.
const ROUNDS: u64 = 10 * 127;

/// How many nodes the manager looks after.
const NODES: [u8; 2] = [1, 127];

/// What is counted, and for how many nodes it is prepared.
struct Case {
    name: &'static str,
    /// Returns what does one round.
    prepare: fn(nodes: u8) -> Box<dyn FnMut()>,
    /// More is too much.
    goal: Option<u64>,
}

const fn case(name: &'static str, prepare: fn(u8) -> Box<dyn FnMut()>) -> Case {
    Case { name, prepare, goal: None }
}

const MANAGER: [Case; 6] = [
    Case { goal: Some(700), ..case("manager: a heartbeat", manager::heartbeat) },
    Case { goal: Some(1500), ..case("manager: a PDO", manager::pdo) },
    case("manager: an emergency", manager::emergency),
    case("manager: SDO read of 4 bytes, both frames", manager::sdo_read),
    case("manager: the deadline of SYNC, and SYNC", manager::sync),
    case("manager that keeps up a network: a heartbeat", manager::heartbeat_of_network),
];

const DEVICE: [Case; 4] = [
    case("device: a frame of another node", device::other),
    case("device: SDO read of 4 bytes, both frames", device::sdo_read),
    case("device: an RPDO of 2 objects", device::rpdo),
    case("device: SYNC, and 4 TPDOs of 2 objects each", device::sync),
];

pub(crate) fn run() {
    println!("| | 1 node | 127 nodes | at most |\n| --- | --- | --- | --- |");
    for Case { name, goal, .. } in MANAGER {
        let [one, many] = NODES.map(|nodes| count(name, nodes));
        println!("| {name} | {one} | {many} | {} |", goal.map_or_else(String::new, |goal| goal.to_string()));
    }
    for Case { name, .. } in DEVICE {
        println!("| {name} | {} | | |", count(name, 1));
    }
    for (name, [one, many]) in [
        ("`Manager`", [size_of::<Manager<1>>(), size_of::<Manager<127>>()]),
        ("`Network`, its configurations lent", [size_of::<Network<&[u8], 1>>(), size_of::<Network<&[u8], 127>>()]),
    ] {
        println!("| bytes of a {name} | {one} | {many} | |");
    }
}

/// The instructions of one round.
fn count(name: &str, nodes: u8) -> u64 {
    let [once, twice] = [ROUNDS, 2 * ROUNDS].map(|rounds| all_instructions(name, nodes, rounds));
    (twice - once) / ROUNDS
}

/// The instructions of a whole process that does so many rounds.
fn all_instructions(name: &str, nodes: u8, rounds: u64) -> u64 {
    let this = std::env::current_exe().expect("the program knows where it is");
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(this)
        .args(["count", name, &nodes.to_string(), &rounds.to_string()])
        .output()
        .expect("valgrind is there: apt-get install valgrind");
    let text = String::from_utf8_lossy(&output.stderr);
    let collected = text.lines().find_map(|line| line.split_once("Collected : ")?.1.trim().parse().ok());
    collected.unwrap_or_else(|| panic!("valgrind says how much it has counted: {text}"))
}

/// The process that is counted.
pub(crate) fn child(name: &str, nodes: &str, rounds: &str) {
    let case = MANAGER.into_iter().chain(DEVICE).find(|case| case.name == name).expect("the parent has named it");
    let mut round = (case.prepare)(nodes.parse().expect("a number of nodes"));
    for _ in 0..rounds.parse().expect("a number of rounds") {
        round();
    }
}
