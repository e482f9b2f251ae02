//! A valve's firmware, without its hardware.
#![no_std]

use lexican_runtime::NodeId;

mod od {
    lexican_runtime::include_od!("valve");
}

/// The valve: all it knows is in its dictionary.
pub struct Valve {
    od: od::Storage,
}

impl Valve {
    /// As it leaves the works.
    pub fn new(node: NodeId) -> Self {
        Valve { od: od::storage(node) }
    }

    /// Moves towards the set point.
    pub fn step(&mut self) {
        let target = self.od.get(od::VALVE_SET_POINT);
        let actual = self.od.get(od::VALVE_ACTUAL_VALUE);
        let next = if actual < target { actual + 1 } else { actual.saturating_sub(u16::from(actual > target)) };
        self.od.set(od::VALVE_ACTUAL_VALUE, next);
    }

    /// The data of its PDO.
    pub fn tpdo(&self) -> [u8; 2] {
        od::Tpdo1 { valve_actual_value: self.od.get(od::VALVE_ACTUAL_VALUE) }.pack()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_valve_moves_to_the_default_of_its_data_sheet() {
        let mut valve = Valve::new(NodeId::literal(1));
        (0..600).for_each(|_| valve.step());
        assert_eq!(valve.tpdo(), 500_u16.to_le_bytes());
    }
}
