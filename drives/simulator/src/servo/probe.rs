//! Touch probes (60B8h to 60BDh).

use super::model::Servo;
use super::objects::*;
use super::parts::Probe;
use crate::storage::Storage;

/// Bits of 60B8h for probe 1; those of probe 2 are 8 bits higher.
const ENABLE: u8 = 1 << 0;
const CONTINUOUS: u8 = 1 << 1;
const INDEX_PULSE: u8 = 1 << 2;
/// The positive and the negative edge.
const EDGES: [u8; 2] = [1 << 4, 1 << 5];

impl Servo {
    /// Stores positions at the edges of the probes' inputs, or at the index pulse.
    pub(super) fn take_probes(&mut self, od: &mut dyn Storage) {
        let Some(functions) = od.raw(PROBE_FUNCTION).map(|word| (word as u16).to_le_bytes()) else { return };
        let shaft = self.shaft(self.now).position;
        let shown = self.shown(shaft, &self.parameters(od));
        let mut status = [0; 2];
        for (number, function) in functions.into_iter().enumerate() {
            let level = self.inputs.probes[number];
            let pulses = self.count_pulses(shaft);
            let Some(probe) = self.probes.get_mut(number) else { continue };
            if function != probe.function {
                *probe = Probe { function, level, pulses, stored: [false; 2] };
            }
            let passed = function & INDEX_PULSE != 0 && probe.pulses != pulses;
            let edge = function & INDEX_PULSE == 0 && probe.level != level;
            (probe.level, probe.pulses) = (level, pulses);
            for (side, bit) in EDGES.into_iter().enumerate() {
                let happened = passed || (edge && level == (side == 0));
                let wanted = function & ENABLE != 0 && function & bit != 0;
                if wanted && happened && (function & CONTINUOUS != 0 || !probe.stored[side]) {
                    probe.stored[side] = true;
                    od.set_raw(PROBED[2 * number + side], shown as i64 as u64);
                }
            }
            let [positive, negative] = probe.stored.map(u8::from);
            status[number] = function & ENABLE | positive << 1 | negative << 2;
        }
        od.set_raw(PROBE_STATUS, u16::from_le_bytes(status).into());
    }

    /// The last index pulse at or below a position, if a probe or something else waits for one.
    pub(super) fn awaited_pulse(&self, position: f64, awaits: bool) -> Option<f64> {
        let waits = |probe: &Probe| probe.function & (ENABLE | INDEX_PULSE) == ENABLE | INDEX_PULSE;
        (awaits || self.probes.iter().any(waits)).then(|| self.count_pulses(position))?
    }

    pub(super) fn count_pulses(&self, position: f64) -> Option<f64> {
        let (first, distance) = self.inputs.machine.index.filter(|(_, distance)| *distance > 0.0)?;
        Some(((position - first) / distance).floor())
    }
}
