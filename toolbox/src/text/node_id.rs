//! Parses node-IDs as users write them.

use std::collections::BTreeSet;

use lexican_runtime::NodeId;

/// The text is no node-ID.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NodeIdError {
    /// It is not a number.
    #[error("{0:?} is not a number")]
    NotANumber(String),
    /// The first number of the range is greater than the last.
    #[error("{0:?} is no range: write the lower node-ID first")]
    NoRange(String),
    /// The number is not from 1 to 127.
    #[error("{0} is not a node-ID: node-IDs are 1 to 127")]
    OutOfRange(u32),
}

/// For clap's parsers, which accept a text as error.
impl From<NodeIdError> for String {
    fn from(error: NodeIdError) -> String {
        error.to_string()
    }
}

/// Parses a node-ID, decimal, or hexadecimal after `0x`.
pub fn node_id(text: &str) -> Result<NodeId, NodeIdError> {
    let digits = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X"));
    let number = digits.map_or_else(|| text.parse::<u32>(), |digits| u32::from_str_radix(digits, 16));
    let number = number.map_err(|_| NodeIdError::NotANumber(text.to_owned()))?;
    let id = u8::try_from(number).ok().and_then(NodeId::new);
    id.ok_or(NodeIdError::OutOfRange(number))
}

/// Parses several node-IDs, `3,5-9`: in the order of the text, without duplicates.
pub fn node_ids(text: &str) -> Result<Vec<NodeId>, NodeIdError> {
    let mut nodes = Vec::new();
    for part in text.split(',').map(str::trim) {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let (first, last) = (node_id(first.trim())?, node_id(last.trim())?);
        if first > last {
            return Err(NodeIdError::NoRange(part.to_owned()));
        }
        nodes.extend(NodeId::all().filter(|node| (first..=last).contains(node)));
    }
    let mut seen = BTreeSet::new();
    nodes.retain(|node| seen.insert(*node));
    Ok(nodes)
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
            assert_eq!(node_ids(text).unwrap().iter().map(|node| node.get()).collect::<Vec<_>>(), ids, "{text}");
        }
        for text in ["", "0", "128", "5-", "9-5", "5,,6", "1-2-3", "0x", "x5", "0x-5"] {
            assert!(node_ids(text).is_err(), "{text}");
        }
    }
}
