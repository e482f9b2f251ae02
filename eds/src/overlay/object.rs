//! `[object."2410:05"]`.

use toml::de::DeTable;

use super::keys::keys_of;
use super::value::address;
use super::{Accepted, Correction, Name, Node, Reader, Use};
use crate::finding::Kind;
use crate::model::keys::Key;
use crate::model::types::DataType;
use crate::model::{AccessType, ConditionalRange, Entry, Meaning, NmtState, ObjectKind, Value};

/// The keys allowed for a range of objects.
const SEVERAL: [&str; 2] = ["simulated", "reason"];

impl Reader<'_> {
    pub(super) fn object(&mut self, name: &Name<'_>, node: &Node<'_>) {
        let Some(table) = self.table(node) else { return };
        if let Some((first, last)) = name.get_ref().split_once("..") {
            return self.several(&[first, last], table, name);
        }
        let Some((index, sub)) = address(name.get_ref()) else {
            self.push(Kind::OverlayValue { expected: "\"2410\" or \"2410:05\"".into() }, name);
            return;
        };
        let Ok(at) = self.device.objects.binary_search_by_key(&index, |object| object.index) else {
            self.push(Kind::OverlayObject(name.get_ref().as_ref().into()), name);
            return;
        };
        // Take the entries out while they are changed, to be able to borrow the rest of the device.
        let mut entries = std::mem::take(&mut self.device.objects[at].entries);
        match sub {
            Some(sub) => match entries.iter_mut().find(|entry| entry.sub == sub) {
                Some(entry) => {
                    let accept = table.iter().find(|(key, _)| key.get_ref() == "accept");
                    accept.into_iter().for_each(|(_, node)| self.accept(index, Some(sub), node));
                    self.entry(entry, table, name);
                }
                None => self.push(Kind::OverlayObject(name.get_ref().as_ref().into()), name),
            },
            None => self.whole(at, &mut entries, table, name),
        }
        self.device.objects[at].entries = entries;
    }

    /// `simulated = false` for all entries in a range of indices.
    fn several(&mut self, ends: &[&str; 2], table: &DeTable<'_>, name: &Name<'_>) {
        let [Some((first, None)), Some((last, None))] = ends.map(address) else {
            self.push(Kind::OverlayValue { expected: "\"3400..36FF\"".into() }, name);
            return;
        };
        for (key, _) in table.iter().filter(|(key, _)| !SEVERAL.contains(&key.get_ref().as_ref())) {
            self.unknown(key, &SEVERAL);
        }
        let reason = self.not_simulated(table);
        if reason.as_ref().is_some_and(String::is_empty) {
            self.push(Kind::OverlayReason(name.get_ref().as_ref().into()), name);
        }
        let mut any = false;
        for object in self.device.objects.iter_mut().filter(|object| (first..=last).contains(&object.index)) {
            any = true;
            let counts = object.kind.has_subs();
            let entries = object.entries.iter_mut().filter(|entry| entry.sub > 0 || !counts);
            entries.for_each(|entry| entry.not_simulated.clone_from(&reason));
        }
        if !any {
            self.push(Kind::OverlayObject(name.get_ref().as_ref().into()), name);
        }
    }

    /// The object itself, and the entries that the table applies to.
    fn whole(&mut self, at: usize, entries: &mut [Entry], table: &DeTable<'_>, name: &Name<'_>) {
        let kind = self.device.objects[at].kind;
        let index = self.device.objects[at].index;
        for (key, node) in table {
            match key.get_ref().as_ref() {
                "accept" => self.accept(index, None, node),
                // For a single value, these are read with its entry.
                "name" | "description" if !kind.has_subs() => {}
                "name" => {
                    if let Some(name) = self.text(node) {
                        self.device.objects[at].name = name;
                    }
                }
                "description" => self.device.objects[at].description = self.text(node),
                "reason" => {}
                found if kind == ObjectKind::Record && keys_of("object").contains(&found) => {
                    self.push(Kind::OverlayKeyOfRecord(found.into()), key);
                }
                _ if kind == ObjectKind::Record => self.unknown(key, keys_of("object")),
                _ => {}
            }
        }
        if kind == ObjectKind::Record {
            let has = |key: &str| table.iter().any(|(name, _)| name.get_ref() == key);
            if has("accept") && !has("reason") {
                self.push(Kind::OverlayReason(name.get_ref().as_ref().into()), name);
            }
            return;
        }
        if !kind.has_subs() {
            for entry in entries {
                self.entry(entry, table, name);
                let object = &mut self.device.objects[at];
                object.name.clone_from(&entry.name);
                if entry.description.is_some() {
                    object.description.clone_from(&entry.description);
                }
            }
            return;
        }
        let before = self.out.kept();
        for entry in entries.iter_mut().filter(|entry| entry.sub > 0) {
            // Name and description are those of the object; all other keys apply to every entry.
            let words = (entry.name.clone(), entry.description.clone());
            let others = std::mem::take(self.out);
            self.entry(entry, table, name);
            (entry.name, entry.description) = words;
            // Mistakes in the overlay itself are found again at every entry; report them once.
            for finding in std::mem::replace(self.out, others).iter() {
                if !self.out.has(before, &finding.kind, finding.span) {
                    self.out.push(finding.kind.clone(), finding.span);
                }
            }
        }
    }

    fn entry(&mut self, entry: &mut Entry, table: &DeTable<'_>, name: &Name<'_>) {
        let mut reason = false;
        let mut corrected = false;
        // Read the data type first: it decides how values are read.
        for (key, node) in table {
            if key.get_ref() == "data_type" {
                self.data_type(entry, node);
                corrected = true;
            }
        }
        for (key, node) in table {
            match key.get_ref().as_ref() {
                "data_type" => {}
                // Already read with the address; requires a reason, too.
                "accept" => corrected = true,
                "reason" => reason = self.text(node).is_some_and(|reason| !reason.trim().is_empty()),
                "name" => {
                    if let Some(name) = self.text(node) {
                        self.note(entry, Key::ParameterName, node);
                        entry.name = name;
                    }
                }
                "description" => entry.description = self.text(node),
                "access" | "pdo_mapping" | "default" | "low" | "high" => {
                    corrected = true;
                    self.correct(entry, key.get_ref(), node);
                }
                "quantity" | "enumeration" | "bit_field" => self.meaning(entry, key.get_ref(), node),
                "ranges" => entry.ranges = self.ranges(node),
                "first_character_high" => entry.first_character_high = self.flag(node).unwrap_or(false),
                "persistent" => entry.persistent = self.flag(node).unwrap_or(false),
                "writable_in" => entry.writable_in = self.states(node),
                "simulated" => {
                    corrected = true;
                    entry.not_simulated = self.not_simulated(table);
                }
                _ => self.unknown(key, keys_of("object")),
            }
        }
        if corrected && !reason {
            self.push(Kind::OverlayReason(name.get_ref().as_ref().into()), name);
        }
    }

    fn accept(&mut self, index: u16, sub: Option<u8>, node: &Node<'_>) {
        for node in self.array(node).into_iter().flatten() {
            if let Some(code) = self.text(node) {
                let span = self.span(node.span());
                self.changes.accepted.push(Accepted { index, sub, code, span });
            }
        }
    }

    fn data_type(&mut self, entry: &mut Entry, node: &Node<'_>) {
        if let Some(data_type) = self.known_data_type(node) {
            self.corrected(entry, Key::DataType, node, entry.data_type == data_type);
            entry.data_type = data_type;
        }
    }

    pub(super) fn known_data_type(&mut self, node: &Node<'_>) -> Option<DataType> {
        let data_type = match node.get_ref().as_str() {
            Some(name) => DataType::from_name(name),
            None => match self.number(node) {
                Some(code) => Some(DataType::from_code(code)).filter(|data_type| !data_type.is_unknown()),
                None => return None,
            },
        };
        self.expect(node, data_type, "the name of a data type of CiA 301, or its number")
    }

    pub(super) fn access(&mut self, node: &Node<'_>) -> Option<AccessType> {
        let access = self.text(node).and_then(|word| AccessType::from_name(&word));
        self.expect(node, access, "ro, wo, rw, rwr, rww or const")
    }

    fn correct(&mut self, entry: &mut Entry, key: &str, node: &Node<'_>) {
        match key {
            "access" => {
                if let Some(access) = self.access(node) {
                    self.corrected(entry, Key::AccessType, node, entry.access == access);
                    entry.access = access;
                }
            }
            "pdo_mapping" => {
                if let Some(mapping) = self.flag(node) {
                    self.corrected(entry, Key::PdoMapping, node, entry.pdo_mapping == mapping);
                    entry.pdo_mapping = mapping;
                }
            }
            _ => {
                let Some(value) = self.value(node, entry.data_type) else { return };
                let (key, slot): (Key, fn(&mut Entry) -> &mut Option<Value>) = match key {
                    "default" => (Key::DefaultValue, |entry| &mut entry.default),
                    "low" => (Key::LowLimit, |entry| &mut entry.low),
                    _ => (Key::HighLimit, |entry| &mut entry.high),
                };
                let same = slot(entry).as_ref() == Some(&value);
                self.corrected(entry, key, node, same);
                *slot(entry) = Some(value);
            }
        }
    }

    fn corrected(&mut self, entry: &Entry, key: Key, node: &Node<'_>, same: bool) {
        self.note(entry, key, node);
        if same {
            self.push(Kind::OverlayNoEffect { index: entry.index, sub: entry.sub, key }, node);
        }
    }

    fn note(&mut self, entry: &Entry, key: Key, node: &Node<'_>) {
        let span = self.span(node.span());
        self.changes.corrections.push(Correction { index: entry.index, sub: entry.sub, key, span });
    }

    pub(super) fn meaning(&mut self, entry: &mut Entry, key: &str, node: &Node<'_>) {
        let Some(name) = self.text(node) else { return };
        let span = self.span(node.span());
        let (index, sub) = (entry.index, entry.sub);
        let here = |used: &Use| (used.index, used.sub, used.span.source) == (index, sub, span.source);
        if let Some(other) = self.changes.uses.iter().find(|used| here(used)) {
            let first = other.span;
            self.out.push(Kind::OverlayMeanings { first }, span);
        }
        entry.meaning = match key {
            "quantity" => Meaning::Quantity(name),
            "enumeration" => Meaning::Enumeration(name),
            _ => Meaning::BitField(name),
        };
        self.changes.uses.retain(|used| (used.index, used.sub) != (index, sub) || used.span.source == span.source);
        self.changes.uses.push(Use { index, sub, meaning: entry.meaning.clone(), span });
    }

    fn ranges(&mut self, node: &Node<'_>) -> Vec<ConditionalRange> {
        self.array(node).into_iter().flatten().filter_map(|node| self.range(node)).collect()
    }

    fn range(&mut self, node: &Node<'_>) -> Option<ConditionalRange> {
        let (mut when, mut low, mut high) = (None, None, None);
        let before = self.out.total();
        for (key, node) in self.table(node)? {
            match key.get_ref().as_ref() {
                "when" => when = self.condition(node),
                "low" => low = self.integer(node),
                "high" => high = self.integer(node),
                _ => self.unknown(key, keys_of("ranges")),
            }
        }
        let range = when.zip(low.zip(high)).map(|(when, (low, high))| ConditionalRange { when, low, high });
        let range = self.expect_whole(node, before, range, "a range with `when`, `low` and `high`")?;
        if range.low > range.high {
            self.push(Kind::OverlayRange, node);
        }
        Some(range)
    }

    fn states(&mut self, node: &Node<'_>) -> Option<Box<[NmtState]>> {
        let mut states = Vec::new();
        let nodes = self.array(node)?;
        self.expect(node, (!nodes.is_empty()).then_some(()), "at least one state")?;
        for node in nodes {
            let state = match node.get_ref().as_str() {
                Some("pre-operational") => Some(NmtState::PreOperational),
                Some("operational") => Some(NmtState::Operational),
                _ => None,
            };
            states.extend(self.expect(node, state, "\"pre-operational\" or \"operational\""));
        }
        Some(states.into_boxed_slice())
    }
}
