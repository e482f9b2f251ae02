//! The bench on a terminal with the demo plant: from the faulty node to the stopped motion.
#![cfg(unix)]

use std::path::Path;
use std::process::Command;

use crate::common::folder;
use crate::simulation::Simulation;
use crate::terminal::{Screen, Terminal};
use crate::tmux::Tmux;

const DOWN: &str = "\u{1b}[B";
const DELETE: &str = "\u{1b}[3~";

/// Waits for some words.
#[track_caller]
fn shows(screen: &mut impl Screen, words: &str) -> String {
    screen.wait_for(|text| text.contains(words))
}

/// The title of the details.
fn title(text: &str) -> Option<&str> {
    Some(text.split_once("┌ ")?.1.split_once(" ─")?.0)
}

/// Goes down to the row with this title in its details.
#[track_caller]
fn go_down_to(screen: &mut impl Screen, wanted: &str) {
    let mut text = screen.wait_for(|text| title(text).is_some());
    while title(&text) != Some(wanted) {
        screen.press(DOWN);
        // Numbers change by themselves.
        text = screen.wait_for(|next| title(next).is_some() && title(next) != title(&text));
    }
}

/// Works with the demo plant, whose files are stored in `folder`, and leaves.
fn look_after(screen: &mut impl Screen, folder: &Path) {
    let backup = folder.join("node-5.dcf");
    screen.wait_for(|text| ["feeder", "kollmorgen/akd", "encoder"].iter().all(|name| text.contains(name)));

    // Pasted text presses no keys, and a click selects a tab.
    screen.press("\u{1b}[200~q\u{1b}[201~");
    screen.press("\u{1b}[<0;14;1M");
    shows(screen, "[2 Objects]");

    // The faulty node, and why.
    screen.press("7");
    shows(screen, "node 7 is silent");

    // A limit refuses a value in words, and can be overridden. Without control, nothing is written.
    screen.press("1\r");
    shows(screen, "1000:00");
    screen.press("/v-pos\r");
    screen.wait_for(|text| text.contains("v-Pos") && !text.contains("6064:00"));
    screen.press("\r60\r");
    shows(screen, "take control first");
    screen.press("h");
    shows(screen, "YOU HAVE CONTROL");
    screen.press("\r250\r");
    shows(screen, "too high");
    screen.press("\r60\r");
    shows(screen, "2410:05 = 60");

    // A backup restores the value.
    screen.press("b");
    shows(screen, "node-5.dcf");
    screen.wait_for(|_| backup.exists());
    screen.press("\r70\r");
    shows(screen, "2410:05 = 70");
    screen.press("unode-5.dcf\r");
    screen.wait_for(|text| {
        text.contains("v-Pos") && text.lines().any(|line| line.starts_with("▸2410:05") && line.contains(" 60 "))
    });

    // The bench objects to a PDO that is too long before anything is written.
    screen.press("]3");
    shows(screen, "TPDO1");
    go_down_to(screen, "TPDO1");
    for _ in 0..8 {
        screen.press(DELETE);
    }
    screen.press("a6041\ra6064\ra606C\rc");
    shows(screen, "64");
    screen.press(DELETE);
    screen.press("tevery:20ms\rc");
    shows(screen, "it can be written");
    screen.press("\r");
    shows(screen, "event timer 20 ms");

    // A travel is plotted, and stopped.
    screen.press("5a6064\r");
    shows(screen, "Position actual value = ");
    screen.press("6");
    shows(screen, "SWITCH ON DISABLED");
    screen.press(DOWN);
    shows(screen, "┌ 6 cutter");
    screen.press("e");
    shows(screen, "it is enabled");
    screen.press("m-2000000\r");
    shows(screen, "travels to");
    screen.press(" ");
    shows(screen, "every drive has stopped");

    screen.press("q");
}

#[test]
fn a_plant_is_looked_after_on_a_terminal() {
    let folder = folder("bench-tui");
    let mut command = Command::new(env!("CARGO_BIN_EXE_lexican"));
    let mut screen = Terminal::of(command.args(["bench", "--demo", "--tui"]).current_dir(&folder));
    look_after(&mut screen, &folder);
    let (code, text) = screen.end();
    assert_eq!(code, Some(0), "{text}");
}

#[test]
fn a_plant_is_looked_after_in_tmux() {
    let folder = folder("bench-tmux");
    let Some(mut screen) = Tmux::run(&folder, &["bench", "--demo", "--tui"]) else {
        eprintln!("skipped: tmux is not installed");
        return;
    };
    look_after(&mut screen, &folder);
    assert_eq!(screen.end(), Some(0));
}

#[test]
fn a_terminal_that_is_closed_stops_what_it_has_started() {
    let folder = folder("bench-closed");
    let mut drive = Simulation::begin(&folder, &["kollmorgen/akd", "--node", "6"]);
    // Its controlling terminal is the one that is closed, as for a shell.
    let mut command = Command::new("setsid");
    command.args(["--ctty", env!("CARGO_BIN_EXE_lexican"), "bench", "--tui", "--bus", &drive.buses[0]]);
    let mut screen = Terminal::of(&mut command);
    shows(&mut screen, "f looks for nodes");
    screen.press("f");
    shows(&mut screen, "kollmorgen/akd");
    screen.press("h6");
    shows(&mut screen, "SWITCH ON DISABLED");
    screen.press("e");
    shows(&mut screen, "it is enabled");
    screen.press("v100\r");
    shows(&mut screen, "until it is stopped");
    let velocity = |drive: &mut Simulation| {
        let status = drive.asks("status", "answer")["text"].as_str().unwrap().to_owned();
        let number = status.split(", ").find_map(|part| part.split("/s").next()?.parse::<f64>().ok());
        number.unwrap_or_else(|| panic!("{status}"))
    };
    while velocity(&mut drive) == 0.0 {}
    let code = screen.close();
    assert!(matches!(code, Some(0 | 2)), "it has ended by itself: {code:?}");
    while velocity(&mut drive) != 0.0 {}
}

#[test]
fn what_the_machine_keeps_is_shown_from_the_beginning() {
    let folder = folder("bench-machine");
    let machine = "[node.feeder]\nid = 5\nsheet = \"siko/ag03-1\"\nguarding = \"100 ms\"\n\
                   [bench]\nwatch = [\"feeder.607A\"]\nplot = [\"feeder.position actual value\"]\n";
    std::fs::write(folder.join("machine.toml"), machine).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_lexican"));
    let mut screen = Terminal::of(command.args(["bench", "--bus", "sim", "--tui"]).current_dir(&folder));
    shows(&mut screen, "feeder");
    screen.press("5");
    shows(&mut screen, "Position Actual Value");
    screen.press("q");
    assert_eq!(screen.end().0, Some(0));
}
