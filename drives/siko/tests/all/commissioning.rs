//! What is set up and measured, through both shells: approach, calibration, parameters, torque deactivation,
//! temperature, battery, emergencies.

use lexican_runtime::service::sdo_client::SdoError;
use siko_ag03_1::driver::{Approach, Error, Mode};
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

mod over_tokio {
    use std::sync::{Arc, Mutex};

    use lexican_runtime::host::VirtualBus;
    use lexican_runtime::host::tokio::Network;
    use siko_ag03_1::driver::Outcome;
    use siko_ag03_1::driver::tokio::Drive;
    use siko_ag03_1::parameter::{PARAMETERS, ParameterSet};
    use siko_ag03_1::sim::SimulatedDrive;

    use super::*;

    async fn connected() -> (VirtualBus, Arc<Mutex<SimulatedDrive>>, Drive) {
        let Rig { bus, simulated, .. } = Rig::new();
        let drive = Drive::connect_unprotected(Network::spawn(bus.link()).unwrap(), NODE).await.unwrap();
        (bus, simulated, drive)
    }

    #[tokio::test]
    async fn parameters_are_read_compared_written_and_restored() {
        let (_, _, mut drive) = connected().await;
        let factory = drive.read_parameters().await.unwrap();
        assert_eq!(factory.len(), PARAMETERS.len());
        drive.write(od::MOTOR_PARAMETER_SET.a_pos(), od::Acceleration(75)).await.unwrap();
        drive.write(od::LOOP_LENGTH, od::LoopLength(5)).await.unwrap();
        assert_eq!(drive.compare_parameters(&factory).await.unwrap().len(), 2);
        drive.restore(Some(ParameterSet::Controller)).await.unwrap();
        drive.write_parameters(&factory).await.unwrap();
        assert_eq!(drive.compare_parameters(&factory).await.unwrap(), []);
    }

    #[tokio::test]
    async fn what_the_drive_is_and_measures_is_told() {
        let (bus, simulated, mut drive) = connected().await;
        simulated.lock().unwrap().set_inputs(bus.now(), |inputs| inputs.battery_10mv = 312);
        assert_eq!(drive.battery_voltage().await.unwrap(), 3.12);
        assert!(drive.temperature().await.unwrap() > 0.0);
        drive.calibrate(2500).await.unwrap();
        assert_eq!(drive.position().await.unwrap(), 2500);
        drive.write(od::SPINDLE_PITCH, od::SpindlePitch(200)).await.unwrap();
        assert_eq!(drive.units().await.unwrap().millimetres(1000), Some(10.0));
        drive.set_torque_threshold(Some(50)).await.unwrap();
        assert_eq!(drive.torque_threshold().await.unwrap(), Some(50));
        assert!(matches!(drive.store().await, Err(Error::Unsupported { .. })));
    }

    #[tokio::test]
    async fn an_operation_can_be_a_task_of_its_own() {
        let (_, _, mut drive) = connected().await;
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
}
