//! What goes wrong on the line: nothing moves that was not ordered again, and the program learns of it.

use lexican_driver::{Drive, Error, Missing, Outcome, Refusal};
use lexican_profibus::virtual_bus::VirtualBus;
use lexican_runtime::host::{self, Link};
use lexican_runtime::profile::cia402::State;
use lexican_runtime::{CobId, Duration, Frame, NodeId};
use siko_ag02::driver::Ag02;
use siko_ag03_1::driver::Ag03_1;
use siko_profibus::{AG02, AG03_1, bus, line};

use super::bench::{Bench, NODE, Segment, Sold, both};

both! {
    lost_answers_change_nothing a_cable_that_is_cut_is_noticed_and_nothing_goes_on
    a_drive_that_is_not_there_is_not_connected_to any_frames_do_no_harm
    a_master_that_is_gone_in_a_travel_is_a_drive_that_is_lost a_program_that_slept_finds_its_drive
}

/// Each answer of a travel gets lost in a travel of its own: the master repeats its request, and the drive acts once.
fn lost_answers_change_nothing<K: Sold>() {
    const WAY: i32 = 20;
    let (mut bench, segment) = Bench::<K>::over_profibus();
    bench.drive.enable().unwrap();
    for number in 0.. {
        let exchanges = || segment.bus.with(|line| line.exchanges(segment.id));
        let before = exchanges();
        segment.bus.with(|line| line.lose_answers(segment.id, number..number + 1));
        let target = if number % 2 == 0 { WAY } else { 0 };
        assert_eq!(bench.drive.move_to(target).unwrap(), Outcome::Reached { position: target }, "answer {number}");
        assert_eq!(bench.shaft(), (target, 0), "answer {number}");
        if u64::from(number) >= exchanges() - before {
            assert!(number > 50, "a travel has more answers than {number}");
            break;
        }
    }
}

fn a_cable_that_is_cut_is_noticed_and_nothing_goes_on<K: Sold>() {
    for (cable, master) in [(false, true), (true, false)] {
        let (mut bench, segment) = Bench::<K>::over_profibus();
        bench.drive.enable().unwrap();
        bench.drive.start_moving_to(50_000).unwrap();
        bench.pass_ms(1000);
        segment.set_works(cable, master);
        let error = bench.drive.finish().expect_err("the drive does not answer").into_cause();
        assert!(matches!(error, Error::Sdo(_)), "{error:?}");
        segment.set_works(true, true);
        assert!(matches!(bench.drive.pass(Duration::from_secs(2)).map_err(Error::into_cause), Err(Error::Restarted)));
        assert_eq!((bench.drive.state().unwrap(), bench.pass_ms(1000)), (State::SwitchOnDisabled, ()));
        let (at, velocity) = bench.shaft();
        assert!(at < 10_000 && velocity == 0, "its watchdog has released the motor");
        let refused = bench.drive.move_to(0);
        let missing = vec![Missing::Enabled(State::SwitchOnDisabled)];
        assert!(matches!(&refused, Err(Error::Refused(Refusal(named))) if *named == missing), "{refused:?}");
        bench.drive.enable().unwrap();
        bench.pass_ms(1000);
        assert_eq!(bench.shaft(), (at, 0), "{}: nothing is taken up again", K::MODEL.name);
        assert_eq!(bench.drive.move_to(at + 100).unwrap(), Outcome::Reached { position: at + 100 });
    }
}

/// Nobody says so, as when the thread that runs the line is dead: the facts grow old.
fn a_master_that_is_gone_in_a_travel_is_a_drive_that_is_lost<K: Sold>() {
    let (mut bench, segment) = Bench::<K>::over_profibus();
    bench.drive.enable().unwrap();
    bench.drive.start_moving_to(50_000).unwrap();
    let now = || segment.bus.with(|line| line.now());
    let began = now();
    let mut shown = began;
    let result = bench.drive.finish_watched(|progress| {
        shown = progress.at;
        segment.set_works(true, now() < began + Duration::from_secs(1));
    });
    let error = result.map_err(Error::into_cause);
    assert!(matches!(error, Err(Error::Sdo(_))), "{error:?}");
    assert!(now() - began < Duration::from_secs(2), "{:?}", now() - began);
    let age = shown - began;
    assert!(age < Duration::from_millis(1100), "what is shown has been measured since: {age:?}");
    assert!(bench.drive.pass(Duration::from_secs(6)).is_err());
    assert_eq!(bench.shaft().1, 0, "its watchdog has released the motor");
    segment.set_works(true, true);
    assert!(matches!(bench.drive.pass(Duration::from_secs(2)).map_err(Error::into_cause), Err(Error::Restarted)));
    bench.drive.enable().unwrap();
    let (at, _) = bench.shaft();
    assert_eq!(bench.drive.move_to(at + 100).unwrap(), Outcome::Reached { position: at + 100 });
}

