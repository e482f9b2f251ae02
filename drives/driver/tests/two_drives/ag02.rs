//! The SIKO AG02: state transitions only by PDO, four bytes in every SDO, and the enable bit of EMCY in another place.
//!
//! Numbers in parentheses are lines of the German manual of 02/2018. The frames are those of its table 25 (chapter
//! 10.11) and of the examples of chapter 10.2.8, node 5.

use lexican_driver::description::Approach;
use lexican_driver::{Cause, Code, Direction, Error, Mode, Outcome, ParameterSet, VelocityOutcome};
use lexican_runtime::object::{Object, Rw};
use lexican_runtime::{Duration, NodeId};
use siko_ag02::driver::{AG02, Ag02};

use crate::script::{Rig, Sheet, bus};

/// A drive in SWITCH ON DISABLED with the 62:1 gear, at rest within its limits of ±1,000,000.
const SHEET: Sheet = Sheet {
    node: NodeId::literal(5),
    always_four_bytes: true,
    objects: &[
        (0x1000, 0x00, 4, 0x192),
        (0x1002, 0x00, 2, 0x0880),
        (0x1003, 0x01, 2, 0),
        (0x100A, 0x00, 4, 0x312E_3030),
        (0x1011, 0x01, 4, 0),
        (0x1011, 0x02, 4, 0),
        (0x1014, 0x00, 4, 0x85),
        (0x1018, 0x01, 4, 0x195),
        (0x2102, 0x00, 1, 2),
        (0x2410, 0x01, 2, 250),
        (0x2410, 0x02, 2, 5),
        (0x2410, 0x03, 2, 0),
        (0x2410, 0x04, 1, 50),
        (0x2410, 0x05, 1, 30),
        (0x2410, 0x06, 1, 50),
        (0x2410, 0x08, 1, 50),
        (0x2410, 0x09, 1, 30),
        (0x2412, 0x00, 2, 200),
        (0x2413, 0x00, 1, 0),
        (0x2415, 0x00, 4, 1600),
        (0x6041, 0x00, 2, 0x0250),
        (0x6060, 0x00, 1, 1),
        (0x6064, 0x00, 4, 0),
        (0x6067, 0x00, 2, 10),
        (0x606C, 0x00, 4, 0),
        (0x607A, 0x00, 4, 0),
        (0x607C, 0x00, 4, 2500),
        (0x607D, 0x01, 4, 0xFFF0_BDC0),
        (0x607D, 0x02, 4, 1_000_000),
        (0x607E, 0x00, 1, 0),
        (0x6091, 0x01, 2, 5),
        (0x6091, 0x02, 2, 1),
        (0x60FF, 0x00, 4, 0),
    ],
};

type Drive = lexican_driver::Drive<lexican_runtime::host::VirtualLink, Ag02>;

/// Operates a drive in SWITCH ON DISABLED.
#[track_caller]
fn check<T: std::fmt::Debug>(script: &str, operate: impl FnOnce(&mut Drive) -> Result<T, Error>) -> Result<T, Error> {
    Rig::<Ag02>::new(SHEET).check(script, operate)
}

/// Operates a drive in OPERATION ENABLED, ready to travel: `0000 0x11 0011 0111` (4991).
#[track_caller]
fn enabled<T: std::fmt::Debug>(script: &str, operate: impl FnOnce(&mut Drive) -> Result<T, Error>) -> Result<T, Error> {
    check(&format!("= 6041:00 0337\n= 1002:00 0000\n{script}"), operate)
}

#[test]
fn the_device_answers_as_the_manual_prints_it() {
    // AG02-SDO-R-RSP (4167): 42h, and 2500 in 607Ch:00.
    let rig = Rig::<Ag02>::new(SHEET);
    assert_eq!(rig.device.lock().unwrap().answer_to("605#407C600000000000"), "585#427C6000C4090000");
    assert_eq!(check("", |drive| drive.read(Object::<i32, Rw>::new(0x607C, 0x00))).unwrap(), 2500);
    assert_eq!(check("", Drive::firmware).unwrap(), "1.00", "characters from the top (5884)");
}

#[test]
fn whatever_is_written_has_four_bytes() {
    // AG02-SDO-W-REQ (4213): 2,000,000 into 607Dh:02.
    let limit = Object::<i32, Rw>::new(0x607D, 0x02);
    check("> 605#237D600280841E00", |drive| drive.write(limit, 2_000_000)).unwrap();
    let gear = Object::<u16, Rw>::new(0x6091, 0x01);
    check("> 605#2391600107000000", |drive| drive.write(gear, 7)).unwrap();
    check("> 605#2360600002000000", |drive| drive.set_mode(Mode::Velocity)).unwrap();
}

