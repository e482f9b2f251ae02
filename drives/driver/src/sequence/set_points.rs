//! Positioning mode: set-points that follow one another.

use lexican_runtime::Duration;
use lexican_runtime::profile::cia402::State;

use super::observe::state_of;
use super::refusal::{Order, refuse};
use super::travel::{confirm, hand_over};
use crate::context::DriveContext;
use crate::error::{Capability, Error};
use crate::set_point::{SetPoint, Succession};

/// Gives the drive another set-point, also while it travels; returns once the drive has taken it, and waits for room if
/// the drive has none.
///
/// Errors: [`Error::Refused`], also while a travel is interrupted; [`Error::NotTaken`] if the drive gets no room in
/// time, or does not take the set-point, and is then stopped.
pub async fn add_set_point(drive: &DriveContext, set_point: SetPoint, within: Duration) -> Result<(), Error> {
    let SetPoint { target, relative, succession } = set_point;
    let description = drive.description();
    let bits = drive.need(description.set_points, Capability::SetPoints)?;
    let bit = match succession {
        Succession::Stopped => Some(0),
        Succession::Blended => bits.blended,
        Succession::AtOnce => bits.at_once,
    };
    let bit = drive.need(bit, Capability::Succession(succession))?;
    let from_here = drive.need(if relative { bits.relative } else { Some(0) }, Capability::RelativeSetPoints)?;
    let order = Order::Add { target: (!relative).then_some(target) };
    description.objects.target_position.check(target.into())?;
    refuse(drive, order).await?;
    drive.control(description.moving()).await?;
    wait_for_room(drive, order, within).await?;
    hand_over(drive, order, bit | from_here, target).await?;
    confirm(drive, order).await
}

/// Waits until the previous set-point's acknowledgement is cleared: from then on the drive takes another set-point.
async fn wait_for_room(drive: &DriveContext, order: Order, within: Duration) -> Result<(), Error> {
    let until = drive.now() + within;
    let mut status_word = drive.status().await?;
    loop {
        // Outside OPERATION ENABLED the control word of a set-point would enable the drive.
        if state_of(status_word)? != State::OperationEnabled {
            refuse(drive, order).await?;
        } else if status_word & drive.description().status.acknowledged == 0 {
            return Ok(());
        }
        if drive.now() >= until {
            return Err(Error::NotTaken { status_word });
        }
        status_word = drive.next_status().await?;
    }
}
