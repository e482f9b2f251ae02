//! A data sheet in the words of CiA 306 that was made of one in XML, and the way back to the places there.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::ops::Range;

use crate::diagnostic::Diagnostics;
use crate::finding::{Findings, Kind};
use crate::model::{Device, Enumeration, Meaning, Properties, Quantity};
use crate::overlay::{Changes, Use};
use crate::patch;
use crate::text::{Source, Span};

/// So much text is made of one file, in bytes: many objects may refer to one long text.
const MAX_BYTES: usize = 32 << 20;

/// The sections and keys so far.
#[derive(Default)]
pub(super) struct Sections {
    list: Vec<Section>,
    /// What is said in the place of what the list says, by section and key in lower case.
    instead: BTreeMap<String, (String, Instead)>,
    bytes: usize,
}

/// Keys by their names in lower case; those without a pair go.
type Instead = BTreeMap<String, Option<Pair>>;

struct Section {
    name: String,
    at: Range<usize>,
    pairs: Vec<Pair>,
}

struct Pair {
    key: String,
    value: String,
    at: Range<usize>,
}

impl Sections {
    /// A new section; one of this name may be there already, which is found later.
    pub(super) fn begin(&mut self, name: String, at: Range<usize>) {
        self.list.push(Section { name, at, pairs: Vec::new() });
    }

    /// A key of the section begun last.
    pub(super) fn pair(&mut self, key: &str, value: &str, at: Range<usize>) {
        if !self.has_room(key.len() + value.len()) {
            return;
        }
        if let Some(section) = self.list.last_mut() {
            section.pairs.push(Pair::new(key, value, at));
        }
    }

    /// A key in the place of what the section says otherwise; without a value, there is none.
    pub(super) fn instead(&mut self, section: &str, key: &str, value: Option<&str>, at: Range<usize>) {
        let of_name = || (section.to_owned(), Instead::new());
        let (_, keys) = self.instead.entry(section.to_ascii_lowercase()).or_insert_with(of_name);
        keys.insert(key.to_ascii_lowercase(), value.map(|value| Pair::new(key, value, at)));
    }

    /// Takes room for so many bytes, read or made; whether there is some left.
    pub(super) fn has_room(&mut self, bytes: usize) -> bool {
        self.bytes += bytes;
        self.bytes < MAX_BYTES
    }

    /// All as text.
    pub(super) fn finish(mut self, xml: &Source, says: Vec<Says>, names: Names) -> Sheet {
        let (mut text, mut lines) = (String::new(), Vec::new());
        let mut write = |Section { name, at, pairs }: Section, mut instead: Instead| {
            lines.push(Line { value: text.len(), key: at.clone(), at: at.clone() });
            let _ = writeln!(text, "[{name}]");
            let kept = |pair: Pair| instead.remove(&pair.key.to_ascii_lowercase()).unwrap_or(Some(pair));
            let mut pairs: Vec<Pair> = pairs.into_iter().filter_map(kept).collect();
            pairs.extend(instead.into_values().flatten());
            for Pair { key, value, at: place } in pairs {
                lines.push(Line { value: text.len() + key.len() + 1, key: at.clone(), at: place });
                let _ = writeln!(text, "{key}={value}");
            }
        };
        for section in self.list {
            let instead = self.instead.remove(&section.name.to_ascii_lowercase());
            write(section, instead.map(|(_, keys)| keys).unwrap_or_default());
        }
        for (name, keys) in self.instead.into_values() {
            let at = keys.values().flatten().next().map_or(0..0, |pair| pair.at.clone());
            write(Section { name, at, pairs: Vec::new() }, keys);
        }
        let eds = xml.with_text(text);
        let is_whole = self.bytes < MAX_BYTES && eds.refusal().is_none();
        Sheet { eds, lines, says, names, is_whole }
    }
}

impl Pair {
    fn new(key: &str, value: &str, at: Range<usize>) -> Self {
        let one_line = |text: &str| text.replace(['\r', '\n'], " ");
        Self { key: one_line(key), value: one_line(value), at }
    }
}

/// The source of a place in the XML, until [`Sheet::take_back`].
const XML: u16 = u16::MAX;

