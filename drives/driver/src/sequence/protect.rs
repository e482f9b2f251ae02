//! Arming the protection by which a drive notices that its manager is gone.

use lexican_runtime::Duration;
use lexican_runtime::object::{DataType, OutOfRange};

use super::observe::known;
use crate::context::DriveContext;
use crate::description::Number;
use crate::error::{Capability, Error};
use crate::protection::{GUARD_TIME, Protection, Supervision, consumer};

const LIFE_TIME_FACTOR: Number = Number::new(0x100D, 0x00, DataType::Unsigned8);
const CONSUMER_HEARTBEATS: Number = Number::new(0x1016, 0x00, DataType::Unsigned8);
const PRODUCER_HEARTBEAT: Number = Number::new(0x1017, 0x00, DataType::Unsigned16);

/// How many signs of life are sent within the supervision time.
const SIGNS: u8 = 4;

/// Arms the drive's heartbeat consumer (1016h), or else its life guarding (100Ch, 100Dh). From then on, signs of life
/// have to be sent.
///
/// Errors: [`Error::Unsupported`] if the drive has neither, or refuses the values for both.
pub async fn protect(drive: &DriveContext, supervision: Supervision) -> Result<Protection, Error> {
    let Supervision { within, manager } = supervision;
    let within_ms = within.as_micros() / 1000;
    let period = Duration::from_millis(within_ms / u64::from(SIGNS));
    if period.is_zero() || within_ms > u64::from(u16::MAX) {
        return Err(OutOfRange { address: GUARD_TIME.address(), above: !period.is_zero() }.into());
    }
    for (entry, before) in free_consumers(drive, manager.get(), within_ms as i64).await? {
        // Some drives take only 16 bits, which leave no room for a node-ID.
        if known(drive.set(consumer(entry), i64::from(manager.get()) << 16 | within_ms as i64).await)?.is_some() {
            keep(drive, before.map(|before| vec![(consumer(entry), before)]));
            return Ok(Protection::Heartbeat { entry, manager, period, within });
        }
    }
    let guarding = known(drive.get(GUARD_TIME).await)?.zip(known(drive.get(LIFE_TIME_FACTOR).await)?);
    let (guard_time, factor) = drive.need(guarding, Capability::Protection)?;
    // The two exclude each other (CiA 301, 7.2.8.2.1).
    if let Some(heartbeat_ms @ 1..) = known(drive.get(PRODUCER_HEARTBEAT).await)? {
        return Err(Error::HeartbeatExcludesGuarding { heartbeat_ms: heartbeat_ms as u16 });
    }
    let period_ms = (period.as_micros() / 1000) as i64;
    let armed = match known(drive.set(GUARD_TIME, period_ms).await)? {
        Some(()) => known(drive.set(LIFE_TIME_FACTOR, SIGNS.into()).await)?,
        None => None,
    };
    drive.need(armed, Capability::Protection)?;
    let is_ours = (guard_time, factor) == (period_ms, SIGNS.into());
    keep(drive, (!is_ours).then(|| vec![(LIFE_TIME_FACTOR, factor), (GUARD_TIME, guard_time)]));
    Ok(Protection::LifeGuarding { guard_time: period, life_time_factor: SIGNS })
}

/// Disarms what [`protect`] has armed, and restores the objects.
pub async fn unprotect(drive: &DriveContext, protection: Protection) -> Result<(), Error> {
    let disarming = drive.disarming(protection);
    drive.lock().before.clear();
    for (object, value) in disarming {
        drive.set(object, value).await?;
    }
    Ok(())
}

/// Keeps the former values for [`unprotect`], unless they were left by an earlier program of ours that could not disarm
/// the drive.
fn keep(drive: &DriveContext, before: Option<Vec<(Number, i64)>>) {
    if let Some(before) = before {
        drive.lock().before = before;
    }
}

/// The entries of 1016h that may watch this manager, with their values: the one that does so already, or else the
/// unused ones, whose node-ID or time is 0 (CiA 301, 7.5.2.19). An entry that watches another node belongs to the
/// machine.
async fn free_consumers(drive: &DriveContext, manager: u8, within_ms: i64) -> Result<Vec<(u8, Option<i64>)>, Error> {
    let entries = known(drive.get(CONSUMER_HEARTBEATS).await)?.unwrap_or(0).min(127) as u8;
    let mut free = Vec::new();
    for entry in 1..=entries {
        let Some(value) = known(drive.get(consumer(entry)).await)? else { continue };
        let (node, time) = (value >> 16 & 0xFF, value & 0xFFFF);
        if node == i64::from(manager) {
            return Ok(vec![(entry, (time != within_ms).then_some(value))]);
        }
        if node == 0 || time == 0 {
            free.push((entry, Some(value)));
        }
    }
    Ok(free)
}
