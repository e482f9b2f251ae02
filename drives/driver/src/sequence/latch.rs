//! Positions that an input latches (touch probe).

use crate::context::{DriveContext, narrow};
use crate::description::{Latch, Latches, Trigger};
use crate::error::{Capability, Error};

/// Arms a latch, which keeps the position at the next edge. The position that it kept before is lost.
///
/// Errors: [`Error::NotTaken`] if the drive does not clear the position that it kept before.
pub async fn arm_latch(drive: &DriveContext, trigger: Trigger) -> Result<(), Error> {
    let (latches, latch) = find(drive, trigger)?;
    disarm_latch(drive, trigger).await?;
    let until = drive.reacts_by();
    loop {
        let status = drive.get(latches.status).await?;
        if status & latch.valid == 0 {
            break;
        }
        if drive.now() >= until {
            return Err(Error::NotTaken { status_word: status as u16 });
        }
        drive.pass(drive.description().times.status_period).await?;
    }
    let armed = drive.get(latches.control).await?;
    drive.set(latches.control, armed | latch.enable).await
}

/// The position that the latch has kept since it was armed; `None` if no edge has come.
pub async fn latched(drive: &DriveContext, trigger: Trigger) -> Result<Option<i32>, Error> {
    let (latches, latch) = find(drive, trigger)?;
    if drive.get(latches.status).await? & latch.valid == 0 {
        return Ok(None);
    }
    Ok(Some(narrow(drive.get(latch.position).await?)))
}

/// Disarms a latch.
pub async fn disarm_latch(drive: &DriveContext, trigger: Trigger) -> Result<(), Error> {
    let (latches, latch) = find(drive, trigger)?;
    let armed = drive.get(latches.control).await?;
    // Two edges of one input may share an enable bit: the other edge keeps it.
    let others = latches.rows.iter().filter(|other| other.trigger != trigger && armed & other.enable == other.enable);
    let left = others.fold(armed & !latch.enable, |left, other| left | other.enable);
    if left == armed { Ok(()) } else { drive.set(latches.control, left).await }
}

fn find(drive: &DriveContext, trigger: Trigger) -> Result<(Latches, &'static Latch), Error> {
    let latches = drive.need(drive.description().latches, Capability::Latch(trigger))?;
    let latch = latches.rows.iter().find(|latch| latch.trigger == trigger);
    Ok((latches, drive.need(latch, Capability::Latch(trigger))?))
}
