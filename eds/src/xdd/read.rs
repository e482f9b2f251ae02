//! From XML to the sections and keys of CiA 306: the file and the device; objects are in the file beside this.

use std::collections::BTreeMap;
use std::ops::Range;

use roxmltree::Node;

use super::document::{Refused, Said, attribute, children, document, find, local, tag, text};
use super::sheet::{Names, Says, Sections, Sheet, xml_span};
use super::{COMMISSIONING, FEATURES, FILE, IDENTITY};
use crate::finding::{Findings, Kind};
use crate::model::ObjectList;
use crate::text::{Source, Span};
use crate::write::list_name;

/// An XML data sheet in the words of CiA 306; `None` if it is not one that is read, which is found then.
pub(crate) fn translate(xml: &Source, out: &mut Findings) -> Option<Sheet> {
    let document = match document(xml.text()) {
        Ok(document) => document,
        Err(Refused { why, at, help }) => {
            out.push(Kind::Xml { why: why.into(), help }, Span::eds(at as u32, at as u32));
            return None;
        }
    };
    let root = document.root_element();
    let mut reader = Reader::new(root, out);
    reader.file();
    reader.device();
    reader.objects();
    reader.characteristics();
    reader.unread(root);
    Some(reader.sections.finish(xml, reader.says, reader.names))
}

/// Reads one file.
pub(super) struct Reader<'d, 'i, 'o> {
    /// That of the device, and that of the communication network.
    pub(super) bodies: Vec<Node<'d, 'i>>,
    /// What references name: parameters, templates and data types.
    pub(super) ids: BTreeMap<&'d str, Node<'d, 'i>>,
    pub(super) sections: Sections,
    pub(super) says: Vec<Says>,
    pub(super) names: Names,
    /// The names of the enumerations made so far, by where they are made and the data type.
    pub(super) enumerations: BTreeMap<(usize, String), Option<String>>,
    /// How many objects are off.
    pub(super) off: usize,
    pub(super) out: &'o mut Findings,
}

impl<'d, 'i, 'o> Reader<'d, 'i, 'o> {
    pub(super) fn new(root: Node<'d, 'i>, out: &'o mut Findings) -> Self {
        let profiles = std::iter::once(root).chain(children(root, "ISO15745Profile"));
        let bodies = profiles.flat_map(|profile| children(profile, "ProfileBody")).collect();
        let mut reader = Reader {
            bodies,
            ids: BTreeMap::new(),
            sections: Sections::default(),
            says: Vec::new(),
            names: Names::default(),
            enumerations: BTreeMap::new(),
            off: 0,
            out,
        };
        reader.identify();
        reader
    }

    /// The first element on a path below one of the bodies.
    pub(super) fn find(&self, path: &[&str]) -> Option<Node<'d, 'i>> {
        self.bodies.iter().find_map(|body| find(*body, path))
    }

    fn identify(&mut self) {
        let processes = self.bodies.iter().flat_map(|body| children(*body, "ApplicationProcess"));
        for node in processes.flat_map(|process| process.descendants()) {
            let Some(id) = attribute(node, "uniqueID") else { continue };
            match self.ids.get(id.text) {
                Some(first) => {
                    let first = xml_span(tag(*first));
                    let span = xml_span(id.at);
                    self.out.push(Kind::DuplicateId { id: id.text.into(), first }, span);
                }
                None => drop(self.ids.insert(id.text, node)),
            }
        }
    }

    fn file(&mut self) {
        let Some(&body) = self.bodies.first() else { return };
        self.sections.begin("FileInfo".to_owned(), tag(body));
        for (name, key) in FILE {
            let said = self.bodies.iter().find_map(|body| attribute(*body, name));
            let Some(said) = said.filter(|said| !said.text.is_empty()) else { continue };
            // The version may have more parts than CiA 306 has: `1.0.0`.
            let (version, revision) = said.text.split_once('.').unwrap_or((said.text, ""));
            let value = match key {
                "FileVersion" => Some(version.to_owned()),
                "CreationDate" | "ModificationDate" => date(said.text),
                "CreationTime" | "ModificationTime" => time(said.text),
                _ => None,
            };
            self.sections.pair(key, value.as_deref().unwrap_or(said.text), said.at.clone());
            if key == "FileVersion" && !revision.is_empty() {
                let revision = revision.split('.').next().unwrap_or_default();
                self.sections.pair("FileRevision", revision, said.at);
            }
        }
        let product = self.find(&["DeviceIdentity", "productText"]);
        if let Some(description) = product.and_then(|product| words(product, "description")) {
            self.sections.pair("Description", description.text, description.at);
        }
    }

