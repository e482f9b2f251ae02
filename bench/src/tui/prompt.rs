//! A question in the last line.

use super::action::Action;
use super::text::Text;

/// A question, and what was typed so far.
pub(super) struct Prompt {
    pub(super) title: &'static str,
    /// What it is about: `5 feeder 6081:00`.
    pub(super) of: String,
    pub(super) typed: String,
    pub(super) then: Then,
}

/// What becomes of the answer to a question.
pub(super) enum Then {
    /// It knows what it is about: the selected row may be another one by then.
    Ask(Box<dyn FnOnce(String) -> Result<Action, String>>),
    /// It changes the screen alone.
    Set(Field),
}

/// What somebody types for a tab, and no request asks for.
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
    /// Takes what was pasted: text, of which no part is a key. A line break would be one.
    pub(super) fn paste(&mut self, text: &str) {
        self.typed.extend(text.chars().filter(|character| !character.is_control()));
    }
}
