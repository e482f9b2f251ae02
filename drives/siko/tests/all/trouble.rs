//! The driver in trouble: a fault at every frame, every frame lost in turn, random frames.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use lexican_runtime::host::{Fate, Link, Node, VirtualBus, VirtualLink};
use lexican_runtime::{CobId, Duration, Frame, Instant};
use proptest::prelude::*;
use siko_ag03_1::Direction;
use siko_ag03_1::driver::{Approach, Drive, Error, Missing, Mode, Outcome, Refusal, VelocityOutcome};
use siko_ag03_1::fault::{self, Cause};
use siko_ag03_1::od;
use siko_ag03_1::sim::MODEL;
use siko_ag03_1::sim::SimulatedDrive;
use siko_ag03_1::state::{Command, State};

use super::driver::rig::{NODE, Rig};

/// The actions of an application, and their result.
type Program<L> = fn(&mut Drive<L>) -> Result<End, Error>;

#[derive(Debug, PartialEq)]
enum End {
    Travelled(Outcome),
    Ran(VelocityOutcome),
    Done,
}

/// Together, these contain every sequence.
const PROGRAMS: &[(&str, Program<VirtualLink>)] = &[
    ("travel", |drive| visit(drive, 1000).map(End::Travelled)),
    ("loop", approach_from_below),
    ("inch", inch),
    ("run", run),
    ("stop quickly", stop_quickly),
    ("set up", set_up),
];

/// Enables, travels, interrupts, resumes, waits, disables.
fn visit<L: Link>(drive: &mut Drive<L>, target: i32) -> Result<Outcome, Error> {
    drive.enable()?;
    drive.start_moving_to(target)?;
    drive.pass(Duration::from_millis(500))?;
    drive.interrupt()?;
    drive.resume()?;
    let outcome = drive.finish()?;
    drive.disable()?;
    Ok(outcome)
}

fn approach_from_below<L: Link>(drive: &mut Drive<L>) -> Result<End, Error> {
    drive.set_approach(Approach::Positive)?;
    drive.enable()?;
    let outcome = drive.move_to(-1000)?;
    drive.disable()?;
    drive.set_approach(Approach::Direct)?;
    Ok(End::Travelled(outcome))
}

fn inch<L: Link>(drive: &mut Drive<L>) -> Result<End, Error> {
    drive.enable()?;
    drive.inch(Direction::Negative)?;
    drive.pass(Duration::from_millis(300))?;
    drive.stop_inching()?;
    let outcome = drive.step()?;
    drive.disable()?;
    Ok(End::Travelled(outcome))
}

fn run<L: Link>(drive: &mut Drive<L>) -> Result<End, Error> {
    drive.set_mode(Mode::Velocity)?;
    drive.enable()?;
    drive.run_at(60)?;
    let outcome = drive.run_at(-30)?;
    drive.stop()?;
    drive.disable()?;
    drive.set_mode(Mode::Positioning)?;
    Ok(End::Ran(outcome))
}

fn stop_quickly<L: Link>(drive: &mut Drive<L>) -> Result<End, Error> {
    drive.enable()?;
    drive.start_moving_to(100_000)?;
    drive.pass(Duration::from_millis(500))?;
    drive.quick_stop()?;
    drive.disable()?;
    Ok(End::Done)
}

fn set_up<L: Link>(drive: &mut Drive<L>) -> Result<End, Error> {
    drive.calibrate(100)?;
    drive.set_torque_threshold(Some(100))?;
    let settings = drive.read_parameters()?;
    drive.restore(None)?;
    drive.write_parameters(&settings)?;
    let _ = (drive.units()?, drive.temperature()?, drive.battery_voltage()?);
    drive.restore(None)?;
    drive.calibrate(0)?;
    Ok(End::Done)
}

