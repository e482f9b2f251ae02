//! Whether the node is the drive that is described, and is set up as the driver talks to it.

use lexican_runtime::CobId;
use lexican_runtime::object::{Address, DataType};
use lexican_runtime::service::sdo_client::SdoError;

use crate::context::DriveContext;
use crate::description::Number;
use crate::error::Error;
use crate::fault::ByteOrder;

const DEVICE_TYPE: Number = Number::new(0x1000, 0x00, DataType::Unsigned32);
const DEVICE_NAME: Address = Address::new(0x1008, 0x00);
const EMERGENCIES: Number = Number::new(0x1014, 0x00, DataType::Unsigned32);
const VENDOR_ID: Number = Number::new(0x1018, 0x01, DataType::Unsigned32);

/// "Does not exist", in a COB-ID of 1014h, 1400h and 1800h (CiA 301, 7.5.2.17, 7.5.2.35, 7.5.2.37).
const NOT_VALID: u32 = 1 << 31;

/// Makes sure that the node is the drive that is described, and that its PDOs and emergencies have the COB-IDs by which
/// the driver talks to it.
///
/// # Errors
///
/// [`Error::NotThisDrive`], [`Error::OtherCobId`]; as [`DriveContext::read`].
pub async fn identify(drive: &DriveContext) -> Result<(), Error> {
    let (expected, identity) = (drive.description().name, drive.description().identity);
    let profile = (drive.get(DEVICE_TYPE).await? & 0xFFFF) as u16;
    let vendor_id = drive.get(VENDOR_ID).await? as u32;
    // The name of another drive comes as CiA 301 has text.
    let order = identity.names.map_or(ByteOrder::LowFirst, |_| identity.characters);
    let name = match characters(drive, DEVICE_NAME, order).await {
        Ok(name) => Some(name),
        Err(Error::Sdo(SdoError::Aborted { .. })) => None,
        Err(error) => return Err(error),
    };
    let named = match (identity.names, &name) {
        (None, None) => true,
        (None, Some(_)) => false,
        (Some(names), name) => names.iter().any(|begin| name.as_deref().unwrap_or_default().starts_with(begin)),
    };
    if !named || (profile, vendor_id) != (identity.profile, identity.vendor_id) {
        return Err(Error::NotThisDrive { expected, vendor_id, profile, name });
    }
    check_cob_ids(drive).await
}

/// An order that does not arrive starts nothing; but one that another PDO takes, or a status word that is none, might.
async fn check_cob_ids(drive: &DriveContext) -> Result<(), Error> {
    let outputs = drive.description().outputs;
    for pdo in [outputs.control, outputs.position, outputs.velocity].iter().flatten() {
        let object = pdo_parameter(0x1400, 0x200, pdo.base, 0x01, DataType::Unsigned32);
        check_cob_id(drive, object, pdo.base, true).await?;
    }
    // What the drive does not send by itself is read.
    for pdo in drive.description().inputs {
        let object = pdo_parameter(0x1800, 0x180, pdo.base, 0x01, DataType::Unsigned32);
        check_cob_id(drive, object, pdo.base, false).await?;
    }
    check_cob_id(drive, EMERGENCIES, 0x080, false).await
}

/// A communication parameter of the PDO that has `base` in the predefined connection set (CiA 301, 7.3.5), where the one
/// with `first` has `index`.
pub(super) fn pdo_parameter(index: u16, first: u16, base: u16, sub: u8, data_type: DataType) -> Number {
    Number::new(index.wrapping_add(base.wrapping_sub(first) >> 8), sub, data_type)
}

/// A node that does not have the object cannot have another COB-ID.
async fn check_cob_id(drive: &DriveContext, object: Number, base: u16, needed: bool) -> Result<(), Error> {
    let found = match drive.get(object).await {
        Ok(found) => found as u32,
        Err(Error::Sdo(SdoError::Aborted { .. })) => return Ok(()),
        Err(error) => return Err(error),
    };
    let expected = CobId::of_node(base, drive.node());
    let right = match found & NOT_VALID {
        0 => CobId::from_parameter(found) == expected,
        _ => !needed,
    };
    if right { Ok(()) } else { Err(Error::OtherCobId { address: object.address(), expected, found }) }
}

/// A text: its characters without what pads it.
pub(super) async fn characters(drive: &DriveContext, object: Address, order: ByteOrder) -> Result<String, Error> {
    let mut bytes = drive.text(object).await?;
    if order == ByteOrder::HighFirst {
        bytes.reverse();
    }
    let text: String = bytes.iter().map(|&byte| char::from(byte)).filter(|&character| character != '\0').collect();
    Ok(text.trim_end().to_owned())
}
