//! No operation that stops, reads or sets up makes the simulated drive move, or enables it.

use std::sync::{Arc, Mutex};

use lexican_runtime::Duration;
use lexican_runtime::host::VirtualLink;
use siko_ag03_1::Direction;
use siko_ag03_1::driver::sequence::Setting;
use siko_ag03_1::driver::{Drive, Error, Mode};
use siko_ag03_1::od;
use siko_ag03_1::state::State;
use siko_ag03_1::words::control;

use super::rig::{NODE, Rig};

impl Rig {
    /// Another manager sends a control word, and the drive reports the resulting state. TPDO1 has an inhibit time.
    fn control_and_wait(&mut self, word: u16) {
        self.control(word);
        self.pass_ms(300);
    }

    #[track_caller]
    fn check_stop_stays(&mut self, operate: impl FnOnce(&mut Drive<VirtualLink>) -> Result<(), Error>) {
        let words = Arc::new(Mutex::new(Vec::new()));
        let sent = Arc::clone(&words);
        self.bus.observe(move |_, frame| {
            if let (0x205, [low, high]) = (frame.id().raw(), frame.data()) {
                sent.lock().unwrap().push(u16::from_le_bytes([*low, *high]));
            }
        });
        operate(&mut self.drive).unwrap();
        self.bus.advance(Duration::from_secs(1));
        assert_eq!(self.simulated.lock().unwrap().velocity(self.bus.now()), 0);
        let words = words.lock().unwrap().clone();
        assert!(words.iter().all(|word| word & control::STOP != 0), "{words:04X?}");
        self.bus.observe(|_, _| {});
    }
}

/// A falling edge of Stop would run at the last velocity, or resume an interrupted travel, if only until the driver
/// sees that the drive stands.
#[test]
fn to_end_inching_does_not_take_back_stop() {
    let mut rig = Rig::running();
    rig.drive.run_at(60).unwrap();
    rig.drive.stop().unwrap();
    rig.check_stop_stays(|drive| drive.stop_inching().map(drop));

    let mut rig = Rig::enabled();
    rig.drive.start_moving_to(100_000).unwrap();
    rig.drive.pass(Duration::from_millis(500)).unwrap();
    rig.drive.interrupt().unwrap();
    rig.check_stop_stays(|drive| drive.stop_inching().map(drop));
    rig.drive.resume().unwrap();
    assert_ne!(rig.drive.velocity().unwrap(), 0, "the travel is not lost");
}

/// A control word with both Enable Operation and Stop enables a drive.
#[test]
fn what_stops_does_not_enable_a_drive_that_another_manager_has_disabled() {
    type Operation = fn(&mut Drive<VirtualLink>) -> Result<(), Error>;
    let operations: [(&str, Operation); 5] = [
        ("stop", Drive::stop),
        ("stop_inching", |drive| drive.stop_inching().map(drop)),
        ("interrupt", Drive::interrupt),
        ("resume", Drive::resume),
        ("finish", |drive| drive.finish().map(drop)),
    ];
    for (name, operation) in operations {
        for inching in [false, true] {
            let mut rig = Rig::enabled();
            if inching {
                rig.drive.inch(Direction::Positive).unwrap();
            }
            rig.control_and_wait(0x0107);
            let result = operation(&mut rig.drive);
            rig.bus.advance(Duration::from_millis(10));
            assert_eq!(rig.drive.state().unwrap(), State::SwitchedOn, "{name}: {result:?}");
        }
    }
}

#[test]
fn a_driver_that_is_dropped_does_not_enable_a_drive_that_another_manager_has_disabled() {
    let mut rig = Rig::enabled();
    rig.drive.inch(Direction::Positive).unwrap();
    rig.control_and_wait(0x0107);
    let Rig { bus, drive, .. } = rig;
    drop(drive);
    bus.advance(Duration::from_millis(10));
    let mut other = Drive::connect_unprotected(bus.link(), NODE).unwrap();
    assert_eq!(other.state().unwrap(), State::SwitchedOn);
}

/// A drive that runs at 0 runs at any velocity as soon as it is written.
#[test]
fn a_drive_in_velocity_mode_is_stopped_before_it_is_set_up() {
    for velocity in [0, 1] {
        let mut rig = Rig::running();
        rig.drive.run_at(velocity).unwrap();
        let faster = Setting { address: od::TARGET_VELOCITY.address(), value: 100 };
        for result in [
            rig.drive.write_parameters(&[faster]),
            rig.drive.set_mode(Mode::Positioning),
            rig.drive.calibrate(0),
            rig.drive.restore(None),
        ] {
            assert_eq!(result.unwrap_err().to_string(), "the drive would refuse: a travel is under way");
        }
        rig.bus.advance(Duration::from_secs(1));
        assert_eq!(rig.simulated.lock().unwrap().velocity(rig.bus.now()), velocity);
        rig.drive.stop().unwrap();
        rig.check_stop_stays(|drive| drive.write_parameters(&[faster]));
        rig.drive.set_mode(Mode::Positioning).unwrap();
    }
}
