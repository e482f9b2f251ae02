//! Commands on CAN of a real kernel. If the kernel has none: `cargo xtask vcan -- cargo test -p lexican --test
//! link_socketcan`.
#![cfg(target_os = "linux")]
#![expect(clippy::disallowed_methods, reason = "a real kernel takes real time")]

mod common;

use std::process::{Child, Command, Stdio};
use std::time::Duration;

use lexican_runtime::host::Link;
use lexican_runtime::host::socketcan::SocketCan;
use lexican_runtime::{CobId, Frame};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

/// More frames than the receive buffer that a link requests holds.
const BURST: u32 = 30_000;

const INTERFACE: &str = "lxburst";

fn ip(arguments: &[&str]) -> bool {
    Command::new("ip").args(arguments).stderr(Stdio::null()).status().is_ok_and(|status| status.success())
}

fn signal(child: &Child, signal: Signal) {
    kill(Pid::from_raw(child.id().try_into().unwrap()), signal).unwrap();
}

/// The number before `words`, in each line that has them.
fn numbers(text: &str, words: &str) -> u32 {
    let before = text.lines().filter_map(|line| line.split(words).next().filter(|before| *before != line));
    before.map(|before| before.split_whitespace().last().unwrap().parse::<u32>().unwrap()).sum()
}

#[test]
fn frames_lost_at_the_end_of_a_burst_are_reported_though_none_follows() {
    let is_possible = SocketCan::is_supported().is_ok()
        && ip(&["link", "add", "dev", INTERFACE, "type", "vcan"])
        && ip(&["link", "set", INTERFACE, "up"]);
    if !is_possible {
        assert!(std::env::var_os("LEXICAN_REQUIRE_CAN").is_none(), "skipped although CAN is required");
        println!("skipped: no CAN in this kernel, or no right to create interfaces");
        return;
    }
    let folder = common::folder("burst");
    let run = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_lexican"));
        command.args(arguments).args(["--bus", INTERFACE, "--for", "15s"]).current_dir(&folder);
        // A pipe that nobody reads would block the command.
        let stdout = std::fs::File::create(folder.join(arguments[0])).unwrap();
        command.stdin(Stdio::null()).stdout(stdout).spawn().unwrap()
    };
    let mut commands = [run(&["record", "-o", "burst.log"]), run(&["monitor"])];
    let listeners = || {
        let all = std::fs::read_to_string("/proc/net/can/rcvlist_all").unwrap();
        all.lines().filter(|line| line.trim_start().starts_with(INTERFACE)).count()
    };
    while listeners() < commands.len() {
        std::thread::sleep(Duration::from_millis(20));
    }
    let mut sender = SocketCan::open(INTERFACE).unwrap();
    commands.iter().for_each(|command| signal(command, Signal::SIGSTOP));
    for number in 0..BURST {
        sender.send(&Frame::new(CobId::standard(0x123).unwrap(), &number.to_le_bytes()).unwrap()).unwrap();
    }
    commands.iter().for_each(|command| signal(command, Signal::SIGCONT));
    for command in &mut commands {
        command.wait().unwrap();
    }
    ip(&["link", "delete", INTERFACE]);
    let output = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let heard = u32::try_from(output("burst.log").lines().count()).unwrap();
    assert!(heard < BURST, "nothing was lost");
    assert_eq!(numbers(&output("record"), " are missing"), BURST - heard);
    let monitored = output("monitor");
    let heard = u32::try_from(monitored.lines().filter(|line| line.contains("123")).count()).unwrap();
    assert_eq!(numbers(&monitored, " frames are missing"), BURST - heard, "{heard} were heard");
}
