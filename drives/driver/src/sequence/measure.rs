//! What the drive measures, and the load that stops it.

use crate::description::Measured;
use crate::desk::Desk;
use crate::error::{Capability, Error};

/// The temperature of the drive, in °C.
///
/// # Errors
///
/// [`Error::Unsupported`]; as [`Desk::read`].
pub async fn temperature(desk: &Desk) -> Result<f64, Error> {
    let measured = desk.need(desk.description().temperature, Capability::Temperature)?;
    measure(desk, measured).await
}

/// The voltage of the drive's battery, in V.
///
/// # Errors
///
/// [`Error::Unsupported`]; as [`Desk::read`].
pub async fn battery_voltage(desk: &Desk) -> Result<f64, Error> {
    let measured = desk.need(desk.description().battery, Capability::Battery)?;
    measure(desk, measured).await
}

/// Whether its load has stopped the drive (torque deactivation).
///
/// # Errors
///
/// [`Error::Unsupported`]; as [`Desk::read`].
pub async fn torque_deactivated(desk: &Desk) -> Result<bool, Error> {
    let torque = desk.need(desk.description().torque_deactivation, Capability::TorqueDeactivation)?;
    Ok(desk.get(torque.state).await? as u32 & torque.active != 0)
}

/// The load in % that stops a travel; `None` when none does.
///
/// # Errors
///
/// [`Error::Unsupported`]; as [`Desk::read`].
pub async fn torque_threshold(desk: &Desk) -> Result<Option<u8>, Error> {
    let torque = desk.need(desk.description().torque_deactivation, Capability::TorqueDeactivation)?;
    let threshold = desk.get(torque.threshold).await?;
    Ok(if threshold == torque.off { None } else { u8::try_from(threshold).ok() })
}

/// Sets the load in % that stops a travel; with `None`, none does.
///
/// # Errors
///
/// [`Error::Unsupported`] or [`Error::OutOfRange`] before anything is sent; as [`Desk::write`].
pub async fn set_torque_threshold(desk: &Desk, percent: Option<u8>) -> Result<(), Error> {
    let torque = desk.need(desk.description().torque_deactivation, Capability::TorqueDeactivation)?;
    desk.set(torque.threshold, percent.map_or(torque.off, i64::from)).await
}

async fn measure(desk: &Desk, measured: Measured) -> Result<f64, Error> {
    Ok(desk.get(measured.object).await? as f64 / f64::from(measured.per_unit))
}
