//! What is set up once: identity, operating mode, calibration, parameter sets.

use lexican_runtime::AbortCode;
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::{Scalar, SdoError};

use super::power::state;
use crate::driver::Mode;
use crate::driver::desk::{Access, Desk};
use crate::driver::error::{Error, Missing, Refusal};
use crate::od;
use crate::parameter::{PARAMETERS, ParameterSet};

/// The value of a parameter, in wire form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setting {
    /// The object.
    pub address: Address,
    /// Its value.
    pub raw: u64,
}

/// A parameter whose value in the drive is another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The object.
    pub address: Address,
    /// What was expected.
    pub expected: u64,
    /// What the drive has.
    pub found: u64,
}

/// Makes sure that the node is the drive that is described.
///
/// # Errors
///
/// [`Error::NotThisDrive`]; as [`Desk::read`].
pub async fn identify(desk: &Desk) -> Result<(), Error> {
    let description = desk.description();
    let profile = (desk.read(od::DEVICE_TYPE).await? & 0xFFFF) as u16;
    let vendor_id = desk.read(od::IDENTITY_OBJECT.vendor_id()).await?;
    let name = match desk.read(od::MANUFACTURER_DEVICE_NAME).await {
        Ok(name) => Some(name.to_le_bytes()),
        Err(Error::Sdo(SdoError::Aborted { .. })) => None,
        Err(error) => return Err(error),
    };
    let same = (profile, vendor_id, name) == (description.profile, description.vendor_id, description.device_name);
    if same { Ok(()) } else { Err(Error::NotThisDrive { expected: description.name, vendor_id, profile, name }) }
}

/// Changes the operating mode, unless it is set already.
///
/// # Errors
///
/// [`Error::Refused`] while a travel is under way.
pub async fn set_mode(desk: &Desk, mode: Mode) -> Result<(), Error> {
    if Mode::of(desk.read(od::MODES_OF_OPERATION).await?) == Some(mode) {
        return Ok(());
    }
    require_rest(desk).await?;
    desk.write(od::MODES_OF_OPERATION, mode.object()).await
}

/// Makes `position` the actual position, and keeps it as calibration value.
///
/// # Errors
///
/// [`Error::Refused`] while a travel is under way; [`Error::Sdo`] when the position is outside the limits.
pub async fn calibrate(desk: &Desk, position: i32) -> Result<(), Error> {
    require_rest(desk).await?;
    desk.write(od::CALIBRATION_VALUE, od::Position(position)).await
}

/// Restores a set of parameters to factory settings; all of them for `None`.
///
/// # Errors
///
/// [`Error::Refused`] while a travel is under way.
pub async fn restore(desk: &Desk, set: Option<ParameterSet>) -> Result<(), Error> {
    require_rest(desk).await?;
    let sets = od::RESTORE_DEFAULT_PARAMETERS;
    let entry = match set {
        None => sets.all_parameters(),
        Some(ParameterSet::Standard) => sets.standard_parameters(),
        Some(ParameterSet::Controller) => sets.controller_parameters(),
    };
    desk.write(entry, od::RestoreSignature::LOAD).await
}

/// Reads all parameters of table 6.
///
/// # Errors
///
/// As [`Desk::read`].
pub async fn read_parameters(desk: &Desk) -> Result<Vec<Setting>, Error> {
    let mut settings = Vec::with_capacity(PARAMETERS.len());
    for parameter in PARAMETERS {
        settings.push(read_raw(desk, parameter.address).await?);
    }
    Ok(settings)
}

/// Which of the settings the drive does not have.
///
/// # Errors
///
/// As [`Desk::read`].
pub async fn compare_parameters(desk: &Desk, settings: &[Setting]) -> Result<Vec<Difference>, Error> {
    let mut differences = Vec::new();
    for &Setting { address, raw } in settings {
        let found = read_raw(desk, address).await?.raw;
        if found != raw {
            differences.push(Difference { address, expected: raw, found });
        }
    }
    Ok(differences)
}

/// Writes settings, but only those that differ: writing the calibration value would calibrate the drive.
///
/// # Errors
///
/// [`Error::Refused`] while a travel is under way; [`Error::Sdo`] with the first setting that the drive refuses.
pub async fn write_parameters(desk: &Desk, settings: &[Setting]) -> Result<(), Error> {
    require_rest(desk).await?;
    let mut later = Vec::new();
    for difference in compare_parameters(desk, settings).await? {
        match write_raw(desk, difference.address, difference.expected).await {
            // Of two limits the one may have to wait for the other.
            Err(Error::Sdo(SdoError::Aborted { code: AbortCode::MAXIMUM_BELOW_MINIMUM, .. })) => later.push(difference),
            done => done?,
        }
    }
    for difference in later {
        write_raw(desk, difference.address, difference.expected).await?;
    }
    Ok(())
}

async fn read_raw(desk: &Desk, address: Address) -> Result<Setting, Error> {
    let payload = desk.transfer(access(address, 0, false)).await?;
    let mut bytes = [0; 8];
    bytes.iter_mut().zip(payload.bytes()).for_each(|(to, from)| *to = *from);
    Ok(Setting { address, raw: u64::from_le_bytes(bytes) })
}

async fn write_raw(desk: &Desk, address: Address, raw: u64) -> Result<(), Error> {
    desk.transfer(access(address, raw, true)).await?;
    Ok(())
}

/// An access with a payload of the size that the object has.
fn access(address: Address, raw: u64, writes: bool) -> Access {
    let payload = match od::TABLE.entry(address).ok().and_then(|entry| entry.data_type.size()) {
        Some(1) => Scalar::of(raw as u8),
        Some(2) => Scalar::of(raw as u16),
        _ => Scalar::of(raw as u32),
    };
    Access { address, payload, writes }
}

/// Nothing may be under way.
async fn require_rest(desk: &Desk) -> Result<(), Error> {
    state(desk).await?;
    let bits = desk.description().system;
    let system = desk.read(od::MANUFACTURER_STATUS_REGISTER).await?.0;
    if system & (bits.moving | bits.positioning) != 0 {
        return Err(Error::Refused(Refusal(vec![Missing::NoTravel])));
    }
    Ok(())
}
