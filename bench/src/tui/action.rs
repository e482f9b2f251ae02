//! The requests of the terminal.

use crate::request::Request;

/// The effect of a key.
#[expect(clippy::large_enum_variant, reason = "there is one at a time")]
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Leave the bench.
    Leave,
    /// Send a request.
    Ask(Purpose, Request),
}

/// What the terminal does with an answer.
#[derive(Clone, Debug, PartialEq)]
pub enum Purpose {
    /// Show its text.
    Say,
    /// Show whether all drives have stopped.
    Stop,
    /// Show whether a drive has stopped.
    StopDrive,
    /// Show the changed PDOs of this node.
    Mapped(u8),
    /// Show the entries of this node.
    Objects(u8),
    /// Show the PDOs of this node.
    Pdos(u8),
    /// Show the last values of entries in this node's PDOs.
    Seen(u8),
    /// Show rows of the trace.
    Trace,
    /// Show curves.
    Plots,
    /// Save as a file with this name, or, if empty, that of the answer.
    File(String),
}

/// A request whose answer is only shown as text.
pub(super) fn say(request: Request) -> Option<Action> {
    Some(Action::Ask(Purpose::Say, request))
}
