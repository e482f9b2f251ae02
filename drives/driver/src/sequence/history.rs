//! Past faults, and warnings.

use super::observe::{fault_count, fault_history};
use crate::context::DriveContext;
use crate::error::Error;
use crate::fault::Cause;

/// Clears the history (CiA 301, 7.5.2.4).
pub async fn clear_fault_history(drive: &DriveContext) -> Result<(), Error> {
    drive.set(fault_count(drive), 0).await
}

/// The present warning; `None` if there is none. [`Cause::NoError`] if the drive does not say what it warns of.
pub async fn warning(drive: &DriveContext) -> Result<Option<Cause>, Error> {
    let warns = drive.status().await? & drive.description().status.warning != 0;
    if !warns {
        return Ok(None);
    }
    let heard = drive.lock().warning.map(|code| drive.description().codes.cause(code));
    if heard.is_some() {
        return Ok(heard);
    }
    let mut history = fault_history(drive).await?.into_iter();
    Ok(Some(history.find(|cause| matches!(cause, Cause::Notice(_))).unwrap_or(Cause::NoError)))
}
