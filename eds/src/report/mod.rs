//! Findings as text with the affected lines; as JSON and SARIF in the modules below.

mod json;
mod sarif;

pub use sarif::{sarif, uri};

use annotate_snippets::renderer::DecorStyle;
use annotate_snippets::{Annotation, AnnotationKind, Group, Level, Origin, Renderer, Snippet};

use crate::diagnostic::{Diagnostic, Diagnostics, Label, Severity};
use crate::text::{Input, Source};

/// Two places of one source are shown in one piece if at most this many lines are between them.
const MAX_GAP_LINES: usize = 12;

impl Diagnostics {
    /// All findings as plain text; each ends with an empty line.
    #[must_use]
    pub fn render(&self, input: &Input) -> String {
        self.iter().map(|diagnostic| diagnostic.render(input) + "\n\n").collect()
    }

    /// All findings as text with colours for a terminal.
    #[must_use]
    pub fn render_styled(&self, input: &Input) -> String {
        let renderer = Renderer::styled().decor_style(DecorStyle::Ascii);
        self.iter().map(|diagnostic| diagnostic.render_with(input, &renderer) + "\n\n").collect()
    }
}

impl Diagnostic {
    /// The finding as plain text, without a newline at the end.
    #[must_use]
    pub fn render(&self, input: &Input) -> String {
        self.render_with(input, &Renderer::plain())
    }

    /// One line: `drive.eds:6:14: error[eds::bad-number]: …`.
    #[must_use]
    pub fn render_short(&self, input: &Input) -> String {
        let place = match self.span().and_then(|span| Some((input.source(span.source)?, span))) {
            Some((source, span)) => format!("{}:{}: ", source.name(), source.position(span.start)),
            None => String::new(),
        };
        visible(&format!("{place}{}[{}]: {}", self.severity.name(), self.code, self.message))
    }

    fn render_with(&self, input: &Input, renderer: &Renderer) -> String {
        let level = match self.severity {
            Severity::Error => Level::ERROR,
            Severity::Warning => Level::WARNING,
            Severity::Note => Level::NOTE,
        };
        let mut group = Group::with_title(level.primary_title(self.message.as_str()).id(self.code));
        for piece in pieces(&self.labels, input) {
            group = if piece.bytes(input) > MAX_PIECE_BYTES {
                group.elements(origin(&piece, input))
            } else {
                group.element(snippet(&piece, input))
            };
        }
        if let Some(help) = &self.help {
            group = group.element(Level::HELP.message(help.as_str()));
        }
        // annotate-snippets shows ASCII controls as pictures, but passes on C1 controls (80h to 9Fh), which terminals
        // obey as well.
        let is_c1 = |c: char| matches!(c, '\u{80}'..='\u{9F}');
        renderer.render(&[group]).replace(is_c1, "\u{FFFD}")
    }
}

/// Replaces controls that would move the cursor, change colours or ring the bell: names come from foreign files.
fn visible(line: &str) -> String {
    let picture = |c: char| match c {
        '\0'..='\u{1F}' => char::from_u32(0x2400 + u32::from(c)).unwrap_or(char::REPLACEMENT_CHARACTER),
        _ if c.is_control() => char::REPLACEMENT_CHARACTER,
        _ => c,
    };
    line.chars().map(picture).collect()
}

/// Longer pieces are only named, not shown.
const MAX_PIECE_BYTES: usize = 4096;

/// Neighbouring lines with the labels on them.
struct Piece<'a> {
    source: u16,
    first: usize,
    last: usize,
    labels: Vec<&'a Label>,
}

impl Piece<'_> {
    fn bytes(&self, input: &Input) -> usize {
        let lines = |source: &Source| source.line_range(self.last).1 - source.line_range(self.first).0;
        input.source(self.source).map_or(0, |source| lines(source) as usize)
    }
}

fn pieces<'a>(labels: &'a [Label], input: &Input) -> Vec<Piece<'a>> {
    let mut pieces: Vec<Piece<'a>> = Vec::new();
    for label in labels {
        let Some(source) = input.source(label.span.source) else { continue };
        let first = source.position(label.span.start).line as usize - 1;
        let last = source.position(label.span.end.max(label.span.start)).line as usize - 1;
        let near = |piece: &&mut Piece<'a>| {
            let gap = first.saturating_sub(piece.last).max(piece.first.saturating_sub(last));
            piece.source == label.span.source && gap <= MAX_GAP_LINES
        };
        match pieces.iter_mut().find(near) {
            Some(piece) => {
                piece.first = piece.first.min(first);
                piece.last = piece.last.max(last);
                piece.labels.push(label);
            }
            None => pieces.push(Piece { source: label.span.source, first, last, labels: vec![label] }),
        }
    }
    pieces
}

fn origin<'a>(piece: &Piece<'a>, input: &'a Input) -> Option<Origin<'a>> {
    let source = input.source(piece.source)?;
    let place = source.position(piece.labels.first()?.span.start);
    Some(Origin::path(source.name()).line(place.line as usize).char_column(place.column as usize))
}

fn snippet<'a>(piece: &Piece<'a>, input: &'a Input) -> Snippet<'a, Annotation<'a>> {
    let Some(source) = input.source(piece.source) else { return Snippet::source("") };
    let start = source.line_range(piece.first).0 as usize;
    let end = source.line_range(piece.last).1 as usize;
    let text = source.text().get(start..end).unwrap_or_default();
    let annotations = piece.labels.iter().map(|label| {
        let from = (label.span.start as usize).saturating_sub(start).min(text.len());
        let to = (label.span.end as usize).saturating_sub(start).clamp(from, text.len());
        let kind = if label.primary { AnnotationKind::Primary } else { AnnotationKind::Context };
        let annotation = kind.span(from..to);
        if label.text.is_empty() { annotation } else { annotation.label(label.text.as_str()) }
    });
    Snippet::source(text).line_start(piece.first + 1).path(source.name()).annotations(annotations)
}
