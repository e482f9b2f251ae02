//! What is set up once: operating mode, calibration, approach, emergencies, units.

use lexican_runtime::object::DataType;
use lexican_runtime::profile::cia402::State;

use super::identify::characters;
use super::observe::{cause, is_fault, shown_mode, state_of};
use super::refusal::require_rest;
use super::standstill::hold_still;
use crate::context::DriveContext;
use crate::description::{Approach, Calibration, Homing, Number};
use crate::error::{Capability, Error, Missing, Refusal};
use crate::mode::Mode;
use crate::units::Units;

const SOFTWARE_VERSION: Number = Number::new(0x100A, 0x00, DataType::Unsigned32);

/// The version of the drive's firmware (100Ah): four characters, such as "1.00".
///
/// # Errors
///
/// As [`DriveContext::read`].
pub async fn firmware(drive: &DriveContext) -> Result<String, Error> {
    characters(drive, SOFTWARE_VERSION, drive.description().identity.characters).await
}

/// Changes the operating mode, unless it is set already.
///
/// # Errors
///
/// [`Error::Unsupported`] before anything is sent; [`Error::Refused`] while a travel is under way;
/// [`Error::ModeNotTaken`].
pub async fn set_mode(drive: &DriveContext, mode: Mode) -> Result<(), Error> {
    let code = drive.need(drive.description().code_of(mode), Capability::Mode(mode))?;
    if shown_mode(drive).await? == code.into() {
        return Ok(());
    }
    require_rest(drive).await?;
    choose(drive, code).await
}

/// Writes 6060h, and waits until the drive shows that it has taken the mode.
async fn choose(drive: &DriveContext, code: i8) -> Result<(), Error> {
    let (modes, times) = (drive.description().modes, drive.description().times);
    if let Some(mode) = drive.description().mode_of(code.into()) {
        hold_still(drive, mode).await?;
    }
    drive.set(modes.chosen, code.into()).await?;
    let until = drive.now() + times.reaction;
    // Where 6060h itself shows it, the answer to the write has said so.
    while let Some(shown) = modes.shown {
        match drive.get(shown).await? {
            number if number == code.into() => break,
            shown if drive.now() >= until => return Err(Error::ModeNotTaken { ordered: code, shown }),
            _ => drive.pass(times.status_period).await?,
        }
    }
    Ok(())
}

/// Makes `position` the actual position, which the drive keeps.
///
/// # Errors
///
/// [`Error::Unsupported`] before anything is sent; [`Error::Refused`] while a travel is under way, and outside
/// OPERATION ENABLED where it takes homing; [`Error::Sdo`] when the position is outside the limits;
/// [`Error::NotCalibrated`].
pub async fn calibrate(drive: &DriveContext, position: i32) -> Result<(), Error> {
    let calibration = drive.need(drive.description().calibration, Capability::Calibration)?;
    require_rest(drive).await?;
    match calibration {
        Calibration::Write(object) => drive.set(object, position.into()).await,
        Calibration::Homing(homing) => home(drive, homing, position).await,
    }
}

/// Goes through homing mode and back.
async fn home(drive: &DriveContext, homing: Homing, position: i32) -> Result<(), Error> {
    match state_of(drive.status().await?)? {
        State::OperationEnabled => {}
        state => return Err(Error::Refused(Refusal(vec![Missing::Enabled(state)]))),
    }
    let before = shown_mode(drive).await?;
    choose(drive, homing.mode).await?;
    let ended = home_on_the_spot(drive, homing, position).await;
    // Whether it has succeeded or not.
    if drive.may_be_stopped().await? {
        drive.control(drive.description().resting()).await?;
    }
    if let Ok(before) = i8::try_from(before) {
        choose(drive, before).await?;
    }
    match ended? {
        status_word if status_word & (homing.attained | homing.error) == homing.attained => Ok(()),
        status_word => Err(Error::NotCalibrated { status_word }),
    }
}

/// The status word in the end.
async fn home_on_the_spot(drive: &DriveContext, homing: Homing, position: i32) -> Result<u16, Error> {
    drive.set(homing.offset, position.into()).await?;
    drive.set(homing.method, homing.on_the_spot.into()).await?;
    // The order is an edge.
    drive.control(drive.description().resting()).await?;
    drive.unsettle();
    drive.control(drive.description().moving() | homing.start).await?;
    let until = drive.now() + drive.description().times.reaction;
    let mut status_word = drive.status().await?;
    let ended = |word: u16| word & (homing.attained | homing.error) != 0;
    while !(drive.settled(!ended(status_word)) && ended(status_word)) && drive.now() < until {
        if is_fault(state_of(status_word)?) {
            return Err(Error::Fault(cause(drive).await?));
        }
        status_word = drive.next_status().await?;
    }
    Ok(status_word)
}

/// From which side targets are approached; `None` for a value that the manual does not have.
///
/// # Errors
///
/// [`Error::Unsupported`]; as [`DriveContext::read`].
pub async fn approach(drive: &DriveContext) -> Result<Option<Approach>, Error> {
    let approaches = drive.need(drive.description().approaches, Capability::Approach)?;
    let number = drive.get(approaches.object).await?;
    Ok(approaches.values.iter().find(|(value, _)| *value == number).map(|(_, approach)| *approach))
}

/// Chooses from which side targets are approached.
///
/// # Errors
///
/// [`Error::Unsupported`] before anything is sent; as [`DriveContext::write`].
pub async fn set_approach(drive: &DriveContext, approach: Approach) -> Result<(), Error> {
    let approaches = drive.need(drive.description().approaches, Capability::Approach)?;
    let value = approaches.values.iter().find(|(_, of)| *of == approach).map(|(value, _)| *value);
    let value = drive.need(value, Capability::Approach)?;
    drive.set(approaches.object, value).await
}

/// Switches emergency messages on or off (1014h).
///
/// # Errors
///
/// [`Error::Unsupported`] before anything is sent; [`Error::Sdo`] by a drive that allows it in NMT PRE-OPERATIONAL
/// only.
pub async fn set_emergencies(drive: &DriveContext, on: bool) -> Result<(), Error> {
    let switch = drive.need(drive.description().emergencies, Capability::EmergencySwitch)?;
    let bit = i64::from(switch.bit);
    let before = drive.get(switch.object).await?;
    let after = if on == switch.on_when_set { before | bit } else { before & !bit };
    if after == before { Ok(()) } else { drive.set(switch.object, after).await }
}

/// What one count of a position is worth, as the drive is set up.
///
/// # Errors
///
/// [`Error::Unsupported`]; as [`DriveContext::read`].
pub async fn units(drive: &DriveContext) -> Result<Units, Error> {
    let objects = drive.need(drive.description().units, Capability::Units)?;
    Ok(Units {
        increments: objects.increments,
        spindle_pitch_10um: drive.get(objects.spindle_pitch_10um).await? as u32,
        numerator: drive.get(objects.numerator).await? as u32,
        denominator: drive.get(objects.denominator).await? as u32,
    })
}
