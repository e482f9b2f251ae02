//! Temperature, battery voltage, and the load that stops the drive.

use crate::context::DriveContext;
use crate::description::Measured;
use crate::error::{Capability, Error};

/// The temperature of the drive, in °C.
pub async fn temperature(drive: &DriveContext) -> Result<f64, Error> {
    let measured = drive.need(drive.description().temperature, Capability::Temperature)?;
    measure(drive, measured).await
}

/// The voltage of the drive's battery, in V.
pub async fn battery_voltage(drive: &DriveContext) -> Result<f64, Error> {
    let measured = drive.need(drive.description().battery, Capability::Battery)?;
    measure(drive, measured).await
}

/// Whether its load has stopped the drive (torque deactivation).
pub async fn torque_deactivated(drive: &DriveContext) -> Result<bool, Error> {
    let torque = drive.need(drive.description().torque_deactivation, Capability::TorqueDeactivation)?;
    Ok(drive.get(torque.state).await? as u32 & torque.active != 0)
}

/// The load in % that stops a travel; `None` if none does.
pub async fn torque_threshold(drive: &DriveContext) -> Result<Option<u8>, Error> {
    let torque = drive.need(drive.description().torque_deactivation, Capability::TorqueDeactivation)?;
    let threshold = drive.get(torque.threshold).await?;
    Ok(if threshold == torque.off { None } else { u8::try_from(threshold).ok() })
}

/// Sets the load in % that stops a travel; with `None`, none does.
pub async fn set_torque_threshold(drive: &DriveContext, percent: Option<u8>) -> Result<(), Error> {
    let torque = drive.need(drive.description().torque_deactivation, Capability::TorqueDeactivation)?;
    drive.set(torque.threshold, percent.map_or(torque.off, i64::from)).await
}

async fn measure(drive: &DriveContext, measured: Measured) -> Result<f64, Error> {
    Ok(drive.get(measured.object).await? as f64 / f64::from(measured.per_unit))
}
