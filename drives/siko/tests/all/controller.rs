//! The simulated controller without a bus: what cannot be seen on a bus. `tests/verify` tests everything else.

use lexican_runtime::{Duration, Instant};
use siko_ag03_1::fault::{self, register};
use siko_ag03_1::sim::MODEL;
use siko_ag03_1::sim::controller::{Controller, Emergency, Network};
use siko_ag03_1::sim::inputs::{BusState, Inputs, Shaft};
use siko_ag03_1::sim::motion::{FULL_ACCELERATION, Motion};
use siko_ag03_1::sim::parameters::Parameters;
use siko_ag03_1::state::State;
use siko_ag03_1::words::control;

/// A controller and the present time.
struct Rig {
    controller: Controller,
    now: Instant,
    parameters: Parameters,
    inputs: Inputs,
}

impl Rig {
    fn new(parameters: Parameters) -> Self {
        let (now, inputs) = (Instant::ZERO, Inputs::default());
        Rig { controller: Controller::new(&MODEL, now, parameters, inputs, 0), now, parameters, inputs }
    }

    /// A drive in OPERATION ENABLED, by the control words of the examples.
    fn enabled(parameters: Parameters) -> Self {
        let mut rig = Rig::new(parameters);
        rig.controller.set_network(rig.now, Network::Operational);
        for word in [0x0106, 0x0107, 0x010F] {
            rig.control(word);
        }
        assert_eq!(rig.controller.state(), State::OperationEnabled);
        rig
    }

    fn control(&mut self, word: u16) {
        self.controller.control(self.now, word);
    }

    fn set(&mut self, change: impl FnOnce(&mut Parameters)) {
        change(&mut self.parameters);
        self.controller.set_parameters(self.now, self.parameters);
    }

    fn world(&mut self, change: impl FnOnce(&mut Inputs)) {
        change(&mut self.inputs);
        self.controller.set_inputs(self.now, self.inputs);
    }

    fn travel_to(&mut self, target: i32) {
        self.set(|parameters| parameters.target_position = target);
        self.control(0x001F);
    }

    fn pass_ms(&mut self, ms: u64) {
        let until = self.now + Duration::from_millis(ms);
        while let Some(at) = self.controller.next_change(self.now).filter(|at| *at <= until) {
            self.now = at;
            self.controller.advance(at);
        }
        self.now = until;
        self.controller.advance(until);
    }
}

#[test]
fn a_new_controller_has_the_faults_and_the_load_that_are_there() {
    let now = Instant::ZERO;
    let new = |inputs| Controller::new(&MODEL, now, Parameters::default(), inputs, 0);
    assert_eq!(new(Inputs { internal_error: true, ..Inputs::default() }).faults(), [fault::INTERNAL]);
    let inputs = Inputs { attainable_rpm: Some(20), ..Inputs::default() };
    let mut rig = Rig { controller: new(inputs), now, parameters: Parameters::default(), inputs };
    rig.controller.set_network(now, Network::Operational);
    [0x0106, 0x0107, 0x010F].into_iter().for_each(|word| rig.control(word));
    rig.travel_to(5000);
    rig.pass_ms(1000);
    assert_eq!(rig.controller.velocity(rig.now), 20);
}

#[test]
fn a_new_controller_does_not_run_at_its_target_velocity() {
    let mut rig = Rig::new(Parameters::default());
    rig.set(|parameters| parameters.target_velocity = 30);
    rig.pass_ms(1000);
    assert_eq!(rig.controller.velocity(rig.now), 0);
}

#[test]
fn the_words_change_only_when_announced() {
    // A span that next_change skips must look the same throughout.
    let mut rig = Rig::enabled(Parameters { positioning_type: 2, limits: [-800, 2500], ..Parameters::default() });
    rig.travel_to(2000);
    for _ in 0..50 {
        let words = |rig: &Rig, at| (rig.controller.status_word(at), rig.controller.system_status(at));
        let next = rig.controller.next_change(rig.now);
        let until = next.unwrap_or(rig.now + Duration::from_secs(10));
        let before = words(&rig, rig.now);
        let span = until.since(rig.now).as_micros();
        for part in 0..1000 {
            let at = rig.now + Duration::from_micros(span.saturating_sub(1) * part / 999);
            assert_eq!(words(&rig, at), before, "at {at}, announced for {until}");
        }
        rig.now = until;
        if next.is_none() {
            assert_eq!(rig.controller.position(rig.now), 2000);
            return;
        }
    }
    panic!("the drive does not come to rest");
}

