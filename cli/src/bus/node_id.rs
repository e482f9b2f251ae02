//! Node-IDs in arguments.

use std::convert::Infallible;
use std::str::FromStr;

use lexican_runtime::NodeId;
use lexican_toolbox::text::node_id::{NodeIdError, node_id, node_ids};

/// A node-ID, or `none`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NodeOrNone(pub(crate) Option<NodeId>);

impl FromStr for NodeOrNone {
    type Err = NodeIdError;

    fn from_str(text: &str) -> Result<Self, NodeIdError> {
        if text == "none" { Ok(NodeOrNone(None)) } else { node_id(text).map(|node| NodeOrNone(Some(node))) }
    }
}

/// Several node-IDs, `3,5-9`: in the order of the text, without duplicates.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct NodeIds(pub(crate) Vec<NodeId>);

impl FromStr for NodeIds {
    type Err = NodeIdError;

    fn from_str(text: &str) -> Result<Self, NodeIdError> {
        node_ids(text).map(NodeIds)
    }
}

/// The value of `--device`, for one node or for all.
#[derive(Clone, Debug)]
pub(crate) struct SheetName {
    pub(crate) node: Option<NodeId>,
    /// A file, a device of the library, or `none`.
    pub(crate) sheet: String,
}

impl FromStr for SheetName {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Infallible> {
        let of_one = text.split_once('=').and_then(|(node, sheet)| Some((Some(node_id(node).ok()?), sheet)));
        let (node, sheet) = of_one.unwrap_or((None, text));
        Ok(SheetName { node, sheet: sheet.to_owned() })
    }
}

/// Parses a value for a node: `5=siko/ag03-1`.
pub(crate) fn of_node(text: &str) -> Result<(NodeId, String), String> {
    let (node, said) = text.split_once('=').ok_or("write ID=FILE or ID=DEVICE, for example 5=siko/ag03-1")?;
    Ok((node_id(node)?, said.to_owned()))
}
