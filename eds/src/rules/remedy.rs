//! Remedies: what to write to be rid of a finding, in a form that can be copied. A test applies every one.
//!
//! A remedy is a line that says where, `in the data sheet:` or `in an overlay:`, and what to write there below it.
//! Several of them below each other are alternatives.

use std::fmt::{Display, Write as _};
use std::sync::Arc;

use super::context::{Context, place};
use crate::diagnostic::Diagnostic;
use crate::dump::value_text;
use crate::model::{Entry, Value};
use crate::parse::section::SectionKind;
use crate::parse::syntax::Section;
use crate::patch::{Change, Patch};
use crate::text::Span;

/// The most lines of a file, or tables of an overlay, that one remedy writes out.
pub(super) const MAX_STEPS: usize = 8;

/// `in an overlay:` and a table for an object or entry, with a reason.
pub(super) fn overlay(address: &str, keys: &str) -> String {
    overlays([(address.to_owned(), keys.to_owned())])
}

/// The same for several objects or entries.
pub(super) fn overlays(tables: impl IntoIterator<Item = (String, String)>) -> String {
    let mut text = "in an overlay:".to_owned();
    for (address, keys) in tables {
        let _ = write!(text, "\n[object.\"{address}\"]\nreason = \"…\"\n{keys}");
    }
    text
}

/// How an overlay accepts the findings of a code there.
pub(super) fn accept(address: &str, code: &str) -> String {
    overlay(address, &format!("accept = [\"{code}\"]"))
}

/// A value as an overlay writes it.
pub(super) fn toml(value: &Value) -> String {
    match value {
        Value::Integer(number) if i64::try_from(*number).is_ok() => number.to_string(),
        Value::Real(number) => format!("{number:?}"),
        other => quoted(&value_text(other)),
    }
}

/// A text as an overlay writes it.
pub(super) fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

impl Context<'_> {
    /// The data sheet with this in the place of a span.
    pub(super) fn replace(&self, span: Span, by: &str) -> Option<Patch> {
        (span.source == 0).then(|| Patch::from_iter([self.facts.syntax.with(span, by)]))
    }

    /// The data sheet without the line of a span.
    pub(super) fn remove(&self, span: Span) -> Option<Patch> {
        let (line, _) = self.line(span)?;
        Some(Patch::from_iter([Change::Remove(line, line)]))
    }

    /// The data sheet with another value of a key in the section whose name is at `section`.
    pub(super) fn set(&self, section: Span, key: &str, value: &str) -> Option<Patch> {
        let section = self.facts.syntax.section_at(section)?;
        Some(Patch::from_iter([self.set_in(section, key, value)]))
    }

    /// The same for a section that there is once.
    pub(super) fn set_info(&self, kind: SectionKind, key: &str, value: &str) -> Option<Patch> {
        Some(Patch::from_iter([self.set_in(self.facts.section(kind)?, key, value)]))
    }

    pub(super) fn set_in(&self, section: &Section<'_>, key: &str, value: &str) -> Change {
        match section.get(key) {
            Some(pair) => self.facts.syntax.with_value(pair, value),
            None => Change::After(section.line + 1, format!("{key}={value}")),
        }
    }

    /// An overlay with other keys for an entry.
    pub(super) fn correct(&self, entry: &Entry, keys: &str) -> String {
        overlay(&self.address(entry), keys)
    }

    /// An overlay that takes a finding about an entry as it is.
    pub(super) fn accept(&self, entry: &Entry, code: &str) -> String {
        accept(&place(entry), code)
    }
}

impl Diagnostic {
    /// The remedy, if there is one; else [`rest`] finds one.
    pub(super) fn mend(self, remedy: Option<impl Display>) -> Self {
        match remedy {
            Some(remedy) => self.help(remedy.to_string()),
            None => self,
        }
    }

    /// Adds the one right answer, if there is one. It is shown as the remedy too, unless it is long or a remedy was given.
    pub(super) fn fix(mut self, fix: Option<impl Into<Arc<Patch>>>) -> Self {
        self.fix = fix.map(Into::into);
        let short = self.fix.as_ref().filter(|fix| fix.changes().len() <= MAX_STEPS && self.help.is_none());
        self.help = short.map(ToString::to_string).or(self.help);
        self
    }
}

/// What can be done about a finding for which its rule has no remedy: accept it, where it is about an object.
pub(super) fn rest(context: &Context<'_>, finding: &Diagnostic) -> Option<String> {
    let span = finding.span().filter(|span| span.source == 0)?;
    Some(match context.facts.address_of(span) {
        Some((index, sub)) => {
            let sub = sub.map(|sub| format!(":{sub:02X}")).unwrap_or_default();
            format!("where it must be so, {}", accept(&format!("{index:04X}{sub}"), finding.code))
        }
        None => "no overlay is needed for it; mend the file for the sake of other readers".to_owned(),
    })
}
