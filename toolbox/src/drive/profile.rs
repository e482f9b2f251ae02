//! Velocity and ramps of travels.

use lexican_driver::{Capability, DriveContext, Error};

/// Sets the velocity (6081h) and the ramps (6083h, 6084h) of travels, as far as they are named. They stay set until the drive
/// restarts, or another one sets them.
///
/// # Errors
///
/// [`Error::Unsupported`] by a drive whose velocity and ramps are not known; [`Error::OutOfRange`]; as
/// [`DriveContext::write`].
pub async fn set_profile(drive: &DriveContext, velocity: Option<i64>, acceleration: Option<i64>) -> Result<(), Error> {
    if velocity.is_none() && acceleration.is_none() {
        return Ok(());
    }
    let profile = drive.need(drive.description().profile, Capability::Profile)?;
    if let Some(velocity) = velocity {
        drive.set(profile.velocity, velocity).await?;
    }
    if let Some(acceleration) = acceleration {
        drive.set(drive.need(profile.acceleration, Capability::Profile)?, acceleration).await?;
        if let Some(deceleration) = profile.deceleration {
            drive.set(deceleration, acceleration).await?;
        }
    }
    Ok(())
}
