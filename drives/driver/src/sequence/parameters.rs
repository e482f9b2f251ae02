//! Sets of parameters: read, compared, written, stored and restored.

use lexican_runtime::AbortCode;
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::SdoError;

use super::refusal::require_rest;
use crate::context::DriveContext;
use crate::description::Number;
use crate::error::{Capability, Error};
use crate::parameter::{Parameter, ParameterSet};

/// The value of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setting {
    /// The object.
    pub address: Address,
    /// Its value.
    pub value: i64,
}

/// A parameter with another value in the drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Difference {
    pub address: Address,
    pub expected: i64,
    pub found: i64,
}

/// Reads all parameters that the description names.
pub async fn read_parameters(drive: &DriveContext) -> Result<Vec<Setting>, Error> {
    let parameters = drive.description().parameters;
    let mut settings = Vec::with_capacity(parameters.len());
    for parameter in parameters {
        settings.push(Setting { address: parameter.address, value: drive.get(parameter.object()).await? });
    }
    Ok(settings)
}

/// The settings whose values differ in the drive.
pub async fn compare_parameters(drive: &DriveContext, settings: &[Setting]) -> Result<Vec<Difference>, Error> {
    for setting in settings {
        object(drive, setting.address)?;
    }
    let mut differences = Vec::new();
    for &Setting { address, value } in settings {
        let found = drive.get(object(drive, address)?).await?;
        if found != value {
            differences.push(Difference { address, expected: value, found });
        }
    }
    Ok(differences)
}

/// Writes the settings that differ, and only those: writing the calibration value may calibrate the drive.
///
/// Errors: [`Error::NoParameter`] or [`Error::OutOfRange`] before anything is sent; [`Error::Refused`] while a travel
/// is under way; [`Error::Sdo`] with the first setting that the drive refuses. Other settings may have been written by
/// then, since a setting that is refused is tried again after them: one limit may depend on the other.
pub async fn write_parameters(drive: &DriveContext, settings: &[Setting]) -> Result<(), Error> {
    for &Setting { address, value } in settings {
        object(drive, address)?.check(value)?;
    }
    require_rest(drive).await?;
    let mut left = compare_parameters(drive, settings).await?;
    loop {
        let (mut waiting, mut refusal) = (Vec::new(), None);
        for &difference in &left {
            match write(drive, difference).await {
                Err(Error::Sdo(error)) if is_out_of_place(error) => {
                    waiting.push(difference);
                    refusal.get_or_insert(error);
                }
                done => done?,
            }
        }
        match refusal {
            Some(error) if waiting.len() == left.len() => return Err(error.into()),
            Some(_) => left = waiting,
            None => return Ok(()),
        }
    }
}

/// Whether the value may be right once others are written, such as one of two limits, or a position between them.
fn is_out_of_place(error: SdoError) -> bool {
    let SdoError::Aborted { code, .. } = error else { return false };
    const OUT_OF_PLACE: [AbortCode; 4] = [
        AbortCode::MAXIMUM_BELOW_MINIMUM,
        AbortCode::INVALID_VALUE,
        AbortCode::VALUE_TOO_HIGH,
        AbortCode::VALUE_TOO_LOW,
    ];
    OUT_OF_PLACE.contains(&code)
}

/// Stores all parameters permanently.
///
/// Errors: [`Error::Unsupported`] if the drive has no such command, perhaps since it stores them by itself;
/// [`Error::Refused`] while a travel is under way.
pub async fn store(drive: &DriveContext) -> Result<(), Error> {
    let store = drive.need(drive.description().store, Capability::Store)?;
    require_rest(drive).await?;
    drive.set(store.all, store.signature.into()).await
}

/// Restores a set of parameters to factory settings; all of them for `None`.
///
/// Errors: [`Error::Unsupported`] if the drive does not have this set; [`Error::Refused`] while a travel is under way.
pub async fn restore(drive: &DriveContext, set: Option<ParameterSet>) -> Result<(), Error> {
    let restore = drive.need(drive.description().restore, Capability::Restore)?;
    let object = match set {
        None => Some(restore.all),
        Some(set) => restore.sets.iter().find(|(of, _)| *of == set).map(|(_, object)| *object),
    };
    let object = drive.need(object, Capability::Restore)?;
    require_rest(drive).await?;
    drive.set(object, restore.signature.into()).await
}

async fn write(drive: &DriveContext, difference: Difference) -> Result<(), Error> {
    drive.set(object(drive, difference.address)?, difference.expected).await
}

fn object(drive: &DriveContext, address: Address) -> Result<Number, Error> {
    let found = drive.description().parameters.iter().find(|parameter| parameter.address == address);
    let drive = drive.description().name;
    found.map(Parameter::object).ok_or(Error::NoParameter { drive, address })
}
