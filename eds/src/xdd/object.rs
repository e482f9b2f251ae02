//! Objects, and the parameters that say what they are.

use std::ops::Range;

use roxmltree::Node;

use super::document::{Said, attribute, children, find, local, tag};
use super::read::{Reader, hex, words};
use super::sheet::{Names, Says, xml_span};
use super::{ACCESS, BITSTRING, TYPES};
use crate::finding::Kind;
use crate::model::keys::Key;
use crate::model::types::DataType;
use crate::model::{AccessType, Enumeration, Meaning, Named, ObjectKind, Properties, Quantity, Unit};
use crate::overlay::rational;
use crate::parse::number;

/// A data type may name another; so often it is followed.
const MAX_STEPS: usize = 8;

impl<'d, 'i> Reader<'d, 'i, '_> {
    pub(super) fn objects(&mut self) {
        let Some(list) = self.find(&["ApplicationLayers", "CANopenObjectList"]) else { return };
        let index = |node: &Node<'d, 'i>| attribute(*node, "index").map_or("", |said| said.text);
        let objects = children(list, "CANopenObject").map(|node| (node, self.parameter(node)));
        let (off, objects): (Vec<_>, Vec<_>) = objects.partition(|(_, parameter)| parameter.is_some_and(is_off));
        self.off = off.len();
        let listed = |node: &Node<'d, 'i>| Some((u16::from_str_radix(index(node), 16).ok()?, place(*node, "index")));
        self.lists(&objects.iter().filter_map(|(node, _)| listed(node)).collect::<Vec<_>>(), &tag(list));
        for (object, parameter) in objects {
            let name = index(&object);
            let number = u16::from_str_radix(name, 16).unwrap_or_default();
            self.sections.begin(name.to_owned(), place(object, "index"));
            self.entry(object, parameter, number, None);
            for entry in children(object, "CANopenSubObject") {
                let sub = attribute(entry, "subIndex").map_or("", |said| said.text);
                // As CiA 306 writes it, without a leading zero.
                let number_of_sub = u8::from_str_radix(sub, 16).ok();
                let sub = number_of_sub.map_or(sub.to_owned(), |sub| format!("{sub:X}"));
                self.sections.begin(format!("{name}sub{sub}"), place(entry, "subIndex"));
                let parameter = self.parameter(entry);
                self.entry(entry, parameter, number, number_of_sub);
            }
        }
    }

    /// The keys of an object, or of one of its sub-indices.
    fn entry(&mut self, node: Node<'d, 'i>, parameter: Option<Node<'d, 'i>>, index: u16, sub: Option<u8>) {
        let code = attribute(node, "objectType").and_then(|said| said.text.parse().ok());
        let kind = code.and_then(ObjectKind::from_code).unwrap_or(ObjectKind::Variable);
        let is_value = !kind.has_subs();
        // Of objects with sub-indices, tools keep there what belongs to these.
        let own = Own { parameter: parameter.filter(|_| is_value), node, reader: self };
        let data_type = own.data_type();
        let mut keys: Vec<(Key, String, Range<usize>)> = Vec::new();
        let mut say = |key: Key, said: Option<Said<'_>>| {
            keys.extend(said.map(|said| (key, said.text.to_owned(), said.at)));
        };
        say(Key::ParameterName, own.inline("name").or_else(|| words(parameter?, "label")));
        say(Key::ObjectType, own.inline("objectType"));
        say(Key::SubNumber, own.inline("subNumber"));
        say(Key::Denotation, own.value("denotation"));
        say(Key::DefaultValue, own.value("defaultValue"));
        say(Key::ParameterValue, own.value("actualValue"));
        say(Key::LowLimit, own.limit("lowLimit", "minValue"));
        say(Key::HighLimit, own.limit("highLimit", "maxValue"));
        let flags = own.inline("objFlags").map(|said| (Key::ObjFlags, hex(said.text), said.at));
        let mapping = own.inline("PDOmapping").map(|said| {
            let mapped = match said.text {
                "no" => "0",
                "default" | "optional" | "TPDO" | "RPDO" => "1",
                other => other,
            };
            (Key::PdoMapping, mapped.to_owned(), said.at)
        });
        keys.extend(flags.into_iter().chain(mapping));
        keys.extend(own.access().map(|(word, at)| (Key::AccessType, word, at)));
        let code = data_type.as_ref().map_or(String::new(), |(code, _)| code.clone());
        keys.extend(data_type.map(|(code, at)| (Key::DataType, code, at)));
        let at = place(node, if sub.is_some() { "subIndex" } else { "index" });
        for (key, value, at) in keys {
            self.sections.pair(key.name(), &value, at);
        }
        if let Some(parameter) = parameter {
            self.says(parameter, (index, sub), at, is_value.then_some(code));
        }
    }

    /// The parameter that an object refers to.
    pub(super) fn parameter(&mut self, node: Node<'d, 'i>) -> Option<Node<'d, 'i>> {
        let reference = attribute(node, "uniqueIDRef").filter(|said| !said.text.is_empty())?;
        let found = self.ids.get(reference.text).copied().filter(|node| local(*node).starts_with("parameter"));
        let Some(found) = found else {
            let span = xml_span(reference.at);
            self.out.push(Kind::DanglingReference(reference.text.into()), span);
            return None;
        };
        // Many objects may refer to one large parameter or type, which is searched for each of them.
        let said: Vec<_> = self.with_templates(found).collect();
        let types = said.iter().flat_map(|node| self.with_types(*node)).map(|node| node.range().len()).sum();
        if !self.sections.has_room(types) {
            return None;
        }
        let dangling = said.last().and_then(|last| attribute(*last, "templateIDRef"));
        if let Some(dangling) = dangling.filter(|said| !said.text.is_empty() && !self.ids.contains_key(said.text)) {
            self.out.push(Kind::DanglingReference(dangling.text.into()), xml_span(dangling.at));
        }
        Some(found)
    }

    /// A parameter or allowed values, and the templates that say what these leave out.
    fn with_templates(&self, node: Node<'d, 'i>) -> impl Iterator<Item = Node<'d, 'i>> {
        let template = |node: &Node<'d, 'i>| self.ids.get(attribute(*node, "templateIDRef")?.text).copied();
        std::iter::successors(Some(node), template).take(MAX_STEPS)
    }

    /// An element of a parameter, or of its templates.
    fn element(&self, parameter: Node<'d, 'i>, path: &[&str]) -> Option<Node<'d, 'i>> {
        self.with_templates(parameter).find_map(|node| find(node, path))
    }

    /// An attribute of a parameter, or of its templates.
    fn attribute(&self, parameter: Node<'d, 'i>, name: &str) -> Option<Said<'d>> {
        self.with_templates(parameter).find_map(|node| attribute(node, name))
    }

    /// A parameter, and the types that it comes down to.
    fn with_types(&self, node: Node<'d, 'i>) -> impl Iterator<Item = Node<'d, 'i>> {
        std::iter::successors(Some(node), |node| self.type_ref(*node)).take(MAX_STEPS)
    }

    /// What a parameter says beyond CiA 306.
    fn says(
        &mut self,
        parameter: Node<'d, 'i>,
        (index, sub): (u16, Option<u8>),
        at: Range<usize>,
        data_type: Option<String>,
    ) {
        let description = words(parameter, "description").map(|said| said.text.to_owned());
        let text = |node, name| attribute(node, name).map_or("", |said| said.text).to_owned();
        let properties = self
            .with_templates(parameter)
            .flat_map(|node| children(node, "property"))
            .map(|it| (text(it, "name"), text(it, "value")));
        let properties: Vec<_> = properties.collect();
        let properties = (!properties.is_empty()).then(|| Box::new(Properties(properties)));
        let persistent = self.attribute(parameter, "persistent").is_some_and(|said| matches!(said.text, "true" | "1"));
        let meaning = data_type.and_then(|data_type| self.meaning(parameter, &data_type, at.clone()));
        if description.is_some() || persistent || properties.is_some() || meaning.is_some() {
            let span = xml_span(at);
            self.says.push(Says { index, sub, description, persistent, properties, meaning, span });
        }
    }

    /// An enumeration by the type of the parameter or its allowed values; else a quantity by its unit.
    fn meaning(&mut self, parameter: Node<'d, 'i>, data_type: &str, at: Range<usize>) -> Option<Meaning> {
        let of_type = self.with_templates(parameter).find_map(|node| self.type_ref(node));
        if let Some(node) = of_type.filter(|it| local(*it) == "enum") {
            return self.enumeration(node, attribute(node, "name"), data_type, "enumValue");
        }
        let allowed = self.element(parameter, &["allowedValues"]);
        let mut allowed = allowed.into_iter().flat_map(|node| self.with_templates(node));
        let labelled = allowed.find(|node| find(*node, &["value"]).is_some());
        drop(allowed);
        if let Some(node) = labelled {
            let name = words(parameter, "label").or(attribute(parameter, "uniqueID"));
            return self.enumeration(node, name, data_type, "value");
        }
        let symbol = words(self.element(parameter, &["unit"])?, "label")?.text.to_owned();
        let offset =
            self.attribute(parameter, "offset").is_none_or(|said| said.text.trim_matches(['0', '.']).is_empty());
        let (num, den) = self.attribute(parameter, "multiplier").map_or(Some((1, 1)), |said| rational(said.text))?;
        if !offset || num == 0 || den <= 0 {
            return None;
        }
        let wanted = if num == den { symbol.clone() } else { format!("{symbol} {num}/{den}") };
        let units = vec![Unit { method: symbol.clone(), symbol, num, den, when: None }];
        let is_same = |names: &Names, name: &str| names.quantities.get(name).is_some_and(|known| known.units == units);
        let name = self.name(&wanted, data_type, is_same)?;
        let span = xml_span(at);
        self.names.quantities.entry(name.clone()).or_insert_with(|| Quantity { description: None, units, span });
        Some(Meaning::Quantity(name))
    }

    /// The values that have labels.
    fn enumeration(
        &mut self,
        node: Node<'d, 'i>,
        name: Option<Said<'d>>,
        data_type: &str,
        of: &str,
    ) -> Option<Meaning> {
        let key = (node.range().start, data_type.to_owned());
        if let Some(known) = self.enumerations.get(&key) {
            return known.clone().map(Meaning::Enumeration);
        }
        let mut values: Vec<Named<i128>> = Vec::new();
        for value in children(node, of) {
            let number = attribute(value, "value").and_then(|said| number::integer(said.text));
            let (Some(number), Some(label)) = (number, words(value, "label")) else { continue };
            let description = words(value, "description").map(|said| said.text.to_owned());
            values.push(Named { name: label.text.to_owned(), description, value: number.value });
        }
        values.sort_by_key(|named| named.value);
        values.dedup_by(|a, b| a.value == b.value);
        let is_same = |names: &Names, name: &str| names.enumerations.get(name).is_some_and(|it| it.values == values);
        let name = name.filter(|_| !values.is_empty()).and_then(|name| self.name(name.text, data_type, is_same));
        self.enumerations.insert(key, name.clone());
        let description = words(node, "description").map(|said| said.text.to_owned());
        let enumeration = Enumeration { description, values, is_hex: false, span: xml_span(tag(node)) };
        self.names.enumerations.entry(name.clone()?).or_insert(enumeration);
        name.map(Meaning::Enumeration)
    }

    /// A name that stands for one thing of one data type: others of the same name get a number.
    fn name(&mut self, wanted: &str, data_type: &str, is_same: impl Fn(&Names, &str) -> bool) -> Option<String> {
        let numbered = (2..100).map(|number| format!("{wanted} {number}"));
        let name =
            std::iter::once(wanted.to_owned()).chain(numbered).find(|name| match self.names.types.get(name) {
                Some(known) => known == data_type && is_same(&self.names, name),
                None => true,
            })?;
        self.names.types.insert(name.clone(), data_type.to_owned());
        Some(name)
    }

    /// The type that a parameter or a type refers to; not an array or struct, whose types are those of the sub-indices.
    fn type_ref(&self, node: Node<'d, 'i>) -> Option<Node<'d, 'i>> {
        let reference = attribute(find(node, &["dataTypeIDRef"])?, "uniqueIDRef")?;
        self.ids.get(reference.text).copied().filter(|it| matches!(local(*it), "enum" | "derived"))
    }
}