/// The number of frames of an undisturbed program.
fn frames_of(name: &str, program: Program<VirtualLink>) -> u64 {
    let Rig { bus, mut drive, .. } = Rig::new();
    let count = Arc::new(AtomicU64::new(0));
    let counter = Arc::clone(&count);
    bus.observe(move |_, _| {
        counter.fetch_add(1, Ordering::Relaxed);
    });
    let end = program(&mut drive).unwrap_or_else(|error| panic!("{name}: {error}"));
    let reached =
        matches!(end, End::Travelled(Outcome::Reached { .. }) | End::Ran(VelocityOutcome::Reached { .. }) | End::Done);
    assert!(reached, "{name}: {end:?}");
    count.load(Ordering::Relaxed)
}

/// Checks that a travel works after all that has happened. It is long enough to be interrupted.
#[track_caller]
fn check_usable(drive: &mut Drive<VirtualLink>, what: &str) {
    let again = (|| {
        // A quick stop ends what is still in progress.
        if drive.state()? == State::OperationEnabled {
            drive.quick_stop()?;
        }
        drive.disable()?;
        drive.set_mode(Mode::Positioning)?;
        drive.set_approach(Approach::Direct)?;
        let target = drive.position()? - 2000;
        Ok::<_, Error>((target, visit(drive, target)?))
    })();
    let there = matches!(again, Ok((target, Outcome::Reached { position })) if position == target);
    assert!(there, "{what}: {again:?}");
}

#[test]
fn a_fault_at_any_frame_is_told_and_can_be_reset() {
    let fault = Cause::from(fault::OVERVOLTAGE);
    for &(name, program) in PROGRAMS {
        for at in 0..frames_of(name, program) {
            let Rig { bus, simulated, mut drive } = Rig::new();
            let mut count = 0;
            let victim = Arc::clone(&simulated);
            bus.observe(move |now, _| {
                if count == at {
                    victim.lock().unwrap().set_inputs(now, |inputs| inputs.output_stage_supply_100mv = 400);
                }
                count += 1;
            });
            let is_reported = match program(&mut drive).map_err(Error::into_cause) {
                Ok(End::Travelled(Outcome::Fault(cause)) | End::Ran(VelocityOutcome::Fault(cause)))
                | Err(Error::Fault(cause)) => cause == fault,
                Err(Error::Refused(Refusal(missing))) => {
                    let expected = [Missing::NoFault(fault), Missing::Travel, Missing::Enabled(State::Fault)];
                    missing.len() == 1 && expected.contains(&missing[0])
                }
                // The program was over before the fault came, or nothing moves in it.
                Ok(End::Travelled(Outcome::Reached { .. }) | End::Ran(VelocityOutcome::Reached { .. }) | End::Done) => {
                    true
                }
                other => panic!("{name} at frame {at}: {other:?}"),
            };
            assert!(is_reported, "{name} at frame {at}");
            simulated.lock().unwrap().set_inputs(bus.now(), |inputs| inputs.output_stage_supply_100mv = 240);
            let passed = drive.pass(Duration::from_secs(1));
            let noticed = matches!(passed, Ok(()) | Err(Error::Fault(_)));
            assert!(noticed, "{name} at frame {at}: {passed:?}");
            drive.pass(Duration::from_secs(1)).unwrap();
            let reset = drive.reset_fault().unwrap();
            assert!(reset.is_none_or(|cause| cause == fault), "{name} at frame {at}");
            check_usable(&mut drive, &format!("{name} at frame {at}"));
        }
    }
}

#[test]
fn a_frame_that_is_lost_ends_in_an_answer_and_leaves_the_driver_usable() {
    for &(name, program) in PROGRAMS {
        for lost in 0..frames_of(name, program) {
            let Rig { bus, mut drive, .. } = Rig::new();
            bus.set_fate(move |number, _| if number == lost { Fate::Lose } else { Fate::Deliver });
            let before = bus.now();
            match program(&mut drive).map_err(Error::into_cause) {
                Ok(End::Travelled(Outcome::Reached { .. }) | End::Ran(VelocityOutcome::Reached { .. }) | End::Done) => {
                }
                Err(Error::Sdo(_) | Error::NoReaction { .. } | Error::NotTaken { .. }) => {}
                other => panic!("{name} without frame {lost}: {other:?}"),
            }
            assert!(bus.now().since(before) < Duration::from_secs(60), "{name} without frame {lost}");
            check_usable(&mut drive, &format!("{name} without frame {lost}"));
        }
    }
}

