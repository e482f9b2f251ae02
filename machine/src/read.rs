//! Reads the file, and reports every mistake with its place.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use lexican_eds::text::Span;
use lexican_eds::{Diagnostic, Diagnostics, Input, Severity, Source};
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::text::files::{ReadError, read};
use lexican_toolbox::text::similarity::similarity;
use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue, ValueDeserializer};

use crate::at::At;
use crate::file::{self, About, Fault, Simulated, Wire};
use crate::files::Files;
use crate::model::{Bus, Machine};
use crate::nodes::lower;
use crate::{bench, faults, wire};

/// The findings about a file, without duplicates.
#[derive(Default)]
pub(crate) struct Out {
    pub(crate) findings: Diagnostics,
}

/// A place in the file.
pub(crate) fn span(range: &Range<usize>) -> Span {
    Span { source: 0, start: range.start as u32, end: range.end as u32 }
}

impl Out {
    /// Adds an error with a remedy.
    pub(crate) fn wrong(
        &mut self,
        code: &'static str,
        at: &Range<usize>,
        what: impl Into<String>,
        help: Option<String>,
    ) {
        self.push(Severity::Error, code, at, what, help);
    }

    pub(crate) fn push(
        &mut self,
        severity: Severity,
        code: &'static str,
        at: &Range<usize>,
        what: impl Into<String>,
        help: Option<String>,
    ) {
        let finding = Diagnostic::new(code, severity, what).at(span(at), "");
        let finding = Diagnostic { help, ..finding };
        // Nodes that share a kind or a YAML anchor repeat the same finding.
        if !self.findings.contains(&finding) {
            self.findings.push(finding);
        }
    }
}

/// The data sheets loaded so far, by name and overlays: many nodes have the same one.
pub(crate) struct Sheets<'f> {
    pub(crate) files: Files<'f>,
    read: BTreeMap<(String, Vec<PathBuf>), Option<Arc<DataSheet>>>,
}

impl Sheets<'_> {
    /// Loads a data sheet with its overlays, and returns the name by which it is known outside. Its findings are
    /// reported once.
    pub(crate) fn load(
        &mut self,
        name: &At<String>,
        overlays: &[At<PathBuf>],
        out: &mut Out,
    ) -> Option<(String, Arc<DataSheet>)> {
        let path = self.files.name(name);
        let key = (path.clone(), overlays.iter().map(|overlay| overlay.value.clone()).collect());
        if !self.read.contains_key(&key) {
            let sheet = self.files.data_sheet(&path, &key.1);
            let sheet = sheet.map(Arc::new).map_err(|error| {
                out.wrong("machine::sheet", &name.span, error.to_string(), error.remedy());
            });
            if let Ok(sheet) = &sheet
                && sheet.errors().next().is_some()
            {
                let what = format!("{path} has errors, and is used as far as it can be read");
                let help = Some(format!("`lexican eds lint {path}` shows them"));
                out.push(Severity::Warning, "machine::sheet", &name.span, what, help);
            }
            self.read.insert(key.clone(), sheet.ok());
        }
        self.read[&key].clone().map(|sheet| (path, sheet))
    }
}

impl Machine {
    /// Reads a machine from a file, to which its paths are relative.
    ///
    /// Errors: the file cannot be read. Mistakes in it are [findings](Machine::findings).
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        Ok(Machine::parse(read(path)?, Files::Folder(path.parent().unwrap_or(Path::new("")))))
    }

    /// Reads a machine from a text.
    #[must_use]
    pub fn parse(source: Source, files: Files<'_>) -> Self {
        let mut out = Out::default();
        if source.refusal().is_some() {
            out.wrong("machine::syntax", &(0..0), "the file is too large for a machine", None);
        }
        let (mut document, errors) = DeTable::parse_recoverable(source.text());
        for error in errors {
            out.wrong("machine::syntax", &error.span().unwrap_or(0..0), error.message(), None);
        }
        take_kinds(document.get_mut(), &mut out);
        let mut sections = Sections::default();
        for (key, value) in document.get_ref() {
            sections.read(key, value, &mut out);
        }
        let mut sheets = Sheets { files, read: BTreeMap::new() };
        let input = Input::new(source);
        let parts = sections.of_each_bus(&mut out).into_iter();
        let mut machines = parts.map(|(bus, part)| part.machine(bus, &input, &mut sheets, &mut out));
        let machine = machines.next().expect("there is at least one bus");
        let others = machines.collect();
        Machine { others, findings: out.findings, ..machine }
    }
}

