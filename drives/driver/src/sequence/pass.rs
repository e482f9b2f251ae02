//! Letting time pass, and watching over what moves meanwhile.

use lexican_runtime::Duration;
use lexican_runtime::profile::cia402::State;

use super::observe::{cause, is_fault, moves, state_of};
use super::rest::{at_rest, stand_still, stopped};
use crate::desk::{Desk, Pause};
use crate::error::Error;

/// Lets time pass. While the drive may be moving, its status word is looked at meanwhile, and read if the drive sends none:
/// a drive that has failed to stop, and could not be reached then, is stopped.
///
/// # Errors
///
/// [`Error::Restarted`]. While the drive may be moving: [`Error::Fault`]; [`Error::Sdo`] or [`Error::Link`] if it does
/// not answer any more.
pub async fn pass(desk: &Desk, span: Duration) -> Result<(), Error> {
    let until = desk.now() + span;
    if !desk.may_move() {
        return desk.pass(span).await;
    }
    let mut status_word = desk.status().await?;
    loop {
        let state = state_of(status_word)?;
        if is_fault(state) {
            at_rest(desk);
            return Err(Error::Fault(cause(desk).await?));
        }
        let stop = desk.lock().stop;
        if let Some(word) = stop {
            if state == State::OperationEnabled && moves(desk, status_word).await? {
                stand_still(desk, word).await?;
            }
            desk.lock().stop = None;
            // A travel that is interrupted goes on when it is resumed.
            if desk.lock().motion.pause() != Some(Pause::Interrupted) {
                stopped(desk);
            }
        }
        if desk.now() >= until {
            return Ok(());
        }
        let next = desk.now() + desk.description().times.status_period;
        status_word = desk.next_status_before(next.min(until)).await?;
    }
}
