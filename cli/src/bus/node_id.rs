//! Node-IDs on the command line.

use std::str::FromStr;

use lexican_runtime::NodeId;

/// A node-ID, or `none`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NodeOrNone(pub(crate) Option<NodeId>);

impl FromStr for NodeOrNone {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "none" { Ok(NodeOrNone(None)) } else { node_id(text).map(|node| NodeOrNone(Some(node))) }
    }
}

pub(crate) fn node_id(text: &str) -> Result<NodeId, String> {
    let number: u32 = text.parse().map_err(|_| format!("{text:?} is not a number"))?;
    let id = u8::try_from(number).ok().and_then(NodeId::new);
    id.ok_or_else(|| format!("{number} is not a node-ID: node-IDs are 1 to 127"))
}
