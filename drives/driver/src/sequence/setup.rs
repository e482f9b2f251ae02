//! What is set up once: operating mode, calibration, approach, emergencies, units.

use lexican_runtime::object::DataType;
use lexican_runtime::profile::cia402::State;

use super::identify::characters;
use super::observe::{cause, is_fault, shown_mode, state_of};
use super::refusal::require_rest;
use crate::description::{Approach, Calibration, Homing, Number};
use crate::desk::Desk;
use crate::error::{Capability, Error, Missing, Refusal};
use crate::mode::Mode;
use crate::units::Units;

const SOFTWARE_VERSION: Number = Number::new(0x100A, 0x00, DataType::Unsigned32);

/// The version of the drive's firmware (100Ah): four characters, such as "1.00".
///
/// # Errors
///
/// As [`Desk::read`].
pub async fn firmware(desk: &Desk) -> Result<String, Error> {
    characters(desk, SOFTWARE_VERSION, desk.description().identity.characters).await
}

/// Changes the operating mode, unless it is set already.
///
/// # Errors
///
/// [`Error::Unsupported`] before anything is sent; [`Error::Refused`] while a travel is under way;
/// [`Error::ModeNotTaken`].
pub async fn set_mode(desk: &Desk, mode: Mode) -> Result<(), Error> {
    let code = desk.need(desk.description().code_of(mode), Capability::Mode(mode))?;
    if shown_mode(desk).await? == code.into() {
        return Ok(());
    }
    require_rest(desk).await?;
    choose(desk, code).await
}

/// Writes 6060h, and waits until the drive shows that it has taken the mode.
async fn choose(desk: &Desk, code: i8) -> Result<(), Error> {
    let (modes, times) = (desk.description().modes, desk.description().times);
    if let Some(velocity) = desk.description().runs_unasked_at()
        && desk.description().mode_of(code.into()) == Some(Mode::Velocity)
    {
        desk.set(velocity, 0).await?;
    }
    desk.set(modes.chosen, code.into()).await?;
    let until = desk.now() + times.reaction;
    // Where 6060h itself shows it, the answer to the write has said so.
    while let Some(shown) = modes.shown {
        match desk.get(shown).await? {
            number if number == code.into() => break,
            shown if desk.now() >= until => return Err(Error::ModeNotTaken { told: code, shown }),
            _ => desk.pass(times.status_period).await?,
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
pub async fn calibrate(desk: &Desk, position: i32) -> Result<(), Error> {
    let calibration = desk.need(desk.description().calibration, Capability::Calibration)?;
    require_rest(desk).await?;
    match calibration {
        Calibration::Write(object) => desk.set(object, position.into()).await,
        Calibration::Homing(homing) => home(desk, homing, position).await,
    }
}

/// Goes through homing mode and back.
async fn home(desk: &Desk, homing: Homing, position: i32) -> Result<(), Error> {
    match state_of(desk.status().await?)? {
        State::OperationEnabled => {}
        state => return Err(Error::Refused(Refusal(vec![Missing::Enabled(state)]))),
    }
    let before = shown_mode(desk).await?;
    choose(desk, homing.mode).await?;
    let ended = home_on_the_spot(desk, homing, position).await;
    // Whether it has succeeded or not.
    if desk.may_be_stopped().await? {
        desk.control(desk.description().resting()).await?;
    }
    if let Ok(before) = i8::try_from(before) {
        choose(desk, before).await?;
    }
    match ended? {
        status_word if status_word & (homing.attained | homing.error) == homing.attained => Ok(()),
        status_word => Err(Error::NotCalibrated { status_word }),
    }
}

/// The status word in the end.
async fn home_on_the_spot(desk: &Desk, homing: Homing, position: i32) -> Result<u16, Error> {
    desk.set(homing.offset, position.into()).await?;
    desk.set(homing.method, homing.on_the_spot.into()).await?;
    // The order is an edge.
    desk.control(desk.description().resting()).await?;
    desk.unsettle();
    desk.control(desk.description().moving() | homing.start).await?;
    let until = desk.now() + desk.description().times.reaction;
    let mut status_word = desk.status().await?;
    let ended = |word: u16| word & (homing.attained | homing.error) != 0;
    while !(desk.settled(!ended(status_word)) && ended(status_word)) && desk.now() < until {
        if is_fault(state_of(status_word)?) {
            return Err(Error::Fault(cause(desk).await?));
        }
        status_word = desk.next_status().await?;
    }
    Ok(status_word)
}

/// From which side targets are approached; `None` for a value that the manual does not have.
///
/// # Errors
///
/// [`Error::Unsupported`]; as [`Desk::read`].
pub async fn approach(desk: &Desk) -> Result<Option<Approach>, Error> {
    let approaches = desk.need(desk.description().approaches, Capability::Approach)?;
    let number = desk.get(approaches.object).await?;
    Ok(approaches.values.iter().find(|(value, _)| *value == number).map(|(_, approach)| *approach))
}

/// Chooses from which side targets are approached.
///
/// # Errors
///
/// [`Error::Unsupported`] before anything is sent; as [`Desk::write`].
pub async fn set_approach(desk: &Desk, approach: Approach) -> Result<(), Error> {
    let approaches = desk.need(desk.description().approaches, Capability::Approach)?;
    let value = approaches.values.iter().find(|(_, of)| *of == approach).map(|(value, _)| *value);
    let value = desk.need(value, Capability::Approach)?;
    desk.set(approaches.object, value).await
}

/// Switches emergency messages on or off (1014h).
///
/// # Errors
///
/// [`Error::Unsupported`] before anything is sent; [`Error::Sdo`] by a drive that allows it in NMT PRE-OPERATIONAL
/// only.
pub async fn set_emergencies(desk: &Desk, on: bool) -> Result<(), Error> {
    let switch = desk.need(desk.description().emergencies, Capability::EmergencySwitch)?;
    let bit = i64::from(switch.bit);
    let before = desk.get(switch.object).await?;
    let after = if on == switch.on_when_set { before | bit } else { before & !bit };
    if after == before { Ok(()) } else { desk.set(switch.object, after).await }
}

/// What one count of a position is worth, as the drive is set up.
///
/// # Errors
///
/// [`Error::Unsupported`]; as [`Desk::read`].
pub async fn units(desk: &Desk) -> Result<Units, Error> {
    let objects = desk.need(desk.description().units, Capability::Units)?;
    Ok(Units {
        increments: objects.increments,
        spindle_pitch_10um: desk.get(objects.spindle_pitch_10um).await? as u32,
        numerator: desk.get(objects.numerator).await? as u32,
        denominator: desk.get(objects.denominator).await? as u32,
    })
}
