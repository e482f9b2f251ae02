//! Another manager, or another handle, orders something during an operation of the driver.

use lexican_runtime::host::{Fate, Node};
use lexican_runtime::{CobId, Duration, Frame, Instant};
use siko_ag03_1::Direction;
use siko_ag03_1::driver::{Drive, Missing, Mode, Outcome, VelocityOutcome};
use siko_ag03_1::fault::{self, Cause};
use siko_ag03_1::od;
use siko_ag03_1::sim::inputs::Shaft;

use super::rig::{NODE, Rig, refused};

/// Another manager, which answers the first velocity order with one of its own.
struct Rival {
    order: Option<Frame>,
    outbox: Option<Frame>,
}

impl Rival {
    fn new(order: Frame) -> Self {
        Rival { order: Some(order), outbox: None }
    }
}

impl Node for Rival {
    fn handle_frame(&mut self, _: Instant, frame: &Frame) {
        if frame.id() == CobId::of_node(0x500, NODE) {
            self.outbox = self.order.take();
        }
    }
    fn handle_timeout(&mut self, _: Instant) {}
    fn poll_transmit(&mut self, _: Instant) -> Option<Frame> {
        self.outbox.take()
    }
    fn poll_timeout(&self) -> Option<Instant> {
        None
    }
}

#[test]
fn a_travel_that_ends_elsewhere_has_not_reached_its_target() {
    let mut rig = Rig::enabled();
    rig.drive.start_moving_to(5000).unwrap();
    rig.pass_ms(500);
    let mut other = Drive::connect_unprotected(rig.bus.link(), NODE).unwrap();
    other.quick_stop().unwrap();
    other.enable().unwrap();
    assert_eq!(other.move_to(-300).unwrap(), Outcome::Reached { position: -300 });
    assert_eq!(rig.drive.finish().unwrap(), Outcome::Overridden { position: -300 });
    assert_eq!(rig.drive.move_to(5000).unwrap(), Outcome::Reached { position: 5000 });
}

/// The target that the drive shows is still that of the order.
#[test]
fn a_travel_that_a_foreign_step_has_ended_has_not_reached_its_target() {
    let mut rig = Rig::enabled();
    rig.drive.write(od::DELTA_JOG, od::Position(-700)).unwrap();
    rig.drive.start_moving_to(5000).unwrap();
    rig.pass_ms(500);
    let mut other = Drive::connect_unprotected(rig.bus.link(), NODE).unwrap();
    other.quick_stop().unwrap();
    other.enable().unwrap();
    let Outcome::Reached { position } = other.step().unwrap() else { panic!("nothing is in its way") };
    assert_eq!(rig.drive.finish().unwrap(), Outcome::Overridden { position });
}

/// Another manager has changed the width since the driver read it.
#[test]
fn a_step_of_another_width_is_not_the_one_that_was_ordered() {
    let mut rig = Rig::enabled();
    rig.drive.write(od::DELTA_JOG, od::Position(400)).unwrap();
    let answer = CobId::of_node(0x580, NODE);
    rig.bus.set_fate(move |_, frame| match *frame.data() {
        [0x42 | 0x43, 0x15, 0x24, 0, ..] if frame.id() == answer => {
            Fate::Replace(Frame::from_array(answer, [0x43, 0x15, 0x24, 0, 100, 0, 0, 0]))
        }
        _ => Fate::Deliver,
    });
    assert_eq!(rig.drive.step().unwrap(), Outcome::Overridden { position: 400 });
}

/// Another manager may prepare an order without giving it.
#[test]
fn a_target_that_is_only_written_overrides_nothing() {
    let mut rig = Rig::enabled();
    rig.drive.start_moving_to(500).unwrap();
    let mut other = Drive::connect_unprotected(rig.bus.link(), NODE).unwrap();
    other.write(od::TARGET_POSITION, od::Position(-300)).unwrap();
    assert_eq!(rig.drive.finish().unwrap(), Outcome::Reached { position: 500 });
}

