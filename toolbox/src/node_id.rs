//! Node-IDs as people write them.

use lexican_runtime::NodeId;

/// A text is no node-ID.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NodeIdError {
    /// It is not even a number.
    #[error("{0:?} is not a number")]
    NotANumber(String),
    /// No node has this number.
    #[error("{0} is not a node-ID: node-IDs are 1 to 127")]
    OutOfRange(u32),
}

/// For parsers of arguments, which want a text.
impl From<NodeIdError> for String {
    fn from(error: NodeIdError) -> String {
        error.to_string()
    }
}

/// A node-ID in decimal or, after `0x`, in hexadecimal.
///
/// # Errors
///
/// [`NodeIdError`].
pub fn node_id(text: &str) -> Result<NodeId, NodeIdError> {
    let digits = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X"));
    let number = digits.map_or_else(|| text.parse::<u32>(), |digits| u32::from_str_radix(digits, 16));
    let number = number.map_err(|_| NodeIdError::NotANumber(text.to_owned()))?;
    let id = u8::try_from(number).ok().and_then(NodeId::new);
    id.ok_or(NodeIdError::OutOfRange(number))
}
