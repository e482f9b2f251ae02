//! What a frame says.

use lexican_runtime::{Frame, NodeId};

use super::detail::{Detail, Side};

/// A frame in words and in parts.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Decoded {
    pub(crate) service: Service,
    /// `RPDO3`, `SDO request`.
    pub(crate) name: String,
    /// Whom it concerns; `None` for everybody.
    pub(crate) node: Option<NodeId>,
    /// In words; may be empty.
    pub(crate) text: String,
    /// Whether something went wrong.
    pub(crate) alarming: bool,
    /// In parts.
    pub(crate) detail: Detail,
}

/// The services of CiA 301.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Service {
    Nmt,
    Sync,
    Time,
    Emcy,
    Rpdo,
    Tpdo,
    Sdo,
    ErrorControl,
    Lss,
    Unknown,
}

impl Decoded {
    /// Whether nobody but the node itself sends such a frame.
    pub(crate) fn is_from_node(&self) -> bool {
        match &self.detail {
            Detail::Sdo(sdo) => sdo.side == Side::Server,
            Detail::Pdo(pdo) => !pdo.received,
            Detail::Emcy(_) | Detail::ErrorControl { .. } => true,
            _ => false,
        }
    }

    pub(super) fn new(service: Service, name: impl Into<String>, node: Option<NodeId>) -> Self {
        Decoded { service, name: name.into(), node, text: String::new(), alarming: false, detail: Detail::None }
    }

    /// A frame that its service does not have.
    pub(super) fn unreadable(service: Service, name: &str, node: Option<NodeId>, frame: &Frame) -> Self {
        let text = format!("not readable: {} bytes {}", frame.dlc(), crate::values::hex(frame.data()));
        Decoded { text, alarming: true, ..Decoded::new(service, name, node) }
    }
}
