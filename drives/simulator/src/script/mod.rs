//! Scripts: what happens to a simulated drive, and when.
//!
//! A [`Script`] is a list of steps, made in code or read from TOML (feature `script`). The steps happen one after
//! another; each waits for its [`Trigger`] and then makes its changes at once. Time is that of the bus, so a script
//! does the same in virtual and in real time. Each drive defines what can change:
//! [`Change`](crate::servo::script::Change) for a servo.
//!
//! # TOML
//!
//! A file is a list of `[[step]]`s. Every key of a step is optional, but a step has to change something. Unknown keys
//! and impossible values are refused with their line and a remedy (`ScriptError`). Besides the keys of the drive there
//! are:
//!
//! | Key | Value | What it does |
//! |---|---|---|
//! | `at_ms` | milliseconds | the step happens at this time after the start of the script |
//! | `when` | a condition | it happens as soon as the condition holds |
//! | `after_ms` | milliseconds | it happens at this time after the previous step, or after `when` has come true |
//!
//! Conditions are `moving`, `standing`, `positioning`, `target reached`, `switch on disabled`, `ready to switch on`,
//! `switched on`, `operation enabled`, `quick stop active`, `fault`, `no fault`, `operational`, `pre-operational`,
//! `stopped`, `on`, `off`, `position above N` and `position below N`.

mod condition;
#[cfg(feature = "script")]
mod input;
#[cfg(feature = "script")]
mod toml;

pub use condition::Condition;
#[cfg(feature = "script")]
pub use input::{Input, Range, Takes, listed};
#[cfg(feature = "script")]
pub use toml::{FromToml, Reading, ScriptError};

use lexican_runtime::{Duration, Instant};

/// What happens to a drive, step by step. See the [module](self).
#[derive(Clone, Debug, PartialEq)]
pub struct Script<C> {
    steps: Vec<Step<C>>,
}

/// Changes that happen together.
#[derive(Clone, Debug, PartialEq)]
pub struct Step<C> {
    /// What it waits for.
    pub trigger: Trigger,
    /// The changes, in this order.
    pub changes: Vec<C>,
}

/// What a step waits for after the previous one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trigger {
    /// This long after the start of the script; at once if that is past.
    At(Duration),
    /// This long after the previous step.
    After(Duration),
    /// Until a condition holds; it may hold already.
    When {
        /// The condition.
        condition: Condition,
        /// How long to wait after that, whether or not the condition still holds.
        and_then: Duration,
    },
}

impl<C> Default for Script<C> {
    fn default() -> Self {
        Script { steps: Vec::new() }
    }
}

impl<C> Script<C> {
    /// The same with one more step.
    #[must_use]
    pub fn then(mut self, trigger: Trigger, changes: impl Into<Vec<C>>) -> Self {
        self.steps.push(Step { trigger, changes: changes.into() });
        self
    }

    /// The steps, in their order.
    #[must_use]
    pub fn steps(&self) -> &[Step<C>] {
        &self.steps
    }
}

/// A script and its progress.
#[derive(Clone, Debug)]
pub struct Following<C> {
    script: Script<C>,
    /// How many steps have happened.
    done: usize,
    began: Instant,
    /// When the last step happened.
    last: Instant,
    /// Since when the condition of the next step has been seen to hold.
    held_since: Option<Instant>,
    /// When the condition was last checked.
    seen: Instant,
}

impl<C> Default for Following<C> {
    fn default() -> Self {
        Following::new(Instant::ZERO, Script::default())
    }
}

impl<C> Following<C> {
    /// A script that begins at `now`.
    #[must_use]
    pub fn new(now: Instant, script: Script<C>) -> Self {
        Following { script, done: 0, began: now, last: now, held_since: None, seen: now }
    }

    /// How many steps have not happened yet.
    #[must_use]
    pub fn steps_left(&self) -> usize {
        self.script.steps.len() - self.done
    }

    /// When to check the next step again. `is_so` says whether a condition holds at a time, and `may_become_so` when it
    /// may next come true by itself.
    pub fn next_step(
        &self,
        is_so: impl FnOnce(Instant, Condition) -> bool,
        may_become_so: impl FnOnce(Instant, Condition) -> Option<Instant>,
    ) -> Option<Instant> {
        match self.script.steps.get(self.done)?.trigger {
            Trigger::At(span) => Some(self.began + span),
            Trigger::After(span) => Some(self.last + span),
            Trigger::When { condition, and_then } => match self.held_since {
                Some(since) => Some(since + and_then),
                None if is_so(self.seen, condition) => Some(self.seen),
                None => may_become_so(self.seen, condition),
            },
        }
    }
}

impl<C: Clone> Following<C> {
    /// The changes of the next step if its time has come; the step is then done.
    pub fn take_step(&mut self, now: Instant, is_so: impl FnOnce(Instant, Condition) -> bool) -> Option<Vec<C>> {
        self.seen = now;
        let step = self.script.steps.get(self.done)?;
        let due = match step.trigger {
            Trigger::At(span) => self.began + span,
            Trigger::After(span) => self.last + span,
            Trigger::When { condition, and_then } => {
                if self.held_since.is_none() && is_so(now, condition) {
                    self.held_since = Some(now);
                }
                self.held_since? + and_then
            }
        };
        if due > now {
            return None;
        }
        let changes = step.changes.clone();
        (self.done, self.last, self.held_since) = (self.done + 1, now, None);
        Some(changes)
    }
}
