//! A valve's firmware, without its hardware.
#![no_std]

use lexican_runtime::NodeId;

mod od {
    lexican_runtime::include_od!("valve");
}

/// The valve. All its state is in its dictionary.
pub struct Valve {
    od: od::Storage,
}

impl Valve {
    /// The valve as delivered.
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
    use lexican_runtime::object::{Address, ObjectDictionary};

    use super::*;

    #[test]
    fn the_valve_moves_to_the_default_of_its_data_sheet() {
        let mut valve = Valve::new(NodeId::literal(1));
        (0..600).for_each(|_| valve.step());
        assert_eq!(valve.tpdo(), 500_u16.to_le_bytes());
    }

    mod configured {
        lexican_runtime::include_od!("configured");
    }

    #[test]
    fn a_configured_device_starts_with_what_is_configured() {
        let node = NodeId::literal(7);
        let mut od = configured::storage(node);
        assert_eq!(od.get(configured::PRODUCER_HEARTBEAT_TIME), 500);
        assert_eq!(od.get(configured::SPEED), -250);
        assert_eq!(od.get(configured::ONLY_A_DEFAULT), 7);
        assert_eq!(od.get(configured::ONLY_CONFIGURED), 8);
        assert_eq!(od.get(configured::ABSOLUTE_IDENTIFIER), 0x1A5);
        assert_eq!(od.get(configured::IDENTIFIER_WITH_NODE_ID), 0x407);
        assert_eq!(od.get(configured::CONFIGURED_OUT_OF_ITS_TYPE), 1);
        assert_eq!(od.get(configured::GAIN), 2.5);
        let positions = configured::POSITIONS;
        let held: [i32; 3] = core::array::from_fn(|row| od.get(positions.at(row as u8 + 1).expect("there are three")));
        assert_eq!(held, [1000, 2000, 0]);
        holds(&mut od, configured::STATION_NAME.address(), b"Line 4, left");
        holds(&mut od, configured::KEY.address(), &[0xC0, 0xFF, 0xEE]);
        // The handle still has the default of the delivered device.
        assert_eq!(configured::SPEED.default(node), Some(100));
    }

    #[track_caller]
    fn holds(od: &mut configured::Storage, address: Address, expected: &[u8]) {
        let entry = od.entry(address).expect("it is described");
        let mut buffer = [0; 32];
        let len = od.read(&entry, 0, &mut buffer).expect("it can be read");
        assert_eq!(&buffer[..len], expected);
    }
}
