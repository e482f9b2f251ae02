//! Full-screen commands, as a user sees them.
#![cfg(unix)]

use crate::terminal::{Screen, Terminal};

const DRIVE: &str = "sim:siko/ag03-1?node=5";

#[test]
fn watch_is_a_table_that_is_renewed_and_stays_behind() {
    let mut screen = Terminal::run(&["watch", "--bus", DRIVE, "statusword", "6064", "2FFF"]);
    screen.wait_for(|text| {
        text.contains("6041:00  Statusword")
            && text.contains("SWITCH ON DISABLED")
            && text.contains("0 increments")
            && text.contains("q to leave")
    });
    screen.press("q");
    let (code, text) = screen.end();
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("6064:00  Position Actual Value") && !text.contains("q to leave"), "{text}");
}

#[test]
fn statistics_are_renewed_while_they_are_looked_at() {
    let mut screen = Terminal::run(&["statistics", "--bus", DRIVE, "--bit-rate", "500"]);
    screen.wait_for(|text| text.contains("PRE-OPERATIONAL") && text.contains("705  boot-up") && text.contains("load"));
    // For a program that uses the whole terminal, Ctrl-C is a key.
    screen.press("\u{3}");
    let (code, text) = screen.end();
    assert!(code == Some(0) && text.contains("705  boot-up"), "{text}");
}

#[test]
fn plot_draws_curves_with_their_last_values() {
    let mut screen = Terminal::run(&["plot", "--bus", DRIVE, "6064", "241B:01"]);
    let is_drawn = |text: &str| {
        let braille = text.chars().filter(|letter| ('\u{2801}'..='\u{28FF}').contains(letter)).count();
        text.contains("Position Actual Value = 0 increments") && text.contains(" = 24.0 V") && braille > 20
    };
    screen.wait_for(is_drawn);
    screen.press("\u{1b}");
    let (code, text) = screen.end();
    assert!(code == Some(0) && !is_drawn(&text), "{text}");
}
