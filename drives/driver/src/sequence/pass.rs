//! Waiting while a drive may be moving.

use lexican_runtime::Duration;
use lexican_runtime::profile::cia402::State;

use super::observe::{cause, is_fault, moves, state_of};
use super::standstill::{at_rest, stand_still, stopped};
use crate::context::{DriveContext, Pause};
use crate::error::Error;

/// Waits for `span`. While the drive may be moving, its status word is checked, and read if the drive sends none. A
/// drive that should have stopped, but could not be reached then, is stopped.
///
/// Errors, only while the drive may be moving: [`Error::Fault`]; [`Error::Sdo`] or [`Error::Link`] if it does not
/// answer any more.
pub async fn pass(drive: &DriveContext, span: Duration) -> Result<(), Error> {
    let until = drive.now() + span;
    if !drive.may_move() {
        return drive.pass(span).await;
    }
    let mut status_word = drive.status().await?;
    loop {
        let state = state_of(status_word)?;
        if is_fault(state) {
            at_rest(drive);
            return Err(Error::Fault(cause(drive).await?));
        }
        let stop = drive.lock().stop;
        if let Some(word) = stop {
            if state == State::OperationEnabled && moves(drive, status_word).await? {
                stand_still(drive, word).await?;
            }
            drive.lock().stop = None;
            // An interrupted travel is not over: it can be resumed.
            if drive.lock().motion.pause() != Some(Pause::Interrupted) {
                stopped(drive);
            }
        }
        if drive.now() >= until {
            return Ok(());
        }
        let next = drive.now() + drive.description().times.status_period;
        status_word = drive.next_status_before(next.min(until)).await?;
    }
}