#[test]
fn it_is_not_taken_for_a_drive_that_tells_its_name() {
    const NAMED: Sheet =
        Sheet { objects: &[(0x1000, 0, 4, 0x192), (0x1008, 0, 4, 0x3330_4741), (0x1018, 1, 4, 0x195)], ..SHEET };
    let (bus, _) = bus(NAMED);
    let error = Drive::connect_unprotected(bus.link(), NAMED.node).unwrap_err();
    assert_eq!(error.to_string(), "the node is not a SIKO AG02: vendor 195h, profile 402, name \"AG03\"");
}

#[test]
fn it_is_enabled_by_table_25() {
    let script = "
        > 000#0105    AG02-PPM-01 (5210)
        > 205#0601    AG02-PPM-02 (5212)
        = 6041:00 0231
        > 205#0701    AG02-PPM-03 (5214)
        = 6041:00 0233
        > 205#0F01    AG02-PPM-04 (5216)
        < 185#3703
        = 6041:00 0337
    ";
    check(script, Drive::enable).unwrap();
}

#[test]
fn it_travels_by_table_25() {
    let script = "
        > 205#0F01            the edges begin below
        > 405#1F0088130000    AG02-PPM-05 (5218)
        = 6041:00 D237        the job is active (5040)
        = 1002:00 4810
        ~ 300
        = 6064:00 1388
        = 1002:00 0008
        < 185#3717
        = 6041:00 1737        the target is reached
        > 205#0F01            AG02-PPM-07 (5222)
    ";
    let outcome = enabled(script, |drive| drive.move_to(5000)).unwrap();
    assert_eq!(outcome, Outcome::Reached { position: 5000 });
}

#[test]
fn a_travel_is_interrupted_and_goes_on_by_table_25() {
    let script = "
        > 205#0F01
        > 405#1F0078ECFFFF    AG02-PPM-08 (5224)
        = 6041:00 D237
        = 606C:00 FFFFFFE2
        > 205#1F01            AG02-PPM-09 (5226)
        = 6041:00 5237        standing, and still active (5047)
        = 606C:00 00000000
        > 205#1F01            the order is so young that the drive might stand because of it
        > 205#1F00            AG02-PPM-10 (5228)
        = 6041:00 D237
        = 606C:00 FFFFFFE2
        ~ 300
        = 606C:00 00000000
        = 6064:00 FFFFEC78
        = 6041:00 1737
        > 205#0F01            AG02-PPM-12 (5232)
    ";
    let outcome = enabled(script, |drive| {
        drive.start_moving_to(-5000)?;
        drive.interrupt()?;
        drive.resume()?;
        drive.finish()
    });
    assert_eq!(outcome.unwrap(), Outcome::Reached { position: -5000 });
}

#[test]
fn it_runs_by_table_26() {
    let script = "
        = 6060:00 02          by parameter 20, beforehand (5251)
        > 205#0F01
        > 505#0F0044000000    AG02-PVM-05 (5266)
        = 606C:00 00000044
        = 6041:00 0737
        > 505#0F001E000000    AG02-PVM-07 (5272)
        = 606C:00 0000001E
        > 205#0F01            AG02-PVM-08 (5275)
        = 606C:00 00000000
    ";
    let outcomes = enabled(script, |drive| {
        let outcomes = [drive.run_at(68)?, drive.run_at(30)?];
        drive.stop()?;
        Ok::<_, Error>(outcomes)
    });
    assert_eq!(outcomes.unwrap(), [68, 30].map(|velocity| VelocityOutcome::Reached { velocity }));
}

/// This drive reports inching only by its movement. A shaft that settles does not count as such.
#[test]
fn inching_has_begun_when_the_drive_turns_as_it_was_told() {
    let script = "
        > 205#0F00
        > 205#0F40
        = 6064:00 A           within the window
        ~ 100
        = 6064:00 FFFFFF00    the other way
        ~ 100
        = 606C:00 1E
        > 205#0F01
        = 606C:00 0
    ";
    enabled(script, |drive| {
        drive.inch(Direction::Positive)?;
        assert_eq!(drive.velocity()?, 30);
        drive.stop_inching()
    })
    .unwrap();
}

#[test]
fn it_stops_quickly_and_is_switched_off() {
    let script = "
        = 606C:00 00000044
        > 205#0201            quick stop; bit 8 stays, nothing is to move
        = 6041:00 0217
        = 606C:00 00000000
        > 205#0001            AG02-PPM-15 (5238)
        = 6041:00 0250
    ";
    enabled(script, |drive| {
        drive.quick_stop()?;
        drive.disable()
    })
    .unwrap();
}

