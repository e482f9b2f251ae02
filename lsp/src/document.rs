//! An open text: its changes, positions, and the result of reading it.

use std::path::{Path, PathBuf};

use lexican_eds::model::Device;
use lexican_eds::{Diagnostics, Input, Memory, Source, Span, load_again, report};
use lexican_machine::{Files, Machine};
use lexican_toolbox::text::files::read;
use percent_encoding::percent_decode_str;
use serde_json::{Value, json};

/// The kind of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Sheet,
    Overlay,
    Machine,
    /// No findings: another kind of file, or an overlay whose data sheet is not found.
    Other,
}

/// An open text.
pub(crate) struct Document {
    pub(crate) uri: String,
    pub(crate) path: PathBuf,
    pub(crate) version: Value,
    pub(crate) kind: Kind,
    /// The number of columns that a character takes in the client's encoding.
    columns: fn(char) -> usize,
    /// For an overlay, its data sheet and the overlays before it as well.
    pub(crate) input: Input,
    /// The number of this text within `input`.
    pub(crate) number: u16,
    memory: Memory,
    pub(crate) device: Device,
    pub(crate) machine: Option<Machine>,
    pub(crate) findings: Diagnostics,
    pub(crate) is_published: bool,
}

impl Document {
    /// Opens a `TextDocumentItem` of the client.
    pub(crate) fn new(item: &Value, columns: fn(char) -> usize) -> Self {
        let uri = item["uri"].as_str().unwrap_or_default().to_owned();
        let path = path_of(&uri);
        let source = Source::new(path.display().to_string(), item["text"].as_str().unwrap_or_default());
        let mut document = Self {
            uri,
            path,
            version: item["version"].clone(),
            kind: Kind::Other,
            columns,
            input: Input::new(source),
            number: 0,
            memory: Memory::default(),
            device: Device::default(),
            machine: None,
            findings: Diagnostics::default(),
            is_published: false,
        };
        document.settle();
        document
    }

    /// Determines the kind of the text and the files that belong to it. Called again when a file is saved, since files
    /// refer to each other.
    pub(crate) fn settle(&mut self) {
        let source = self.source().clone();
        self.kind = kind_of(&self.path, &source);
        (self.input, self.number) = (Input::new(source.clone()), 0);
        if self.kind == Kind::Overlay {
            match beside(&self.path).or_else(|| of_machine(&self.path)) {
                Some(found) => (self.input, self.number) = found,
                None => self.kind = Kind::Other,
            }
        }
        self.replace_by(source);
    }

    pub(crate) fn source(&self) -> &Source {
        self.input.source(self.number).unwrap_or(&self.input.eds)
    }

    fn replace_by(&mut self, source: Source) {
        match self.number {
            0 => self.input.eds = source,
            number => self.input.overlays[usize::from(number) - 1] = source,
        }
        self.is_published = false;
    }

    /// Applies changes; each refers to the text after the previous one.
    pub(crate) fn change(&mut self, changes: &Value) {
        self.is_published = false;
        for change in changes.as_array().into_iter().flatten() {
            let source = self.source();
            let new = change["text"].as_str().unwrap_or_default();
            let text = match &change["range"] {
                Value::Null => new.to_owned(),
                // The content of a text that is too large was not kept.
                _ if source.refusal().is_some() => continue,
                range => {
                    let [start, end] = [&range["start"], &range["end"]].map(|at| self.offset(at) as usize);
                    [&source.text()[..start], new, &source.text()[end.max(start)..]].concat()
                }
            };
            self.replace_by(source.with_text(text));
        }
    }

    /// Reads the text. While it is not valid TOML, the last result is kept, so that names are still known.
    pub(crate) fn read(&mut self) {
        let is_toml = |findings: &Diagnostics| !findings.iter().any(|finding| finding.code.ends_with("::syntax"));
        match self.kind {
            Kind::Sheet | Kind::Overlay => {
                let (device, findings) = load_again(&self.input, &mut self.memory);
                if is_toml(&findings) || self.device.objects.is_empty() {
                    self.device = device;
                }
                self.findings = findings;
            }
            Kind::Machine => {
                let folder = self.path.parent().unwrap_or(Path::new(""));
                let mut machine = Machine::parse(self.source().clone(), Files::Folder(folder));
                self.findings = std::mem::take(&mut machine.findings);
                if is_toml(&self.findings) || self.machine.is_none() {
                    self.machine = Some(machine);
                }
            }
            Kind::Other => self.findings = Diagnostics::default(),
        }
    }

