//! Where an object lies: index and sub-index.

use core::fmt;

/// Index and sub-index of an entry. Every combination is legal; orders by index, then sub-index.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Address(pub(super) u32);

impl Address {
    /// The entry `index`:`sub`.
    #[must_use]
    pub const fn new(index: u16, sub: u8) -> Self {
        Address((index as u32) << 8 | sub as u32)
    }

    /// The index.
    #[must_use]
    pub const fn index(self) -> u16 {
        (self.0 >> 8) as u16
    }

    /// The sub-index.
    #[must_use]
    pub const fn sub(self) -> u8 {
        self.0 as u8
    }
}

/// As everywhere in lexican: `2410:0A`.
impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04X}:{:02X}", self.index(), self.sub())
    }
}

impl fmt::Debug for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Address({self})")
    }
}
