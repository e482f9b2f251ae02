//! The faults of table 2 and the emergency codes of table 20, as one table.

pub use lexican_driver::Cause;
use lexican_driver::{ByteOrder, Code, Codes};
use siko::fault::{ERROR_PASSIVE, RECOVERED_FROM_BUS_OFF};
pub use siko::fault::{Fault, FaultKind, register};

siko::faults! {
    FAULTS[10];
    UNDERVOLTAGE = Undervoltage, "A", 1, 0x3120, VOLTAGE, "supply voltage too low";
    SHAFT_BLOCKED = ShaftBlocked, "B", 2, 0x7121, SHAFT_BLOCKED, "drive shaft blocked";
    OVERCURRENT = Overcurrent, "C", 3, 0x2100, CURRENT, "motor current too high";
    OVERTEMPERATURE = Overtemperature, "D", 4, 0x4310, TEMPERATURE, "output stage too hot";
    SENSOR = Sensor, "E", 5, 0x7300, MANUFACTURER, "position sensor: sine/cosine monitoring";
    INTERNAL = Internal, "F", 6, 0xFF01, MANUFACTURER, "internal error";
    OVERVOLTAGE = Overvoltage, "G", 7, 0x3210, VOLTAGE, "intermediate circuit voltage too high";
    BUS_PASSIVE = BusPassive, "H", 8, 0xFF02, COMMUNICATION, "CAN controller error passive during a positioning";
    BUS_OFF = BusOff, "I", 9, 0xFF03, COMMUNICATION, "CAN controller bus off";
    BATTERY = Battery, "J", 10, 0xFF09, VOLTAGE, "battery voltage below 2.2 V";
}

/// The emergency codes, for the driver.
pub const CODES: Codes = Codes {
    faults: &Fault::codes(FAULTS),
    notices: &[
        Code { number: ERROR_PASSIVE, label: "", text: "CAN controller error passive" },
        Code { number: RECOVERED_FROM_BUS_OFF, label: "", text: "recovered from bus off" },
    ],
    order: ByteOrder::Either,
};

/// The meaning of an emergency code, or of an entry of 1003h, in either byte order.
#[must_use]
pub fn cause_of(code: u16) -> Cause {
    CODES.cause(code)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_is_understood_in_both_orders() {
        for fault in FAULTS {
            for cause in [cause_of(fault.code.number), cause_of(fault.code.number.swap_bytes())] {
                assert_eq!(cause, Cause::from(*fault));
                assert_eq!(cause.to_string(), fault.to_string());
            }
        }
        assert_eq!(cause_of(0x2081).to_string(), "CAN controller error passive");
        assert_eq!(cause_of(0x4081).to_string(), "recovered from bus off");
        assert_eq!(cause_of(0x1234), Cause::Unknown(0x1234));
        assert_eq!(SHAFT_BLOCKED.to_string(), "B (7121): drive shaft blocked");
    }
}
