//! PDO: COB-ID parameters and transmission types (CiA 301, 7.2.2, 7.5.2.35 and 7.5.2.37). The functions for the bits of
//! a PDO are [`place`](crate::object::place) and [`take`](crate::object::take).

use core::fmt;

use crate::id::CobId;

/// The COB-ID parameter of a PDO, 1400h:01 or 1800h:01.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct PdoCobId(pub u32);

impl PdoCobId {
    const INVALID: u32 = 1 << 31;
    const NO_REMOTE: u32 = 1 << 30;

    /// The parameter of a PDO that does not exist.
    pub const OFF: PdoCobId = PdoCobId(Self::INVALID);

    /// The parameter of a valid PDO that remote frames may request.
    #[must_use]
    pub const fn valid(id: CobId) -> Self {
        PdoCobId(id.to_parameter())
    }

    /// The same, with the PDO disabled (bit 31 set).
    #[must_use]
    pub const fn switched_off(self) -> Self {
        PdoCobId(self.0 | Self::INVALID)
    }

    /// The same, with remote requests not allowed (bit 30 set).
    #[must_use]
    pub const fn without_remote(self) -> Self {
        PdoCobId(self.0 | Self::NO_REMOTE)
    }

    /// Whether the PDO exists (bit 31 clear).
    #[must_use]
    pub const fn is_valid(self) -> bool {
        self.0 & Self::INVALID == 0
    }

    /// Whether remote frames may request the PDO (bit 30 clear).
    #[must_use]
    pub const fn allows_remote(self) -> bool {
        self.0 & Self::NO_REMOTE == 0
    }

    /// The identifier.
    #[must_use]
    pub const fn id(self) -> CobId {
        CobId::from_parameter(self.0)
    }
}

impl fmt::Debug for PdoCobId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "PdoCobId({:08X})", self.0)
    }
}

/// When a PDO is sent or takes effect (1400h:02, 1800h:02).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TransmissionType {
    /// 0: with the next SYNC after an event.
    SynchronousAcyclic,
    /// 1 to 240: with every n-th SYNC.
    SynchronousCyclic(u8),
    /// 252: sampled at SYNC, sent on a remote request.
    SynchronousRemote,
    /// 253: sampled and sent on a remote request.
    Remote,
    /// 254: at an event that the manufacturer defines.
    EventManufacturer,
    /// 255: at an event that the profile defines.
    EventProfile,
    /// 241 to 251: reserved.
    Reserved(u8),
}

impl TransmissionType {
    /// The type with this number.
    #[must_use]
    pub const fn from_code(code: u8) -> Self {
        match code {
            0 => TransmissionType::SynchronousAcyclic,
            1..=240 => TransmissionType::SynchronousCyclic(code),
            252 => TransmissionType::SynchronousRemote,
            253 => TransmissionType::Remote,
            254 => TransmissionType::EventManufacturer,
            255 => TransmissionType::EventProfile,
            241..=251 => TransmissionType::Reserved(code),
        }
    }

    /// The number.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            TransmissionType::SynchronousAcyclic => 0,
            TransmissionType::SynchronousCyclic(n) | TransmissionType::Reserved(n) => n,
            TransmissionType::SynchronousRemote => 252,
            TransmissionType::Remote => 253,
            TransmissionType::EventManufacturer => 254,
            TransmissionType::EventProfile => 255,
        }
    }

    /// Whether a SYNC triggers it: 0 to 240.
    #[must_use]
    pub const fn is_synchronous(self) -> bool {
        matches!(self, TransmissionType::SynchronousAcyclic | TransmissionType::SynchronousCyclic(_))
    }

    /// Whether events of the device trigger it: 254 and 255.
    #[must_use]
    pub const fn is_event_driven(self) -> bool {
        matches!(self, TransmissionType::EventManufacturer | TransmissionType::EventProfile)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_of_the_cob_id_parameter_have_their_meaning() {
        let id = CobId::standard(0x185).unwrap();
        assert_eq!(PdoCobId::valid(id), PdoCobId(0x185));
        assert_eq!(PdoCobId::valid(id).switched_off().without_remote(), PdoCobId(0xC000_0185));
        assert_eq!(PdoCobId(0xC000_0185).id(), id);
        assert!(PdoCobId(0x2000_0185).id().is_extended());
    }

    #[test]
    fn every_transmission_type_keeps_its_number() {
        for code in 0..=0xFF {
            assert_eq!(TransmissionType::from_code(code).code(), code);
        }
    }
}
