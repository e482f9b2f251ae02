//! The faults of table 2 and the emergency codes of table 20.

pub use lexican_driver::Cause;
use lexican_driver::{ByteOrder, Code, Codes};
use siko::fault::ERROR_PASSIVE;
pub use siko::fault::{Fault, FaultKind, register};

siko::faults! {
    FAULTS[6];
    UNDERVOLTAGE = Undervoltage, "A", 1, 0x3120, VOLTAGE, "supply voltage too low";
    SHAFT_BLOCKED = ShaftBlocked, "B", 2, 0x7121, SHAFT_BLOCKED, "shaft blocked";
    OVERCURRENT = Overcurrent, "C", 3, 0x2100, CURRENT, "motor current too high";
    OVERTEMPERATURE = Overtemperature, "D", 4, 0x4310, TEMPERATURE, "output stage too hot";
    SENSOR = Sensor, "E", 5, 0xF000, MANUFACTURER, "absolute position cannot be read";
    BUS_OFF = BusOff, "F", 6, ERROR_PASSIVE, COMMUNICATION, "CAN controller bus off";
}

/// The emergency codes, for the driver.
///
/// Fault F has no code of its own: table 20 names it beside 8120h, which is also sent when the controller becomes error
/// passive, which is not a fault. So the driver takes 8120h for a notice, and sees a fault by the state.
pub const CODES: Codes = Codes {
    faults: {
        let [a, b, c, d, e, _] = Fault::codes(FAULTS);
        &[a, b, c, d, e]
    },
    notices: &[
        Code { number: 0x8001, label: "", text: "bus: acknowledgement missing" },
        Code { number: 0x8002, label: "", text: "bus: form error" },
        Code { number: 0x8003, label: "", text: "bus: CRC error" },
        Code { number: 0x8004, label: "", text: "bus: stuff error" },
        Code { number: ERROR_PASSIVE, label: "", text: "CAN controller error passive, or bus off (fault F)" },
    ],
    // The manual calls byte 0 the high byte, contrary to CiA 301.
    order: ByteOrder::Either,
};

#[cfg(test)]
mod tests {
    use lexican_runtime::object::Enumeration;
    use siko::fault::NO_ERROR;

    use super::*;
    use crate::od::EmergencyCode;

    #[test]
    fn the_codes_are_those_of_the_data_sheet() {
        let faults = CODES.faults.iter().chain(CODES.notices).map(|code| code.number);
        let mut codes: Vec<u16> = faults.chain([NO_ERROR]).collect();
        codes.sort_unstable();
        let listed: Vec<u16> = EmergencyCode::NAMES.iter().map(|name| name.raw as u16).collect();
        assert_eq!(codes, listed);
    }
}
