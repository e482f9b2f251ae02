//! Lost or damaged bytes, and a cut line: success or a named error, and no unordered motion.

use std::ops::Range;
use std::sync::{Arc, Mutex};

use lexican_driver::sequence::Recovery;
use lexican_runtime::Duration;
use lexican_runtime::service::sdo_client::SdoError;
use siko_ag02::driver::{Drive, Error, Outcome};
use siko_ag02::sim::SimulatedDrive;
use siko_ag02::state::State;
use siko_serial::Settings;
use siko_serial::gateway::{self, NODE, SerialLink};
use siko_serial::sim::{SerialDrive, VirtualLine};

use super::noisy::Noisy;
use super::rig::Rig;

/// Travels while `damage` alters one byte in `one_in`. Returns the outcome, and checks the motion.
#[track_caller]
fn travel(seed: u64, one_in: u64, damage: fn(u8) -> Option<u8>) -> Result<Outcome, Error> {
    let mut rig = Rig::new();
    rig.drive.enable().unwrap();
    let mut random = seed;
    rig.set_fate(move |_, byte| {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        if (random >> 33).is_multiple_of(one_in) { damage(byte) } else { Some(byte) }
    });
    let outcome = rig.drive.move_to(1000);
    rig.set_fate(|_, byte| Some(byte));
    let (position, _) = rig.shaft();
    assert!((-10..=1010).contains(&position), "seed {seed}: {outcome:?} at {position}");
    if let Ok(Outcome::Reached { position: reported }) = outcome {
        assert!((990..=1010).contains(&position) && (990..=1010).contains(&reported), "seed {seed}: {position}");
    }
    // The next order works.
    rig.pass(3000);
    rig.drive.stop().unwrap();
    rig.drive.enable().unwrap();
    assert_eq!(rig.drive.move_to(500).unwrap(), Outcome::Reached { position: 500 }, "seed {seed}");
    outcome
}

#[test]
fn lost_bytes_end_in_success_or_in_a_named_error() {
    let outcomes: Vec<_> = (0..40).map(|seed| travel(seed, 60, |_| None)).collect();
    assert!(outcomes.iter().any(Result::is_ok));
}

/// The noise contains no letters and digits, because they are commands for the drive, as the gateway's documentation
/// says.
#[test]
fn damaged_bytes_end_in_success_or_in_a_named_error() {
    let outcomes: Vec<_> = (100..140).map(|seed| travel(seed, 60, |byte| Some(byte | 0x80))).collect();
    assert!(outcomes.iter().any(Result::is_ok));
}

/// Damages each byte of the order in turn: a setpoint with a wrong digit never starts a travel.
#[test]
fn a_setpoint_that_is_not_read_back_as_it_was_written_starts_nothing() {
    for at in 0..80 {
        let mut rig = Rig::new();
        rig.drive.enable().unwrap();
        rig.set_fate(move |number, byte| {
            Some(if number == at && byte.is_ascii_digit() { b'0' + (byte - b'0' + 1) % 10 } else { byte })
        });
        let outcome = rig.drive.move_to(5000);
        rig.pass(1000);
        let (position, velocity) = rig.shaft();
        assert!((0..=5000).contains(&position) && velocity == 0, "byte {at}: {outcome:?} at {position}");
    }
}

#[test]
fn a_cut_line_is_a_named_error_and_the_drive_is_there_again_as_it_was() {
    let mut rig = Rig::new();
    rig.drive.enable().unwrap();
    rig.drive.start_moving_to(20_000).unwrap();
    rig.pass(1000);
    rig.set_fate(|_, _| None);
    let error = rig.drive.finish().unwrap_err();
    assert!(matches!(error.into_cause(), Error::Sdo(SdoError::TimedOut { .. })));
    rig.bus.advance(Duration::from_secs(4));
    assert!(!rig.node.lock().unwrap().gateway().is_connected());
    assert!(rig.shaft().1 > 0, "it goes on, as on CAN");
    rig.set_fate(|_, byte| Some(byte));
    rig.bus.advance(Duration::from_secs(4));
    assert_eq!(rig.drive.state().unwrap(), State::OperationEnabled);
    rig.drive.stop().unwrap();
    assert_eq!(rig.shaft().1, 0);
}