/// The sections of the file.
#[derive(Default)]
struct Sections {
    about: About,
    /// The buses with their names; the only one has none.
    buses: Vec<(Option<At<String>>, file::Bus)>,
    nodes: Vec<Named<file::Node>>,
    wires: Vec<Named<Wire>>,
    simulated: Vec<Named<Simulated>>,
    faults: Vec<Fault>,
    bench: file::Bench,
}

type Value<'i> = Spanned<DeValue<'i>>;

impl Sections {
    const NAMES: [&'static str; 8] = ["machine", "bus", "node", "kind", "wire", "simulate", "fault", "bench"];

    fn read(&mut self, key: &Spanned<std::borrow::Cow<'_, str>>, value: &Value<'_>, out: &mut Out) {
        match key.get_ref().as_ref() {
            "machine" => self.about = section(value, out).unwrap_or_default(),
            "bus" => {
                let is_several = |table: &DeTable<'_>| {
                    !table.is_empty() && table.values().all(|value| value.get_ref().as_table().is_some())
                };
                self.buses = match value.get_ref().as_table().is_some_and(is_several) {
                    true => each(value, out).into_iter().map(|bus| (Some(bus.name), bus.table)).collect(),
                    false => vec![(None, section(value, out).unwrap_or_default())],
                };
            }
            "node" => self.nodes = each(value, out),
            // Merged into the nodes already; read here so that mistakes in unused kinds are reported, too.
            "kind" => drop(each::<file::Node>(value, out)),
            "wire" => self.wires = each(value, out),
            "simulate" => self.simulated = each(value, out),
            "bench" => self.bench = section(value, out).unwrap_or_default(),
            "fault" => match value.get_ref().as_array() {
                Some(faults) => self.faults = faults.iter().filter_map(|fault| section(fault, out)).collect(),
                None => out.wrong("machine::value", &value.span(), "a fault is a table [[fault]]", None),
            },
            other => {
                let help =
                    similar(other, Self::NAMES).unwrap_or_else(|| format!("there are {}", Self::NAMES.join(", ")));
                out.wrong("machine::key", &key.span(), format!("unknown section `{other}`"), Some(help));
            }
        }
    }
}

