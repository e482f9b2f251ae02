//! What refuses which orders: rows of a table.

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
    /// Whether one of them has to be set; else all of them have to be clear.
    pub set: bool,
}

/// A row: while `when` holds, the drive refuses these orders, since something is missing.
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

    /// The same bits are clear.
    #[must_use]
    pub const fn clear(self) -> Self {
        Test { set: false, ..self }
    }

    /// Whether a word of this kind passes.
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
    /// Homing, wherever to.
    pub const HOME: Orders = Orders(1 << 6);
    /// Another set-point while travelling.
    pub const ADD: Orders = Orders(1 << 7);
    /// All that moves.
    pub const MOVE: Orders = Orders::TRAVEL.and(Orders::ADD).and(Orders::INCH).and(Orders::RUN).and(Orders::HOME);
    /// All that begins from rest.
    pub const FROM_REST: Orders = Orders::TRAVEL.and(Orders::INCH).and(Orders::SET_UP);
    /// Leading to OPERATION ENABLED.
    pub const ENABLE: Orders = Orders(1 << 4);
    /// Changing mode, calibration or parameters.
    pub const SET_UP: Orders = Orders(1 << 5);

    /// These and those.
    #[must_use]
    pub const fn and(self, other: Orders) -> Orders {
        Orders(self.0 | other.0)
    }

    /// Whether one of the others is among these.
    #[must_use]
    pub const fn contains(self, other: Orders) -> bool {
        self.0 & other.0 != 0
    }
}
