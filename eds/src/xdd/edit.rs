//! Another value for a key: where XML says it, once or twice, else where CiA 311 has it.

use std::ops::Range;

use roxmltree::Node;

use super::document::{attribute, children, document, find, local, start_tag, tag, text};
use super::object::{is_elementary, is_off};
use super::read::{Reader, kbit, translate, words};
use super::write::{boolean, date, kbps, time, type_name};
use super::xml::QUALIFIED;
use super::{BITSTRING, COMMISSIONING, FEATURES, FILE, IDENTITY, access_word, pdo_mapping};
use crate::finding::Findings;
use crate::model::{Entry, ObjectKind};
use crate::parse::number;
use crate::parse::section::{ObjectPart, SectionKind};
use crate::patch::Patch;
use crate::text::{Source, escaped};
use crate::{Input, device, write};

/// What comes behind the value of a parameter.
const AFTER_VALUE: [&str; 5] = ["defaultValue", "substituteValue", "allowedValues", "unit", "property"];

/// An XML data sheet in the words of CiA 306; `None` if it is not read.
pub(crate) fn in_words(xml: &Source) -> Option<Source> {
    Some(translate(xml, &mut Findings::default())?.eds)
}

/// Sets a key of a section in XML; without a value, the key goes. What comes of it is read: `None` if it is not what is wanted, in the
/// words of CiA 306.
pub(crate) fn set(
    xml: &Source,
    (section, name): (SectionKind, &str),
    key: &str,
    value: Option<&str>,
    wanted: Source,
) -> Option<Patch> {
    let wanted = device(&Input::new(wanted));
    let document = document(xml.text()).ok()?;
    let mut findings = Findings::default();
    let root = document.root_element();
    let mut editor = Editor { root, reader: Reader::new(root, &mut findings), edits: Vec::new() };
    match section {
        SectionKind::FileInfo => editor.file(key, value),
        SectionKind::DeviceInfo => editor.device(key, value),
        SectionKind::Commissioning => editor.commissioning(key, value),
        SectionKind::Object(index, ObjectPart::Sub(sub)) => {
            editor.object(index, Some(sub), key, value, wanted.entry(index, sub))
        }
        SectionKind::Object(index, _) => editor.object(index, None, key, value, wanted.entry(index, 0)),
        _ => None,
    };
    editor.characteristic(name, key, value);
    let patch = Patch::of_bytes(xml, editor.edits);
    let is = device(&Input::new(xml.with_text(patch.apply(xml))));
    (write::dcf(&is) == write::dcf(&wanted)).then_some(patch)
}

struct Editor<'d, 'i, 'o> {
    root: Node<'d, 'i>,
    reader: Reader<'d, 'i, 'o>,
    edits: Vec<(Range<usize>, String)>,
}

