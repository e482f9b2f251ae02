//! Node-IDs on the command line.

use std::str::FromStr;

use lexican_runtime::NodeId;
use lexican_toolbox::node_id::{NodeIdError, node_id};

/// A node-ID, or `none`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NodeOrNone(pub(crate) Option<NodeId>);

impl FromStr for NodeOrNone {
    type Err = NodeIdError;

    fn from_str(text: &str) -> Result<Self, NodeIdError> {
        if text == "none" { Ok(NodeOrNone(None)) } else { node_id(text).map(|node| NodeOrNone(Some(node))) }
    }
}

/// Several node-IDs: `3,5-9`; in the order of the text, each once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct NodeIds(pub(crate) Vec<NodeId>);

impl FromStr for NodeIds {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut nodes = Vec::new();
        for part in text.split(',').map(str::trim) {
            let (first, last) = part.split_once('-').unwrap_or((part, part));
            let (first, last) = (node_id(first.trim())?, node_id(last.trim())?);
            if first > last {
                return Err(format!("{part:?} is no range: write the lower node-ID first"));
            }
            nodes.extend(NodeId::all().filter(|node| (first..=last).contains(node)));
        }
        let mut seen = Vec::new();
        nodes.retain(|node| {
            !seen.contains(node) && {
                seen.push(*node);
                true
            }
        });
        Ok(NodeIds(nodes))
    }
}

/// What is said of a node: `5=siko/ag03-1`.
pub(crate) fn of_node(text: &str) -> Result<(NodeId, String), String> {
    let (node, said) = text.split_once('=').ok_or("write ID=FILE or ID=DEVICE, for example 5=siko/ag03-1")?;
    Ok((node_id(node)?, said.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_and_ranges_are_node_ids() {
        for (text, ids) in [
            ("5", &[5][..]),
            ("0x10", &[16]),
            ("3,5-9", &[3, 5, 6, 7, 8, 9]),
            ("0x7E-127, 1", &[126, 127, 1]),
            ("5,4-6", &[5, 4, 6]),
        ] {
            let nodes: NodeIds = text.parse().unwrap();
            assert_eq!(nodes.0.iter().map(|node| node.get()).collect::<Vec<_>>(), ids, "{text}");
        }
        for text in ["", "0", "128", "5-", "9-5", "5,,6", "1-2-3", "0x", "x5", "0x-5"] {
            assert!(text.parse::<NodeIds>().is_err(), "{text}");
        }
    }
}
