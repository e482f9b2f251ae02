//! What LSS has changed of a device, and has to be put back.

use lexican_runtime::NodeId;
use lexican_runtime::wire::lss::Identity;

/// The device as LSS knows it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Addressed {
    pub(crate) identity: Identity,
    pub(crate) node: NodeId,
}

impl Addressed {
    /// The lowest identity of the same major revision number with this serial number.
    pub(crate) fn of_major_revision(self, serial: u32) -> Identity {
        Identity { revision: self.identity.revision & 0xFFFF_0000, serial, ..self.identity }
    }
}

/// What cases have done to the device by LSS.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Changes {
    /// The device, once LSS has been used.
    pub(crate) device: Option<Addressed>,
    /// The node-ID that it was given.
    pub(crate) node: Option<Option<NodeId>>,
    /// It was given a bit rate.
    pub(crate) bit_rate: bool,
}
