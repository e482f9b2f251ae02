//! Checks that the node is the drive of the description, and that its PDOs are as the driver uses them.

use lexican_runtime::CobId;
use lexican_runtime::object::{Address, DataType, Direction, Mapped};

use super::observe::known;
use crate::context::DriveContext;
use crate::description::{Number, Pdo};
use crate::error::Error;
use crate::fault::ByteOrder;

const DEVICE_TYPE: Number = Number::new(0x1000, 0x00, DataType::Unsigned32);
const DEVICE_NAME: Address = Address::new(0x1008, 0x00);
const EMERGENCIES: Number = Number::new(0x1014, 0x00, DataType::Unsigned32);
const VENDOR_ID: Number = Number::new(0x1018, 0x01, DataType::Unsigned32);

/// The bit "does not exist" of the COB-IDs in 1014h, 1400h and 1800h (CiA 301, 7.5.2.17, 7.5.2.35, 7.5.2.37).
const NOT_VALID: u32 = 1 << 31;

/// Checks that the node is the drive of the description, and that its PDOs have the COB-IDs and the mapping that the
/// driver uses; reads the COB-ID of its emergencies.
///
/// Errors: [`Error::NotThisDrive`], [`Error::OtherCobId`], [`Error::OtherMapping`].
pub async fn identify(drive: &DriveContext) -> Result<(), Error> {
    let (expected, identity) = (drive.description().name, drive.description().identity);
    let profile = (drive.get(DEVICE_TYPE).await? & 0xFFFF) as u16;
    let vendor_id = known(drive.get(VENDOR_ID).await)?.unwrap_or(0) as u32;
    // If the drive is expected to have no name, a name that it has is read in the byte order of CiA 301.
    let order = identity.names.map_or(ByteOrder::LowFirst, |_| identity.characters);
    let name = known(characters(drive, DEVICE_NAME, order).await)?;
    let named = match (identity.names, &name) {
        (None, None) => true,
        (None, Some(_)) => false,
        (Some(names), name) => names.iter().any(|begin| name.as_deref().unwrap_or_default().starts_with(begin)),
    };
    let of_vendor = identity.vendor_ids.is_empty() || identity.vendor_ids.contains(&vendor_id);
    if !named || !of_vendor || profile != identity.profile {
        return Err(Error::NotThisDrive { expected, vendor_id, profile, name });
    }
    check_pdos(drive).await?;
    follow_emergencies(drive).await
}

/// Emergencies are listened to on the COB-ID of 1014h (CiA 301, 7.5.2.17), and not at all if it is disabled.
async fn follow_emergencies(drive: &DriveContext) -> Result<(), Error> {
    let Some(cob_id) = known(drive.get(EMERGENCIES).await)? else { return Ok(()) };
    let cob_id = cob_id as u32;
    let id = CobId::from_parameter(cob_id);
    // On a COB-ID of another service, frames are not emergencies.
    drive.lock().emergencies = Some(id).filter(|id| cob_id & NOT_VALID == 0 && !id.is_restricted());
    Ok(())
}

/// An order that does not arrive starts nothing. But something might start if another PDO takes it, if the drive takes
/// it for something else, or if other data are taken for a status word.
async fn check_pdos(drive: &DriveContext) -> Result<(), Error> {
    let outputs = drive.description().outputs;
    for pdo in [outputs.control, outputs.position, outputs.velocity].iter().flatten() {
        let object = pdo_parameter(0x1400, 0x200, pdo.base, 0x01, DataType::Unsigned32);
        check_cob_id(drive, object, pdo.base, true).await?;
        check_mapping(drive, Direction::Receive, pdo).await?;
    }
    // A status word that the drive does not send by itself is read.
    for pdo in drive.description().inputs {
        let object = pdo_parameter(0x1800, 0x180, pdo.base, 0x01, DataType::Unsigned32);
        if check_cob_id(drive, object, pdo.base, false).await? {
            check_mapping(drive, Direction::Transmit, pdo).await?;
        }
    }
    Ok(())
}

