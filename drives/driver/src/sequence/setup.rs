//! Set-up: operating mode, approach, reactions, emergencies, units.

use lexican_runtime::object::Address;

use super::identify::characters;
use super::observe::shown_mode;
use super::refusal::require_rest;
use super::standstill::hold_still;
use crate::context::DriveContext;
use crate::description::{Approach, Number, Reaction};
use crate::error::{Capability, Error};
use crate::mode::Mode;
use crate::units::Units;

const SOFTWARE_VERSION: Address = Address::new(0x100A, 0x00);

/// The version of the drive's firmware (100Ah), such as "1.00".
pub async fn firmware(drive: &DriveContext) -> Result<String, Error> {
    characters(drive, SOFTWARE_VERSION, drive.description().identity.characters).await
}

/// Changes the operating mode, unless it is set already.
///
/// Errors: [`Error::Refused`] while a travel is under way.
pub async fn set_mode(drive: &DriveContext, mode: Mode) -> Result<(), Error> {
    let code = drive.need(drive.description().code_of(mode), Capability::Mode(mode))?;
    if shown_mode(drive).await? == i64::from(code) {
        return Ok(());
    }
    require_rest(drive).await?;
    choose(drive, code).await
}

/// Writes 6060h, and waits until the drive shows that it has taken the mode.
pub(super) async fn choose(drive: &DriveContext, code: i8) -> Result<(), Error> {
    let (modes, times) = (drive.description().modes, drive.description().times);
    if let Some(mode) = drive.description().mode_of(code.into()) {
        hold_still(drive, mode).await?;
    }
    drive.set(modes.chosen, code.into()).await?;
    let until = drive.reacts_by();
    // If 6060h itself shows the mode, the write has already been answered.
    while let Some(shown) = modes.shown {
        match drive.get(shown).await? {
            number if number == i64::from(code) => break,
            shown if drive.now() >= until => return Err(Error::ModeNotTaken { ordered: code, shown }),
            _ => drive.pass(times.status_period).await?,
        }
    }
    Ok(())
}

/// The side from which targets are approached; `None` for a value that the manual does not have.
pub async fn approach(drive: &DriveContext) -> Result<Option<Approach>, Error> {
    let approaches = drive.need(drive.description().approaches, Capability::Approach)?;
    let number = drive.get(approaches.object).await?;
    Ok(approaches.values.iter().find(|(value, _)| *value == number).map(|(_, approach)| *approach))
}

/// Chooses the side from which targets are approached.
pub async fn set_approach(drive: &DriveContext, approach: Approach) -> Result<(), Error> {
    let approaches = drive.need(drive.description().approaches, Capability::Approach)?;
    let value = approaches.values.iter().find(|(_, of)| *of == approach).map(|(value, _)| *value);
    let value = drive.need(value, Capability::Approach)?;
    drive.set(approaches.object, value).await
}

/// What the drive does in a situation: the option code in 605Ah to 605Eh.
pub async fn reaction(drive: &DriveContext, to: Reaction) -> Result<i16, Error> {
    Ok(drive.get(option_code(drive, to)?).await? as i16)
}

/// Sets what the drive does in a situation.
///
/// Errors: [`Error::Refused`] while a travel is under way.
pub async fn set_reaction(drive: &DriveContext, to: Reaction, code: i16) -> Result<(), Error> {
    let object = option_code(drive, to)?;
    require_rest(drive).await?;
    drive.set(object, code.into()).await
}

fn option_code(drive: &DriveContext, to: Reaction) -> Result<Number, Error> {
    let row = drive.description().reactions.iter().find(|(reaction, _)| *reaction == to);
    drive.need(row.map(|(_, object)| *object), Capability::Reaction(to))
}

/// Switches emergency messages on or off (1014h).
///
/// Errors: [`Error::Sdo`] if the drive allows it in NMT PRE-OPERATIONAL only.
pub async fn set_emergencies(drive: &DriveContext, on: bool) -> Result<(), Error> {
    let switch = drive.need(drive.description().emergencies, Capability::EmergencySwitch)?;
    let bit = i64::from(switch.bit);
    let before = drive.get(switch.object).await?;
    let after = if on == switch.on_when_set { before | bit } else { before & !bit };
    if after == before { Ok(()) } else { drive.set(switch.object, after).await }
}

/// What one count of a position is worth, as the drive is set up.
pub async fn units(drive: &DriveContext) -> Result<Units, Error> {
    let objects = drive.need(drive.description().units, Capability::Units)?;
    Ok(Units {
        increments: objects.increments,
        spindle_pitch_10um: drive.get(objects.spindle_pitch_10um).await? as u32,
        numerator: drive.get(objects.numerator).await? as u32,
        denominator: drive.get(objects.denominator).await? as u32,
    })
}