/// Orders that stop or resume a travel have no effect if there is none to stop or resume.
#[test]
fn only_a_travel_under_way_is_interrupted_and_only_once() {
    let ms = |ms| Instant::ZERO + Duration::from_millis(ms);
    let parameters = Parameters { positioning_type: 1, loop_length: 4000, numerator: 5, ..Parameters::default() };
    let mut motion = Motion::at_rest(ms(0), 0.0);
    motion.move_to(ms(0), -1000.0, parameters.positioning(), parameters.by_loop());
    assert_eq!(motion.next_change(ms(1), |_| ()).map(|at| motion.state(at).position), Some(-21_000.0));
    let end = motion.rest_at().unwrap();
    // The turn is over by then.
    let before_the_end = Instant::ZERO + Duration::from_micros(end.as_micros() - 1_000_000);
    motion.resume(before_the_end);
    assert_eq!(motion.rest_at(), Some(end));
    motion.interrupt(before_the_end);
    let stands = motion.rest_at();
    motion.interrupt_braking(before_the_end + Duration::from_millis(1), FULL_ACCELERATION);
    assert_eq!(motion.rest_at(), stands);
    motion.resume(end);
    let end = motion.rest_at().unwrap();
    motion.interrupt(end);
    assert!(!motion.is_interrupted() && motion.state(end).position == -1000.0);
}

#[test]
fn what_is_due_is_said_at_once_and_to_the_millisecond() {
    let mut rig = Rig::enabled(Parameters::default());
    rig.travel_to(9000);
    rig.world(|inputs| inputs.load_ma = 2401);
    let begun = rig.now;
    assert_eq!(rig.controller.next_event(), Some(begun + Duration::from_secs(4)));
    rig.pass_ms(4000);
    assert_eq!(rig.controller.faults(), [fault::OVERCURRENT]);
    let mut rig = Rig::enabled(Parameters::default());
    rig.travel_to(9000);
    rig.pass_ms(1000);
    rig.world(|inputs| inputs.shaft = Shaft::Blocked);
    assert_eq!(rig.controller.next_event(), Some(rig.now + Duration::from_millis(500)));
    rig.controller.set_network(rig.now, Network::PreOperational);
    assert_eq!(rig.controller.next_event(), None);
}

#[test]
fn emergencies_have_the_bits_of_what_they_report() {
    let mut rig = Rig::enabled(Parameters::default());
    rig.world(|inputs| inputs.bus = BusState::Passive);
    let communication = register::GENERAL | register::COMMUNICATION;
    let passive = Emergency { code: 0x8120, register: communication, stored: false };
    assert_eq!(rig.controller.next_emergency(), Some(passive));
    rig.world(|inputs| inputs.bus = BusState::Active);
    rig.world(|inputs| inputs.internal_error = true);
    assert!(rig.controller.next_emergency().is_some_and(|emergency| emergency.stored));
    rig.world(|inputs| inputs.internal_error = false);
    rig.control(control::FAULT_RESET);
    let none = Emergency { code: 0x0000, register: 0, stored: false };
    assert_eq!((rig.controller.next_emergency(), rig.controller.next_emergency()), (Some(none), None));
}

/// Without any time passing; 600 mA are 30 %.
#[test]
fn words_and_parameters_take_effect_at_once() {
    let mut rig = Rig::enabled(Parameters { torque_deactivation: 29, ..Parameters::default() });
    rig.travel_to(5000);
    assert_eq!(rig.controller.torque_deactivation_state(), 1);
    let mut rig = Rig::enabled(Parameters::default());
    rig.travel_to(5000);
    rig.set(|parameters| parameters.torque_deactivation = 20);
    assert_eq!(rig.controller.torque_deactivation_state(), 1);
    rig.controller.set_network(rig.now, Network::PreOperational);
    rig.control(0x0106);
    assert_eq!(rig.controller.state(), State::SwitchOnDisabled, "the bus does not command");
}
