//! What a data sheet's overlay says beyond types and limits, as data for the device that serves the objects.

use super::{Address, Limit};
use crate::wire::nmt::NmtState;

/// `2102:00 == 2`, or `2412:00 != 0`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Condition {
    /// The entry that decides.
    pub address: Address,
    /// Whether it must be equal; else it must differ.
    pub equal: bool,
    /// What it is compared with, in wire form.
    pub raw: u64,
}

impl Condition {
    /// A condition on the entry `index`:`sub`.
    #[must_use]
    pub const fn new(index: u16, sub: u8, equal: bool, raw: u64) -> Self {
        Condition { address: Address::new(index, sub), equal, raw }
    }

    /// Whether it holds when the entry has this value, in wire form.
    #[must_use]
    pub const fn holds(&self, raw: u64) -> bool {
        (self.raw == raw) == self.equal
    }
}

/// Limits of an entry that hold while another entry has a certain value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct ConditionalLimit {
    pub address: Address,
    pub when: Condition,
    pub limit: Limit,
}

impl ConditionalLimit {
    /// Limits of the entry `index`:`sub`, in wire form.
    #[must_use]
    pub const fn new(index: u16, sub: u8, when: Condition, low: u64, high: u64) -> Self {
        ConditionalLimit { address: Address::new(index, sub), when, limit: Limit { low, high } }
    }
}

/// In which NMT states an entry may be written; entries that are not listed may be in all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct WritableIn {
    pub address: Address,
    pub pre_operational: bool,
    pub operational: bool,
}

impl WritableIn {
    /// The states in which the entry `index`:`sub` may be written.
    #[must_use]
    pub const fn new(index: u16, sub: u8, pre_operational: bool, operational: bool) -> Self {
        WritableIn { address: Address::new(index, sub), pre_operational, operational }
    }

    /// Whether the entry may be written in a state.
    #[must_use]
    pub const fn allows(&self, state: NmtState) -> bool {
        match state {
            NmtState::PreOperational => self.pre_operational,
            NmtState::Operational => self.operational,
            // Not written in these states.
            _ => false,
        }
    }
}