    fn device(&mut self) {
        let Some(&body) = self.bodies.first() else { return };
        let identity = self.find(&["DeviceIdentity"]);
        self.sections.begin("DeviceInfo".to_owned(), tag(identity.unwrap_or(body)));
        for (name, key) in IDENTITY {
            let Some(said) = identity.and_then(|identity| find(identity, &[name])).map(text) else { continue };
            // Eight digits are hexadecimal, with or without prefix.
            let is_hex = said.text.len() == 8 && said.text.bytes().all(|byte| byte.is_ascii_hexdigit());
            let prefix = if is_hex && key.ends_with("Number") { "0x" } else { "" };
            self.sections.pair(key, &format!("{prefix}{}", said.text), said.at);
        }
        self.bit_rates();
        let general = self.find(&["NetworkManagement", "CANopenGeneralFeatures"]);
        for (name, key, default) in FEATURES {
            let Some(general) = general else { break };
            match (attribute(general, name), default) {
                (Some(said), _) => self.sections.pair(key, flag(said.text), said.at),
                (None, Some(default)) => self.sections.pair(key, flag(default), tag(general)),
                (None, None) => {}
            }
        }
        let master = self.find(&["NetworkManagement", "CANopenMasterFeatures"]);
        if let Some(said) = master.and_then(|master| attribute(master, "bootUpMaster")) {
            self.sections.pair("SimpleBootUpMaster", flag(said.text), said.at);
        }
        if let Some(node) = self.find(&["NetworkManagement", "deviceCommissioning"]) {
            self.sections.begin("DeviceComissioning".to_owned(), tag(node));
            for (name, key) in COMMISSIONING {
                let named = |name: &str| node.attributes().find(|it| it.name().eq_ignore_ascii_case(name));
                let Some(said) = named(name) else { continue };
                let value = said.value();
                let value = if key == "Baudrate" { kbit(value).unwrap_or(value) } else { flag(value) };
                self.sections.pair(key, value, said.range_value());
            }
        }
        self.dummies();
    }

    fn bit_rates(&mut self) {
        let Some(node) = self.find(&["TransportLayers", "PhysicalLayer", "baudRate"]) else { return };
        for said in children(node, "supportedBaudRate").filter_map(|node| attribute(node, "value")) {
            if let Some(rate) = kbit(said.text) {
                self.sections.pair(&format!("BaudRate_{rate}"), "1", said.at);
            }
        }
    }

    fn dummies(&mut self) {
        if let Some(node) = self.find(&["ApplicationLayers", "dummyUsage"]) {
            self.sections.begin("DummyUsage".to_owned(), tag(node));
            for said in children(node, "dummy").filter_map(|node| attribute(node, "entry")) {
                let (key, value) = said.text.split_once('=').unwrap_or((said.text, ""));
                self.sections.pair(key, value, said.at);
            }
        }
    }

    /// The lists that objects belong into by their indices, which XML leaves open.
    pub(super) fn lists(&mut self, objects: &[(u16, Range<usize>)], at: &Range<usize>) {
        for list in [ObjectList::Mandatory, ObjectList::Optional, ObjectList::Manufacturer] {
            let mut of_list: Vec<_> =
                objects.iter().filter(|(index, _)| ObjectList::of_index(*index) == list).collect();
            of_list.sort_by_key(|(index, _)| *index);
            of_list.dedup_by_key(|(index, _)| *index);
            self.sections.begin(list_name(list).to_owned(), at.clone());
            self.sections.pair("SupportedObjects", &of_list.len().to_string(), at.clone());
            for ((index, at), number) in of_list.into_iter().zip(1..) {
                self.sections.pair(&format!("{number}"), &format!("0x{index:04X}"), at.clone());
            }
        }
    }

