//! A page in HTML or Markdown, with headings, tables and pictures of bits.

use lexican_eds::text::escaped;

/// Title (twice), contents and body replace the marks `{{}}`, in this order.
const FRAME: &str = include_str!("page.html");

/// The format of a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// A single self-contained file with a search field, also well-formed XML.
    Html,
    /// For a wiki or a repository.
    Markdown,
}

/// A text with markup.
#[derive(Clone, Debug, Default)]
pub struct Markup(Vec<Piece>);

#[derive(Clone, Debug)]
enum Piece {
    Words(String),
    /// The class in `page.html`, and the text.
    Class(&'static str, String),
    /// The anchor, and the text.
    Link(String, String),
    Break,
}

impl Markup {
    /// A text with a style of `page.html`.
    pub fn class(class: &'static str, text: impl Into<String>) -> Markup {
        Markup(vec![Piece::Class(class, text.into())])
    }

    /// A link to a heading of the page.
    pub fn link(anchor: impl Into<String>, text: impl Into<String>) -> Markup {
        Markup(vec![Piece::Link(anchor.into(), text.into())])
    }

    /// Appends more after a blank.
    #[must_use]
    pub fn and(mut self, more: impl Into<Markup>) -> Markup {
        self.0.extend([Piece::Words(" ".to_owned())].into_iter().chain(more.into().0));
        self
    }

    /// Each part on a line of its own.
    pub fn lines(parts: impl IntoIterator<Item = Markup>) -> Markup {
        let parts: Vec<_> = parts.into_iter().map(|part| part.0).collect();
        Markup(parts.join(&Piece::Break))
    }

    fn is_empty(&self) -> bool {
        self.0.iter().all(|piece| matches!(piece, Piece::Words(text) if text.trim().is_empty()))
    }

    fn in_format(&self, format: Format) -> String {
        let piece = |piece: &Piece| match (piece, format) {
            (Piece::Break, _) => "<br/>".to_owned(),
            (Piece::Words(text), Format::Html) => escaped(text),
            (Piece::Class(class, text), Format::Html) => format!("<span class=\"{class}\">{}</span>", escaped(text)),
            (Piece::Link(anchor, text), Format::Html) => {
                format!("<a href=\"#{}\">{}</a>", escaped(anchor), escaped(text))
            }
            (Piece::Words(text) | Piece::Class(_, text), Format::Markdown) => without_markup(text),
            (Piece::Link(anchor, text), Format::Markdown) => format!("[{}](#{anchor})", without_markup(text)),
        };
        self.0.iter().map(piece).collect()
    }
}

impl<T: Into<String>> From<T> for Markup {
    fn from(text: T) -> Markup {
        Markup(vec![Piece::Words(text.into())])
    }
}

/// Escapes Markdown.
fn without_markup(text: &str) -> String {
    let mut out = String::new();
    for letter in text.chars() {
        if matches!(letter, '|' | '*' | '_' | '<' | '[' | '`' | '\\') {
            out.push('\\');
        }
        out.push(if letter.is_control() { ' ' } else { letter });
    }
    out
}

/// A page while it is written.
#[derive(Debug)]
pub struct Page {
    /// What it is written in.
    pub format: Format,
    title: String,
    contents: String,
    body: String,
    /// The levels of the open sections.
    open: Vec<u8>,
}

impl Page {
    /// A page with this title.
    #[must_use]
    pub fn new(format: Format, title: &str) -> Page {
        Page { format, title: title.to_owned(), contents: String::new(), body: String::new(), open: Vec::new() }
    }

    /// Begins a section, which ends at the next one of the same or a lower level. The title has level 1.
    pub fn heading(&mut self, level: u8, anchor: &str, title: &str, beside: &str) {
        self.close(level);
        let link = Markup::link(anchor, title).in_format(self.format);
        let beside = Markup::class("small", beside).in_format(self.format);
        if self.format == Format::Html {
            self.open.push(level);
            self.contents += &format!("<li class=\"level{level}\">{link}</li>\n");
            let anchor = escaped(anchor);
            self.body += &format!("<section id=\"{anchor}\">\n<h{level}>{link} {beside}</h{level}>\n");
        } else {
            self.contents += &if level == 2 { format!("- {link}\n") } else { String::new() };
            let (marks, title) = ("#".repeat(level.into()), Markup::from(title).in_format(self.format));
            let beside = if beside.is_empty() { beside } else { format!(" ({beside})") };
            self.body += &format!("\n<a id=\"{anchor}\"></a>\n{marks} {title}{beside}\n");
        }
    }

    /// A paragraph; nothing for an empty text.
    pub fn paragraph(&mut self, text: impl Into<Markup>) {
        let text = text.into().in_format(self.format);
        self.body += &match self.format {
            _ if text.is_empty() => text,
            Format::Html => format!("<p>{text}</p>\n"),
            Format::Markdown => format!("\n{text}\n"),
        };
    }

    /// A picture: a separate file for Markdown, inline in HTML.
    pub fn picture(&mut self, name: &str, file: &str, svg: impl FnOnce() -> String) {
        self.body += &match self.format {
            Format::Html => format!("<figure>{}</figure>\n", svg()),
            Format::Markdown => format!("\n![{name}]({file})\n"),
        };
    }

