//! Which identifiers the COB-ID parameters of a device give to its services.
//!
//! A service exists if its parameter says so and names an identifier that a service may have. Restricted
//! identifiers (CiA 301, 7.3.5), those of NMT, error control and the default SDO server among them, are given to no
//! service, even if the dictionary holds them.

use crate::cia301;
use crate::id::CobId;
use crate::object::{Address, ObjectDictionary};
use crate::service::objects;
use crate::wire::pdo::PdoCobId;
use core::ops::Range;

/// 1005h: the device produces SYNC.
pub(super) const SYNC_GENERATED: u32 = 1 << 30;
/// 1012h: the device consumes TIME.
pub(super) const TIME_CONSUMED: u32 = 1 << 31;
/// 1012h: the device produces TIME.
pub(super) const TIME_PRODUCED: u32 = 1 << 30;
/// 1012h: TIME exists for a device that consumes or produces it.
pub(super) const TIME_EXISTS: u32 = TIME_CONSUMED | TIME_PRODUCED;

/// Whether an entry holds the COB-ID of a service.
pub(super) fn is_cob_id(address: Address) -> bool {
    match address.index() {
        cia301::COB_ID_SYNC | cia301::COB_ID_TIME | cia301::COB_ID_EMCY => address.sub() == 0,
        cia301::EMERGENCY_CONSUMER => address.sub() > 0,
        cia301::SDO_SERVER_1..=cia301::SDO_CLIENT_128 => matches!(address.sub(), 1 | 2),
        cia301::RPDO_1..=cia301::RPDO_512 | cia301::TPDO_1..=cia301::TPDO_512 => address.sub() == 1,
        _ => false,
    }
}

/// The identifier in a COB-ID parameter; `None` if no service may have it.
pub(super) fn identifier(parameter: u32) -> Option<CobId> {
    let id = CobId::from_parameter(parameter);
    (CobId::is_parameter(parameter) && !id.is_restricted()).then_some(id)
}

/// The identifier of a service that bit 31 switches off; `None` if it does not exist.
pub(super) fn switched(parameter: u32) -> Option<CobId> {
    if PdoCobId(parameter).is_valid() { identifier(parameter) } else { None }
}

/// The identifier of SYNC (1005h). A device without the object has the predefined one.
pub(super) fn sync(od: &mut (impl ObjectDictionary + ?Sized)) -> Option<CobId> {
    identifier(objects::read_u32(od, cia301::COB_ID_SYNC, 0).unwrap_or(CobId::SYNC.to_parameter()))
}

/// The identifier of TIME (1012h), where one of the bits in `roles` is set.
pub(super) fn time(roles: u32, od: &mut (impl ObjectDictionary + ?Sized)) -> Option<CobId> {
    objects::read_u32(od, cia301::COB_ID_TIME, 0).filter(|time| time & roles != 0).and_then(identifier)
}

/// The identifier of EMCY (1014h).
pub(super) fn emcy(od: &mut (impl ObjectDictionary + ?Sized)) -> Option<CobId> {
    objects::read_u32(od, cia301::COB_ID_EMCY, 0).and_then(switched)
}

/// The identifiers of requests and answers of an SDO channel other than the default server (1201h and up); `None`
/// unless both exist.
pub(super) fn sdo(index: u16, od: &mut (impl ObjectDictionary + ?Sized)) -> Option<(CobId, CobId)> {
    let mut id = |sub| objects::read_u32(od, index, sub).and_then(switched);
    Some((id(1)?, id(2)?))
}

/// How many SDO channels of these indices there are.
pub(super) fn sdo_count(indices: Range<u16>, od: &mut (impl ObjectDictionary + ?Sized)) -> usize {
    indices.filter(|&index| sdo(index, od).is_some()).count()
}

/// Whether SYNC, TIME, EMCY or an SDO of the device has the identifier. The service that has the parameter `owner`
/// does not count.
pub(super) fn is_taken(id: CobId, owner: Address, od: &mut (impl ObjectDictionary + ?Sized)) -> bool {
    let is_other = |index, it| owner.index() != index && it == Some(id);
    let by_message = is_other(cia301::COB_ID_SYNC, sync(od))
        || is_other(cia301::COB_ID_TIME, time(TIME_EXISTS, od))
        || is_other(cia301::COB_ID_EMCY, emcy(od));
    let mut by_sdo = |index, sub| {
        let counts = Address::new(index, sub) != owner;
        counts && objects::read_u32(od, index, sub).and_then(switched) == Some(id)
    };
    by_message || (cia301::SDO_SERVER_2..=cia301::SDO_CLIENT_128).any(|index| by_sdo(index, 1) || by_sdo(index, 2))
}
