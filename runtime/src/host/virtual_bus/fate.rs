//! What happens to frames on their way.

use std::boxed::Box;

use crate::{Duration, Frame};

/// What happens to a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// All nodes receive it.
    Deliver,
    /// No node receives it.
    Lose,
    /// All nodes receive it twice.
    Repeat,
    /// All nodes receive another frame.
    Replace(Frame),
    /// All nodes receive it later; frames sent meanwhile overtake it.
    Delay(Duration),
}

/// Decides the fate of a frame by its number, from 0.
type Decision = Box<dyn FnMut(u64, &Frame) -> Fate + Send>;

/// Decides about frames, and counts them.
#[derive(Default)]
pub(super) struct Judge {
    fate: Option<Decision>,
    frames: u64,
}

impl Judge {
    pub(super) fn new(fate: impl FnMut(u64, &Frame) -> Fate + Send + 'static) -> Self {
        Judge { fate: Some(Box::new(fate)), frames: 0 }
    }

    pub(super) fn decide(&mut self, frame: &Frame) -> Fate {
        let number = self.frames;
        self.frames += 1;
        self.fate.as_mut().map_or(Fate::Deliver, |fate| fate(number, frame))
    }
}
