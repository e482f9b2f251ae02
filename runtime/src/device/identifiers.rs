//! Which identifiers the services of a device have: each of them belongs to one service.

use super::checked::Checked;
use crate::id::CobId;
use crate::object::Address;
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

impl Checked<'_> {
    /// Whether a service of the device has the identifier. The one whose parameter `owner` is does not count.
    pub(super) fn is_taken(&mut self, id: CobId, owner: Address) -> bool {
        self.is_taken_by_pdo(id, owner) || self.is_taken_by_message(id, owner) || self.is_taken_by_sdo(id, owner)
    }

    fn is_taken_by_pdo(&self, id: CobId, owner: Address) -> bool {
        let rpdos = self.rpdos.iter().map(|slot| (slot.parameter_index(), slot.pdo.parameters().cob_id));
        let tpdos = self.tpdos.iter().map(|slot| (slot.parameter_index(), slot.pdo.parameters().cob_id));
        rpdos.chain(tpdos).any(|(index, cob_id)| index != owner.index() && cob_id.is_valid() && cob_id.id() == id)
    }

    fn is_taken_by_message(&mut self, id: CobId, owner: Address) -> bool {
        let sync = objects::read_u32(self.od, 0x1005, 0).unwrap_or(CobId::SYNC.to_parameter());
        let time = objects::read_u32(self.od, 0x1012, 0).filter(|time| time & TIME_EXISTS != 0);
        let emcy = objects::read_u32(self.od, 0x1014, 0).filter(|&emcy| PdoCobId(emcy).is_valid());
        let messages = [(0x1005, Some(sync)), (0x1012, time), (0x1014, emcy)];
        messages.into_iter().any(|(index, cob_id)| {
            index != owner.index() && cob_id.is_some_and(|cob_id| CobId::from_parameter(cob_id) == id)
        })
    }

    /// Whether an SDO has both its identifiers.
    pub(super) fn server_exists(&mut self, index: u16) -> bool {
        [1, 2].into_iter().all(|sub| objects::read_u32(self.od, index, sub).is_some_and(|it| PdoCobId(it).is_valid()))
    }

    /// How many servers of these indices there are.
    pub(super) fn servers_of(&mut self, indices: Range<u16>) -> usize {
        indices.filter(|&index| self.server_exists(index)).count()
    }

    /// Servers (1200h and up) and clients (1280h and up). The identifiers of the default server are restricted
    /// where it has no object.
    fn is_taken_by_sdo(&mut self, id: CobId, owner: Address) -> bool {
        let mut has = |index, sub| {
            let cob_id = objects::read_u32(self.od, index, sub).map(PdoCobId);
            let counts = Address::new(index, sub) != owner;
            counts && cob_id.is_some_and(|cob_id| cob_id.is_valid() && cob_id.id() == id)
        };
        (0x1200..=0x12FF).any(|index| has(index, 1) || has(index, 2))
    }
}
