//! Torque mode.

use super::refusal::{Order, refuse};
use crate::context::{DriveContext, Motion};
use crate::error::{Capability, Error};
use crate::mode::Mode;

/// Turns with a torque, in 1/1000 of the rated torque; returns once the drive has taken the order.
pub async fn apply_torque(drive: &DriveContext, torque: i16) -> Result<(), Error> {
    refuse(drive, Order::Turn).await?;
    let description = drive.description();
    let torques = drive.need(description.torque, Capability::Mode(Mode::Torque))?;
    torques.target.check(torque.into())?;
    if drive.lock().motion != Motion::Running {
        // Turning begins with a falling edge of Stop; until the new torque is written, Stop holds the drive.
        drive.control(description.stopping()).await?;
    }
    drive.lock().order(Motion::Running);
    drive.unsettle();
    drive.set(torques.target, torque.into()).await?;
    drive.control(description.moving()).await
}

/// The actual torque, in 1/1000 of the rated torque.
pub async fn torque(drive: &DriveContext) -> Result<i16, Error> {
    let torques = drive.need(drive.description().torque, Capability::Mode(Mode::Torque))?;
    let torque = drive.get(torques.actual).await?;
    Ok(torque.clamp(i16::MIN.into(), i16::MAX.into()) as i16)
}