/// An object with its parameter, which says more where both say something (CiA 311).
struct Own<'r, 'd, 'i, 'o> {
    parameter: Option<Node<'d, 'i>>,
    node: Node<'d, 'i>,
    reader: &'r Reader<'d, 'i, 'o>,
}

impl<'d, 'i> Own<'_, 'd, 'i, '_> {
    fn inline(&self, name: &str) -> Option<Said<'d>> {
        attribute(self.node, name)
    }

    /// A value of the parameter.
    fn value(&self, name: &str) -> Option<Said<'d>> {
        let node = self.parameter.and_then(|parameter| self.reader.element(parameter, &[name]));
        let said = node.and_then(|node| attribute(node, "value").or_else(|| words(node, "label")));
        said.or_else(|| self.inline(name))
    }

    fn limit(&self, name: &str, end: &str) -> Option<Said<'d>> {
        let reader = self.reader;
        let end =
            self.parameter.and_then(|it| reader.element(reader.element(it, &["allowedValues"])?, &["range", end]));
        end.and_then(|end| attribute(end, "value")).or_else(|| self.inline(name))
    }

    fn access(&self) -> Option<(String, Range<usize>)> {
        let said = match self.parameter {
            Some(parameter) => self
                .reader
                .attribute(parameter, "access")
                .unwrap_or(Said { text: "read", at: place(parameter, "uniqueID") }),
            None => self.inline("accessType")?,
        };
        let known = ACCESS.iter().find(|(word, _)| *word == said.text).map(|&(_, access)| access);
        let access = known.or_else(|| AccessType::from_name(said.text));
        let access = match (access, self.inline("PDOmapping").map_or("", |said| said.text)) {
            (Some(AccessType::Rw), "TPDO") => Some(AccessType::Rwr),
            (Some(AccessType::Rw), "RPDO") => Some(AccessType::Rww),
            (access, _) => access,
        };
        Some((access.map_or(said.text, |access| access.name()).to_owned(), said.at))
    }

    /// The code of the data type. The attribute of the object can name all types of CiA 301, so it says more than BITSTRING.
    fn data_type(&self) -> Option<(String, Range<usize>)> {
        let inline = self.inline("dataType").map(|said| (hex(said.text), said.at));
        let Some(node) = self.parameter.and_then(|it| self.type_of(it)) else { return inline };
        let known = TYPES.iter().find(|(name, _)| *name == local(node)).map(|&(_, data_type)| data_type);
        let has_default = || self.value("defaultValue").is_some_and(|said| !said.text.is_empty());
        let data_type = match known {
            Some(data_type) => data_type,
            None if inline.is_some() => return inline,
            None if has_default() => DataType::OctetString,
            None => DataType::Domain,
        };
        Some((format!("0x{:04X}", data_type.code()), tag(node)))
    }

    /// The element of IEC 61131-3 that a parameter's type comes down to.
    fn type_of(&self, parameter: Node<'d, 'i>) -> Option<Node<'d, 'i>> {
        let types = self.reader.with_templates(parameter).flat_map(|node| self.reader.with_types(node));
        types.into_iter().find_map(|node| node.children().find(is_elementary))
    }
}

/// Whether an element is a type of IEC 61131-3.
pub(super) fn is_elementary(node: &Node<'_, '_>) -> bool {
    local(*node) == BITSTRING || TYPES.iter().any(|(name, _)| *name == local(*node))
}

/// Whether CANopenEditor offers the object, but leaves it out of the device and of its EDS.
pub(super) fn is_off(parameter: Node<'_, '_>) -> bool {
    let says =
        |node: Node<'_, '_>, name: &str, value: &str| attribute(node, name).is_some_and(|said| said.text == value);
    children(parameter, "property").any(|node| says(node, "name", "CO_disabled") && says(node, "value", "true"))
}

/// The place of an attribute, or that of the element without it.
fn place(node: Node<'_, '_>, name: &str) -> Range<usize> {
    attribute(node, name).map_or(tag(node), |said| said.at)
}