/// Loses the control words (RPDO1) for which `lose` returns true, by their number from 0.
fn lose_control_words(bus: &VirtualBus, lose: impl Fn(u64) -> bool + Send + 'static) {
    let mut count = 0;
    bus.set_fate(move |_, frame| {
        if frame.id() != CobId::of_node(0x200, NODE) {
            return Fate::Deliver;
        }
        count += 1;
        if lose(count - 1) { Fate::Lose } else { Fate::Deliver }
    });
}

#[test]
fn a_quick_stop_that_is_lost_is_sent_again() {
    for lost in 1..10 {
        let Rig { bus, simulated, mut drive } = Rig::new();
        drive.enable().unwrap();
        drive.start_moving_to(100_000).unwrap();
        lose_control_words(&bus, move |number| number < lost);
        drive.quick_stop().unwrap();
        assert_eq!(simulated.lock().unwrap().velocity(bus.now()), 0, "after {lost} were lost");
    }
}

/// A drive that has only just been ordered to move still stands.
#[test]
fn a_stop_that_is_lost_before_the_drive_moves_is_sent_again() {
    type Operation = fn(&mut Drive<VirtualLink>) -> Result<(), Error>;
    let operations: [Operation; 3] = [Drive::interrupt, Drive::stop, Drive::disable];
    for operation in operations {
        let Rig { bus, simulated, mut drive } = Rig::new();
        drive.write(od::MOTOR_PARAMETER_SET.a_pos(), od::Acceleration(1)).unwrap();
        drive.enable().unwrap();
        drive.start_moving_to(100_000).unwrap();
        lose_control_words(&bus, |number| number == 0);
        operation(&mut drive).unwrap();
        bus.advance(Duration::from_secs(2));
        assert_eq!(simulated.lock().unwrap().velocity(bus.now()), 0);
    }
}

#[test]
fn a_quick_stop_that_never_arrives_is_told_of() {
    let Rig { bus, mut drive, .. } = Rig::new();
    drive.enable().unwrap();
    drive.start_moving_to(100_000).unwrap();
    lose_control_words(&bus, |_| true);
    let outcome = drive.quick_stop().map_err(Error::into_cause);
    let is_reported =
        matches!(outcome, Err(Error::NoReaction { state: State::OperationEnabled, command: Command::QuickStop }));
    assert!(is_reported, "{outcome:?}");
}

/// The frame with the order has a lower priority than the one that withdraws it, so it may come later.
#[test]
fn a_travel_that_is_told_as_not_taken_does_not_begin_later() {
    let Rig { bus, simulated, mut drive } = Rig::new();
    drive.enable().unwrap();
    bus.set_fate(|_, frame| match frame.data() {
        [0x1F, 0x00, ..] if frame.id() == CobId::of_node(0x400, NODE) => Fate::Delay(Duration::from_millis(700)),
        _ => Fate::Deliver,
    });
    let started = drive.start_moving_to(100_000);
    let is_reported = matches!(started, Err(Error::Refused(_) | Error::NotTaken { .. }));
    assert!(is_reported, "{started:?}");
    drop(drive);
    for _ in 0..10 {
        bus.advance(Duration::from_millis(300));
        assert_eq!(simulated.lock().unwrap().velocity(bus.now()), 0);
    }
}