impl<'d, 'i> Editor<'d, 'i, '_> {
    fn file(&mut self, key: &str, value: Option<&str>) -> Option<()> {
        if key == "Description" {
            let said = words(self.reader.find(&["DeviceIdentity", "productText"])?, "description")?;
            self.edits.push((said.at, escaped(value.unwrap_or_default())));
            return Some(());
        }
        let (name, _) =
            FILE.into_iter().find(|(_, of)| *of == if key == "FileRevision" { "FileVersion" } else { key })?;
        let said: Vec<_> = self.reader.bodies.iter().copied().filter(|it| attribute(*it, name).is_some()).collect();
        for body in if said.is_empty() { self.reader.bodies.iter().copied().take(1).collect() } else { said } {
            let was = attribute(body, name).map_or("", |said| said.text);
            let (version, rest) = was.split_once('.').unwrap_or((was, ""));
            let value = match (key, value) {
                ("FileVersion", Some(version)) if !rest.is_empty() => Some(format!("{version}.{rest}")),
                ("FileRevision", Some(revision)) => Some(match rest.split_once('.') {
                    Some((_, rest)) => format!("{version}.{revision}.{rest}"),
                    None => format!("{version}.{revision}"),
                }),
                ("FileRevision", None) => Some(version.to_owned()),
                ("CreationDate" | "ModificationDate", Some(value)) => Some(date(value)?),
                ("CreationTime" | "ModificationTime", Some(value)) => Some(time(value)?),
                (_, value) => value.map(str::to_owned),
            };
            self.attribute(body, name, value.as_deref());
        }
        Some(())
    }

    fn device(&mut self, key: &str, value: Option<&str>) -> Option<()> {
        if let Some((name, _)) = IDENTITY.into_iter().find(|(_, of)| *of == key) {
            let identity = self.reader.find(&["DeviceIdentity"])?;
            match (find(identity, &[name]), value) {
                (Some(node), Some(_)) => self.text(node, value),
                (Some(node), None) => self.remove(node),
                (None, Some(value)) => {
                    let name = self.tag_of(name);
                    self.insert(identity, &[], &format!("<{name}>{}</{name}>", escaped(value)));
                }
                (None, None) => {}
            }
        } else if let Some((name, _, default)) = FEATURES.into_iter().find(|(_, of, _)| *of == key) {
            let general = self.reader.find(&["NetworkManagement", "CANopenGeneralFeatures"])?;
            let value = value.map(|value| if default == Some("false") { boolean(value) } else { value });
            self.attribute(general, name, value);
        } else if key == "SimpleBootUpMaster" {
            let master = self.reader.find(&["NetworkManagement", "CANopenMasterFeatures"])?;
            self.attribute(master, "bootUpMaster", value.map(boolean));
        } else if let Some(rate) = key.strip_prefix("BaudRate_") {
            let rates = self.reader.find(&["TransportLayers", "PhysicalLayer", "baudRate"])?;
            let is_rate = |it: &Node<'_, '_>| attribute(*it, "value").and_then(|said| kbit(said.text)) == Some(rate);
            let said = children(rates, "supportedBaudRate").find(is_rate);
            match (said, value) {
                (None, Some("1")) => {
                    let name = self.tag_of("supportedBaudRate");
                    self.insert(rates, &[], &format!("<{name} value=\"{}\" />", kbps(rate)));
                }
                (Some(_), Some("1")) | (None, _) => {}
                (Some(node), _) => self.remove(node),
            }
        }
        Some(())
    }

    fn commissioning(&mut self, key: &str, value: Option<&str>) -> Option<()> {
        let node = self.reader.find(&["NetworkManagement", "deviceCommissioning"])?;
        let (name, _) = COMMISSIONING.into_iter().find(|(_, of)| *of == key)?;
        let as_said = node.attributes().find(|it| it.name().eq_ignore_ascii_case(name));
        let name = as_said.map_or(name, |said| said.name());
        match key {
            "Baudrate" => self.attribute(node, name, value.map(kbps).as_deref()),
            "CANopenManager" => self.attribute(node, name, value.map(boolean)),
            _ => self.attribute(node, name, value),
        }
        Some(())
    }

    fn object(
        &mut self,
        index: u16,
        sub: Option<u8>,
        key: &str,
        value: Option<&str>,
        entry: Option<&Entry>,
    ) -> Option<()> {
        let list = self.reader.find(&["ApplicationLayers", "CANopenObjectList"])?;
        let is = |node: &Node<'_, '_>, name: &str, wanted: u16| {
            attribute(*node, name).and_then(|said| u16::from_str_radix(said.text, 16).ok()) == Some(wanted)
        };
        let mut objects = children(list, "CANopenObject").filter(|node| is(node, "index", index));
        let object = objects.find(|node| !self.reader.parameter(*node).is_some_and(is_off))?;
        let node = match sub {
            Some(sub) => children(object, "CANopenSubObject").find(|it| is(it, "subIndex", sub.into()))?,
            None => object,
        };
        let parameter = self.reader.parameter(node);
        let code = attribute(node, "objectType").and_then(|said| said.text.parse().ok());
        let is_value = !code.and_then(ObjectKind::from_code).unwrap_or(ObjectKind::Variable).has_subs();
        let own = parameter.filter(|_| is_value);
        let number = |digits: fn(i128) -> String| {
            value.map(|value| number::integer(value).map_or(value.to_owned(), |read| digits(read.value)))
        };
        match key {
            "ParameterName" => {
                let label = parameter.and_then(|it| words(it, "label"));
                let was = attribute(node, "name");
                let is_same = label.as_ref().is_some_and(|label| was.as_ref().is_none_or(|was| was.text == label.text));
                if let Some(label) = label.filter(|_| is_same) {
                    self.edits.push((label.at, escaped(value.unwrap_or_default())));
                }
                if was.is_some() || !is_same {
                    self.attribute(node, "name", value);
                }
            }
            "ObjectType" => self.attribute(node, "objectType", number(|code| code.to_string()).as_deref()),
            "SubNumber" => self.attribute(node, "subNumber", number(|count| count.to_string()).as_deref()),
            "ObjFlags" => self.attribute(node, "objFlags", number(|flags| format!("{flags:04X}")).as_deref()),
            "DefaultValue" => self.value(own, node, "defaultValue", value),
            "ParameterValue" => self.value(own, node, "actualValue", value),
            "Denotation" => match own.and_then(|own| find(own, &["denotation", "label"])) {
                Some(label) => self.text(label, value),
                None => self.attribute(node, "denotation", value),
            },
            "LowLimit" => self.limit(own, node, ["lowLimit", "minValue"], value),
            "HighLimit" => self.limit(own, node, ["highLimit", "maxValue"], value),
            "AccessType" | "PDOMapping" => self.access(own, node, entry?),
            "DataType" => {
                let name = type_name(entry?.data_type);
                let is_type = |it: &Node<'_, '_>| is_elementary(it) || local(*it) == "dataTypeIDRef";
                if let Some(node) = own.and_then(|own| own.children().find(is_type)) {
                    self.edits.push((node.range(), format!("<{name} />")));
                }
                if own.is_none() || name == BITSTRING || attribute(node, "dataType").is_some() {
                    self.attribute(node, "dataType", number(|code| format!("{code:04X}")).as_deref());
                }
            }
            _ => {}
        }
        Some(())
    }

    /// A value that the parameter has as an element, and the object as an attribute.
    fn value(&mut self, own: Option<Node<'d, 'i>>, node: Node<'d, 'i>, name: &str, value: Option<&str>) {
        let element = own.and_then(|own| find(own, &[name]));
        match (element, value) {
            (Some(element), Some(_)) => self.attribute(element, "value", value),
            (Some(element), None) => self.remove(element),
            (None, _) => {}
        }
        if attribute(node, name).is_some() || own.is_none() {
            self.attribute(node, name, value);
        } else if let (Some(own), None, Some(value)) = (own, element, value) {
            let later = AFTER_VALUE.iter().position(|it| *it == name).map_or(0, |at| at + 1);
            let name = self.tag_of(name);
            self.insert(own, &AFTER_VALUE[later..], &format!("<{name} value=\"{}\" />", escaped(value)));
        }
    }

    /// A limit; a range has both of them (CiA 311), so that a single one is an attribute of the object.
    fn limit(&mut self, own: Option<Node<'d, 'i>>, node: Node<'d, 'i>, names: [&str; 2], value: Option<&str>) {
        let range = own.and_then(|own| find(own, &["allowedValues", "range"]));
        let end = range.and_then(|range| find(range, &[names[1]]));
        match (range, end, value) {
            (_, Some(end), Some(_)) => self.attribute(end, "value", value),
            (Some(range), Some(end), None) => {
                let others = ["minValue", "maxValue"].into_iter().filter(|name| *name != names[1]);
                let other = others.filter_map(|name| attribute(find(range, &[name])?, "value")).next();
                let name = if names[0] == "lowLimit" { "highLimit" } else { "lowLimit" };
                match other {
                    Some(other) => {
                        self.attribute(node, name, Some(other.text));
                        self.remove(range);
                    }
                    None => self.remove(end),
                }
            }
            _ => {}
        }
        if attribute(node, names[0]).is_some() || end.is_none() {
            self.attribute(node, names[0], value);
        }
    }

    /// Access and mapping, of which each says something of the other; what says the same already stays.
    fn access(&mut self, own: Option<Node<'d, 'i>>, node: Node<'d, 'i>, entry: &Entry) {
        let direction = pdo_mapping(entry.access);
        let is = attribute(node, "PDOmapping").map_or("no", |said| said.text);
        let mapping = match is {
            _ if !entry.pdo_mapping => "no",
            "TPDO" | "RPDO" if is != direction => direction,
            "no" if own.is_none() => direction,
            "no" => "optional",
            kept => kept,
        };
        if mapping != is {
            self.attribute(node, "PDOmapping", Some(mapping));
        }
        if let Some(own) = own {
            self.attribute(own, "access", Some(access_word(entry.access)));
        }
        if own.is_none() || attribute(node, "accessType").is_some() {
            let word = if ["TPDO", "RPDO"].contains(&mapping) { "rw" } else { entry.access.name() };
            self.attribute(node, "accessType", Some(word));
        }
    }

    /// The characteristic that says a key which XML has no word for.
    fn characteristic(&mut self, section: &str, key: &str, value: Option<&str>) {
        for (of, node) in self.reader.characteristics_of_sections() {
            let label = |name: &str| find(node, &[name, "label"]);
            let is_key = label("characteristicName").is_some_and(|it| text(it).text.eq_ignore_ascii_case(key));
            if !is_key || !of.eq_ignore_ascii_case(section) {
                continue;
            }
            match label("characteristicContent").filter(|_| value.is_some()) {
                Some(content) => self.text(content, value),
                None => self.remove(node),
            }
        }
    }

    fn attribute(&mut self, node: Node<'d, 'i>, name: &str, value: Option<&str>) {
        let said = node.attributes().find(|attribute| attribute.name() == name);
        match (said, value) {
            (Some(said), Some(value)) => {
                // With its quotes, which may be single ones.
                let at = said.range_value();
                self.edits.push((at.start - 1..at.end + 1, format!("\"{}\"", escaped(value))));
            }
            (Some(said), None) => {
                let gap = self.gap_before(said.range().start);
                self.edits.push((said.range().start - gap.len()..said.range().end, String::new()));
            }
            (None, Some(value)) => {
                let end = node.attributes().map(|it| it.range().end).max().unwrap_or(tag(node).end);
                self.edits.push((end..end, format!(" {name}=\"{}\"", escaped(value))));
            }
            (None, None) => {}
        }
    }

    fn text(&mut self, node: Node<'d, 'i>, value: Option<&str>) {
        let value = escaped(value.unwrap_or_default());
        if node.children().next().is_some() {
            return self.edits.push((text(node).at, value));
        }
        self.edits.push(self.filled(node, &value));
    }

    /// An element without content gets some.
    fn filled(&self, node: Node<'d, 'i>, content: &str) -> (Range<usize>, String) {
        (node.range(), format!("{}>{content}</{}>", start_tag(node), &self.source()[tag(node)]))
    }

    /// An element goes, with the blanks before it.
    fn remove(&mut self, node: Node<'d, 'i>) {
        let gap = self.gap_before(node.range().start);
        self.edits.push((node.range().start - gap.len()..node.range().end, String::new()));
    }

    /// A new element before those that come later, as far in as its neighbours.
    fn insert(&mut self, parent: Node<'d, 'i>, later: &[&str], markup: &str) {
        let mut elements = parent.children().filter(Node::is_element);
        let edit = if let Some(next) = elements.clone().find(|it| later.contains(&local(*it))) {
            let start = next.range().start;
            (start..start, format!("{markup}{}", self.gap_before(start)))
        } else if let Some(last) = elements.next_back() {
            let end = last.range().end;
            (end..end, format!("{}{markup}", self.gap_before(last.range().start)))
        } else {
            let gap = self.gap_before(parent.range().start);
            let deeper = if gap.is_empty() { "" } else { "  " };
            self.filled(parent, &format!("{gap}{deeper}{markup}{gap}"))
        };
        self.edits.push(edit);
    }

    /// The blanks before a place.
    fn gap_before(&self, at: usize) -> &'d str {
        let before = &self.source()[..at];
        &before[before.trim_end().len()..]
    }

    fn source(&self) -> &'d str {
        self.root.document().input_text()
    }

    /// An element's name as this file writes it, with or without a prefix.
    fn tag_of(&self, name: &str) -> String {
        if let Some(known) = self.root.descendants().find(|it| it.is_element() && local(*it) == name) {
            return self.source()[tag(known)].to_owned();
        }
        let root = &self.source()[tag(self.root)];
        match root.split_once(':').filter(|_| QUALIFIED.split(' ').any(|it| it == name)) {
            Some((prefix, _)) => format!("{prefix}:{name}"),
            None => name.to_owned(),
        }
    }
}
