//! The ten DIP switches below the cover: node address (7.13), factory settings (2.4), bus termination (7.15).

use std::fmt;
use std::str::FromStr;

use lexican_runtime::NodeId;

/// The positions of SW1 to SW10; bit 0 is SW1, and 1 is ON. The drive reads SW1 to SW8 when its supply is
/// switched on, and at no other time (7.13).
///
/// ```
/// use siko_ag03_1::sim::{DipSwitches, Termination};
///
/// let switches: DipSwitches = "1010000 0 11".parse()?;
/// assert_eq!(switches.node().get(), 5);
/// assert_eq!(switches.termination(), Termination::Active);
/// # Ok::<(), siko_ag03_1::sim::NotSwitches>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DipSwitches(u16);

/// SW1 to SW7.
const ADDRESS: u16 = 0x7F;
/// SW8.
const RESTORE: u16 = 1 << 7;
/// SW9 and SW10.
const TERMINATION: u16 = 0b11 << 8;

impl DipSwitches {
    /// The switches in these positions; bits beyond SW10 are ignored.
    #[must_use]
    pub const fn new(bits: u16) -> Self {
        DipSwitches(bits & (ADDRESS | RESTORE | TERMINATION))
    }

    /// The address of `node`; all other switches are OFF.
    #[must_use]
    pub const fn for_node(node: NodeId) -> Self {
        DipSwitches(node.get() as u16)
    }

    /// The positions; bit 0 is SW1.
    #[must_use]
    pub const fn bits(self) -> u16 {
        self.0
    }

    /// The same with another address on SW1 to SW7.
    #[must_use]
    pub const fn with_node(self, node: NodeId) -> Self {
        DipSwitches(self.0 & !ADDRESS | node.get() as u16)
    }

    /// The same, set to restore factory settings; `None` switches SW8 OFF. The address must be set again afterwards
    /// (2.4, steps 5 and 6).
    #[must_use]
    pub const fn with_restore(self, restore: Option<Restore>) -> Self {
        match restore {
            Some(restore) => DipSwitches(self.0 & TERMINATION | RESTORE | restore.switches()),
            None => DipSwitches(self.0 & !RESTORE),
        }
    }

    /// The same with both termination switches ON, or both OFF.
    #[must_use]
    pub const fn with_termination(self, active: bool) -> Self {
        DipSwitches(if active { self.0 | TERMINATION } else { self.0 & !TERMINATION })
    }

    /// The node-ID that SW1 to SW7 set: all OFF means 1 (7.13).
    #[must_use]
    pub const fn node(self) -> NodeId {
        match NodeId::new((self.0 & ADDRESS) as u8) {
            Some(node) => node,
            None => NodeId::literal(1),
        }
    }

    /// The factory settings that the drive restores when its supply is switched on (2.4).
    #[must_use]
    pub fn restore(self) -> Option<Restore> {
        let asked = self.0 & RESTORE != 0;
        Restore::ALL.into_iter().find(|restore| asked && self.0 & ADDRESS == restore.switches())
    }

    /// The state of the bus termination (7.15).
    #[must_use]
    pub const fn termination(self) -> Termination {
        match self.0 & TERMINATION {
            0 => Termination::Deactivated,
            TERMINATION => Termination::Active,
            _ => Termination::Incomplete,
        }
    }
}

/// Ten digits, SW1 first.
impl fmt::Display for DipSwitches {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (0..10).try_for_each(|bit| write!(f, "{}", self.0 >> bit & 1))
    }
}

/// Ten digits, SW1 first; spaces are ignored.
impl FromStr for DipSwitches {
    type Err = NotSwitches;

    fn from_str(text: &str) -> Result<Self, NotSwitches> {
        let (mut bits, mut count) = (0, 0);
        for digit in text.chars().filter(|digit| *digit != ' ') {
            let on = digit.to_digit(2).filter(|_| count < 10).ok_or(NotSwitches)?;
            bits |= (on as u16) << count;
            count += 1;
        }
        if count == 10 { Ok(DipSwitches(bits)) } else { Err(NotSwitches) }
    }
}

/// Why a text is not a set of ten switches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("ten switches are ten digits, SW1 first, 1 for ON: `1010000 0 00` is node 5")]
pub struct NotSwitches;

/// The parameters that get their factory settings (2.4), the same three choices as in 1011h.
///
/// The manual shows the positions of SW1 to SW8 in pictures, which were not available for this simulator. That SW8 is
/// ON follows from step 6. The choice on SW1 to SW7 is an assumption: the sub-index of 1011h that does the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Restore {
    /// All parameters, 1011h:01.
    All,
    /// The standard parameters, 1011h:02.
    Standard,
    /// The controller parameters, 1011h:03.
    Controller,
}

impl Restore {
    /// All three, in the order of 1011h.
    pub const ALL: [Restore; 3] = [Restore::All, Restore::Standard, Restore::Controller];

    /// The sub-index of 1011h that does the same.
    #[must_use]
    pub const fn sub_index(self) -> u8 {
        match self {
            Restore::All => 1,
            Restore::Standard => 2,
            Restore::Controller => 3,
        }
    }

    const fn switches(self) -> u16 {
        self.sub_index() as u16
    }
}

/// The terminating resistor of the bus (7.15).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Termination {
    /// SW9 and SW10 are OFF.
    Deactivated,
    /// SW9 and SW10 are ON.
    Active,
    /// One is ON and one is OFF; a termination takes both.
    Incomplete,
}