#[test]
fn inching_that_does_not_begin_is_not_told_as_done() {
    let Rig { bus, simulated, mut drive } = Rig::new();
    drive.enable().unwrap();
    assert_eq!(drive.move_to(100).unwrap(), Outcome::Reached { position: 100 });
    let lose =
        |word: [u8; 2]| bus.set_fate(move |_, frame| if *frame.data() == word { Fate::Lose } else { Fate::Deliver });
    lose([0x0F, 0x20]);
    assert!(matches!(drive.step(), Err(Error::NotTaken { .. })));
    lose([0x0F, 0x40]);
    assert!(matches!(drive.inch(Direction::Positive), Err(Error::NotTaken { .. })));
    lose([0x0F, 0x80]);
    assert!(matches!(drive.inch(Direction::Negative), Err(Error::NotTaken { .. })));
    assert_eq!(simulated.lock().unwrap().position(bus.now()), 100);
}

#[test]
fn the_smallest_step_is_seen_and_none_is_no_error() {
    let Rig { mut drive, .. } = Rig::new();
    drive.enable().unwrap();
    for (width, position) in [(1, 1), (-1, 0), (0, 0)] {
        drive.write(od::DELTA_JOG, od::Position(width)).unwrap();
        assert_eq!(drive.step().unwrap(), Outcome::Reached { position });
    }
}

fn frames() -> impl Strategy<Value = (u16, Vec<u8>, bool)> {
    // Mostly identifiers that mean something to node 5.
    let ids = prop_oneof![
        Just(0x000_u16),
        Just(0x080),
        Just(0x205),
        Just(0x385),
        Just(0x405),
        Just(0x505),
        Just(0x605),
        Just(0x705),
        0_u16..0x800
    ];
    (ids, proptest::collection::vec(any::<u8>(), 0..=8), any::<bool>())
}

proptest! {
    #[test]
    fn no_frame_makes_the_simulated_drive_panic(
        frames in proptest::collection::vec(frames(), 0..60), gaps_ms in proptest::collection::vec(0_u64..500, 60),
    ) {
        let mut drive = SimulatedDrive::new(&MODEL, NODE);
        let mut now = Instant::ZERO;
        for ((id, data, remote), gap_ms) in frames.into_iter().zip(gaps_ms) {
            now += Duration::from_millis(gap_ms);
            for _ in 0..1000 {
                match drive.poll_timeout() {
                    Some(at) if at <= now => drive.handle_timeout(now),
                    _ => break,
                }
            }
            let id = CobId::standard(id).unwrap();
            let frame = if remote { Frame::remote(id, data.len() as u8) } else { Frame::new(id, &data) };
            drive.handle_frame(now, &frame.unwrap());
            for _ in 0..100 {
                if drive.poll_transmit(now).is_none() {
                    break;
                }
            }
            prop_assert!(drive.poll_transmit(now).is_none(), "the drive sends without end");
            prop_assert!(drive.poll_timeout().is_none_or(|at| at > now) || drive.poll_timeout().is_some());
        }
    }

    #[test]
    fn any_travel_ends_within_an_increment_of_its_target(
        targets in proptest::collection::vec(-20_000_i32..20_000, 1..4), a_pos in 1_u8..=100, d_pos in 1_u8..=101,
        v_pos in 1_u8..=200, pitch in prop_oneof![Just(0_u16), 1_u16..1000],
    ) {
        let Rig { mut drive, .. } = Rig::new();
        drive.set_patience(Duration::from_secs(100_000));
        let set = od::MOTOR_PARAMETER_SET;
        drive.write(set.a_pos(), od::Acceleration(a_pos)).unwrap();
        drive.write(set.d_pos(), od::Deceleration(d_pos)).unwrap();
        drive.write(set.v_pos(), od::Speed(v_pos.max(40))).unwrap();
        drive.write(od::SPINDLE_PITCH, od::SpindlePitch(pitch)).unwrap();
        drive.enable().unwrap();
        for target in targets {
            let target = if pitch == 0 { target } else { target.clamp(-i32::from(pitch), i32::from(pitch)) };
            prop_assert_eq!(drive.move_to(target).unwrap(), Outcome::Reached { position: target });
        }
    }
}
