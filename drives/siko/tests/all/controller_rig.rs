//! A controller without a bus, and what happens to it.
#![allow(dead_code, reason = "not every test needs all of it")]

use lexican_runtime::{Duration, Instant};
use siko_ag03_1::sim::MODEL;
use siko_ag03_1::sim::controller::{Controller, Network};
use siko_ag03_1::sim::inputs::Inputs;
use siko_ag03_1::sim::parameters::Parameters;
use siko_ag03_1::state::State;

/// A controller and the time it is.
pub(crate) struct Rig {
    pub(crate) controller: Controller,
    pub(crate) now: Instant,
    pub(crate) parameters: Parameters,
    pub(crate) inputs: Inputs,
}

impl Rig {
    pub(crate) fn new(parameters: Parameters) -> Self {
        let (now, inputs) = (Instant::ZERO, Inputs::default());
        Rig { controller: Controller::new(&MODEL, now, parameters, inputs, 0), now, parameters, inputs }
    }

    /// In OPERATION ENABLED, by the control words of the examples.
    pub(crate) fn enabled(parameters: Parameters) -> Self {
        let mut rig = Rig::new(parameters);
        rig.controller.set_network(rig.now, Network::Operational);
        for word in [0x0106, 0x0107, 0x010F] {
            rig.control(word);
        }
        assert_eq!(rig.controller.state(), State::OperationEnabled);
        rig
    }

    pub(crate) fn control(&mut self, word: u16) {
        self.controller.control(self.now, word);
    }

    pub(crate) fn set(&mut self, change: impl FnOnce(&mut Parameters)) {
        change(&mut self.parameters);
        self.controller.set_parameters(self.now, self.parameters);
    }

    pub(crate) fn world(&mut self, change: impl FnOnce(&mut Inputs)) {
        change(&mut self.inputs);
        self.controller.set_inputs(self.now, self.inputs);
    }

    pub(crate) fn travel_to(&mut self, target: i32) {
        self.set(|parameters| parameters.target_position = target);
        self.control(0x001F);
    }

    pub(crate) fn pass_ms(&mut self, ms: u64) {
        let until = self.now + Duration::from_millis(ms);
        while let Some(at) = self.controller.next_change(self.now).filter(|at| *at <= until) {
            self.now = at;
            self.controller.advance(at);
        }
        self.now = until;
        self.controller.advance(until);
    }

    /// The mask of bits in the status word as a pattern of the flow charts: 1, 0 and x.
    #[track_caller]
    pub(crate) fn shows(&self, pattern: &str) {
        check_pattern(self.controller.status_word(self.now), pattern);
    }

    #[track_caller]
    pub(crate) fn system_shows(&self, pattern: &str) {
        check_pattern(self.controller.system_status(self.now), pattern);
    }

    pub(crate) fn has(&self, bit: u16) -> bool {
        self.controller.status_word(self.now) & bit != 0
    }

    pub(crate) fn codes(&mut self) -> Vec<u16> {
        std::iter::from_fn(|| self.controller.next_emergency()).map(|emergency| emergency.code).collect()
    }
}

#[track_caller]
fn check_pattern(word: u16, pattern: &str) {
    let digits: Vec<char> = pattern.chars().filter(|digit| !digit.is_whitespace()).collect();
    assert_eq!(digits.len(), 16);
    for (bit, digit) in digits.iter().rev().enumerate() {
        let value = if word >> bit & 1 == 1 { '1' } else { '0' };
        assert!(*digit == 'x' || *digit == value, "bit {bit} of {word:016b} is not as in {pattern}");
    }
}
