//! Trouble on the line: nothing moves that was not ordered again, and the program learns of it.

use lexican_driver::{Drive, Error, Missing, Outcome, Refusal};
use lexican_runtime::host::Link;
use lexican_runtime::profile::cia402::State;
use lexican_runtime::{CobId, Duration, Frame, NodeId};
use siko_ag02::driver::Ag02;
use siko_ag03_1::driver::Ag03_1;
use siko_profibus::{AG02, line};

use super::rig::{NODE, Rig, Segment, Sold, both};
use crate::random::Random;

both! {
    lost_answers_change_nothing a_cable_that_is_cut_is_noticed_and_nothing_goes_on
    a_drive_that_is_not_there_is_not_connected_to any_frames_do_no_harm
    a_master_that_is_gone_in_a_travel_is_a_drive_that_is_lost a_program_that_slept_finds_its_drive
}

/// In each travel, another answer is lost: the master repeats its request, and the drive acts once.
fn lost_answers_change_nothing<K: Sold>() {
    const WAY: i32 = 20;
    let (mut rig, segment) = Rig::<K>::over_profibus();
    rig.drive.enable().unwrap();
    for number in 0.. {
        let exchanges = || segment.bus.with(|line| line.exchanges(segment.id));
        let before = exchanges();
        segment.bus.with(|line| line.lose_answers(segment.id, number..number + 1));
        let target = if number % 2 == 0 { WAY } else { 0 };
        assert_eq!(rig.drive.move_to(target).unwrap(), Outcome::Reached { position: target }, "answer {number}");
        assert_eq!(rig.shaft(), (target, 0), "answer {number}");
        if u64::from(number) >= exchanges() - before {
            assert!(number > 50, "a travel has more answers than {number}");
            break;
        }
    }
}

fn a_cable_that_is_cut_is_noticed_and_nothing_goes_on<K: Sold>() {
    for (cable, master) in [(false, true), (true, false)] {
        let (mut rig, segment) = Rig::<K>::over_profibus();
        rig.drive.enable().unwrap();
        rig.drive.start_moving_to(50_000).unwrap();
        rig.pass_ms(1000);
        segment.set_works(cable, master);
        let error = rig.drive.finish().expect_err("the drive does not answer").into_cause();
        assert!(matches!(error, Error::Sdo(_)), "{error:?}");
        segment.set_works(true, true);
        assert!(matches!(rig.drive.pass(Duration::from_secs(2)).map_err(Error::into_cause), Err(Error::Restarted)));
        assert_eq!((rig.drive.state().unwrap(), rig.pass_ms(1000)), (State::SwitchOnDisabled, ()));
        let (at, velocity) = rig.shaft();
        assert!(at < 10_000 && velocity == 0, "its watchdog has released the motor");
        let refused = rig.drive.move_to(0);
        let missing = vec![Missing::Enabled(State::SwitchOnDisabled)];
        assert!(matches!(&refused, Err(Error::Refused(Refusal(named))) if *named == missing), "{refused:?}");
        rig.drive.enable().unwrap();
        rig.pass_ms(1000);
        assert_eq!(rig.shaft(), (at, 0), "{}: nothing is taken up again", K::MODEL.name);
        assert_eq!(rig.drive.move_to(at + 100).unwrap(), Outcome::Reached { position: at + 100 });
    }
}

/// Nothing reports this, as when the thread of the line has died: the facts get too old.
fn a_master_that_is_gone_in_a_travel_is_a_drive_that_is_lost<K: Sold>() {
    let (mut rig, segment) = Rig::<K>::over_profibus();
    rig.drive.enable().unwrap();
    rig.drive.start_moving_to(50_000).unwrap();
    let now = || segment.bus.with(|line| line.now());
    let began = now();
    let mut shown = began;
    let result = rig.drive.finish_watched(|progress| {
        shown = progress.at;
        segment.set_works(true, now() < began + Duration::from_secs(1));
    });
    let error = result.map_err(Error::into_cause);
    assert!(matches!(error, Err(Error::Sdo(_))), "{error:?}");
    assert!(now() - began < Duration::from_secs(2), "{:?}", now() - began);
    let age = shown - began;
    assert!(age < Duration::from_millis(1100), "what is shown has been measured since: {age:?}");
    assert!(rig.drive.pass(Duration::from_secs(6)).is_err());
    assert_eq!(rig.shaft().1, 0, "its watchdog has released the motor");
    segment.set_works(true, true);
    assert!(matches!(rig.drive.pass(Duration::from_secs(2)).map_err(Error::into_cause), Err(Error::Restarted)));
    rig.drive.enable().unwrap();
    let (at, _) = rig.shaft();
    assert_eq!(rig.drive.move_to(at + 100).unwrap(), Outcome::Reached { position: at + 100 });
}

