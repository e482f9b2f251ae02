//! Parameters through the blocking shell, by the handles that the data sheet's overlay makes.

use lexican_driver::Direction;
use siko_ag02::od::serial::{self, TABLE};
use siko_ag02::od::{InchingStop, OperatingMode, Position, PositioningType, SenseOfRotation, Velocity};
use siko_serial::sim::{SerialDrive, VirtualLine};
use siko_serial::{Connection, Error, Settings, parameter};

fn connection() -> Connection<VirtualLine> {
    Connection::new(VirtualLine::new(SerialDrive::default()), Settings::default())
}

#[test]
fn parameters_have_the_types_of_their_objects() -> Result<(), Error> {
    let mut drive = connection();
    drive.write(serial::UPPER_LIMIT, Position(250_000))?;
    drive.write(serial::LOWER_LIMIT, Position(-250_000))?;
    drive.write(serial::DELTA_JOG, Position(-800))?;
    assert_eq!(drive.read(serial::UPPER_LIMIT)?, Position(250_000));
    assert_eq!(drive.read(serial::LOWER_LIMIT)?, Position(-250_000));
    assert_eq!(Direction::of(drive.read(serial::DELTA_JOG)?.0.into()), Direction::Negative);
    for pos_type in [PositioningType::LOOP_PLUS, PositioningType::DIRECT, PositioningType::LOOP_MINUS] {
        drive.write(serial::POS_TYPE, pos_type)?;
        assert_eq!(drive.read(serial::POS_TYPE)?, pos_type);
    }
    drive.write(serial::SENSE_OF_ROTATION, SenseOfRotation::E)?;
    drive.write(serial::STOP_MODE_INCHING_MODE_2, InchingStop::PROGRAMMED_DECELERATION)?;
    assert_eq!(drive.read(serial::SENSE_OF_ROTATION)?, SenseOfRotation::E);
    Ok(())
}

#[test]
fn a_setpoint_is_a_position_or_a_velocity_by_the_operating_mode() -> Result<(), Error> {
    let mut drive = connection();
    drive.write(serial::TARGET_POSITION, Position(5000))?;
    assert!(matches!(drive.write(serial::TARGET_VELOCITY, Velocity(10)), Err(Error::Elsewhere(_))));
    // 0 and 1 here, 1 and 2 in 6060h.
    drive.write(serial::OPERATING_MODE, OperatingMode::PROFILE_VELOCITY)?;
    assert_eq!(drive.read(serial::OPERATING_MODE)?, OperatingMode::PROFILE_VELOCITY);
    drive.write(serial::TARGET_VELOCITY, Velocity(10))?;
    assert_eq!(drive.read(serial::TARGET_VELOCITY)?, Velocity(10));
    assert!(matches!(drive.read(serial::TARGET_POSITION), Err(Error::Elsewhere("Target Position"))));
    Ok(())
}

#[test]
fn nothing_is_sent_of_a_value_out_of_range() {
    let mut drive = connection();
    for outcome in [
        drive.write(serial::DELTA_JOG, Position(1_000_001)),
        drive.write(serial::OPERATING_MODE, OperatingMode(3)),
        drive.write(serial::STOP_MODE_INCHING_MODE_2, InchingStop(2)),
    ] {
        assert!(matches!(outcome, Err(Error::NoNumber(_))), "{outcome:?}");
    }
}

#[test]
fn every_row_has_commands_that_the_drive_carries_out() {
    for row in TABLE {
        let mut drive = connection();
        if row.when.is_some_and(|when| !when.holds(1)) {
            drive.write(serial::OPERATING_MODE, OperatingMode::PROFILE_VELOCITY).unwrap();
        }
        let number = match parameter::reading(row) {
            Some(command) => parameter::answered(row, drive.request(command).unwrap()).unwrap(),
            None => row.codes[0].0,
        };
        assert_eq!(parameter::reading(row).is_some(), row.access.is_readable(), "{row:?}");
        assert!(row.in_object(number).is_some(), "{row:?}");
        let command = parameter::writing(row, number).unwrap_or_else(|| panic!("{row:?}"));
        drive.request(command).unwrap_or_else(|error| panic!("{row:?}: {error}"));
    }
}
