//! How a test ends a drive's motion: after a case, at Ctrl-C, at a time limit; and for a drive that cannot be stopped.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use lexican_conform::{Case, Ended, Report, Settings, Verdict, profile_cases, run as test};
use lexican_runtime::Duration;
use lexican_runtime::host::VirtualBus;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::object::Address;
use lexican_runtime::profile::cia402::State;

use crate::faults::MODEL;
use crate::faulty::{Faulty, fault};
use crate::{NODE, servo, settings, sheet};

const RIGHT: &str = "";

/// A drive that ignores disable voltage once it has a set-point.
const RUNS_ON: &str =
    "heard 205#0000 after 205#1F00; heard 605#2B4060000000* answered 585#6040600000000000 after 205#1F00";

/// Tests a drive that is faulty by these rules. With `cancel`, the test is cancelled at the first set-point.
fn tested(rules: &'static str, settings: &Settings, names: &[&str], cancel: bool) -> (Report, Vec<String>, State) {
    let (bus, frames) = (VirtualBus::with_bit_rate(500), Arc::new(Mutex::new(Vec::new())));
    bus.attach(Faulty::new(servo(&MODEL), &fault(rules)));
    let (log, stop) = (Arc::clone(&frames), Arc::new(AtomicBool::new(false)));
    let cancels = Arc::clone(&stop);
    bus.observe(move |_, frame| {
        let text = frame.to_string();
        cancels.fetch_or(cancel && text == "205#1F00", Ordering::Relaxed);
        log.lock().unwrap().push(text);
    });
    let cases: Vec<&Case> = profile_cases().filter(|case| names.iter().any(|name| case.is_meant_by(name))).collect();
    let report = test(&mut bus.link(), &sheet(), settings, &cases, &stop, &mut ());
    let word = Network::new(bus.link()).read_bytes(NODE, Address::new(0x6041, 0)).unwrap();
    let frames = frames.lock().unwrap().clone();
    (report, frames, State::from_status_word(u16::from_le_bytes([word[0], word[1]])).unwrap())
}

/// After the last set-point, the drive is disabled and its position is read until it stands; only then it is reset.
fn is_stopped_before_its_reset(frames: &[String]) {
    let last = |text: &str| frames.iter().rposition(|frame| frame.starts_with(text));
    let (ordered, disabled, reset) = (last("205#1F00"), last("205#0000"), last("000#8105"));
    assert!(ordered.is_some() && ordered < disabled && disabled < reset, "{ordered:?} {disabled:?} {reset:?}");
    let positions: Vec<&String> =
        frames[disabled.unwrap()..reset.unwrap()].iter().filter(|frame| frame.starts_with("585#43646000")).collect();
    let [.., before, last] = &positions[..] else { panic!("the position is not looked at: {positions:?}") };
    assert_eq!(before, last);
}

#[test]
fn a_drive_stands_after_each_case() {
    let (report, frames, state) = tested(RIGHT, &settings(), &["402/607Ah/2"], false);
    assert_eq!((&report.cases[0].outcome, report.ended_early, state), (&Ok(()), None, State::SwitchOnDisabled));
    is_stopped_before_its_reset(&frames);
}

#[test]
fn a_drive_stands_after_ctrl_c() {
    let (report, frames, state) = tested(RIGHT, &settings(), &["402/607Ah/2", "402/607Ah/3"], true);
    assert_eq!((report.cases.len(), report.ended_early, state), (1, Some(Ended::Cancelled), State::SwitchOnDisabled));
    is_stopped_before_its_reset(&frames);
}

#[test]
fn a_drive_stands_after_a_case_that_took_too_long() {
    let settings = Settings { case: Duration::from_millis(500), ..settings() };
    let (report, frames, state) = tested(RIGHT, &settings, &["402/607Ah/2"], false);
    let Err(Verdict::Failed(why)) = &report.cases[0].outcome else { panic!("{:?}", report.cases[0].outcome) };
    assert!(why.contains("took longer"), "{why}");
    assert_eq!(state, State::SwitchOnDisabled);
    is_stopped_before_its_reset(&frames);
}

#[test]
fn a_drive_that_does_not_stop_ends_the_test() {
    let (report, ..) = tested(RUNS_ON, &settings(), &["402/607Ah/2", "402/607Ah/3"], false);
    assert_eq!(report.cases.len(), 1);
    let ended = report.ended_early.expect("the test ends");
    assert!(matches!(ended, Ended::Moving(_)) && ended.to_string().contains("switch off its power"), "{ended}");
}
