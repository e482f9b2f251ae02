//! Setting a drive up for a cyclic mode: PDOs, period, a set-point at the actual position, and only then the mode.

use lexican_driver::cyclic::AxisSettings;
use lexican_driver::{Error, Mode};
use lexican_runtime::Duration;
use lexican_runtime::object::Direction;

use crate::script::Rig;
use crate::servo::{ByPdo, Drive, SHEET, check, enabled};

const SETTINGS: AxisSettings = AxisSettings::new(Mode::CyclicPosition, Duration::from_millis(1), 100);

const MAPPING: &str = "
    > 000#8003
    > 603#2301140103030080    RPDO 2 off
    > 603#2F01140201000000
    > 603#2F01160000000000
    > 603#2301160110004060
    > 603#2301160220007A60
    > 603#2F01160002000000
    > 603#2301140103030000
    > 603#2302180183030080    TPDO 3 off
    > 603#2F02180201000000
    > 603#2F021A0000000000
    > 603#23021A0110004160
    > 603#23021A0220006460
    > 603#2F021A0002000000
    > 603#2302180183030000
    > 603#2FC2600101000000
    > 603#2FC26002FD000000
    > 603#23061000E8030000
";

const MODE: &str = "
    > 603#237A6000A08C0000    where it stands
    > 603#237A6000A08C0000
    > 603#2F60600008000000
    = 6061:00 08
    > 000#0103
";

#[test]
fn the_set_point_is_where_the_drive_stands_before_the_mode_is_entered() {
    let script = format!("= 6064:00 00008CA0 {MAPPING} {MODE}");
    let axis = check(&script, |drive| drive.prepare_cyclic(SETTINGS)).unwrap();
    assert_eq!((axis.position(), axis.rpdo().raw(), axis.tpdo().raw()), (36_000, 0x303, 0x383));
}

#[test]
fn a_drive_that_is_enabled_is_disabled_first() {
    let script = format!(
        "= 6064:00 00008CA0
        > 603#2B4060000F010000
        > 603#2B40600000000000
        = 6041:00 0240
        {MAPPING} {MODE}"
    );
    enabled::<crate::servo::BySdo, _>(&script, |drive| drive.prepare_cyclic(SETTINGS)).unwrap();
}

#[test]
fn what_the_drive_does_not_have_is_refused_before_anything_is_sent() {
    let refused = |settings| {
        check("", |drive: &mut Drive<crate::servo::BySdo>| drive.prepare_cyclic(settings)).unwrap_err().to_string()
    };
    let other = |mode| AxisSettings { mode, ..SETTINGS };
    assert_eq!(refused(other(Mode::CyclicVelocity)), "the servo has no cyclic velocity mode in which to follow a path");
    assert_eq!(refused(other(Mode::Positioning)), "the servo has no positioning mode in which to follow a path");
    let period = Duration::from_micros(1_234_567);
    assert_eq!(
        refused(AxisSettings { period, ..SETTINGS }),
        "60C2:01: the value is above the limits of the data sheet"
    );
    assert_eq!(
        refused(AxisSettings { rpdo: 0, ..SETTINGS }),
        "1400:01: the value is below the limits of the data sheet"
    );
}

#[test]
fn a_pdo_that_carries_orders_is_not_mapped_anew() {
    let settings = AxisSettings { rpdo: 1, ..SETTINGS };
    let error = Rig::<ByPdo>::new(SHEET).check("", |drive| drive.prepare_cyclic(settings)).unwrap_err();
    assert!(matches!(error, Error::PdoInUse { direction: Direction::Receive, number: 1 }), "{error}");
}

#[test]
fn a_drive_in_fault_is_not_set_up() {
    let error = check("= 6041:00 0218", |drive| drive.prepare_cyclic(SETTINGS)).unwrap_err();
    assert!(matches!(error, Error::Fault(_)), "{error}");
}
