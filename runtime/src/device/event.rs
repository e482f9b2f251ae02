//! What happens to a device.

use crate::abort::AbortCode;
use crate::id::NodeId;
use crate::object::{Address, TimeOfDay};
use crate::service::nmt::Reset;
use crate::service::{guarding, heartbeat_consumer};
use crate::wire::nmt::NmtState;

/// What happened to a device. One frame or deadline is at most one event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The device is in another NMT state.
    StateChanged(NmtState),
    /// A manager asks for a reset. The device is silent until the application has reset its values
    /// and calls [`Device::restart`](super::Device::restart).
    Reset(Reset),
    /// A client has written an entry, and the dictionary has it. When the entry configures the
    /// communication, it is in effect already.
    Written(Address),
    /// A client's access to an entry failed, or the client gave up.
    SdoAborted {
        /// The entry.
        address: Address,
        /// Why.
        reason: AbortCode,
    },
    /// The objects of an RPDO are in the dictionary.
    RpdoReceived {
        /// 1 to 512.
        number: u16,
    },
    /// The same, but the dictionary refused at least one of the objects.
    RpdoRefused {
        /// 1 to 512.
        number: u16,
        /// The first object that was refused.
        address: Address,
        /// Why.
        reason: AbortCode,
    },
    /// An RPDO was shorter than its mapping, and ignored.
    RpdoTooShort {
        /// 1 to 512.
        number: u16,
        /// The bytes that are mapped.
        expected: u8,
        /// The bytes that came.
        got: u8,
    },
    /// An RPDO did not come within its deadline.
    RpdoTimedOut {
        /// 1 to 512.
        number: u16,
    },
    /// SYNC: received, or sent by the device itself.
    Sync {
        /// When the producer counts.
        counter: Option<u8>,
        /// The RPDOs whose objects are in the dictionary with it.
        applied: PdoSet,
        /// The RPDOs of which the dictionary refused at least one object.
        refused: PdoSet,
    },
    /// The time of day.
    Time(TimeOfDay),
    /// Something happened to a node whose heartbeat the device consumes (1016h).
    Heartbeat {
        /// Which node.
        node: NodeId,
        /// What.
        event: heartbeat_consumer::Event,
    },
    /// Nobody guards the device any more, or somebody does again.
    LifeGuarding(guarding::Event),
}

/// A set of PDO numbers, 1 to 512.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
pub struct PdoSet([u64; 8]);

impl PdoSet {
    /// No PDO.
    pub const EMPTY: PdoSet = PdoSet([0; 8]);

    /// Adds a PDO; numbers that are none are ignored.
    pub fn insert(&mut self, number: u16) {
        let (word, bit) = Self::place(number);
        if let Some(word) = self.0.get_mut(word) {
            *word |= bit;
        }
    }

    /// Whether the PDO is in the set.
    #[must_use]
    pub fn contains(&self, number: u16) -> bool {
        let (word, bit) = Self::place(number);
        self.0.get(word).is_some_and(|word| word & bit != 0)
    }

    /// Whether the set is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::EMPTY
    }

    /// The numbers, ascending.
    pub fn iter(&self) -> impl Iterator<Item = u16> + '_ {
        (1..=512).filter(|&number| self.contains(number))
    }

    /// Number 0 becomes a word that no set has.
    fn place(number: u16) -> (usize, u64) {
        let at = number.wrapping_sub(1);
        (usize::from(at / 64), 1 << (at % 64))
    }
}

impl core::fmt::Debug for PdoSet {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_set().entries(self.iter()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::PdoSet;

    #[test]
    fn a_set_holds_the_numbers_1_to_512() {
        let mut set = PdoSet::EMPTY;
        [1, 64, 65, 512, 0, 513].into_iter().for_each(|number| set.insert(number));
        assert_eq!(std::format!("{set:?}"), "{1, 64, 65, 512}");
        assert!(!set.contains(0) && !set.contains(513) && !set.is_empty());
    }
}
