//! Reads CPJ files (CiA 306-3, nodelist project), which list the nodes of networks with their DCFs.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use lexican_eds::model::Device;
use lexican_eds::outline::{Outline, Section};
use lexican_eds::text::Span;
use lexican_eds::{Diagnostics, Input, Severity, Source};
use lexican_runtime::NodeId;

use crate::draft::{Draft, Found, quoted};
use crate::files::Files;
use crate::read::{Out, similar};

/// A machine that a CPJ and its DCFs describe.
#[derive(Debug)]
pub struct Cpj {
    /// The machine, with one bus for each network.
    pub draft: Draft,
    /// What is wrong with the file, and what a machine cannot express.
    pub findings: Diagnostics,
    /// The text, to render the findings.
    pub input: Input,
}

impl Cpj {
    /// Reads a CPJ. For the DCF of a node, given by path and contents, `sheet` returns the name and contents of the
    /// node's data sheet: the DCF itself, or a known one.
    #[must_use]
    pub fn read(source: Source, files: Files<'_>, sheet: &dyn Fn(&str, &Device) -> (String, Device)) -> Self {
        let mut reader = Reader { source: &source, files, sheet, draft: Draft::default(), out: Out::default() };
        reader.file(&Outline::new(&source).sections);
        reader.out.findings.finish();
        let Reader { draft, out, .. } = reader;
        Cpj { draft, findings: out.findings, input: Input::new(source) }
    }
}

/// A key with its value.
struct Pair<'a> {
    key: &'a str,
    at: Range<usize>,
    value: &'a str,
}

/// The keys of CiA 306-3 for a network, and those for a node, which follow `Node` and its node-ID.
const NETWORK: [&str; 4] = ["NetName", "NetRefd", "EDSBaseName", "Nodes"];
const NODE: [&str; 4] = ["Present", "Name", "Refd", "DCFName"];

struct Reader<'a> {
    source: &'a Source,
    files: Files<'a>,
    sheet: &'a dyn Fn(&str, &Device) -> (String, Device),
    draft: Draft,
    out: Out,
}

impl<'a> Reader<'a> {
    fn warn(&mut self, code: &'static str, at: &Range<usize>, what: String, help: Option<String>) {
        self.out.push(Severity::Warning, code, at, what, help);
    }

    fn file(&mut self, sections: &[Section]) {
        let mut networks: BTreeMap<u32, &Section> = BTreeMap::new();
        for section in sections {
            let (at, name) = (range(section.name), self.source.get(section.name).trim());
            let number = strip(name, "Topology").map(|digits| if digits.is_empty() { "1" } else { digits });
            let what = match number.and_then(|number| number.parse().ok()) {
                None => format!("[{name}] is left out: a machine has nothing of it"),
                Some(number) if networks.contains_key(&number) => again(&format!("[{name}]")),
                Some(number) => {
                    networks.insert(number, section);
                    continue;
                }
            };
            self.warn("cpj::section", &at, what, None);
        }
        if networks.is_empty() {
            self.out.wrong("cpj::section", &(0..0), "this is no CPJ: it has no [Topology]", None);
        }
        for section in networks.values() {
            self.network(section, networks.len() > 1);
        }
    }