/// Meanwhile the line goes on, and nobody reads from it.
fn a_program_that_slept_finds_its_drive<K: Sold>() {
    let (mut rig, segment) = Rig::<K>::over_profibus();
    rig.drive.enable().unwrap();
    rig.drive.start_moving_to(50).unwrap();
    segment.bus.with(|line| line.run(Duration::from_secs(20)));
    assert_eq!(rig.drive.finish().unwrap(), Outcome::Reached { position: 50 });
}

fn a_drive_that_is_not_there_is_not_connected_to<K: Sold>() {
    let segment = Segment::new::<K>();
    let other = NodeId::literal(9);
    let result = Drive::<_, K>::connect_unprotected(line::link(&segment.bus, K::MODEL, other).unwrap(), other);
    assert!(matches!(result.err(), Some(Error::Sdo(_))));
    // Another kind of drive does not accept the ident number.
    let segment = if K::MODEL.name == AG02.name { Segment::new::<Ag03_1>() } else { Segment::new::<Ag02>() };
    let result = Drive::<_, K>::connect_unprotected(line::link(&segment.bus, K::MODEL, NODE).unwrap(), NODE);
    assert!(matches!(result.err(), Some(Error::Sdo(_))));
}

/// Random frames, including some that the drive accepts: the driver works afterwards.
fn any_frames_do_no_harm<K: Sold>() {
    let segment = Segment::new::<K>();
    let mut link = segment.link::<K>();
    let mut random = Random(0x5EED);
    for _ in 0..2000 {
        let (bytes, shape) = (random.next().to_le_bytes(), random.next());
        let node = u16::from(NODE.get());
        let id = [0x000, 0x080, 0x200 + node, 0x400 + node, 0x500 + node, 0x600 + node, 0x700 + node];
        let id = CobId::standard(id[shape as usize % 7]).unwrap();
        let frame = Frame::new(id, &bytes[..(shape >> 8) as usize % 9]).unwrap();
        link.send(&frame).unwrap();
        let until = link.now() + Duration::from_micros((shape >> 16) % 10_000);
        while link.receive(until).unwrap().is_some() {}
    }
    let mut drive = Drive::<_, K>::connect_unprotected(link, NODE).unwrap();
    drive.restore(None).or_else(|_| drive.disable().and_then(|()| drive.restore(None))).unwrap();
    drive.reset_fault().unwrap();
    drive.enable().unwrap();
    let target = drive.position().unwrap() + 10;
    assert_eq!(drive.move_to(target).unwrap(), Outcome::Reached { position: target });
}

/// ZSW.0 is 0 here, while over CANopen the AG02 can be enabled.
#[test]
fn without_supply_it_is_not_enabled() {
    let (mut rig, segment) = Rig::<Ag02>::over_profibus();
    rig.world(|inputs| inputs.output_stage_supply_100mv = 0);
    let refused = rig.drive.enable();
    assert!(matches!(refused, Err(Error::NoReaction { state: State::SwitchedOn, .. })), "{refused:?}");
    rig.world(|inputs| inputs.output_stage_supply_100mv = 240);
    rig.pass_ms(1000);
    assert_eq!(rig.drive.state().unwrap(), State::SwitchedOn);
    let mut is_enabled = true;
    segment.simulated(&mut |drive, _| is_enabled = drive.state() == State::OperationEnabled);
    assert!(!is_enabled, "what was refused does not come later");
    rig.drive.enable().unwrap();
}