#[test]
fn a_drive_that_is_not_there_is_a_named_error_and_may_come_later() {
    let (node, bus) = Rig::unplugged();
    let connect = || siko_ag02::driver::Drive::connect_unprotected(bus.link(), super::rig::NODE);
    assert!(matches!(connect(), Err(Error::Sdo(SdoError::TimedOut { .. }))));
    node.lock().unwrap().line().0.set_fate(|_, byte| Some(byte));
    bus.advance(Duration::from_secs(4));
    connect().unwrap();
}

#[test]
fn a_drive_that_restarts_during_a_travel_has_ended_it() {
    let mut rig = Rig::new();
    rig.drive.enable().unwrap();
    rig.drive.start_moving_to(20_000).unwrap();
    rig.pass(1000);
    rig.see(SimulatedDrive::power_cycle);
    let outcome = rig.drive.finish().unwrap();
    assert!(matches!(outcome, Outcome::Interrupted { state: State::SwitchOnDisabled, .. }), "{outcome:?}");
}

#[test]
fn a_drive_that_restarts_while_the_line_is_cut_boots() {
    let mut rig = Rig::new();
    rig.drive.enable().unwrap();
    rig.drive.start_moving_to(20_000).unwrap();
    rig.pass(1000);
    rig.set_fate(|_, _| None);
    rig.bus.advance(Duration::from_secs(4));
    rig.see(SimulatedDrive::power_cycle);
    rig.set_fate(|_, byte| Some(byte));
    rig.bus.advance(Duration::from_secs(4));
    assert!(rig.drive.recover(&Recovery::within(Duration::ZERO)).unwrap().restarted);
}

type Operation = fn(&mut Drive<SerialLink<Noisy>>) -> Result<(), Error>;

/// A drive on a separate link. Bytes whose numbers are in the range are lost.
fn on_its_own_link() -> (Drive<SerialLink<Noisy>>, Arc<Mutex<Range<u64>>>) {
    let settings = Settings { baud: 19_200, ..Settings::default() };
    let mut line = Noisy::new(VirtualLine::with_settings(SerialDrive::default(), settings));
    let lost = Arc::new(Mutex::new(0..0_u64));
    let range = Arc::clone(&lost);
    line.set_fate(move |_, byte| {
        let mut range = range.lock().unwrap();
        let is_lost = range.start == 0 && range.end > 0;
        *range = range.start.saturating_sub(1)..range.end.saturating_sub(1);
        (!is_lost).then_some(byte)
    });
    (Drive::connect_unprotected(gateway::link(line, settings, NODE), NODE).unwrap(), lost)
}

/// A drive whose answers were lost has not restarted, whatever it was doing, and follows the next order.
#[test]
fn lost_answers_are_no_restart() {
    let operations: [(&str, Operation); 4] = [
        ("disable", |drive| drive.disable()),
        ("stop", |drive| drive.stop()),
        ("start", |drive| drive.start_moving_to(-2000)),
        ("finish", |drive| drive.start_moving_to(800).and_then(|()| drive.finish()).map(drop)),
    ];
    for (name, operation) in operations {
        for (from, count) in (0..56).step_by(8).flat_map(|from| [4, 20, 40].map(|count| (from, count))) {
            let (mut drive, lost) = on_its_own_link();
            drive.enable().unwrap();
            drive.move_to(500).unwrap();
            *lost.lock().unwrap() = from..from + count;
            let result = operation(&mut drive);
            let what = format!("{name}, {count} bytes from {from}: {result:?}");
            assert!(!format!("{result:?}").contains("Restarted"), "{what}");
            drive.pass(Duration::from_secs(15)).unwrap_or_else(|error| panic!("{what}, then {error}"));
            drive.stop().unwrap_or_else(|error| panic!("{what}, then {error}"));
            drive.enable().unwrap_or_else(|error| panic!("{what}, then {error}"));
            assert_eq!(drive.move_to(300).unwrap(), Outcome::Reached { position: 300 }, "{what}");
        }
    }
}