    /// The offset of a `Position`. A column beyond the end of a line counts as its end.
    pub(crate) fn offset(&self, at: &Value) -> u32 {
        let [line, column] = ["line", "character"].map(|key| at[key].as_u64().unwrap_or(0) as usize);
        let mut columns = 0;
        let is_at = |&(_, letter): &(usize, char)| {
            columns += (self.columns)(letter);
            columns > column
        };
        let (start, end) = self.source().line_range(line);
        self.source().line(line).char_indices().find(is_at).map_or(end, |(before, _)| start + before as u32)
    }

    /// The `Range` of a place in one of the input's texts.
    pub(crate) fn range_in(&self, source: &Source, place: Span) -> Value {
        let [start, end] = [place.start, place.end].map(|offset| {
            let line = source.line_at(offset);
            let (start, end) = source.line_range(line);
            let before = source.get(Span::eds(start, offset.min(end)));
            [line, before.chars().map(self.columns).sum()]
        });
        json!({
            "start": { "line": start[0], "character": start[1] },
            "end": { "line": end[0], "character": end[1] },
        })
    }

    /// The `Range` of a place in this text.
    pub(crate) fn range(&self, place: Span) -> Value {
        self.range_in(self.source(), place)
    }

    /// The `TextEdit`s that turn this text into another one: they replace the lines from the first to the last
    /// difference.
    pub(crate) fn edits(&self, text: &str) -> Value {
        let old = self.source().text();
        if old == text {
            return json!([]);
        }
        let lines = |text| str::split_inclusive(text, '\n');
        let same = |(a, b): &(&str, &str)| a == b;
        let length = |(line, _): (&str, &str)| line.len();
        let begin: usize = lines(old).zip(lines(text)).take_while(same).map(length).sum();
        let (rest, new) = (lines(&old[begin..]).rev(), lines(&text[begin..]).rev());
        let end: usize = rest.zip(new).take_while(same).map(length).sum();
        let range = self.range(Span::eds(begin as u32, (old.len() - end) as u32));
        json!([{ "range": range, "newText": &text[begin..text.len() - end] }])
    }

    /// The `WorkspaceEdit` that turns this text into another one.
    pub(crate) fn workspace_edit(&self, text: &str) -> Value {
        json!({ "changes": { &self.uri: self.edits(text) } })
    }
}

fn kind_of(path: &Path, source: &Source) -> Kind {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    let has = |header: &str| (0..source.line_count()).any(|line| source.line(line).starts_with(header));
    match extension.to_str() {
        Some("eds" | "dcf") => Kind::Sheet,
        Some("toml") if has("[overlay]") => Kind::Overlay,
        Some("toml") if path.ends_with("machine.toml") || has("[node.") || has("[bus") => Kind::Machine,
        _ => Kind::Other,
    }
}

/// The data sheet with the file name of an overlay.
fn beside(overlay: &Path) -> Option<(Input, u16)> {
    let paths = ["eds", "EDS", "dcf", "DCF"].map(|extension| overlay.with_extension(extension));
    let sheet = read(paths.iter().find(|path| path.is_file())?).ok()?;
    Some((Input::new(sheet).overlay(Source::new("", "")), 1))
}

/// The data sheet of the node that uses an overlay, in a machine in the overlay's folder or above it.
fn of_machine(overlay: &Path) -> Option<(Input, u16)> {
    let file = overlay.ancestors().skip(1).map(|folder| folder.join("machine.toml")).find(|file| file.is_file())?;
    let machine = Machine::open(&file).ok()?;
    let whole = overlay.canonicalize().ok()?;
    let is_it = |path: &PathBuf| file.with_file_name(path).canonicalize().is_ok_and(|path| path == whole);
    machine.buses().flat_map(|machine| &machine.nodes).find_map(|node| {
        let place = node.overlays.iter().position(is_it)?;
        let input = node.sheet.as_ref()?.input.clone();
        let number = input.overlays.len() - node.overlays.len() + place + 1;
        Some((input, number as u16))
    })
}

/// The path of a `file:` URI; other URIs are kept as they are.
fn path_of(uri: &str) -> PathBuf {
    let path = uri.strip_prefix(if cfg!(windows) { "file:///" } else { "file://" }).unwrap_or(uri);
    percent_decode_str(path).decode_utf8_lossy().into_owned().into()
}

/// The URI of a file; `None` for one that does not exist, as in the device library.
pub(crate) fn uri_of(path: &Path) -> Option<String> {
    let uri = report::uri(&path.display().to_string());
    path.is_file().then(|| format!("file://{}{uri}", if uri.starts_with('/') { "" } else { "/" }))
}
