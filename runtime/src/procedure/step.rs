//! The steps of a procedure.

use core::fmt;

use crate::object::{Address, Object, Value, Writable};
use crate::service::sdo_client::Scalar;
use crate::time::Duration;
use crate::wire::nmt::NmtCommand;

/// One step of a procedure.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Step<'a> {
    /// Writes an entry.
    Write {
        address: Address,
        data: Data<'a>,
    },
    /// Reads an entry, and fails if it has another value.
    Expect {
        address: Address,
        mask: u64,
        value: u64,
    },
    /// Reads an entry repeatedly until it has a value.
    Await {
        address: Address,
        mask: u64,
        value: u64,
        /// The time between two readings.
        poll: Duration,
        timeout: Duration,
    },
    /// Reads an entry, decides what to write into another, and repeats this until the goal is reached.
    Steer {
        observed: Address,
        /// The entry that is written, an UNSIGNED16.
        acted: Address,
        steer: &'a dyn Steer,
        /// The time between two readings.
        poll: Duration,
        timeout: Duration,
    },
    Nmt(NmtCommand),
    /// Waits for the node's boot-up message.
    AwaitBootUp {
        timeout: Duration,
    },
    Wait(Duration),
}

/// The data of a write.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Data<'a> {
    Value(Scalar),
    Bytes(&'a [u8]),
}

/// Decides what to write next, from what was read and written.
pub trait Steer: fmt::Debug + Sync {
    /// What to do now. `written` is the last value that this step has written; `None` at its beginning, when the
    /// content of the entry is unknown.
    fn decide(&self, observed: u64, written: Option<u64>) -> Decision;
}

/// A decision for [`Step::Steer`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Decision {
    /// The goal is reached.
    Reached,
    /// Write this number.
    Write(u64),
    /// Read again later.
    Wait,
    /// Give up.
    Impossible,
}

impl<'a> Step<'a> {
    /// Writes an object.
    #[must_use]
    pub fn write<T: Value, A: Writable, M, D>(object: Object<T, A, M, D>, value: T) -> Self {
        Step::value(object.address(), value)
    }

    /// Writes a value into an entry that has no handle.
    #[must_use]
    pub fn value<T: Value>(address: Address, value: T) -> Self {
        Step::Write { address, data: Data::Value(Scalar::of(value)) }
    }

    /// Writes bytes.
    #[must_use]
    pub const fn bytes(address: Address, bytes: &'a [u8]) -> Self {
        Step::Write { address, data: Data::Bytes(bytes) }
    }

    /// Reads an entry, and fails unless all its bits have this value.
    #[must_use]
    pub const fn expect(address: Address, value: u64) -> Self {
        Step::Expect { address, mask: u64::MAX, value }
    }
}

/// In a few words: `write 1017:00`.
impl fmt::Display for Step<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Step::Write { address, .. } => write!(f, "write {address}"),
            Step::Expect { address, value, .. } => write!(f, "expect {value:X}h in {address}"),
            Step::Await { address, value, .. } => write!(f, "wait for {value:X}h in {address}"),
            Step::Steer { acted, .. } => write!(f, "steer by {acted}"),
            Step::Nmt(command) => write!(f, "{command}"),
            Step::AwaitBootUp { .. } => f.write_str("wait for the boot-up message"),
            Step::Wait(span) => write!(f, "wait {span}"),
        }
    }
}
