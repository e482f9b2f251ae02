//! What LSS has changed in a device, to be undone.

use lexican_runtime::NodeId;
use lexican_runtime::wire::lss::Identity;

/// The identity and the node-ID of the device.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Addressed {
    pub(crate) identity: Identity,
    pub(crate) node: NodeId,
}

impl Addressed {
    /// The lowest identity with the same major revision number and this serial number.
    pub(crate) fn of_major_revision(self, serial: u32) -> Identity {
        Identity { revision: self.identity.revision & 0xFFFF_0000, serial, ..self.identity }
    }
}

/// What cases have changed in the device by LSS.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Changes {
    /// The device, once LSS has been used.
    pub(crate) device: Option<Addressed>,
    /// The node-ID that it was given; the inner `None` is no node-ID.
    pub(crate) node: Option<Option<NodeId>>,
    /// Whether it was given a bit rate.
    pub(crate) bit_rate: bool,
}