/// A communication parameter of the PDO with the COB-ID `base` in the predefined connection set (CiA 301, 7.3.5).
/// `index` is the object of the PDO with the COB-ID `first`.
pub(super) fn pdo_parameter(index: u16, first: u16, base: u16, sub: u8, data_type: DataType) -> Number {
    Number::new(index.wrapping_add(base.wrapping_sub(first) >> 8), sub, data_type)
}

/// Whether the PDO exists. If the node lacks the object, its COB-ID cannot have been changed.
async fn check_cob_id(drive: &DriveContext, object: Number, base: u16, needed: bool) -> Result<bool, Error> {
    let Some(found) = known(drive.get(object).await)? else { return Ok(true) };
    let (found, expected) = (found as u32, CobId::of_node(base, drive.node()));
    let valid = found & NOT_VALID == 0;
    let right = if valid { CobId::from_parameter(found) == expected } else { !needed };
    if right { Ok(valid) } else { Err(Error::OtherCobId { address: object.address(), expected, found }) }
}

/// If the node lacks the object, its mapping cannot have been changed. In a transmit PDO, nothing after the status word
/// is read.
async fn check_mapping(drive: &DriveContext, direction: Direction, pdo: &Pdo) -> Result<(), Error> {
    let (index, first) = match direction {
        Direction::Receive => (0x1600, 0x200),
        Direction::Transmit => (0x1A00, 0x180),
    };
    let entry = |sub, data_type| pdo_parameter(index, first, pdo.base, sub, data_type);
    let Some(count) = known(drive.get(entry(0x00, DataType::Unsigned8)).await)? else { return Ok(()) };
    let receives = direction == Direction::Receive;
    // A PDO without mapped objects is not sent.
    if count == 0 && !receives {
        return Ok(());
    }
    let expected = pdo.mapping(drive.description());
    let known = places(&expected).filter(|(_, mapped)| *mapped != Pdo::anything(mapped.bits));
    let known: Vec<(u32, Mapped)> = known.collect();
    let asked = known.last().map_or(0, |(place, mapped)| place + u32::from(mapped.bits));
    let mut found = Vec::new();
    // Higher values are not counts: 254 and 255 mean multiplexed PDOs (CiA 301, 7.5.2.36).
    let subs = 1..=u8::try_from(count).ok().filter(|count| *count <= 64).unwrap_or(0);
    for sub in subs {
        if !receives && bits(&found) >= asked {
            break;
        }
        found.push(Mapped::from_parameter(drive.get(entry(sub, DataType::Unsigned32)).await? as u32));
    }
    let in_place = known.iter().all(|wanted| places(&found).any(|place| place == *wanted));
    let as_long = bits(&found).div_ceil(8) == bits(&expected).div_ceil(8);
    if in_place && (as_long || !receives) {
        return Ok(());
    }
    let number = (pdo.base - first) / 0x100 + 1;
    Err(Error::OtherMapping { direction, number, expected, found })
}

/// Each entry with the number of bits before it.
fn places(mapping: &[Mapped]) -> impl Iterator<Item = (u32, Mapped)> + '_ {
    mapping.iter().scan(0, |next, &mapped| {
        let place = *next;
        *next += u32::from(mapped.bits);
        Some((place, mapped))
    })
}

fn bits(mapping: &[Mapped]) -> u32 {
    mapping.iter().map(|mapped| u32::from(mapped.bits)).sum()
}

/// A text without the characters that pad it.
pub(super) async fn characters(drive: &DriveContext, object: Address, order: ByteOrder) -> Result<String, Error> {
    let mut bytes = drive.text(object).await?;
    if order == ByteOrder::HighFirst {
        bytes.reverse();
    }
    let text: String = bytes.iter().map(|&byte| char::from(byte)).filter(|&character| character != '\0').collect();
    Ok(text.trim_end().to_owned())
}