    /// The keys of a section in lower case; the first of equal keys counts.
    fn pairs(&mut self, section: &Section) -> BTreeMap<String, Pair<'a>> {
        let mut pairs = BTreeMap::new();
        for (key, value) in &section.pairs {
            let (at, key, value) = (range(*key), self.source.get(*key), self.source.get(*value).trim());
            match pairs.entry(key.to_ascii_lowercase()) {
                Entry::Vacant(free) => {
                    free.insert(Pair { key, at, value });
                }
                Entry::Occupied(_) => self.warn("cpj::key", &at, again(&format!("`{key}`")), None),
            }
        }
        pairs
    }

    /// Adds the nodes of a network. It is the machine's only bus, or one of `several`.
    fn network(&mut self, section: &Section, several: bool) {
        let mut pairs = self.pairs(section);
        let [name, designator, base, count] = NETWORK.map(|key| pairs.remove(&key.to_ascii_lowercase()));
        let [name, designator, base] = [name, designator, base].map(text);
        let bus = several.then(|| self.draft.free_bus_name(name.unwrap_or_default()));
        let (mut places, mut nodes, mut rates) = (Vec::new(), Vec::new(), BTreeSet::new());
        for id in NodeId::all() {
            let keys = NODE.map(|word| pairs.remove(&format!("node{id}{}", word.to_ascii_lowercase())));
            let Some(at) = keys.iter().flatten().next().map(|pair| pair.at.clone()) else { continue };
            if let Some(mut node) = self.node(id, keys, base, &at) {
                let dcf = node.sheet.as_ref().and_then(|(.., dcf)| dcf.commissioning.as_ref());
                rates.extend(dcf.and_then(|dcf| dcf.bit_rate_kbit));
                node.lines.extend(bus.as_deref().map(|bus| ("bus", quoted(bus))));
                places.push(at);
                nodes.push(node);
            }
        }
        if let Some(count) = count.filter(|count| number(count.value) != u32::try_from(nodes.len()).ok()) {
            let what = format!("Nodes={}, but there are {} present", count.value, nodes.len());
            self.warn("cpj::value", &count.at, what, Some(format!("Nodes=0x{:02X}", nodes.len())));
        }
        for Pair { key, at, .. } in pairs.values() {
            let help = similar(key, NETWORK).or_else(|| Some("nodes are Node1… to Node127…".to_owned()));
            self.warn("cpj::key", at, format!("unknown key `{key}`, which is left out"), help);
        }
        match rates.first() {
            Some(rate) if rates.len() == 1 => self.draft.bus.put_bit_rate((*rate).into()),
            Some(_) => {
                let what = format!("left out: the DCFs have several bit rates, {rates:?} kbit/s");
                self.warn("cpj::differs", &range(section.name), what, None);
            }
            None => {}
        }
        for ((at, node), (name, refused)) in places.iter().zip(&nodes).zip(self.draft.add_all(&nodes)) {
            if let Some(wanted) = node.name.as_ref().filter(|wanted| **wanted != name) {
                let what = format!("{wanted:?} cannot be the name of this node, which is called {name:?}");
                self.warn("cpj::name", at, what, None);
            }
            for refused in refused {
                self.out.wrong("cpj::value", at, format!("left out: {refused}"), None);
            }
        }
        self.draft.end_bus(bus, name, designator);
    }

    /// Adds a node if it is present.
    fn node(
        &mut self,
        id: NodeId,
        keys: [Option<Pair<'a>>; 4],
        base: Option<&str>,
        at: &Range<usize>,
    ) -> Option<Found> {
        let [present, name, designator, dcf] = keys;
        match present.map(|pair| number(pair.value)) {
            Some(Some(1)) => {}
            Some(Some(0)) => {
                self.warn("cpj::left-out", at, format!("node {id} is left out: it is not present"), None);
                return None;
            }
            _ => {
                let what = format!("node {id} is left out: it does not say that it is present");
                self.warn("cpj::value", at, what, Some(format!("Node{id}Present=0x01")));
                return None;
            }
        }
        let dcf = dcf.filter(|dcf| !dcf.value.is_empty()).and_then(|dcf| self.dcf(base, &dcf));
        let mut node = match dcf {
            Some((path, dcf)) => {
                let (sheet_name, sheet) = (self.sheet)(&path, &dcf);
                let node_id = dcf.commissioning.as_ref().and_then(|it| it.node_id);
                self.differs(id, at, "NodeID", node_id.map(|id| id.to_string()), Some(&id.to_string()));
                Found::of_dcf(id, dcf, sheet_name, sheet)
            }
            None => Found::new(id, [None; 4], None, 0),
        };
        let [name, designator] = [name, designator].map(text);
        node.name = self.differs(id, at, "NodeName", node.name, name);
        node.designator = self.differs(id, at, "NodeRefd", node.designator, designator);
        Some(node)
    }

    /// The value in the list, or else in the DCF; reports a difference.
    fn differs(
        &mut self,
        id: NodeId,
        at: &Range<usize>,
        key: &str,
        dcf: Option<String>,
        list: Option<&str>,
    ) -> Option<String> {
        if let (Some(other), Some(said)) = (&dcf, list)
            && other != said
        {
            let what = format!("the DCF of node {id} says {key}={other}; the list of the nodes counts: {said}");
            self.warn("cpj::differs", at, what, None);
        }
        list.map(str::to_owned).or(dcf)
    }

    /// The DCF of a node, and its path.
    fn dcf(&mut self, base: Option<&str>, name: &Pair<'_>) -> Option<(String, Device)> {
        let path = base.map_or_else(|| name.value.to_owned(), |base| format!("{base}/{}", name.value));
        let path = self.files.name(&path.replace('\\', "/"));
        let sheet = self.files.data_sheet(&path, &[]);
        let sheet = sheet.map_err(|error| self.out.wrong("cpj::sheet", &name.at, error.to_string(), error.remedy()));
        Some((path, sheet.ok()?.device))
    }
}

fn again(what: &str) -> String {
    format!("{what} comes again, and only the first one counts")
}

/// The value, unless it is empty.
fn text(pair: Option<Pair<'_>>) -> Option<&str> {
    pair.map(|pair| pair.value).filter(|value| !value.is_empty())
}

fn range(span: Span) -> Range<usize> {
    span.start as usize..span.end as usize
}

/// The rest after a word, which may be in upper or lower case.
fn strip<'a>(text: &'a str, word: &str) -> Option<&'a str> {
    text.get(word.len()..).filter(|_| text[..word.len()].eq_ignore_ascii_case(word))
}

fn number(text: &str) -> Option<u32> {
    match strip(text, "0x") {
        Some(digits) => u32::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}
