//! Travels of several drives that begin together: each drive holds its target, and one SYNC starts them all (CiA 301,
//! 7.2.2.2).

use lexican_runtime::wire::nmt::NmtCommand;

use super::process_data::enter_pre_operational;
use super::travel::{order_travel, target_transmission, waits_for_sync};
use crate::context::DriveContext;
use crate::error::{Error, Missing, Refusal};

/// Transmission types of a receive PDO (CiA 301, 7.5.2.35): wait for SYNC, or take effect at once.
const SYNCHRONOUS: i64 = 0;
const EVENT_DRIVEN: i64 = 255;

/// Switches on or off that the drive holds each target until SYNC, by the transmission type of the PDO that carries
/// targets. It is changed in NMT PRE-OPERATIONAL; afterwards the node is in OPERATIONAL.
///
/// Errors: [`Error::Unsupported`] before anything is sent if the drive does not take a target and its start in one PDO;
/// [`Error::Refused`] while the drive is enabled; [`Error::Sdo`] if the drive does not allow it.
pub async fn set_start_by_sync(drive: &DriveContext, on: bool) -> Result<(), Error> {
    let transmission = target_transmission(drive)?;
    if waits_for_sync(drive).await? != on {
        enter_pre_operational(drive).await?;
        let written = drive.set(transmission, if on { SYNCHRONOUS } else { EVENT_DRIVEN }).await;
        drive.command(NmtCommand::Start);
        written?;
    }
    if !on {
        drive.lock().held = None;
    }
    Ok(())
}

/// Hands the drive a target for which it starts at the next SYNC, to be followed by
/// [`confirm_start`](super::confirm_start). Any other order takes the target back.
///
/// Errors: [`Error::Unsupported`] as [`set_start_by_sync`]; [`Error::Refused`] as
/// [`start_travel`](super::start_travel), and if the drive would start at once.
pub async fn prepare_travel(drive: &DriveContext, target: i32) -> Result<(), Error> {
    target_transmission(drive)?;
    if !waits_for_sync(drive).await? {
        return Err(Error::Refused(Refusal(vec![Missing::StartBySync])));
    }
    order_travel(drive, target).await
}
