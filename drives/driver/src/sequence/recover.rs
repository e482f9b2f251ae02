//! Bringing a drive back, without moving it: after a power cut, an emergency stop, a fault, bus-off or a reset.

use lexican_runtime::Duration;

use super::cyclic::prepare_cyclic;
use super::identify::identify;
use super::observe::{cause, is_fault, shown_mode, state};
use super::parameters::{Setting, write_parameters};
use super::power::{disable, reset_fault, start};
use super::setup::set_mode;
use super::standstill::at_rest;
use crate::context::{DriveContext, Seen};
use crate::cyclic::{Axis, AxisSettings};
use crate::error::Error;
use crate::fault::Cause;

/// How a drive is to be recovered.
#[derive(Clone, Debug)]
pub struct Recovery {
    /// How long to wait until the drive answers, and the bus carries frames.
    pub within: Duration,
    /// Whether to reset a fault.
    pub reset_fault: bool,
    /// Parameters to write that the drive does not store by itself.
    pub settings: Vec<Setting>,
    /// The cyclic mode to set the drive up for again, if any.
    pub cyclic: Option<AxisSettings>,
}

impl Recovery {
    /// With no parameters and no cyclic mode, and without a fault reset.
    #[must_use]
    pub const fn within(within: Duration) -> Self {
        Recovery { within, reset_fault: false, settings: Vec::new(), cyclic: None }
    }
}

/// The state of a recovered drive. It is not enabled, and no order is left from before.
#[derive(Clone, Copy, Debug)]
pub struct Recovered {
    /// What the driver had last seen before.
    pub before: Seen,
    /// What the driver sees now.
    pub now: Seen,
    /// The drive has booted since the last recovery. If the boot-up message was lost, this stays false.
    pub restarted: bool,
    /// Whether the position is referenced; `None` for a drive that does not say
    /// ([`Description::referenced`](crate::Description::referenced)).
    pub referenced: Option<bool>,
    /// The fault that was reset, or the present one if the state is FAULT.
    pub fault: Option<Cause>,
    /// The axis, if it has been set up for a cyclic mode.
    pub axis: Option<Axis>,
}

/// Recovers a drive that answers: checks that it is the same kind of drive, resets its fault if asked to, stops and
/// disables it if it was not off, writes parameters, and its mode or the whole set-up of a cyclic mode. It never
/// enables or moves the drive. If a fault stays, it does nothing more.
///
/// The shells wait until the drive answers, and protect it again afterwards.
///
/// Errors: [`Error::Fault`] if a fault cannot be reset.
pub async fn recover(drive: &DriveContext, recovery: &Recovery, before: Seen) -> Result<Recovered, Error> {
    identify(drive).await?;
    start(drive);
    let mut fault = None;
    if is_fault(state(drive).await?) {
        at_rest(drive);
        fault = Some(cause(drive).await?);
        if recovery.reset_fault {
            reset_fault(drive).await?;
        }
    }
    let mut axis = None;
    if !is_fault(state(drive).await?) {
        disable(drive).await?;
        at_rest(drive);
        if !recovery.settings.is_empty() {
            write_parameters(drive, &recovery.settings).await?;
        }
        let mode = before.mode.and_then(|mode| drive.description().mode_of(mode.value.into()));
        match (recovery.cyclic, mode) {
            (Some(settings), _) => axis = Some(prepare_cyclic(drive, settings).await?),
            (None, Some(mode)) => set_mode(drive, mode).await?,
            (None, None) => {}
        }
    }
    let status_word = drive.status().await?;
    let referenced = match drive.description().referenced {
        Some(test) => Some(drive.holds(test, status_word).await?),
        None => None,
    };
    shown_mode(drive).await?;
    drive.position().await?;
    let mut shared = drive.lock();
    let restarted = std::mem::take(&mut shared.booted);
    Ok(Recovered { before, now: shared.seen, restarted, referenced, fault, axis })
}