impl Sections {
    /// Splits the sections by bus.
    fn of_each_bus(mut self, out: &mut Out) -> Vec<(Bus, Sections)> {
        let buses = match std::mem::take(&mut self.buses) {
            none if none.is_empty() => vec![Default::default()],
            buses => buses,
        };
        let names: Vec<String> = buses.iter().filter_map(|(name, _)| Some(name.as_ref()?.value.clone())).collect();
        // The bus of each node. A node that names none must be on the only bus.
        let mut places: BTreeMap<String, usize> = BTreeMap::new();
        for node in &self.nodes {
            let given = &node.table.bus;
            let place = given.as_ref().and_then(|bus| names.iter().position(|name| *name == bus.value));
            if let (Some(bus), None) = (given, place) {
                let help = similar(&bus.value, names.iter().map(String::as_str))
                    .or_else(|| Some(format!("there are {}", names.join(", "))).filter(|_| !names.is_empty()));
                out.wrong("machine::bus", &bus.span, format!("there is no bus {:?}", bus.value), help);
            } else if place.is_none() && buses.len() > 1 && node.is_whole {
                let help = Some(format!("bus = {:?}, or {:?}", names[0], names[1]));
                out.wrong("machine::bus", &node.name.span, format!("on which bus is {}?", node.name.value), help);
            }
            places.insert(node.name.value.clone(), place.unwrap_or(0));
        }
        // The bus of the node in a text such as `feeder.statusword`; a text without node belongs to the first bus.
        let of_node = |text: &str| places.get(text.split('.').next()?).copied();
        let of_wire = |wire: &Named<Wire>| {
            let ends = std::iter::once(wire.name.as_str()).chain(wire.table.0.to.iter().map(|to| to.as_str()));
            ends.filter_map(of_node).collect::<BTreeSet<_>>()
        };
        for wire in self.wires.extract_if(.., |wire| of_wire(wire).len() > 1) {
            let help = Some("a PDO stays on its bus; the manager has to pass the value on".to_owned());
            out.wrong("machine::wire", &wire.name.span, "this goes from one bus to another", help);
        }
        let part = |(at, (name, bus)): (usize, (Option<At<String>>, file::Bus))| {
            let is_here = |text: &str| of_node(text).unwrap_or(0) == at;
            let bench = file::Bench {
                watch: self.bench.watch.extract_if(.., |text| is_here(text)).collect(),
                plot: self.bench.plot.extract_if(.., |text| is_here(text)).collect(),
                every: self.bench.every.clone(),
                sequences: self.bench.sequences.clone(),
                messages: self.bench.messages.clone(),
                filters: self.bench.filters.clone(),
            };
            let part = Sections {
                about: self.about.clone(),
                buses: Vec::new(),
                nodes: self.nodes.extract_if(.., |node| is_here(&node.name)).collect(),
                wires: self.wires.extract_if(.., |wire| of_wire(wire).first().is_none_or(|it| *it == at)).collect(),
                simulated: self.simulated.extract_if(.., |it| is_here(&it.name)).collect(),
                faults: self
                    .faults
                    .extract_if(.., |it| is_here(it.from.as_deref().map_or("", String::as_str)))
                    .collect(),
                bench,
            };
            (Bus::new(name, bus), part)
        };
        buses.into_iter().enumerate().map(part).collect()
    }

    /// The part of the machine on one bus.
    fn machine(self, bus: Bus, input: &Input, sheets: &mut Sheets<'_>, out: &mut Out) -> Machine {
        let files = sheets.files;
        let mut nodes = lower(self.nodes, sheets, out);
        wire::connect(&mut nodes, &self.wires, &bus, out);
        faults::simulate(&mut nodes, self.simulated, files, out);
        let faults = faults::of(self.faults, &nodes, out);
        let bench = bench::shown(&nodes, &self.bench, out);
        let sequences = bench::sequences(&self.bench.sequences, files, out);
        let filters = bench::filters(&nodes, self.bench.filters, out);
        let messages = self.bench.messages;
        let About { name, note } = self.about;
        let (input, findings, others) = (input.clone(), Diagnostics::default(), Vec::new());
        let machine =
            Machine { input, name, note, bus, nodes, faults, bench, sequences, messages, filters, findings, others };
        crate::check::check(&machine, out);
        machine
    }
}

/// Merges the kinds into the tables of their nodes, where the nodes say nothing else.
fn take_kinds(document: &mut DeTable<'_>, out: &mut Out) {
    let kinds = document.get("kind").and_then(|kinds| kinds.get_ref().as_table()).cloned().unwrap_or_default();
    let nodes = document.get_mut("node").map(Spanned::get_mut);
    let Some(DeValue::Table(nodes)) = nodes else { return };
    for (_, node) in nodes.iter_mut() {
        let DeValue::Table(node) = node.get_mut() else { continue };
        let Some((name, at)) = node.get("kind").and_then(|it| Some((it.get_ref().as_str()?, it.span()))) else {
            continue;
        };
        let Some(kind) = kinds.get(name).and_then(|kind| kind.get_ref().as_table()) else {
            let help = similar(name, kinds.keys().map(|kind| kind.get_ref().as_ref()));
            out.wrong("machine::name", &at, format!("there is no kind {name:?}"), help);
            continue;
        };
        for (key, value) in kind {
            match (node.get_mut(key).map(Spanned::get_mut), value.get_ref()) {
                (None, _) => drop(node.insert(key.clone(), value.clone())),
                // An identity is replaced as a whole; settings, limits and PDOs are merged one by one.
                (Some(DeValue::Table(own)), DeValue::Table(kind)) if key.get_ref() != "identity" => {
                    let more = kind.iter().filter(|(key, _)| !own.contains_key(*key));
                    let more: Vec<_> = more.map(|(key, value)| (key.clone(), value.clone())).collect();
                    own.extend(more);
                }
                _ => {}
            }
        }
    }
}