#[test]
fn a_fault_is_told_by_its_letter_and_reset_by_an_edge() {
    let script = "
        = 6041:00 0218
        = 1003:01 7121
        > 000#0105
        > 205#0001
        > 205#8001
        = 6041:00 0250
        > 205#0001
    ";
    let cause = enabled(script, Drive::reset_fault);
    assert_eq!(cause.unwrap().unwrap().to_string(), "B (7121): shaft blocked");
    // In an emergency, the manual's table has the high byte of the code first, and CiA 301 the low one. The driver
    // accepts both.
    for emergency in ["< 085#7121210000000000", "< 085#2171210000000000"] {
        let cause = enabled(emergency, |drive| {
            drive.pass(Duration::from_millis(2))?;
            drive.cause()
        });
        assert!(matches!(cause, Ok(Cause::Fault(Code { number: 0x7121, .. }))), "{cause:?}");
    }
}

#[test]
fn what_is_missing_is_named_before_anything_moves() {
    let refused = |system: &str, missing: &str, order: fn(&mut Drive) -> Result<(), Error>| {
        let result = enabled(&format!("= 1002:00 {system}"), order);
        assert_eq!(result.unwrap_err().to_string(), format!("the drive would refuse: {missing}"));
    };
    refused("0401", "its enable input is not active; its limit switch 1 is active", |drive| drive.start_moving_to(0));
    refused("0400", "its enable input is not active", |drive| drive.inch(Direction::Negative));
    refused("0020", "its position is above the upper limit", |drive| drive.inch(Direction::Positive));
    refused("4010", "a travel is under way", |drive| drive.calibrate(0));
    refused("0000", "it is in positioning mode; the velocity 81 is more than its gear allows, 80", |drive| {
        drive.run_at(81).map(drop)
    });
}

#[test]
fn what_only_the_ag03_has_is_refused_before_anything_is_sent() {
    let mut rig = Rig::<Ag02>::new(SHEET);
    rig.check_unsupported("the SIKO AG02 has no temperature to read", Drive::temperature);
    rig.check_unsupported("the SIKO AG02 has no battery voltage to read", Drive::battery_voltage);
    rig.check_unsupported("the SIKO AG02 has no torque deactivation", Drive::torque_threshold);
    rig.check_unsupported("the SIKO AG02 has no command that keeps parameters", Drive::store);
}

#[test]
fn it_is_set_up() {
    check("> 605#237C6000C5090000", |drive| drive.calibrate(2501)).unwrap();
    check("> 605#2313240002000000", |drive| drive.set_approach(Approach::Negative)).unwrap();
    // AG02-OBJ-02 (6054): "load".
    check("> 605#231110026C6F6164", |drive| drive.restore(Some(ParameterSet::Standard))).unwrap();
    // Bit 30, not bit 31 (6108).
    check("> 605#2314100085000040", |drive| drive.set_emergencies(true)).unwrap();
    let units = check("", Drive::units).unwrap();
    assert_eq!((units.millimetres(250), units.shaft_revolutions(200)), (Some(2.5), 5.0));
    let mut settings = check("", Drive::read_parameters).unwrap();
    assert_eq!(settings.len(), AG02.parameters.len());
    settings[0].value = 300;
    check("> 605#231024012C010000", |drive| drive.write_parameters(&settings)).unwrap();
    settings[0].value = 0x1_0005;
    let cut = check("", |drive| drive.write_parameters(&settings));
    assert!(matches!(cut, Err(Error::OutOfRange(_))), "not 5: {cut:?}");
}

#[test]
fn a_driver_that_is_dropped_stops_it() {
    let mut rig = Rig::<Ag02>::new(SHEET);
    let script = "
        = 6041:00 0337
        = 1002:00 0000
        > 205#0F01
        > 405#1F0088130000
        = 6041:00 D237
    ";
    rig.check(script, |drive| drive.start_moving_to(5000)).unwrap();
    rig.follow("> 205#0F01");
    rig.check_dropped();
}

#[cfg(feature = "tokio")]
#[tokio::test]
async fn the_other_shell_does_the_same() {
    use lexican_runtime::host::tokio::Network;

    let (bus, device) = bus(SHEET);
    let network = Network::spawn(bus.link()).unwrap();
    let mut drive = lexican_driver::tokio::Drive::<Ag02>::connect_unprotected(network, SHEET.node).await.unwrap();
    let script = "
        > 000#0105    AG02-PPM-01 (5210)
        > 205#0601    AG02-PPM-02 (5212)
        = 6041:00 0231
        > 205#0701    AG02-PPM-03 (5214)
        = 6041:00 0233
        > 205#0F01    AG02-PPM-04 (5216)
        = 6041:00 0218
        < 085#7121210000000000
        > 605#2360600002000000
    ";
    device.lock().unwrap().follow(bus.now(), script);
    match drive.enable().await {
        // The code with its high byte first.
        Err(Error::Fault(cause)) => assert_eq!(cause.to_string(), "B (7121): shaft blocked"),
        other => panic!("{other:?}"),
    }
    drive.set_mode(Mode::Velocity).await.unwrap();
    assert!(matches!(drive.temperature().await, Err(Error::Unsupported { .. })));
    assert!(device.lock().unwrap().is_through());
}
