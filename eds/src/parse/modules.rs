//! Modular devices, dynamic channels and tools (CiA 306-1).

use std::collections::BTreeMap;

use crate::finding::Kind;
use crate::model::keys::{KEYS, Key};
use crate::model::types::DataType;
use crate::model::{AccessType, Device, DynamicChannel, Module, Object, ObjectKind, SubExtension, Tool};
use crate::parse::number;
use crate::parse::object::nonempty;
use crate::parse::reader::Reader;
use crate::parse::section::{ModulePart, ObjectPart, SectionKind};
use crate::parse::syntax::{Pair, Section};

const SUB_EXTENSION: [&str; KEYS.len() + 2] = {
    let mut keys = [""; KEYS.len() + 2];
    keys[0] = "Count";
    keys[1] = "ObjExtend";
    let mut at = 0;
    while at < KEYS.len() {
        keys[at + 2] = KEYS[at];
        at += 1;
    }
    keys
};

impl<'a, 's> Reader<'a, 's> {
    /// The sections of one module, ordered by part.
    pub(crate) fn module(&mut self, number: u16, parts: &[(ModulePart, &'s Section<'a>)]) -> Module {
        let mut module = Module { number, ..Module::default() };
        for &(part, section) in parts {
            match part {
                ModulePart::Info => self.module_info(&mut module, section),
                ModulePart::Comments => module.comments = self.comments(section),
                ModulePart::FixedObjects | ModulePart::SubExtends => {
                    let ([count], lines) = self.numbered(section, "", 10, &["NrOfEntries"]);
                    self.count(count, lines.len());
                    for line in lines {
                        self.described(line.pair, part, parts);
                    }
                }
                ModulePart::SubExt(index) => {
                    let extension = self.sub_extension(index, section);
                    module.extends.push(extension);
                }
                ModulePart::Fixed(..) => {}
            }
        }
        module.fixed = self.fixed(parts);
        module
    }

    /// Reads `[SupportedModules]`, `[ConnectedModules]`, `[DynamicChannels]` and `[Tools]`; false if the section is
    /// none of these.
    pub(crate) fn extras(&mut self, section: &'s Section<'a>, device: &mut Device) -> bool {
        match section.kind {
            SectionKind::SupportedModules => {
                let [count] = self.fields(section, &["NrOfEntries"]);
                let said: Option<u16> = self.number(count);
                let modules = (1..=said.unwrap_or(0)).map(|number| Module { number, ..Module::default() });
                // No device has more modules; a file that claims more must not take memory.
                device.modules.extend(modules.take(1000));
            }
            SectionKind::ConnectedModules => {
                let ([count], lines) = self.numbered(section, "", 10, &["NrOfEntries"]);
                self.count(count, lines.len());
                device.connected_modules = lines.iter().filter_map(|line| self.number(Some(line.pair))).collect();
            }
            SectionKind::DynamicChannels => device.channels = self.channels(section),
            SectionKind::Tools => {
                let [count] = self.fields(section, &["Items"]);
                let is_tool = |section: &&Section<'_>| matches!(section.kind, SectionKind::Tool(_));
                self.count(count, self.syntax.sections.iter().filter(is_tool).count());
            }
            SectionKind::Tool(_) => {
                let [name, command] = self.fields(section, &["Name", "Command"]);
                let [name, command] = [name, command].map(|pair| self.text(pair).unwrap_or_default());
                device.tools.push(Tool { name, command });
            }
            _ => return false,
        }
        true
    }

    fn module_info(&mut self, module: &mut Module, section: &'s Section<'a>) {
        let keys = ["ProductName", "ProductVersion", "ProductRevision", "OrderCode"];
        let [name, version, revision, order_code] = self.fields(section, &keys);
        module.product_name = self.text(name);
        module.product_version = self.number(version);
        module.product_revision = self.number(revision);
        module.order_code = self.text(order_code);
    }

    /// Reports an object that a list of the module names but no section describes.
    fn described(&mut self, pair: &'s Pair<'a>, list: ModulePart, parts: &[(ModulePart, &'s Section<'a>)]) {
        let Some(index) = self.number::<u16>(Some(pair)) else { return };
        // The parts are sorted, so the first one that is not less is the wanted one, or it is missing.
        let first = match list {
            ModulePart::FixedObjects => ModulePart::Fixed(index, ObjectPart::Header),
            _ => ModulePart::SubExt(index),
        };
        let at = parts.partition_point(|&(part, _)| part < first);
        let found = match (list, parts.get(at)) {
            (ModulePart::FixedObjects, Some((ModulePart::Fixed(found, _), _))) => *found == index,
            (ModulePart::SubExtends, Some((ModulePart::SubExt(found), _))) => *found == index,
            _ => false,
        };
        if !found {
            self.out.push(Kind::ObjectWithoutSection { index, module: true }, self.syntax.value_span(pair));
        }
    }

