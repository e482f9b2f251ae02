//! Set-up and measurements: approach, calibration, parameters, torque deactivation, temperature, battery, emergencies.

use lexican_runtime::host::tokio::Network;
use lexican_runtime::service::sdo_client::SdoError;
use siko_ag03_1::driver::{Approach, Error, Mode, Outcome, tokio as tokio_driver};
use siko_ag03_1::od;

use super::driver::rig::{NODE, Rig};

#[test]
fn temperature_and_battery_are_in_degrees_and_volts() {
    let mut rig = Rig::new();
    rig.world(|inputs| {
        inputs.temperature_100mdegc = -105;
        inputs.battery_10mv = 312;
    });
    assert_eq!((rig.drive.temperature().unwrap(), rig.drive.battery_voltage().unwrap()), (-10.5, 3.12));
}

#[test]
fn every_approach_has_its_number() {
    let Rig { mut drive, .. } = Rig::new();
    for (approach, number) in [
        (Approach::Positive, od::PositioningType::LOOP_PLUS),
        (Approach::Negative, od::PositioningType::LOOP_MINUS),
        (Approach::Direct, od::PositioningType::DIRECT),
    ] {
        drive.set_approach(approach).unwrap();
        assert_eq!((drive.approach().unwrap(), drive.read(od::POS_TYPE).unwrap()), (Some(approach), number));
    }
}

#[test]
fn torque_deactivation_is_switched_on_and_off() {
    let Rig { mut drive, .. } = Rig::new();
    assert_eq!(drive.torque_threshold().unwrap(), None, "off from the factory");
    drive.set_torque_threshold(Some(50)).unwrap();
    assert_eq!((drive.torque_threshold().unwrap(), drive.torque_deactivated().unwrap()), (Some(50), false));
    drive.set_torque_threshold(None).unwrap();
    assert_eq!(drive.read(od::TORQUE_DEACTIVATION).unwrap().0, 125);
    assert!(matches!(drive.set_torque_threshold(Some(19)), Err(Error::OutOfRange(_))));
}

#[test]
fn mode_position_velocity_and_firmware_are_told() {
    let Rig { mut drive, .. } = Rig::new();
    assert_eq!(drive.mode().unwrap(), Some(Mode::Positioning));
    assert_eq!((drive.position().unwrap(), drive.velocity().unwrap()), (0, 0));
    let version = drive.firmware().unwrap();
    assert!(version.len() == 4 && version.contains('.'), "{version}");
}

#[test]
fn there_is_no_command_that_keeps_parameters_since_they_are_kept() {
    let Rig { mut drive, .. } = Rig::new();
    let error = drive.store().unwrap_err();
    assert_eq!(error.to_string(), "the SIKO AG03/1 has no command that keeps parameters");
}

#[test]
fn emergencies_are_switched_by_bit_31_before_the_drive_is_started() {
    let Rig { mut drive, .. } = Rig::new();
    drive.set_emergencies(false).unwrap();
    assert_eq!(drive.read(od::COB_ID_EMERGENCY_MESSAGE).unwrap(), 0x8000_0085);
    drive.set_emergencies(true).unwrap();
    assert_eq!(drive.read(od::COB_ID_EMERGENCY_MESSAGE).unwrap(), 0x85);
    drive.enable().unwrap();
    assert!(matches!(drive.set_emergencies(false), Err(Error::Sdo(SdoError::Aborted { .. }))));
}

#[tokio::test]
async fn an_operation_can_be_a_task_of_its_own() {
    let Rig { bus, .. } = Rig::new();
    let network = Network::spawn(bus.link()).unwrap();
    let mut drive = tokio_driver::Drive::connect_unprotected(network, NODE).await.unwrap();
    let travel = tokio::spawn(async move {
        drive.set_approach(Approach::Positive).await?;
        let factory = drive.read_parameters().await?;
        drive.write_parameters(&factory).await?;
        drive.enable().await?;
        let mut seen = 0;
        let outcome = drive.move_to_watched(500, |_| seen += 1).await?;
        assert!(seen > 1);
        drive.disable().await?;
        Ok::<_, Error>(outcome)
    });
    assert_eq!(travel.await.unwrap().unwrap(), Outcome::Reached { position: 500 });
}
