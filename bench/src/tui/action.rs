//! What the terminal asks for.

use crate::request::Request;

/// What a key asks for.
#[expect(clippy::large_enum_variant, reason = "there is one at a time")]
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// To leave.
    Leave,
    /// To carry a request out.
    Ask(Purpose, Request),
}

/// What an answer is for.
#[derive(Clone, Debug, PartialEq)]
pub enum Purpose {
    /// To be said.
    Say,
    /// To say whether all drives have stopped.
    Stop,
    /// To say whether one drive has.
    StopDrive,
    /// To be shown: the PDOs of this node that were written.
    Mapped(u8),
    /// To be shown: the entries of this node.
    Objects(u8),
    /// The PDOs of this node.
    Pdos(u8),
    /// What was seen of the entries in the PDOs of this node.
    Seen(u8),
    /// Rows of the trace.
    Trace,
    /// Curves.
    Plots,
    /// A file of this name; that of the answer if it is empty.
    File(String),
}

/// Asks for a request whose answer is only said.
pub(super) fn say(request: Request) -> Option<Action> {
    Some(Action::Ask(Purpose::Say, request))
}