    /// A table without empty columns; `class` is one of `page.html`. Tables of class `entries` keep all columns, so
    /// that they align with each other.
    pub fn table<const N: usize>(&mut self, class: &str, head: [&str; N], rows: Vec<[Markup; N]>) {
        let is_used = |at: &usize| class == "entries" || rows.iter().any(|row| !row[*at].is_empty());
        let used: Vec<_> = (0..N).filter(is_used).collect();
        let line = |cells: Vec<String>, tag: &str| match self.format {
            Format::Html => format!("<tr><{tag}>{}</{tag}></tr>\n", cells.join(&format!("</{tag}><{tag}>"))),
            Format::Markdown => format!("| {} |\n", cells.join(" | ")),
        };
        let head = line(used.iter().map(|&at| head[at].to_owned()).collect(), "th");
        let cells = |row: &[Markup; N]| used.iter().map(|&at| row[at].in_format(self.format)).collect();
        let body: String = rows.iter().map(|row| line(cells(row), "td")).collect();
        self.body += &match self.format {
            _ if rows.is_empty() => String::new(),
            Format::Html => format!("<table class=\"{class}\"><thead>{head}</thead><tbody>\n{body}</tbody></table>\n"),
            Format::Markdown => format!("\n{head}|{}\n{body}", " --- |".repeat(used.len())),
        };
    }

    /// A picture of a word's bits, the highest on the left, up to 16 in a row. Fields are given by lowest and highest
    /// bit. Left out in Markdown.
    pub fn word<'n>(&mut self, bits: u8, fields: impl IntoIterator<Item = (u8, u8, &'n str)>) {
        if self.format == Format::Markdown {
            return;
        }
        let mut names = [None; 64];
        for (low, high, name) in fields {
            names.iter_mut().take(usize::from(high) + 1).skip(low.into()).for_each(|it| *it = Some((low, name)));
        }
        let columns = usize::from(bits.clamp(8, 16));
        self.body += &format!("<div class=\"word of{columns}\">");
        for (number, row) in names[..usize::from(bits).min(64)].chunks(columns).enumerate().rev() {
            let mut end = number * columns + row.len();
            // A field that continues in the next row has a cell in both.
            for cell in row.chunk_by(|one, other| one.map(|it| it.0) == other.map(|it| it.0)).rev() {
                let range = range(end - 1, end - cell.len());
                end -= cell.len();
                let (class, name) = match cell[0] {
                    None => ("free", ""),
                    Some((_, name)) if cell.len() == 1 && columns > 8 => ("upright", name),
                    Some((_, name)) => ("", name),
                };
                let (width, name) = (cell.len(), escaped(name));
                let style = format!("class=\"{class}\" style=\"grid-column:span {width}\"");
                self.body += &format!("<span {style}><i>{range}</i><b>{name}</b></span>");
            }
        }
        self.body += "</div>\n";
    }

    /// A picture of a PDO, the first bit on the left, with bits and name of each object. Left out in Markdown.
    pub fn layout(&mut self, objects: &[(u8, String)]) {
        if self.format == Format::Markdown {
            return;
        }
        let bits: usize = objects.iter().map(|(bits, _)| usize::from(*bits).max(1)).sum();
        // Valid mappings fit a frame of 64 bits, but a data sheet may say otherwise.
        let columns = bits.next_multiple_of(8).max(64);
        let bytes: String = (0..columns / 8).map(|byte| format!("<i>{byte}</i>")).collect();
        self.body += &format!("<div class=\"pdo\" style=\"--bits:{columns}\">{bytes}");
        let mut low = 0;
        for (bits, name) in objects {
            let (bits, title) = (usize::from(*bits).max(1), escaped(name));
            let words = if bits < 8 { String::new() } else { format!("<b>{title}</b>{}", range(low, low + bits - 1)) };
            self.body += &format!("<span style=\"grid-column:span {bits}\" title=\"{title}\">{words}</span>");
            low += bits;
        }
        if low < columns {
            self.body += &format!("<span class=\"free\" style=\"grid-column:span {}\"></span>", columns - low);
        }
        self.body += "</div>\n";
    }

    /// The whole page.
    #[must_use]
    pub fn finish(mut self) -> String {
        self.close(0);
        let Page { format, title, contents, body, .. } = self;
        let title = Markup::from(title).in_format(format);
        match format {
            Format::Html => {
                let parts = FRAME.split("{{}}").zip([title.as_str(), &title, &contents, &body, ""]);
                parts.flat_map(|(frame, part)| [frame, part]).collect()
            }
            Format::Markdown => format!("# {title}\n\n{contents}{body}"),
        }
    }

    fn close(&mut self, level: u8) {
        while self.open.pop_if(|open| *open >= level).is_some() {
            self.body += "</section>\n";
        }
    }
}

/// A bit, or a range of bits.
pub(super) fn range(from: usize, to: usize) -> String {
    if from == to { from.to_string() } else { format!("{from}–{to}") }
}
