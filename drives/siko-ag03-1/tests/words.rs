//! The bits that all drives of SIKO share agree with this drive's data sheet.

use lexican_runtime::object::{BitField, BitName};
use siko_ag03_1::od;
use siko_ag03_1::words::{control, generic, status, system};

/// Checks that the overlay names the same bits, in similar words.
#[track_caller]
fn check(bits: &[BitName<'_>], named: &[(u64, &str)]) {
    for &(mask, name) in named {
        let bit = bits.iter().find(|bit| 1 << bit.low == mask && bit.width == 1);
        assert_eq!(bit.map(|bit| bit.name), Some(name), "{mask:04X}");
    }
}

#[test]
fn the_overlay_has_the_same_bits() {
    check(
        od::SystemStatus::BITS,
        &[
            (system::IN_POSITION.into(), "in position"),
            (system::MOVING.into(), "moving"),
            (system::ABOVE_UPPER_LIMIT.into(), "above upper limit"),
            (system::BELOW_LOWER_LIMIT.into(), "below lower limit"),
            (system::MOTOR_RELEASED.into(), "motor released"),
            (system::FAULT.into(), "fault"),
            (system::AGAINST_APPROACH.into(), "loop travel"),
            (system::NO_SUPPLY.into(), "output stage without supply"),
            (system::NOT_READY.into(), "not ready to travel"),
            (system::BATTERY_LOW.into(), "battery low"),
            (system::OVERCURRENT.into(), "overcurrent"),
            (system::POSITIONING.into(), "positioning active"),
            (system::LAG_ERROR.into(), "lag error"),
        ],
    );
    check(
        od::Statusword::BITS,
        &[
            (status::VOLTAGE_ENABLED.into(), "voltage enabled"),
            (status::WARNING.into(), "warning"),
            (status::READY.into(), "ready to travel"),
            (status::REMOTE.into(), "remote"),
            (status::TARGET_REACHED.into(), "target reached"),
            (status::INTERNAL_LIMIT.into(), "internal limit"),
            (status::ACKNOWLEDGED.into(), "setpoint acknowledged or standstill"),
            (status::STANDSTILL.into(), "setpoint acknowledged or standstill"),
            (status::POSITIONING.into(), "positioning active"),
            (status::MOVING.into(), "moving"),
        ],
    );
    check(
        od::Controlword::BITS,
        &[
            (control::NEW_SETPOINT.into(), "new setpoint"),
            (control::FAULT_RESET.into(), "fault reset"),
            (control::STOP.into(), "stop"),
            (control::INCHING_1.into(), "inching 1"),
            (control::INCHING_2_POSITIVE.into(), "inching 2 positive"),
            (control::INCHING_2_NEGATIVE.into(), "inching 2 negative"),
        ],
    );
    check(
        od::GenericStatus::BITS,
        &[
            (generic::SUPPLY_PRESENT.into(), "output stage supplied"),
            (generic::TORQUE_DEACTIVATED.into(), "torque deactivation active"),
        ],
    );
}