    /// What XML has no word for: keys of the section that the category names.
    fn characteristics(&mut self) {
        for (section, characteristic) in self.characteristics_of_sections() {
            let label = |name: &str| find(characteristic, &[name, "label"]).map(text);
            let Some(key) = label("characteristicName") else { continue };
            let value = label("characteristicContent");
            let at = value.as_ref().map_or(key.at, |value| value.at.clone());
            self.sections.instead(section, key.text, value.map(|value| value.text), at);
        }
    }

    /// The characteristics that stand for keys, with the section of each.
    pub(super) fn characteristics_of_sections(&self) -> Vec<(&'d str, Node<'d, 'i>)> {
        let functions = self.bodies.iter().flat_map(|body| children(*body, "DeviceFunction"));
        let lists = functions.flat_map(|it| it.descendants()).filter(|node| local(*node) == "characteristicsList");
        let lists = lists.filter_map(|list| Some((section_of(list)?, list)));
        lists.flat_map(|(section, list)| children(list, "characteristic").map(move |it| (section, it))).collect()
    }

    /// Elements that say something which the model has no place for, but for those below them.
    fn unread(&mut self, root: Node<'d, 'i>) {
        let mut found: BTreeMap<&str, usize> = BTreeMap::new();
        let mut first = None;
        let mut below = 0;
        for node in root.descendants().filter(|node| UNREAD.split(' ').any(|name| name == local(*node))) {
            let says_something = node.has_children() || node.attributes().len() > 0;
            if node.range().start < below || !says_something || section_of(node).is_some() {
                continue;
            }
            below = node.range().end;
            first = first.or(Some(tag(node)));
            *found.entry(local(node)).or_default() += 1;
        }
        if self.off > 0 {
            found.insert("object that is off", self.off);
            first = first.or(self.find(&["ApplicationLayers", "CANopenObjectList"]).map(tag));
        }
        if let Some(at) = first {
            let span = xml_span(at);
            self.out.push(Kind::Unread(found.into_iter().map(|(name, count)| (name.into(), count)).collect()), span);
        }
    }
}

/// What is not read.
const UNREAD: &str = "\
    vendorText deviceFamily productFamily version buildDate specificationRevision instanceName DeviceManager \
    characteristicsList standardComplianceList picturesList dictionaryList functionTypeList functionInstanceList \
    parameterGroupList ExternalProfileHandle moduleManagement dynamicChannels variableRef \
    conditionalSupport substituteValue step";

/// The section that a list of characteristics is about.
fn section_of<'d>(list: Node<'d, '_>) -> Option<&'d str> {
    let category = words(find(list, &["category"])?, "label")?.text;
    category.strip_prefix('[')?.strip_suffix(']')
}

/// The label or description of an element: the English one, else the first.
pub(super) fn words<'d>(node: Node<'d, '_>, name: &str) -> Option<Said<'d>> {
    let is_english = |node: &Node<'_, '_>| attribute(*node, "lang").is_some_and(|lang| lang.text.starts_with("en"));
    let node = children(node, name).find(is_english).or_else(|| children(node, name).next())?;
    Some(text(node)).filter(|said| !said.text.trim().is_empty())
}

/// A number that XML writes in hexadecimal without prefix.
pub(super) fn hex(text: &str) -> String {
    let is_hex = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_hexdigit());
    if is_hex { format!("0x{text}") } else { text.to_owned() }
}

fn flag(text: &str) -> &str {
    match text {
        "true" => "1",
        "false" => "0",
        other => other,
    }
}

/// `500 Kbps`.
pub(super) fn kbit(text: &str) -> Option<&str> {
    text.strip_suffix("Kbps").map(str::trim)
}

/// `2020-11-28`, as CiA 306 writes it.
fn date(text: &str) -> Option<String> {
    let (year, rest) = text.split_once('-')?;
    let (month, day) = rest.split_once('-')?;
    let day = day.get(..2)?;
    Some(format!("{month}-{day}-{year}"))
}

/// `12:37:54.0000000+01:00`, as CiA 306 writes it.
fn time(text: &str) -> Option<String> {
    let (hours, minutes) = (text.get(..2)?.parse::<u8>().ok()?, text.get(2..5)?);
    let half = if hours < 12 { "AM" } else { "PM" };
    Some(format!("{:02}{minutes}{half}", (hours + 11) % 12 + 1))
}