/// A place that belongs to no key.
pub(super) fn xml_span(at: Range<usize>) -> Span {
    Span { source: XML, start: at.start as u32, end: at.end as u32 }
}

/// What an object or entry says beyond CiA 306.
pub(super) struct Says {
    pub(super) index: u16,
    /// None for the object itself, and the only entry of a VAR.
    pub(super) sub: Option<u8>,
    pub(super) description: Option<String>,
    pub(super) persistent: bool,
    pub(super) properties: Option<Box<Properties>>,
    pub(super) meaning: Option<Meaning>,
    pub(super) span: Span,
}

/// What meanings name.
#[derive(Default)]
pub(super) struct Names {
    pub(super) enumerations: BTreeMap<String, Enumeration>,
    pub(super) quantities: BTreeMap<String, Quantity>,
    /// The data types of those who use them, who share one.
    pub(super) types: BTreeMap<String, String>,
}

/// A data sheet in the words of CiA 306, and where each of its lines comes from.
pub(crate) struct Sheet {
    pub(crate) eds: Source,
    lines: Vec<Line>,
    says: Vec<Says>,
    names: Names,
    is_whole: bool,
}

/// Where a line comes from.
struct Line {
    /// Where its value begins in the text of the sheet.
    value: usize,
    /// Where its key comes from.
    key: Range<usize>,
    /// Where its value comes from.
    at: Range<usize>,
}

impl Sheet {
    /// What XML alone can say goes where an overlay would put it, so that one can still say otherwise.
    pub(crate) fn annotate(&mut self, device: &mut Device, changes: &mut Changes, out: &mut Findings) {
        if !self.is_whole {
            let kind = Kind::Xml {
                why: "it says more than is read, which ends here".into(),
                help: "let fewer objects share long texts",
            };
            out.push(kind, Span::eds(0, 0));
        }
        device.enumerations.append(&mut self.names.enumerations);
        device.quantities.append(&mut self.names.quantities);
        for says in self.says.drain(..) {
            let Ok(at) = device.objects.binary_search_by_key(&says.index, |object| object.index) else { continue };
            let object = &mut device.objects[at];
            if says.sub.is_none() {
                object.description.clone_from(&says.description);
                if object.kind.has_subs() {
                    object.properties = says.properties;
                    continue;
                }
            }
            let sub = says.sub.unwrap_or(0);
            let Some(entry) = object.entries.iter_mut().find(|entry| entry.sub == sub) else { continue };
            entry.description = says.description;
            entry.persistent = says.persistent;
            entry.properties = says.properties;
            if let Some(meaning) = says.meaning {
                entry.meaning = meaning.clone();
                changes.uses.push(Use { index: says.index, sub, meaning, span: says.span });
            }
        }
    }

    /// Gives the device and the findings their places in the XML.
    pub(crate) fn take_back(&self, device: &mut Device, findings: &mut Diagnostics) {
        device.for_each_span(|span| *span = self.place(*span));
        // Lines are XML's own.
        findings.allow("eds::long-line");
        for finding in findings.iter_mut() {
            finding.labels.iter_mut().for_each(|label| label.span = self.place(label.span));
            finding.fix = None;
            finding.help = finding.help.take().map(|help| in_words(&help).unwrap_or(help));
        }
        findings.finish();
    }

    fn place(&self, span: Span) -> Span {
        match span.source {
            XML => return Span { source: 0, ..span },
            0 if span != Span::eds(0, 0) => {}
            _ => return span,
        }
        let line = self.eds.position(span.start).line as usize - 1;
        let Some(line) = self.lines.get(line) else { return Span::eds(0, 0) };
        let from = if (span.start as usize) < line.value { &line.key } else { &line.at };
        Span::eds(from.start as u32, from.end as u32)
    }
}

/// A remedy by lines, which are not those of the XML, by its keys.
fn in_words(help: &str) -> Option<String> {
    let (before, lines) = help.split_once(patch::HEADING)?;
    let keys: Vec<&str> = lines.lines().filter_map(|line| Some(line.split_once(": ")?.1)).collect();
    Some(match keys.as_slice() {
        [] => format!("{before}leave it out"),
        keys => format!("{before}say in XML what in CiA 306 is:\n{}", keys.join("\n")),
    })
}
