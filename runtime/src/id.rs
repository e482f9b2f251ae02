//! Node-IDs and CAN identifiers, as types that cannot hold an illegal value.

use core::fmt;
use core::num::NonZeroU8;

use crate::cia301;

/// A CANopen node-ID, 1 to 127 (CiA 301, 7.3.5).
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(NonZeroU8);

impl NodeId {
    /// The largest node-ID, 127.
    pub const MAX: NodeId = NodeId::literal(127);

    /// `None` when `id` is 0 or above 127.
    pub const fn new(id: u8) -> Option<Self> {
        match NonZeroU8::new(id) {
            Some(id) if id.get() <= 127 => Some(NodeId(id)),
            _ => None,
        }
    }

    /// A node-ID written in the source.
    ///
    /// # Panics
    ///
    /// When `id` is 0 or above 127: at compile time in a constant.
    #[must_use]
    pub const fn literal(id: u8) -> Self {
        match NodeId::new(id) {
            Some(id) => id,
            None => panic!("a node-ID is 1 to 127"),
        }
    }

    /// The number, 1 to 127.
    #[must_use]
    pub const fn get(self) -> u8 {
        self.0.get()
    }

    /// All node-IDs, in order.
    pub fn all() -> impl DoubleEndedIterator<Item = NodeId> {
        (1..=127).filter_map(NodeId::new)
    }
}

/// A number is not a node-ID: it is 0 or above 127.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[error("{0} is not a node-ID: node-IDs are 1 to 127")]
pub struct InvalidNodeId(pub u8);

impl TryFrom<u8> for NodeId {
    type Error = InvalidNodeId;
    fn try_from(id: u8) -> Result<Self, InvalidNodeId> {
        NodeId::new(id).ok_or(InvalidNodeId(id))
    }
}

impl fmt::Display for NodeId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.get(), f)
    }
}

impl fmt::Debug for NodeId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "NodeId({})", self.get())
    }
}

/// A CAN identifier: 11 bits, or 29 bits of an extended frame.
///
/// Orders as the bus arbitrates between identifiers of one format: the lower number wins.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CobId(u32);

impl CobId {
    const EXTENDED: u32 = 1 << 29;
    const STANDARD_MAX: u32 = 0x7FF;
    const EXTENDED_MAX: u32 = 0x1FFF_FFFF;

    /// NMT commands (CiA 301, 7.2.8).
    pub const NMT: CobId = CobId(0x000);
    /// SYNC as the predefined connection set has it (CiA 301, 7.3.3).
    pub const SYNC: CobId = CobId(0x080);
    /// TIME as the predefined connection set has it (CiA 301, 7.3.3).
    pub const TIME: CobId = CobId(0x100);

    /// An 11-bit identifier; `None` above 7FFh.
    pub const fn standard(id: u16) -> Option<Self> {
        if id as u32 <= Self::STANDARD_MAX { Some(CobId(id as u32)) } else { None }
    }

    /// A 29-bit identifier; `None` above 1FFF FFFFh.
    pub const fn extended(id: u32) -> Option<Self> {
        if id <= Self::EXTENDED_MAX { Some(CobId(Self::EXTENDED | id)) } else { None }
    }

    /// The identifier of a COB-ID parameter such as 1014h or 1400h:01: bit 29 is the format;
    /// bits 30 and 31 do not belong to the identifier (CiA 301, 7.5.2.14).
    #[must_use]
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    pub const fn from_parameter(value: u32) -> Self {
        if value & Self::EXTENDED != 0 {
            CobId(value & (Self::EXTENDED | Self::EXTENDED_MAX))
        } else {
            CobId(value & Self::STANDARD_MAX)
        }
    }

    /// Whether a number can be a COB-ID parameter: where bit 29 is clear, bits 11 to 28 are, too.
    pub(crate) const fn is_parameter(value: u32) -> bool {
        value & Self::EXTENDED != 0 || value & Self::EXTENDED_MAX <= Self::STANDARD_MAX
    }

    /// `base + node`, as the predefined connection set counts. `base` is a multiple of 80h, so that
    /// base and node-ID together stay within 11 bits.
    ///
    /// # Panics
    ///
    /// When `base` is not one of the sixteen function codes 000h, 080h, ... 780h.
    #[must_use]
    pub const fn of_node(base: u16, node: NodeId) -> Self {
        assert!(base & !0x780 == 0, "a function code is a multiple of 80h up to 780h");
        CobId(base as u32 | node.get() as u32)
    }

    /// The bare identifier, without its format.
    #[must_use]
    pub const fn raw(self) -> u32 {
        self.0 & Self::EXTENDED_MAX
    }

    /// Whether the identifier has 29 bits.
    #[must_use]
    pub const fn is_extended(self) -> bool {
        self.0 & Self::EXTENDED != 0
    }

    /// As a COB-ID parameter holds it: the identifier, with bit 29 for the extended format.
    #[must_use]
    pub const fn to_parameter(self) -> u32 {
        self.0
    }

    /// Whether CiA 301, 7.3.5, table 40 forbids the identifier to any configurable object.
    #[must_use]
    pub const fn is_restricted(self) -> bool {
        !self.is_extended() && cia301::is_restricted(self.0)
    }
}

/// As the manuals write it: three hex digits, or eight for an extended identifier.
impl fmt::Display for CobId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_extended() { write!(f, "{:08X}", self.raw()) } else { write!(f, "{:03X}", self.raw()) }
    }
}

impl fmt::Debug for CobId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "CobId({self})")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_id_is_1_to_127() {
        assert_eq!(NodeId::new(0), None);
        assert_eq!(NodeId::new(128), None);
        assert_eq!(
            NodeId::all().map(NodeId::get).collect::<std::vec::Vec<_>>(),
            (1..=127).collect::<std::vec::Vec<u8>>()
        );
        assert_eq!(NodeId::try_from(128), Err(InvalidNodeId(128)));
    }

    #[test]
    fn bits_30_and_31_of_a_parameter_are_not_the_identifier() {
        assert_eq!(CobId::from_parameter(0xC000_0185), CobId::standard(0x185).unwrap());
        assert_eq!(CobId::from_parameter(0xA000_0185), CobId::extended(0x185).unwrap());
        assert_eq!(CobId::extended(0x185).unwrap().to_parameter(), 0x2000_0185);
        let are = |values: [u32; 3]| values.map(CobId::is_parameter);
        assert_eq!(are([0xC000_07FF, 0x2000_0800, 0x3FFF_FFFF]), [true; 3]);
        assert_eq!(are([0x0000_0800, 0x8000_1185, 0x1000_0000]), [false; 3]);
        assert_eq!(std::format!("{} {}", CobId::NMT, CobId::extended(0x185).unwrap()), "000 00000185");
    }

    #[test]
    fn identifiers_outside_their_format_are_refused() {
        assert_eq!(CobId::standard(0x800), None);
        assert_eq!(CobId::extended(0x2000_0000), None);
    }
}