    fn fixed(&mut self, parts: &[(ModulePart, &'s Section<'a>)]) -> Vec<Object> {
        let of_objects: Vec<(u16, ObjectPart, &'s Section<'a>)> = parts
            .iter()
            .filter_map(|&(part, section)| match part {
                ModulePart::Fixed(index, part) => Some((index, part, section)),
                _ => None,
            })
            .collect();
        let chunks = of_objects.chunk_by(|a, b| a.0 == b.0);
        chunks
            .map(|chunk| {
                let parts: Vec<_> = chunk.iter().map(|&(_, part, section)| (part, section)).collect();
                self.object(chunk[0].0, &parts).0
            })
            .collect()
    }

    fn sub_extension(&mut self, index: u16, section: &'s Section<'a>) -> SubExtension {
        let span = self.syntax.name_span(section);
        let [count, extend, fields @ ..] = self.fields(section, &SUB_EXTENSION);
        SubExtension {
            entry: self.entry(index, 1, span, &fields, ObjectKind::Variable),
            kind: self.object_type(fields[Key::ObjectType as usize]).unwrap_or(ObjectKind::Variable),
            count: self.counts(count),
            next_index: self.flag(extend),
        }
    }

    /// `2`, or `2,4,2` by slot.
    fn counts(&mut self, pair: Option<&'s Pair<'a>>) -> Vec<u16> {
        let Some(pair) = pair else { return Vec::new() };
        let numbers = pair.value.split([',', ';']).filter(|number| !number.trim().is_empty());
        let number = |text: &str| u16::try_from(number::integer(text)?.value).ok();
        numbers.map(number).collect::<Option<_>>().unwrap_or_else(|| {
            self.out.push(Kind::BadNumber { key: pair.key.into() }, self.syntax.value_span(pair));
            Vec::new()
        })
    }

    fn channels(&mut self, section: &'s Section<'a>) -> Vec<DynamicChannel> {
        const KINDS: [&str; 4] = ["Type", "Dir", "Range", "PPOffset"];
        let mut segments: BTreeMap<u32, [Option<&'s Pair<'a>>; 4]> = BTreeMap::new();
        let mut said = None;
        for pair in &section.pairs {
            let digits = pair.key.trim_start_matches(|c: char| !c.is_ascii_digit());
            let word = &pair.key[..pair.key.len() - digits.len()];
            let kind = KINDS.iter().position(|kind| kind.eq_ignore_ascii_case(word));
            match (kind, digits.parse()) {
                (Some(kind), Ok(number)) => self.keep_first(&mut segments.entry(number).or_default()[kind], pair),
                _ if pair.key.eq_ignore_ascii_case("NrOfSeg") => self.keep_first(&mut said, pair),
                _ => self.unknown(pair),
            }
        }
        self.count(said, segments.len());
        segments.into_values().filter_map(|pairs| self.channel(section, pairs)).collect()
    }

    fn channel(&mut self, section: &'s Section<'a>, pairs: [Option<&'s Pair<'a>>; 4]) -> Option<DynamicChannel> {
        let [data_type, access, range, offset] = pairs;
        let span = range.map_or(self.syntax.name_span(section), |pair| self.syntax.value_span(pair));
        let data_type = match nonempty(data_type) {
            Some(pair) => self.data_type(Some(pair), ObjectKind::Variable, span),
            None => DataType::Other(0),
        };
        let access = match nonempty(access) {
            Some(pair) => self.access(Some(pair), ObjectKind::Variable, span),
            None => AccessType::Rww,
        };
        let (first, last) = range.map_or("", |pair| pair.value).split_once('-').unwrap_or_default();
        let index = |text: &str| u16::try_from(number::integer(text)?.value).ok();
        let (Some(first), Some(last)) = (index(first), index(last)) else {
            self.out.push(Kind::BadChannel, span);
            return None;
        };
        Some(DynamicChannel {
            data_type,
            access,
            first,
            last,
            offset: self.number(nonempty(offset)).unwrap_or(0),
            span,
        })
    }
}