/// A table of the file, with its name.
pub(crate) struct Named<T> {
    pub(crate) name: At<String>,
    pub(crate) table: T,
    /// Whether no key was left out. If one was, its absence is not reported again.
    pub(crate) is_whole: bool,
}

/// Reads each table of a section by itself.
fn each<T: DeserializeOwned>(value: &Value<'_>, out: &mut Out) -> Vec<Named<T>> {
    let Some(table) = value.get_ref().as_table() else {
        out.wrong("machine::value", &value.span(), "expected a table", None);
        return Vec::new();
    };
    let one = |(key, value): (&Spanned<std::borrow::Cow<'_, str>>, &Value<'_>)| {
        let name = At { value: key.get_ref().to_string(), span: key.span() };
        let before = out.findings.iter().count();
        let table = section(value, out)?;
        Some(Named { name, table, is_whole: out.findings.iter().count() == before })
    };
    // The parser sorts keys; restore the order of the file.
    let mut entries: Vec<_> = table.iter().collect();
    entries.sort_by_key(|(key, _)| key.span().start);
    entries.into_iter().filter_map(one).collect()
}

/// Reads a table. A key with a mistake is reported and left out, so that the others are still read.
fn section<T: DeserializeOwned>(value: &Value<'_>, out: &mut Out) -> Option<T> {
    let (mut value, mut is_whole) = (value.clone(), true);
    loop {
        let error = match T::deserialize(ValueDeserializer::from(value.clone())) {
            Ok(read) => return Some(read),
            // Do not report a key as missing that was left out.
            Err(error) if !is_whole && error.message().starts_with("missing field") => return None,
            Err(error) => error,
        };
        let at = error.span().unwrap_or_else(|| value.span());
        let (code, what, help) = in_words(error.message());
        out.wrong(code, &at, what, help);
        if !leave_out(&mut value, &at) {
            return None;
        }
        is_whole = false;
    }
}

/// The code and text for an error of serde, and which of the listed keys may be meant.
fn in_words(message: &str) -> (&'static str, String, Option<String>) {
    match message.split_once(", expected ") {
        Some((what, expected)) if what.starts_with("unknown") => {
            let word = what.split('`').nth(1).unwrap_or_default();
            let known: Vec<_> = expected.split('`').skip(1).step_by(2).collect();
            let help =
                similar(word, known.iter().copied()).unwrap_or_else(|| format!("there are {}", known.join(", ")));
            (
                if what.starts_with("unknown field") { "machine::key" } else { "machine::value" },
                what.to_owned(),
                Some(help),
            )
        }
        _ => ("machine::value", message.to_owned(), None),
    }
}

/// Removes the innermost key at a place; false if there is none.
fn leave_out(value: &mut Value<'_>, at: &Range<usize>) -> bool {
    let is_within = |span: Range<usize>| span.start <= at.start && at.end <= span.end;
    match value.get_mut() {
        DeValue::Table(table) => {
            let found = table.iter().find(|(key, value)| is_within(key.span()) || is_within(value.span()));
            let Some(key) = found.map(|(key, _)| key.clone()) else { return false };
            let deeper = table.get_mut(&key).is_some_and(|value| value.span() != *at && leave_out(value, at));
            deeper || table.remove(&key).is_some()
        }
        DeValue::Array(array) => array.iter_mut().any(|value| is_within(value.span()) && leave_out(value, at)),
        _ => false,
    }
}

/// The known word that is most similar, if it may be meant.
pub(crate) fn similar<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let near = known.into_iter().map(|known| (similarity(known, word), known)).filter(|(alike, _)| *alike > 0.8);
    let best = near.max_by(|(a, _), (b, _)| a.total_cmp(b));
    best.map(|(_, known)| format!("did you mean `{known}`?"))
}