#[test]
fn a_resumed_travel_is_compared_with_its_target_too() {
    let mut rig = Rig::enabled();
    rig.drive.start_moving_to(5000).unwrap();
    rig.pass_ms(500);
    rig.drive.stop().unwrap();
    rig.drive.resume().unwrap();
    let mut other = Drive::connect_unprotected(rig.bus.link(), NODE).unwrap();
    other.quick_stop().unwrap();
    other.enable().unwrap();
    other.move_to(4000).unwrap();
    assert_eq!(rig.drive.finish().unwrap(), Outcome::Overridden { position: 4000 });
}

/// The window around a low velocity includes zero.
#[test]
fn a_blocked_shaft_does_not_run() {
    let mut rig = Rig::running();
    rig.world(|inputs| inputs.shaft = Shaft::Blocked);
    assert_eq!(rig.drive.run_at(5).unwrap(), VelocityOutcome::Fault(Cause::from(fault::SHAFT_BLOCKED)));
}

#[test]
fn a_shaft_that_still_turns_the_other_way_has_not_reached_its_velocity() {
    let mut rig = Rig::running();
    rig.drive.write(od::MOTOR_PARAMETER_SET.a_rot(), od::Acceleration(1)).unwrap();
    rig.drive.run_at(-4).unwrap();
    rig.pass_ms(5000);
    let outcome = rig.drive.run_at(4).unwrap();
    assert!(matches!(outcome, VelocityOutcome::Reached { velocity: 1.. }), "{outcome:?}");
}

#[test]
fn a_foreign_stop_ends_the_waiting_for_a_velocity() {
    let mut rig = Rig::running();
    rig.drive.set_patience(Duration::from_millis(100));
    assert!(matches!(rig.drive.run_at(100).unwrap(), VelocityOutcome::TimedOut { .. }));
    rig.drive.set_patience(Duration::from_secs(600));
    rig.bus.attach(Rival::new(Frame::from_array(CobId::of_node(0x200, NODE), [0x0F, 0x01])));
    let before = rig.bus.now();
    assert_eq!(rig.drive.run_at(100).unwrap(), VelocityOutcome::Overridden { velocity: 0 });
    assert!(rig.bus.now().since(before) < Duration::from_secs(10));
}

#[test]
fn a_foreign_velocity_is_not_the_one_that_was_ordered() {
    let mut rig = Rig::running();
    rig.bus.attach(Rival::new(Frame::from_array(CobId::of_node(0x500, NODE), [0x0F, 0x00, 30, 0, 0, 0])));
    let outcome = rig.drive.run_at(100).unwrap();
    assert!(matches!(outcome, VelocityOutcome::Overridden { .. }), "{outcome:?}");
}

/// If the drive refuses to inch beyond a limit, the error names the limit.
#[test]
fn inching_at_a_limit_names_the_limit() {
    for (target, direction, limit) in [
        (1000, Direction::Positive, Missing::ShortOfUpperLimit),
        (-1000, Direction::Negative, Missing::ShortOfLowerLimit),
    ] {
        let mut rig = Rig::enabled();
        rig.drive.write(od::SOFTWARE_POSITION_LIMIT.limit_1(), od::Position(1000)).unwrap();
        rig.drive.write(od::SOFTWARE_POSITION_LIMIT.limit_2(), od::Position(-1000)).unwrap();
        assert_eq!(rig.drive.move_to(target).unwrap(), Outcome::Reached { position: target });
        // The order is lost, as if the drive did not accept it.
        rig.bus.set_fate(|_, frame| match frame.data() {
            [0x0F, 0x40 | 0x80] if frame.id() == CobId::of_node(0x200, NODE) => Fate::Lose,
            _ => Fate::Deliver,
        });
        refused(rig.drive.inch(direction), &[limit]);
    }
}

#[test]
fn modes_of_other_handles_are_seen() {
    let mut rig = Rig::enabled();
    let mut other = Drive::connect_unprotected(rig.bus.link(), NODE).unwrap();
    other.set_mode(Mode::Velocity).unwrap();
    refused(rig.drive.move_to(10), &[Missing::Mode(Mode::Velocity)]);
}
