//! Which conditions refuse which orders, as rows of a table.

use crate::error::Missing;

/// A word of status bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Word {
    /// The status word (6041h).
    Status,
    /// The manufacturer's status register ([`Objects::system_word`](super::Objects::system_word)).
    System,
}

/// A condition on the bits of a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Test {
    /// Where the bits are.
    pub word: Word,
    /// Which bits.
    pub mask: u32,
    /// Whether the test holds if any of the bits is set; else it holds if all of them are clear.
    pub set: bool,
}

/// While `when` holds, the drive refuses these orders, because of what is missing.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Condition {
    pub when: Test,
    pub refuses: Orders,
    pub missing: Missing,
}

/// A set of orders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Orders(u16);

impl Test {
    /// One of these bits of the status word is set.
    #[must_use]
    pub const fn of_status(mask: u16) -> Self {
        Test { word: Word::Status, mask: mask as u32, set: true }
    }

    /// One of these bits of the manufacturer's status register is set.
    #[must_use]
    pub const fn of_system(mask: u32) -> Self {
        Test { word: Word::System, mask, set: true }
    }

    /// The test that all of these bits are clear.
    #[must_use]
    pub const fn clear(self) -> Self {
        Test { set: false, ..self }
    }

    /// Whether the test holds for a word of this kind.
    #[must_use]
    pub const fn holds(&self, word: u32) -> bool {
        (word & self.mask != 0) == self.set
    }
}

impl Orders {
    /// Travelling to a position.
    pub const TRAVEL: Orders = Orders(1 << 0);
    /// Inching towards greater positions.
    pub const INCH_POSITIVE: Orders = Orders(1 << 1);
    /// Inching towards smaller positions.
    pub const INCH_NEGATIVE: Orders = Orders(1 << 2);
    /// Inching either way.
    pub const INCH: Orders = Orders::INCH_POSITIVE.and(Orders::INCH_NEGATIVE);
    /// Running at a velocity, or turning with a torque.
    pub const RUN: Orders = Orders(1 << 3);
    /// Homing, by any method.
    pub const HOME: Orders = Orders(1 << 6);
    /// Another set-point while travelling.
    pub const ADD: Orders = Orders(1 << 7);
    /// Every order that moves the drive.
    pub const MOVE: Orders = Orders::TRAVEL.and(Orders::ADD).and(Orders::INCH).and(Orders::RUN).and(Orders::HOME);
    /// Every order that needs a drive at rest.
    pub const FROM_REST: Orders = Orders::TRAVEL.and(Orders::INCH).and(Orders::SET_UP);
    /// Leading to OPERATION ENABLED.
    pub const ENABLE: Orders = Orders(1 << 4);
    /// Changing mode, calibration or parameters.
    pub const SET_UP: Orders = Orders(1 << 5);

    /// The union of both.
    #[must_use]
    pub const fn and(self, other: Orders) -> Orders {
        Orders(self.0 | other.0)
    }

    /// Whether any order is in both.
    #[must_use]
    pub const fn contains(self, other: Orders) -> bool {
        self.0 & other.0 != 0
    }
}
