//! The bench on a terminal, played on the demo plant: from the node that is faulty to the travel that is stopped.
#![cfg(unix)]

#[path = "common/terminal.rs"]
mod terminal;

use std::path::Path;

use terminal::Terminal;

const DOWN: &str = "\u{1b}[B";
const DELETE: &str = "\u{1b}[3~";

/// Waits for some words.
#[track_caller]
fn shows(screen: &mut Terminal, words: &str) -> String {
    screen.wait_for(|text| text.contains(words))
}

/// Goes down to the row whose detail has this title.
#[track_caller]
fn go_down_to(screen: &mut Terminal, title: &str) {
    let title = format!("┌ {title} ");
    for _ in 0..20 {
        let before = screen.text();
        if before.contains(&title) {
            return;
        }
        screen.press(DOWN);
        screen.wait_for(|text| text != before);
    }
    shows(screen, &title);
}

#[test]
fn a_plant_is_looked_after_on_a_terminal() {
    let backup = Path::new(env!("CARGO_TARGET_TMPDIR")).join("node-5.dcf");
    let _ = std::fs::remove_file(&backup);
    let mut screen = Terminal::run(&["bench", "--demo", "--tui"]);
    screen.wait_for(|text| ["feeder", "kollmorgen/akd", "encoder"].iter().all(|name| text.contains(name)));

    // Who is faulty, and why.
    screen.press("7");
    shows(&mut screen, "node 7 is silent");

    // A limit refuses in words, then lets through. Nothing is written without the hands.
    screen.press("1\r");
    shows(&mut screen, "1000:00");
    screen.press("/v-pos\r");
    screen.wait_for(|text| text.contains("v-Pos") && !text.contains("6064:00"));
    screen.press("\r60\r");
    shows(&mut screen, "take the hands first");
    screen.press("h");
    shows(&mut screen, "HANDS ON");
    screen.press("\r250\r");
    shows(&mut screen, "too high");
    screen.press("\r60\r");
    shows(&mut screen, "2410:05 = 60");

    // A backup brings the value back.
    screen.press("b");
    shows(&mut screen, "node-5.dcf");
    screen.wait_for(|_| backup.exists());
    screen.press("\r70\r");
    shows(&mut screen, "2410:05 = 70");
    screen.press("unode-5.dcf\r");
    screen.wait_for(|text| {
        text.contains("v-Pos") && text.lines().any(|line| line.starts_with("2410:05") && line.contains(" 60 "))
    });

    // A PDO that is too long is objected to before anything is written.
    screen.press("]3");
    shows(&mut screen, "TPDO1");
    go_down_to(&mut screen, "TPDO1");
    for _ in 0..8 {
        screen.press(DELETE);
    }
    screen.press("a6041\ra6064\ra606C\rc");
    shows(&mut screen, "64");
    screen.press(DELETE);
    screen.press("tevery:20ms\rc");
    shows(&mut screen, "it can be written");
    screen.press("\r");
    shows(&mut screen, "event timer 20 ms");

    // A travel is plotted, and stopped.
    screen.press("5a6064\r");
    shows(&mut screen, "Position actual value = ");
    screen.press("6");
    shows(&mut screen, "SWITCH ON DISABLED");
    screen.press(DOWN);
    shows(&mut screen, "┌ 6 cutter");
    screen.press("e");
    shows(&mut screen, "it is enabled");
    screen.press("m-2000000\r");
    shows(&mut screen, "travels to");
    screen.press(" ");
    shows(&mut screen, "every drive has stopped");

    screen.press("q");
    let (code, text) = screen.end();
    assert_eq!(code, Some(0), "{text}");
    let _ = std::fs::remove_file(&backup);
}
