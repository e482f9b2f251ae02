//! The prompt in the last line.

use super::action::Action;
use super::text::Text;

/// A question with the text typed so far.
pub(super) struct Prompt {
    pub(super) title: &'static str,
    /// The subject of the question: `5 feeder 6081:00`.
    pub(super) of: String,
    pub(super) typed: String,
    pub(super) then: Then,
}

/// What to do with the answer.
pub(super) enum Then {
    /// Make a request. It is bound to its subject now, because the selection may change meanwhile.
    Ask(Box<dyn FnOnce(String) -> Result<Action, String>>),
    /// Change a field of the screen.
    Set(Field),
}

/// A text that a tab keeps, without a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Field {
    Search,
    Text,
    Services,
    Nodes,
    Object,
    Timing,
    Trigger,
}

impl Field {
    pub(super) const fn title(self) -> Text {
        match self {
            Field::Search => Text::AskSearch,
            Field::Text => Text::AskFilter,
            Field::Services => Text::AskServices,
            Field::Nodes => Text::AskNodes,
            Field::Object => Text::AskObject,
            Field::Timing => Text::AskTiming,
            Field::Trigger => Text::AskTrigger,
        }
    }
}

impl Prompt {
    /// Takes pasted text. It counts as text, never as keys, so line breaks are removed.
    pub(super) fn paste(&mut self, text: &str) {
        self.typed.extend(text.chars().filter(|character| !character.is_control()));
    }
}
