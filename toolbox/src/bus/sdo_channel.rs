//! Frames of the default SDO channel.

use lexican_runtime::cia301::connection;
use lexican_runtime::wire::sdo::ClientRequest;
use lexican_runtime::{CobId, Frame, NodeId};

/// A request to the server of a node.
#[must_use]
pub fn request_frame(node: NodeId, request: ClientRequest) -> Frame {
    Frame::from_array(CobId::of_node(connection::SDO_REQUEST, node), request.to_bytes())
}

/// The COB-ID of the responses of a node.
#[must_use]
pub const fn response_id(node: NodeId) -> CobId {
    CobId::of_node(connection::SDO_RESPONSE, node)
}

/// The node whose server has sent a frame.
#[must_use]
pub fn responder(frame: &Frame) -> Option<NodeId> {
    let low = frame.id().raw().checked_sub(connection::SDO_RESPONSE.into()).filter(|_| !frame.id().is_extended())?;
    NodeId::new(u8::try_from(low).ok()?)
}
