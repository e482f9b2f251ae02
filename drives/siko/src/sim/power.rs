//! Supply: switching on and off, resets, and the data kept across them (2.4, 2.5, 7.2.2.2, 7.13).

use lexican_runtime::{Instant, NodeId};

use super::address;
use super::drive::{Power, SimulatedDrive};
use super::objects;
use super::setup::{BIT_RATES, Setup};
use crate::model::Addressing;

impl SimulatedDrive {
    /// Whether the drive is supplied, and not switched off.
    #[must_use]
    pub fn is_on(&self) -> bool {
        self.power != Power::Off
    }

    /// Switches the supply off: a moving shaft coasts (2.5).
    pub fn switch_off(&mut self, now: Instant) {
        self.switched_off = true;
        self.follow_supply(now);
        self.settle(now);
    }

    /// Switches the supply on: the drive reads its switches and boots.
    pub fn switch_on(&mut self, now: Instant) {
        self.switched_off = false;
        self.follow_supply(now);
        self.settle(now);
    }

    /// Switches the supply off and on again.
    pub fn power_cycle(&mut self, now: Instant) {
        self.switch_off(now);
        self.switch_on(now);
    }

    /// Whether it operates, and does not only wait for its next power-on.
    pub(super) fn is_running(&self) -> bool {
        self.power == Power::On
    }

    pub(super) fn follow_supply(&mut self, now: Instant) {
        let supplied = !self.switched_off && self.inputs().control_is_supplied();
        match (self.is_on(), supplied) {
            (false, true) => self.begin(now),
            (true, false) => {
                // Emergencies that are not reported yet are lost.
                self.controller = self.controller.restarted(now, *self.inputs());
                self.power = Power::Off;
            }
            _ => {}
        }
    }

    fn begin(&mut self, now: Instant) {
        let has_switches = self.setup.model.addressing == Addressing::Switches;
        if let Some(which) = self.setup.switches.restore().filter(|_| has_switches) {
            objects::restore(self.setup.model, self.device.node(), &mut *self.storage, which);
            self.power = Power::Restored;
            return;
        }
        self.power = Power::On;
        self.initialise(now, self.setup.switches.node());
    }

    /// NMT INITIALISATION, entered at power-on and by both resets (7.2.2.2).
    pub(super) fn initialise(&mut self, now: Instant, switched: NodeId) {
        let kept = Setup { non_volatile: self.non_volatile(now), ..self.setup.clone() };
        let node = if self.setup.model.addressing == Addressing::Object { kept.node() } else { switched };
        self.storage = kept.storage(node);
        self.parameters_written = true;
        self.controller = self.controller.restarted(now, *self.inputs());
        let rate = self.storage.raw(address::BIT_RATE).and_then(|rate| BIT_RATES.get(rate as usize));
        self.bit_rate = rate.copied().unwrap_or(0);
        self.with_device(now, |device, od| device.restart_as(node, now, od));
    }

    /// Writes the EEPROM file, if there is one and its content has changed.
    pub(super) fn save(&mut self, now: Instant) {
        let Some(mut file) = self.eeprom.take() else { return };
        let mut kept = self.non_volatile(now);
        // The encoder always knows the position, but a file cannot be written at every increment.
        if self.controller.motion().is_moving(now)
            && let Some(saved) = file.saved()
        {
            kept.position = saved.position;
        }
        // `eeprom_trouble` reports the error.
        let _ = file.save(&kept, |kept| kept.to_text(self.setup.model));
        self.eeprom = Some(file);
    }

    /// When [`SimulatedDrive::save`] will have a new position to write.
    pub(super) fn next_save(&self) -> Option<Instant> {
        self.eeprom.as_ref()?;
        self.controller.motion().rest_at().filter(|at| *at > self.settled)
    }
}
