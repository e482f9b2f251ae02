//! Velocity and ramps of profile position mode.

use lexican_driver::{Capability, DriveContext, Error};

/// Sets the given ones of velocity (6081h) and ramps (6083h, 6084h) for motions to a target. They stay until the drive
/// restarts or they are set again. Errors: [`Error::Unsupported`] if the description lacks these objects.
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
