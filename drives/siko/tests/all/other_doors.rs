//! Orders that do not come by CAN: the same motion, and the reason when there is none.

use super::controller_rig::Rig;
use lexican_driver::Direction;
use siko::sim::inputs::{Inputs, Shaft};
use siko::sim::motion::Job;
use siko::sim::parameters::{Mode, Parameters};
use siko::sim::{Braking, Order, Refused};
use siko::state::State;
use siko::words::system;

impl Rig {
    fn order(&mut self, order: Order) -> Result<(), Refused> {
        self.controller.order(self.now, order)
    }

    fn in_control(parameters: Parameters) -> Self {
        let mut rig = Rig::new(parameters);
        rig.order(Order::Enable).unwrap();
        rig
    }

    fn velocity(&self) -> f64 {
        self.controller.motion().state(self.now).velocity
    }
}

/// The figures of the CANopen door: 30 rev/min with 50 %, so 800 increments/s after 250 ms.
#[test]
fn a_travel_is_that_of_the_control_words() {
    let parameters = Parameters { target_position: 5000, ..Parameters::default() };
    let (mut by_order, mut by_word) = (Rig::in_control(parameters), Rig::enabled(parameters));
    by_order.order(Order::Start).unwrap();
    by_word.control(0x001F);
    for _ in 0..80 {
        by_order.pass_ms(100);
        by_word.pass_ms(100);
        let [a, b] = [&by_order, &by_word].map(|rig| rig.controller.motion().state(rig.now));
        assert_eq!(a, b);
    }
    assert_eq!(by_order.controller.position(by_order.now), 5000);
}

#[test]
fn a_drive_whose_travel_is_blocked_is_not_ready_for_another() {
    let mut rig = Rig::in_control(Parameters { target_position: 5000, ..Parameters::default() });
    rig.world(|inputs| inputs.shaft = Shaft::Blocked);
    rig.order(Order::Start).unwrap();
    rig.pass_ms(10);
    let shown = rig.controller.system_status(rig.now) & (system::NOT_READY | system::MOVING);
    assert_eq!(shown, system::NOT_READY);
}

#[test]
fn a_travel_is_interrupted_resumed_and_aborted() {
    let mut rig = Rig::in_control(Parameters { target_position: 5000, ..Parameters::default() });
    assert_eq!(rig.order(Order::Resume), Err(Refused::Busy));
    rig.order(Order::Start).unwrap();
    rig.pass_ms(1000);
    assert_eq!(rig.order(Order::Start), Err(Refused::Busy));
    rig.order(Order::Interrupt(Braking::Programmed)).unwrap();
    rig.pass_ms(249);
    assert!(rig.velocity() > 0.0);
    rig.pass_ms(1);
    assert_eq!(rig.velocity(), 0.0);
    rig.order(Order::Resume).unwrap();
    rig.pass_ms(1000);
    rig.order(Order::Interrupt(Braking::Full)).unwrap();
    rig.pass_ms(125);
    assert_eq!(rig.velocity(), 0.0);
    rig.order(Order::Abort(Braking::Full)).unwrap();
    assert_eq!((rig.order(Order::Resume), rig.controller.motion().job()), (Err(Refused::Busy), Job::None));
    assert_eq!(rig.controller.state(), State::OperationEnabled);
}

#[test]
fn hold_brakes_and_keeps_the_torque_and_release_does_not() {
    for (order, stands_after_ms, state) in
        [(Order::Hold, 125, State::QuickStopActive), (Order::Release, 250, State::SwitchOnDisabled)]
    {
        let mut rig = Rig::in_control(Parameters { target_position: 5000, ..Parameters::default() });
        rig.order(Order::Start).unwrap();
        rig.pass_ms(1000);
        rig.order(order).unwrap();
        rig.pass_ms(stands_after_ms - 1);
        assert!(rig.velocity() > 0.0, "{order:?}");
        rig.pass_ms(1);
        assert_eq!((rig.velocity(), rig.controller.state()), (0.0, state));
        assert_eq!(rig.order(Order::Start), Err(Refused::NotEnabled));
        assert_eq!(rig.order(Order::Enable), Ok(()));
    }
}

#[test]
fn what_cannot_be_started_says_why() {
    let within = Parameters { limits: [-1000, 1000], ..Parameters::default() };
    let check = |parameters: Parameters, world: fn(&mut Inputs), order, reason| {
        let mut rig = Rig::in_control(parameters);
        rig.world(world);
        assert_eq!(rig.order(order), Err(reason), "{order:?}");
        assert!(!rig.controller.motion().is_moving(rig.now));
    };
    let well = |_: &mut Inputs| {};
    let beyond = Parameters { target_position: 1001, ..within };
    let velocity = Parameters { mode: Mode::Velocity, ..within };
    let outside = Parameters { limits: [1, 2], target_position: 2, ..within };
    check(beyond, well, Order::Start, Refused::Target);
    check(outside, well, Order::Start, Refused::Limit(Direction::Negative));
    check(outside, well, Order::Inch(Direction::Negative), Refused::Limit(Direction::Negative));
    check(Parameters { delta_inch: -5, ..outside }, well, Order::Step, Refused::Limit(Direction::Negative));
    check(velocity, well, Order::Step, Refused::Mode);
    check(within, |inputs| inputs.output_stage_supply_100mv = 0, Order::Start, Refused::NoPower);
    check(within, |inputs| inputs.output_stage_supply_100mv = 0, Order::Enable, Refused::NoPower);
    check(within, |inputs| inputs.sensor_fails = true, Order::Enable, Refused::Fault);
    check(within, |inputs| inputs.sensor_fails = true, Order::ResetFault, Refused::Fault);
}

#[test]
fn a_fault_is_reset_when_its_cause_is_gone() {
    let mut rig = Rig::in_control(Parameters::default());
    rig.world(|inputs| inputs.sensor_fails = true);
    rig.world(|inputs| inputs.sensor_fails = false);
    assert_eq!((rig.order(Order::ResetFault), rig.controller.state()), (Ok(()), State::SwitchOnDisabled));
}

#[test]
fn inching_goes_on_until_it_is_stopped() {
    let mut rig = Rig::in_control(Parameters::default());
    rig.order(Order::Inch(Direction::Negative)).unwrap();
    rig.pass_ms(1000);
    assert_eq!(rig.velocity(), -800.0);
    rig.order(Order::StopInching).unwrap();
    rig.pass_ms(125);
    assert_eq!(rig.velocity(), 0.0);
    rig.order(Order::Step).unwrap();
    rig.pass_ms(10);
    rig.order(Order::Interrupt(Braking::Programmed)).unwrap();
    rig.pass_ms(10);
    assert_eq!((rig.velocity(), rig.controller.motion().job()), (0.0, Job::None));
}

#[test]
fn in_velocity_mode_a_start_turns_and_an_interruption_runs_out() {
    let parameters = Parameters { mode: Mode::Velocity, target_velocity: -30, ..Parameters::default() };
    let mut rig = Rig::in_control(parameters);
    rig.order(Order::Start).unwrap();
    rig.pass_ms(250);
    assert_eq!(rig.velocity(), -800.0);
    rig.order(Order::Interrupt(Braking::Programmed)).unwrap();
    rig.pass_ms(249);
    assert!(rig.velocity() < 0.0 && rig.controller.motion().is_active(rig.now));
    rig.pass_ms(1);
    assert_eq!(rig.velocity(), 0.0);
    assert!(!rig.controller.motion().is_active(rig.now));
}