/// The line goes on meanwhile, and nobody takes what comes.
fn a_program_that_slept_finds_its_drive<K: Sold>() {
    let (mut bench, segment) = Bench::<K>::over_profibus();
    bench.drive.enable().unwrap();
    bench.drive.start_moving_to(50).unwrap();
    segment.bus.with(|line| line.run(Duration::from_secs(20)));
    assert_eq!(bench.drive.finish().unwrap(), Outcome::Reached { position: 50 });
}

fn a_drive_that_is_not_there_is_not_connected_to<K: Sold>() {
    let segment = Segment::new::<K>();
    let other = NodeId::literal(9);
    let result = Drive::<_, K>::connect_unprotected(line::link(&segment.bus, K::MODEL, other).unwrap(), other);
    assert!(matches!(result.err(), Some(Error::Sdo(_))));
    // Another kind of drive refuses the ident number.
    let segment = if K::MODEL.name == AG02.name { Segment::new::<Ag03_1>() } else { Segment::new::<Ag02>() };
    let result = Drive::<_, K>::connect_unprotected(line::link(&segment.bus, K::MODEL, NODE).unwrap(), NODE);
    assert!(matches!(result.err(), Some(Error::Sdo(_))));
}

/// Frames from a generator, also such as the drive would take: the driver works afterwards.
fn any_frames_do_no_harm<K: Sold>() {
    let segment = Segment::new::<K>();
    let mut link = segment.link::<K>();
    let mut random = 0x2545_F491_4F6C_DD1D_u64;
    let mut next = || {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        random
    };
    for _ in 0..2000 {
        let (bytes, shape) = (next().to_le_bytes(), next());
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

/// ZSW.0 is 0, where CANopen lets the AG02 be enabled.
#[test]
fn without_supply_it_is_not_enabled() {
    let (mut bench, segment) = Bench::<Ag02>::over_profibus();
    bench.world(|inputs| inputs.output_stage_supply_100mv = 0);
    let refused = bench.drive.enable();
    assert!(matches!(refused, Err(Error::NoReaction { state: State::SwitchedOn, .. })), "{refused:?}");
    bench.world(|inputs| inputs.output_stage_supply_100mv = 240);
    bench.pass_ms(1000);
    assert_eq!(bench.drive.state().unwrap(), State::SwitchedOn);
    let mut is_enabled = true;
    segment.simulated(&mut |drive, _| is_enabled = drive.state() == State::OperationEnabled);
    assert!(!is_enabled, "what was refused does not come later");
    bench.drive.enable().unwrap();
}

/// Two drives on one segment, and one on CAN, are nodes of one bus.
#[test]
fn drives_behind_several_doors_share_a_bus() {
    let mut segment = VirtualBus::new();
    let [five, six, seven] = [5, 6, 7].map(NodeId::literal);
    for (model, node) in [(&AG02, five), (&AG03_1, six)] {
        bus::attach_unknown(&mut segment, model, node.get());
    }
    let segment = lexican_profibus::bus::Bus::new(segment);
    let can = host::VirtualBus::with_bit_rate(500);
    can.attach(line::node(&segment, &AG02, five).unwrap());
    can.attach(line::node(&segment, &AG03_1, six).unwrap());
    can.attach(siko_ag02::sim::SimulatedDrive::new(AG02.drive, seven));
    let mut first = Drive::<_, Ag02>::connect_unprotected(can.link(), five).unwrap();
    let mut second = Drive::<_, Ag03_1>::connect_unprotected(can.link(), six).unwrap();
    let mut third = Drive::<_, Ag02>::connect_unprotected(can.link(), seven).unwrap();
    first.enable().unwrap();
    second.enable().unwrap();
    third.enable().unwrap();
    first.start_moving_to(1000).unwrap();
    second.start_moving_to(1100).unwrap();
    third.start_moving_to(1200).unwrap();
    assert_eq!(first.finish().unwrap(), Outcome::Reached { position: 1000 });
    assert_eq!(second.finish().unwrap(), Outcome::Reached { position: 1100 });
    assert_eq!(third.finish().unwrap(), Outcome::Reached { position: 1200 });
}
