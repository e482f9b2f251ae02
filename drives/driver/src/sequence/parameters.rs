//! Sets of parameters: read, compared, written, kept and restored.

use lexican_runtime::AbortCode;
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::SdoError;

use super::refusal::require_rest;
use crate::description::Number;
use crate::desk::Desk;
use crate::error::{Capability, Error};
use crate::parameter::ParameterSet;

/// The value of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setting {
    /// The object.
    pub address: Address,
    /// Its value.
    pub value: i64,
}

/// A parameter whose value in the drive is another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The object.
    pub address: Address,
    /// What was expected.
    pub expected: i64,
    /// What the drive has.
    pub found: i64,
}

/// Reads all parameters that the description names.
///
/// # Errors
///
/// As [`Desk::read`].
pub async fn read_parameters(desk: &Desk) -> Result<Vec<Setting>, Error> {
    let parameters = desk.description().parameters;
    let mut settings = Vec::with_capacity(parameters.len());
    for parameter in parameters {
        settings.push(Setting { address: parameter.address, value: desk.get(parameter.object()).await? });
    }
    Ok(settings)
}

/// Which of the settings the drive does not have. Those that are no parameters of it are not compared.
///
/// # Errors
///
/// As [`Desk::read`].
pub async fn compare_parameters(desk: &Desk, settings: &[Setting]) -> Result<Vec<Difference>, Error> {
    let mut differences = Vec::new();
    for &Setting { address, value } in settings {
        let Some(object) = object(desk, address) else { continue };
        let found = desk.get(object).await?;
        if found != value {
            differences.push(Difference { address, expected: value, found });
        }
    }
    Ok(differences)
}

/// Writes settings, but only those that differ: writing the calibration value may calibrate the drive.
///
/// # Errors
///
/// [`Error::OutOfRange`] before anything is sent; [`Error::Refused`] while a travel is under way; [`Error::Sdo`] with the
/// first setting that the drive refuses.
pub async fn write_parameters(desk: &Desk, settings: &[Setting]) -> Result<(), Error> {
    for &Setting { address, value } in settings {
        object(desk, address).map_or(Ok(()), |object| object.check(value))?;
    }
    require_rest(desk).await?;
    let mut later = Vec::new();
    for difference in compare_parameters(desk, settings).await? {
        match write(desk, difference).await {
            // Of two limits the one may have to wait for the other.
            Err(Error::Sdo(SdoError::Aborted { code: AbortCode::MAXIMUM_BELOW_MINIMUM, .. })) => later.push(difference),
            done => done?,
        }
    }
    for difference in later {
        write(desk, difference).await?;
    }
    Ok(())
}

/// Keeps all parameters for when there is no power.
///
/// # Errors
///
/// [`Error::Unsupported`] by a drive that has no such command, perhaps since it keeps them anyway; [`Error::Refused`]
/// while a travel is under way.
pub async fn store(desk: &Desk) -> Result<(), Error> {
    let store = desk.need(desk.description().store, Capability::Store)?;
    require_rest(desk).await?;
    desk.set(store.all, store.signature.into()).await
}

/// Restores a set of parameters to factory settings; all of them for `None`.
///
/// # Errors
///
/// [`Error::Unsupported`] by a drive without this set; [`Error::Refused`] while a travel is under way.
pub async fn restore(desk: &Desk, set: Option<ParameterSet>) -> Result<(), Error> {
    let restore = desk.need(desk.description().restore, Capability::Restore)?;
    let object = match set {
        None => Some(restore.all),
        Some(set) => restore.sets.iter().find(|(of, _)| *of == set).map(|(_, object)| *object),
    };
    let object = desk.need(object, Capability::Restore)?;
    require_rest(desk).await?;
    desk.set(object, restore.signature.into()).await
}

async fn write(desk: &Desk, difference: Difference) -> Result<(), Error> {
    match object(desk, difference.address) {
        Some(object) => desk.set(object, difference.expected).await,
        None => Ok(()),
    }
}

fn object(desk: &Desk, address: Address) -> Option<Number> {
    let found = desk.description().parameters.iter().find(|parameter| parameter.address == address)?;
    Some(found.object())
}
