//! Remedies: what to write to get rid of a finding, ready to be copied. A test applies every one.
//!
//! A remedy is a line `in the data sheet:` or `in an overlay:`, followed by what to write there. Several remedies in a
//! row are alternatives.

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

/// The most lines or overlay tables that a remedy writes out.
pub(super) const MAX_STEPS: usize = 8;

/// `in an overlay:` with the table of an object or entry, and a reason.
pub(super) fn overlay(address: &str, keys: &str) -> String {
    overlays([(address.to_owned(), keys.to_owned())])
}

/// The same with several tables.
pub(super) fn overlays(tables: impl IntoIterator<Item = (String, String)>) -> String {
    let mut text = "in an overlay:".to_owned();
    for (address, keys) in tables {
        let _ = write!(text, "\n[object.\"{address}\"]\nreason = \"…\"\n{keys}");
    }
    text
}

/// A remedy that accepts the findings of a code for an object or entry.
pub(super) fn accept(address: &str, code: &str) -> String {
    overlay(address, &format!("accept = [\"{code}\"]"))
}

/// A value in the TOML of an overlay.
pub(super) fn toml(value: &Value) -> String {
    match value {
        Value::Integer(number) if i64::try_from(*number).is_ok() => number.to_string(),
        Value::Real(number) => format!("{number:?}"),
        other => quoted(&value_text(other)),
    }
}

/// A text in the TOML of an overlay.
pub(super) fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

impl Context<'_> {
    /// Replaces a span in the data sheet.
    pub(super) fn replace(&self, span: Span, by: &str) -> Option<Patch> {
        (span.source == 0).then(|| Patch::from_iter([self.facts.syntax.with(span, by)]))
    }

    /// Removes the line of a span from the data sheet.
    pub(super) fn remove(&self, span: Span) -> Option<Patch> {
        let (line, _) = self.line(span)?;
        Some(Patch::from_iter([Change::Remove(line, line)]))
    }

    /// Sets a key in the section whose name is at `section`.
    pub(super) fn set(&self, section: Span, key: &str, value: &str) -> Option<Patch> {
        let section = self.facts.syntax.section_at(section)?;
        Some(Patch::from_iter([self.set_in(section, key, value)]))
    }

    /// Sets a key in a section that occurs once.
    pub(super) fn set_info(&self, kind: SectionKind, key: &str, value: &str) -> Option<Patch> {
        Some(Patch::from_iter([self.set_in(self.facts.section(kind)?, key, value)]))
    }

    pub(super) fn set_in(&self, section: &Section<'_>, key: &str, value: &str) -> Change {
        match section.get(key) {
            Some(pair) => self.facts.syntax.with_value(pair, value),
            None => Change::After(section.line + 1, format!("{key}={value}")),
        }
    }

    /// A remedy that sets keys of an entry in an overlay.
    pub(super) fn correct(&self, entry: &Entry, keys: &str) -> String {
        overlay(&self.address(entry), keys)
    }

    /// A remedy that accepts a finding about an entry.
    pub(super) fn accept(&self, entry: &Entry, code: &str) -> String {
        accept(&place(entry), code)
    }
}

impl Diagnostic {
    /// Sets the remedy, if there is one; otherwise [`rest`] supplies it.
    pub(super) fn mend(self, remedy: Option<impl Display>) -> Self {
        match remedy {
            Some(remedy) => self.help(remedy.to_string()),
            None => self,
        }
    }

    /// Sets the fix, if there is one. It also becomes the remedy unless it is long or there is one already.
    pub(super) fn fix(mut self, fix: Option<impl Into<Arc<Patch>>>) -> Self {
        self.fix = fix.map(Into::into);
        let short = self.fix.as_ref().filter(|fix| fix.changes().len() <= MAX_STEPS && self.help.is_none());
        self.help = short.map(ToString::to_string).or(self.help);
        self
    }
}

/// The remedy for findings whose rule gives none: accept the finding, if it is about an object.
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
