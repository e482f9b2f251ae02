//! What a test does only if it is allowed, since it may move a machine, or outlast the test.

use lexican_eds::model::{AccessType, Device};

/// Something that a test may do to a device only if it is allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Hazard {
    /// Gives a drive orders: control word, operating mode, targets (CiA 402).
    Motion,
    /// Sets process outputs: objects in 6000h to 9FFFh that an RPDO may map.
    Outputs,
    /// Writes manufacturer objects, 2000h to 5FFFh, whose effect is described only in the manual.
    Manufacturer,
    /// Stores parameters (1010h).
    Store,
    /// Restores parameters (1011h).
    Restore,
    /// Changes the node-ID or the bit rate.
    NodeId,
}

/// The objects of CiA 402-2 with orders, as in the first axis.
const ORDERS: [u16; 10] = [0x6040, 0x6042, 0x6060, 0x6071, 0x607A, 0x60B0, 0x60B1, 0x60B2, 0x60C1, 0x60FF];

impl Hazard {
    /// All of them.
    pub const ALL: [Hazard; 6] =
        [Hazard::Motion, Hazard::Outputs, Hazard::Manufacturer, Hazard::Store, Hazard::Restore, Hazard::NodeId];

    /// The name by which it is allowed.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Hazard::Motion => "motion",
            Hazard::Outputs => "outputs",
            Hazard::Manufacturer => "manufacturer",
            Hazard::Store => "store",
            Hazard::Restore => "restore",
            Hazard::NodeId => "node-id",
        }
    }

    /// What the test would do, in words.
    #[must_use]
    pub const fn what(self) -> &'static str {
        match self {
            Hazard::Motion => "gives a drive orders",
            Hazard::Outputs => "sets process outputs",
            Hazard::Manufacturer => "writes objects of the manufacturer",
            Hazard::Store => "stores parameters",
            Hazard::Restore => "restores parameters",
            Hazard::NodeId => "changes node-ID or bit rate",
        }
    }

    /// The hazard of writing an object, if there is one.
    #[must_use]
    pub fn of_write(device: &Device, index: u16) -> Option<Hazard> {
        // Objects of the profile repeat every 800h, for up to eight axes or units.
        let of_axis = |index: u16| 0x6000 + (index - 0x6000) % 0x800;
        match index {
            0x1010 => Some(Hazard::Store),
            0x1011 => Some(Hazard::Restore),
            0x2000..=0x5FFF if is_about_identity(device, index) => Some(Hazard::NodeId),
            0x2000..=0x5FFF => Some(Hazard::Manufacturer),
            0x6000..=0x9FFF if device.profile == Some(402) => {
                ORDERS.contains(&of_axis(index)).then_some(Hazard::Motion)
            }
            0x6000..=0x9FFF => is_output(device, index).then_some(Hazard::Outputs),
            _ => None,
        }
    }
}

/// Whether an object is the node-ID or the bit rate, judged by its name.
fn is_about_identity(device: &Device, index: u16) -> bool {
    let name = device.object(index).map(|object| object.name.to_ascii_lowercase()).unwrap_or_default();
    ["node id", "node-id", "nodeid", "node address", "baud", "bit rate", "bitrate"]
        .iter()
        .any(|word| name.contains(word))
}

fn is_output(device: &Device, index: u16) -> bool {
    device.entries().any(|entry| {
        entry.index == index
            && entry.pdo_mapping
            && !matches!(entry.access, AccessType::Ro | AccessType::Rwr | AccessType::Const)
    })
}
