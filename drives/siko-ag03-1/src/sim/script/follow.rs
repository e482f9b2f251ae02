//! How a drive follows its script.

use lexican_runtime::Instant;

use super::{Change, Script, Step, Trigger};
use crate::sim::SimulatedDrive;
use crate::sim::inputs::Inputs;

/// A script, and how far it is.
#[derive(Clone, Debug)]
pub(in crate::sim) struct Following {
    script: Script,
    /// How many steps have happened.
    done: usize,
    began: Instant,
    /// When the last step happened.
    last: Instant,
    /// Since when the condition of the next step has been seen to hold.
    held_since: Option<Instant>,
}

impl Following {
    pub(in crate::sim) fn new(now: Instant, script: Script) -> Self {
        Following { script, done: 0, began: now, last: now, held_since: None }
    }

    pub(in crate::sim) fn left(&self) -> usize {
        self.script.steps().len() - self.done
    }

    fn next(&self) -> Option<&Step> {
        self.script.steps().get(self.done)
    }
}

impl SimulatedDrive {
    /// Makes every step happen whose time has come.
    pub(in crate::sim) fn run_script(&mut self, now: Instant) {
        while let Some(mut following) = self.following.take() {
            let Some(Step { trigger, changes }) = following.next().cloned() else { return };
            let due = match trigger {
                Trigger::At(span) => Some(following.began + span),
                Trigger::After(span) => Some(following.last + span),
                Trigger::When { condition, and_then } => {
                    if following.held_since.is_none() && condition.holds(self, now) {
                        following.held_since = Some(now);
                    }
                    following.held_since.map(|since| since + and_then)
                }
            };
            let happens = due.is_some_and(|due| due <= now);
            if happens {
                following.done += 1;
                following.last = now;
                following.held_since = None;
            }
            self.following = Some(following);
            if !happens {
                return;
            }
            changes.into_iter().for_each(|change| self.apply(now, change));
        }
    }

    /// When to look again whether the next step's time has come.
    pub(in crate::sim) fn next_step(&self) -> Option<Instant> {
        let following = self.following.as_ref()?;
        match following.next()?.trigger {
            Trigger::At(span) => Some(following.began + span),
            Trigger::After(span) => Some(following.last + span),
            Trigger::When { condition, and_then } => match following.held_since {
                Some(since) => Some(since + and_then),
                None if condition.holds(self, self.settled) => Some(self.settled),
                None => condition.next(self, self.settled),
            },
        }
    }

    /// Lets one thing happen to the drive.
    pub fn apply(&mut self, now: Instant, change: Change) {
        match change {
            Change::OutputStageSupply(supply) => {
                self.set_inputs(now, |inputs| inputs.output_stage_supply_100mv = supply);
            }
            Change::ControlSupply(supply) => self.set_inputs(now, |inputs| inputs.control_supply_100mv = supply),
            Change::Battery(voltage) => self.set_inputs(now, |inputs| inputs.battery_10mv = voltage),
            Change::Temperature(degrees) => self.set_inputs(now, |inputs| inputs.temperature_100mdegc = degrees),
            Change::Load(current) => self.set_inputs(now, |inputs| inputs.load_ma = current),
            Change::Attainable(rpm) => self.set_inputs(now, |inputs| inputs.attainable_rpm = rpm),
            Change::Shaft(shaft) => self.set_inputs(now, |inputs| inputs.shaft = shaft),
            Change::Turn(increments) => {
                // A motor that holds the shaft is not turned: that is the point of holding it.
                let _ = self.turn_shaft(now, increments);
            }
            Change::Bus(state) => self.set_inputs(now, |inputs| inputs.bus = state),
            Change::BusBitRate(rate) => self.set_inputs(now, |inputs| inputs.bus_bit_rate = rate),
            Change::Key(key) => self.set_inputs(now, |inputs| inputs.key = key),
            Change::Fault(fault) => self.set_inputs(now, |inputs| inputs.force(fault)),
            Change::Clear(fault) => self.set_inputs(now, |inputs| inputs.clear(fault)),
            Change::ClearAll => self.set_inputs(now, |inputs| *inputs = Inputs::default()),
            Change::Switches(switches) => self.set_switches(switches),
            Change::Node(node) => self.set_switches(self.switches().with_node(node)),
            Change::Restore(which) => self.set_switches(self.switches().with_restore(which)),
            Change::Termination(active) => self.set_switches(self.switches().with_termination(active)),
            Change::Power(true) => self.switch_on(now),
            Change::Power(false) => self.switch_off(now),
            Change::PowerCycle => self.power_cycle(now),
        }
    }
}
