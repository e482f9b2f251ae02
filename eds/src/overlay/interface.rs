//! `[interface.…]`.

use std::mem::discriminant;

use super::keys::keys_of;
use super::value::address;
use super::{Name, Node, Reader};
use crate::finding::Kind;
use crate::model::{Entry, Interface, ObjectKind, Parameter, ParameterNumber};

impl Reader<'_> {
    pub(super) fn interface(&mut self, name: &Name<'_>, node: &Node<'_>) {
        let (description, list) = self.described(node, "parameters");
        let mut parameters: Vec<Parameter> = Vec::new();
        for node in list {
            // Parameters without object get index 0 and consecutive sub-indices.
            let without = parameters.iter().chain(self.device.parameters()).filter(|it| it.object().is_none()).count();
            let Some(parameter) = self.parameter(node, without) else { continue };
            let kind = |parameter: &Parameter| discriminant(&parameter.number);
            if parameters.first().is_some_and(|first| kind(first) != kind(&parameter)) {
                self.expect::<()>(node, None, "a number like that of the first parameter, or a text like it");
                continue;
            }
            let same = |other: &&Parameter| {
                // A number may stand for different parameters under different conditions.
                let apart = other.when.is_some() && parameter.when.is_some() && other.when != parameter.when;
                other.number == parameter.number && !apart
            };
            if let Some(other) = parameters.iter().find(same) {
                let number = parameter.number.to_string().into();
                self.push(Kind::OverlayDuplicateParameter { number, first: other.span }, node);
                continue;
            }
            parameters.push(parameter);
        }
        let span = self.span(name.span());
        self.device.interfaces.insert(name.get_ref().to_string(), Interface { description, parameters, span });
    }

    fn parameter(&mut self, node: &Node<'_>, without_object: usize) -> Option<Parameter> {
        let before = self.out.total();
        let table = self.table(node)?;
        let span = self.span(node.span());
        // Read the object first: the other keys say how the parameter differs from it.
        let object = table.iter().find(|(key, _)| key.get_ref() == "object");
        let (mut entry, elements) = match object {
            Some((_, node)) => self.equal(node)?,
            None => (Entry::new(0, u8::try_from(without_object).unwrap_or(u8::MAX), span), 1),
        };
        let has = |wanted: &str| table.iter().any(|(key, _)| key.get_ref() == wanted);
        let is_whole = object.is_some() || ["name", "data_type", "access"].into_iter().all(has);
        let (mut number, mut data_type, mut values, mut when) = (None, entry.data_type, Vec::new(), None);
        if let Some((_, node)) = table.iter().find(|(key, _)| key.get_ref() == "data_type") {
            data_type = self.known_data_type(node)?;
            if object.is_none() {
                entry.data_type = data_type;
            }
        }
        for (key, node) in table {
            match key.get_ref().as_ref() {
                "object" | "data_type" => {}
                "number" => number = self.parameter_number(node),
                "name" => entry.name = self.text(node)?,
                "description" => entry.description = self.text(node),
                "access" => entry.access = self.access(node)?,
                "low" => entry.low = self.value(node, entry.data_type),
                "high" => entry.high = self.value(node, entry.data_type),
                "quantity" | "enumeration" | "bit_field" if object.is_none() => {
                    self.meaning(&mut entry, key.get_ref(), node);
                }
                "persistent" if object.is_none() => entry.persistent = self.flag(node).unwrap_or(false),
                "values" => {
                    let nodes = self.array(node).into_iter().flatten();
                    values = nodes.filter_map(|node| self.named(node, "value", Self::integer)).collect();
                }
                "when" => when = self.condition(node),
                _ if object.is_some() => self.unknown(key, &keys_of("parameters")[..10]),
                _ => self.unknown(key, keys_of("parameters")),
            }
        }
        let number = number.filter(|_| is_whole);
        let parameter = number.map(|number| Parameter { number, entry, elements, data_type, values, when, span });
        let expected = "a parameter with `number`, and with `object` or `name`, `data_type` and `access`";
        self.expect_whole(node, before, parameter, expected)
    }

    /// The entry that a parameter equals, and the number of elements: for an ARRAY named as a whole, all of them.
    fn equal(&mut self, node: &Node<'_>) -> Option<(Entry, u8)> {
        let text = self.text(node)?;
        let (index, sub) = self.expect(node, address(&text), "an object such as \"6041\" or \"6041:00\"")?;
        let object = self.device.object(index);
        let is_array = object.is_some_and(|object| object.kind == ObjectKind::Array) && sub.is_none();
        let sub = sub.unwrap_or(u8::from(is_array));
        let found = object.and_then(|object| Some((object, object.entry(sub)?)));
        let Some((object, entry)) = found else {
            self.push(Kind::OverlayObject(text.into()), node);
            return None;
        };
        // PDOs, NMT states and the values of a DCF are specific to CANopen.
        let mut entry = Entry { default: None, pdo_mapping: false, ..entry.clone() };
        if entry.configured.is_some() || entry.writable_in.is_some() {
            (entry.configured, entry.writable_in) = (None, None);
        }
        if is_array || !object.kind.has_subs() {
            entry.name.clone_from(&object.name);
            entry.description.clone_from(&object.description);
        }
        let elements = if is_array { object.entries.iter().filter(|entry| entry.sub > 0).count() as u8 } else { 1 };
        Some((entry, elements))
    }

    fn parameter_number(&mut self, node: &Node<'_>) -> Option<ParameterNumber> {
        match node.get_ref().as_str() {
            Some(text) => Some(ParameterNumber::Text(text.to_owned())),
            None => self.number(node).map(ParameterNumber::Number),
        }
    }
}
