//! The page of a data sheet: the device, its PDOs, emergencies and objects, and findings.

use std::collections::BTreeMap;

use lexican_eds::meanings::complete;
use lexican_eds::model::{self, Condition, Device, Entry, Meaning, NmtState, Object, Pdo, Value};
use lexican_eds::{Diagnostic, rules};
use lexican_runtime::object::{Direction, Mapped};
use lexican_runtime::wire::pdo::PdoCobId;
use lexican_runtime::{NodeId, cia301};

use super::page::range;
use super::{Format, Markup, Page};
use crate::data_sheet::DataSheet;
use crate::pdo::{PdoName, PdoState, manner, title};
use crate::values::{DeviceValues, Limits, address, given, name, plain, resolved};

/// The page of a data sheet.
#[must_use]
pub fn page(sheet: &DataSheet, format: Format) -> String {
    let product = sheet.device.info.product_name.as_deref().map(str::trim).filter(|name| !name.is_empty());
    let mut page = Page::new(format, product.unwrap_or(sheet.input.eds.name()));
    Chapters::new(&mut page, &complete(&sheet.device), 2, "").all(sheet);
    page.finish()
}

/// The chapters about one device, on a page that may also be about others.
pub struct Chapters<'a> {
    page: &'a mut Page,
    values: DeviceValues<'a>,
    level: u8,
    anchors: &'a str,
    /// The anchors of the lists of named values and bits, by the names of their meanings.
    listed: BTreeMap<&'a str, String>,
}

impl<'a> Chapters<'a> {
    /// `level` is that of the headings; `anchors` is the prefix of all anchors.
    pub fn new(page: &'a mut Page, device: &'a Device, level: u8, anchors: &'a str) -> Self {
        Chapters { page, values: DeviceValues::new(device), level, anchors, listed: BTreeMap::new() }
    }

    /// Everything in the data sheet, and the findings.
    pub fn all(mut self, sheet: &DataSheet) {
        self.page.table("facts", ["", " "], facts(self.values.device));
        self.pdos();
        self.emergencies();
        self.areas();
        self.findings(sheet);
    }

    fn heading(&mut self, below: u8, anchor: &str, title: &str, beside: &str) {
        self.page.heading(self.level + below, &format!("{}{anchor}", self.anchors), title, beside);
    }

    /// A link to an object.
    fn link(&self, index: u16, text: &str) -> Markup {
        Markup::link(format!("{}{index:04X}", self.anchors), text)
    }

    fn pdos(&mut self) {
        if !self.values.device.pdos.is_empty() {
            self.heading(0, "pdos", "PDOs", "");
        }
        self.values.device.pdos.iter().for_each(|pdo| self.pdo(pdo));
    }

    fn pdo(&mut self, pdo: &Pdo) {
        let (device, is_received) = (self.values.device, pdo.direction == model::Direction::Receive);
        let direction = if is_received { Direction::Receive } else { Direction::Transmit };
        let pdo_name = PdoName { direction, number: pdo.number };
        let state = PdoState::of_sheet(device, NodeId::literal(1), pdo_name);
        let cob_id = pdo.cob_id.as_ref().map_or("no COB-ID".to_owned(), |value| self.cob_id(value));
        let mapping = if pdo.dynamic { "mapping can be changed" } else { "fixed mapping" };
        let beside = [cob_id].into_iter().chain(state.iter().flat_map(manner)).chain([mapping.to_owned()]);
        let (anchor, beside) = (pdo_name.to_string(), beside.collect::<Vec<_>>().join(", "));
        self.heading(1, &anchor, &anchor, &beside);
        let mapped: Vec<_> = pdo.mapping.iter().map(|it| Mapped::new(it.index, it.sub, it.bits)).collect();
        let titles: Vec<_> = mapped.iter().map(|it| (it.bits, title(it, Some(device)))).collect();
        self.page.layout(&titles);
        let mut end = 0;
        let row = |(mapped, (bits, title)): (&Mapped, &(u8, String))| {
            let (low, entry) = (end, self.values.entry(mapped.address));
            end += usize::from(*bits).max(1);
            let object = entry.map_or_else(|| title.as_str().into(), |entry| self.link(entry.index, title));
            let data_type = entry.map_or(String::new(), |entry| entry.data_type.to_string());
            let units = entry.map_or(String::new(), |entry| self.units(entry).join("; "));
            [range(low, end - 1).into(), object, data_type.into(), units.into()]
        };
        let rows = mapped.iter().zip(&titles).map(row).collect();
        self.page.table("mapped", ["Bits", "Object", "Type", "Unit"], rows);
    }

    /// The codes of emergency messages.
    fn emergencies(&mut self) {
        let device = self.values.device;
        let cob_id = device.entry(cia301::COB_ID_EMCY, 0).and_then(given).map(|value| self.cob_id(value));
        self.heading(0, "emergencies", "Emergencies", &cob_id.map_or(String::new(), |id| format!("COB-ID {id}")));
        let codes = [(cia301::PREDEFINED_ERROR_FIELD, 1), (0x603F, 0)].into_iter().find_map(|(index, sub)| {
            let Meaning::Enumeration(name) = &device.entry(index, sub)?.meaning else { return None };
            Some((name, device.enumerations.get(name)?))
        });
        if let Some((name, codes)) = codes {
            self.listed.insert(name, format!("{}emergencies", self.anchors));
            let rows = codes.values.iter().map(|it| named(format!("{:04X}h", it.value), it)).collect();
            self.page.table("values", ["Code", "Name", "What it means"], rows);
        }
        if let Some(register) = device.entry(cia301::ERROR_REGISTER, 0) {
            let words = self.link(register.index, &register.name).and("says which kinds of error there are:");
            self.page.paragraph(words);
            self.bits(register);
        }
    }

    fn areas(&mut self) {
        let mut rest = self.values.device.objects.as_slice();
        // The areas of the dictionary (CiA 301, 7.4.1): last index, anchor, title.
        for (last, anchor, what) in [
            (0x0FFF, "types", "Data types"),
            (0x1FFF, "communication", "Communication profile"),
            (0x5FFF, "manufacturer", "Manufacturer-specific objects"),
            (0x9FFF, "profile", "Device profile"),
            (0xFFFF, "interface", "Interface profile"),
        ] {
            let (objects, others) = rest.split_at(rest.partition_point(|object| object.index <= last));
            rest = others;
            if !objects.is_empty() {
                let profile = self.values.device.profile.filter(|_| anchor == "profile");
                let profile = profile.map_or(String::new(), |number| format!("CiA {number}"));
                self.heading(0, anchor, what, &profile);
            }
            objects.iter().for_each(|object| self.object(object));
        }
    }

    fn object(&mut self, object: &'a Object) {
        let beside: Vec<_> = [object.kind.name()].into_iter().chain(object.denotation.as_deref()).collect();
        let index = format!("{:04X}", object.index);
        self.heading(1, &index, &format!("{index} {}", object.name), &beside.join(", "));
        let description = object.description.as_deref().unwrap_or_default();
        self.page.paragraph(description);
        let rows = object.entries.iter().map(|entry| self.entry(entry, description)).collect();
        self.page.table("entries", ["Sub", "Name", "Type", "Access", "PDO", "Default", "Limits"], rows);
        let mut last = None;
        for entry in &object.entries {
            let (Meaning::Enumeration(name) | Meaning::BitField(name)) = &entry.meaning else { continue };
            // The entries of an array mostly have the same meaning.
            if last.replace(name) != Some(name) {
                self.meaning(entry, name, object.kind.has_subs());
            }
        }
    }

    fn entry(&self, entry: &Entry, said: &str) -> [Markup; 7] {
        let only = entry.writable_in.as_deref().filter(|states| states.len() == 1);
        let state = only.map(|it| if it == [NmtState::Operational] { "operational" } else { "pre-operational" });
        let notes = [
            entry.description.clone().filter(|text| text != said),
            Some(self.units(entry).join("; ")).filter(|units| !units.is_empty()).map(|units| format!("unit: {units}")),
            entry.persistent.then(|| "kept without power".to_owned()),
            state.map(|state| format!("written in {state} only")),
            entry.denotation.clone(),
        ];
        let notes = notes.into_iter().flatten().map(|note| Markup::class("small", note));
        let default = entry.default.as_ref().map(|value| self.value(entry, value));
        let set = |value| Markup::class("set", "set to").and(self.value(entry, value));
        let own = Limits { low: entry.low.clone(), high: entry.high.clone() };
        let own = (own.low.is_some() || own.high.is_some()).then(|| self.values.range(entry, &own));
        let ranges = entry.ranges.iter();
        let ranges = ranges.map(|it| self.values.range(entry, &Limits::from(it)) + " " + &self.condition(&it.when));
        [
            Markup::class("index", format!("{:02X}", entry.sub)),
            Markup::lines([entry.name.as_str().into()].into_iter().chain(notes)),
            entry.data_type.to_string().into(),
            entry.access.name().into(),
            (if entry.pdo_mapping { "yes" } else { "" }).into(),
            Markup::lines(default.into_iter().chain(entry.configured.as_ref().map(set))),
            Markup::lines(own.into_iter().chain(ranges).map(Markup::from)),
        ]
    }

    /// A value as text, with the number if that differs.
    fn value(&self, entry: &Entry, value: &Value) -> Markup {
        let value = self.at_node(value);
        let (words, number) = (self.values.describe(entry, &value), plain(entry.data_type, &value));
        let number = (!words.contains(&number)).then(|| Markup::class("small", format!("= {number}")));
        number.into_iter().fold(words.into(), Markup::and)
    }

    /// The named values or bits, or a link to where they are listed.
    fn meaning(&mut self, entry: &Entry, name: &'a str, is_sub: bool) {
        let device = self.values.device;
        let (values, bits) = (device.enumerations.get(name), device.bit_fields.get(name));
        let is_word = matches!(entry.meaning, Meaning::BitField(_));
        let (what, description) = match (bits, values) {
            (Some(bits), _) if is_word => ("Bits", &bits.description),
            (_, Some(values)) => ("Values", &values.description),
            _ => return,
        };
        let of = if is_sub { format!(" of {:02X} {}", entry.sub, entry.name) } else { String::new() };
        let caption = Markup::class("caption", format!("{what}{of}:"));
        if let Some(anchor) = self.listed.get(name) {
            let text = format!("see {}", anchor.strip_prefix(self.anchors).unwrap_or(anchor));
            return self.page.paragraph(caption.and(Markup::link(anchor, text)));
        }
        self.listed.insert(name, format!("{}{:04X}", self.anchors, entry.index));
        self.page.paragraph(caption.and(description.as_deref().unwrap_or_default()));
        match values.filter(|_| !is_word) {
            None => self.bits(entry),
            Some(known) => {
                let number = |value: i128| if known.is_hex { format!("{value:04X}h") } else { value.to_string() };
                let rows = known.values.iter().map(|it| named(number(it.value), it)).collect();
                self.page.table("values", ["Value", "Name", "What it means"], rows);
            }
        }
    }

    /// A picture of a word's bits, and a list of what does not fit in it.
    fn bits(&mut self, entry: &Entry) {
        let (device, is_picture) = (self.values.device, self.page.format == Format::Html);
        let Meaning::BitField(name) = &entry.meaning else { return };
        let fields = device.bit_fields.get(name).map(|it| it.fields.as_slice()).unwrap_or_default();
        let names = fields.iter().map(|it| (it.value.low, it.value.high, it.name.as_str()));
        self.page.word(device.bits(entry.data_type).unwrap_or(64), names);
        let fields = fields.iter().filter(|it| !is_picture || it.description.is_some());
        let rows = fields.map(|it| named(range(it.value.high.into(), it.value.low.into()), it)).collect();
        self.page.table("values", ["Bits", "Name", "What it means"], rows);
    }

    fn findings(&mut self, sheet: &DataSheet) {
        self.heading(0, "findings", "What lint finds", "");
        if sheet.diagnostics.is_empty() {
            self.page.paragraph("Nothing is wrong with the data sheet.");
        }
        let row = |finding: &Diagnostic| {
            let remedy = finding.help.iter().map(|help| Markup::class("small", format!("Remedy: {help}")));
            let place = finding.span().and_then(|span| Some((sheet.input.source(span.source)?, span.start)));
            let place = place.map(|(source, at)| format!("{}:{}", source.name(), source.position(at).line));
            let holds = rules::rule(finding.code).map(|rule| Markup::class("small", rule.holds));
            let severity = finding.severity.name();
            [
                Markup::class(severity, severity),
                Markup::lines([finding.message.as_str().into()].into_iter().chain(remedy)),
                place.unwrap_or_default().into(),
                Markup::lines([finding.code.into()].into_iter().chain(holds)),
            ]
        };
        let rows = sheet.diagnostics.iter().map(row).collect();
        self.page.table("findings", ["Severity", "Finding", "Line", "Rule"], rows);
    }

    /// The units of an entry, with their conditions.
    fn units(&self, entry: &Entry) -> Vec<String> {
        let Meaning::Quantity(name) = &entry.meaning else { return Vec::new() };
        let units = self.values.device.quantities.get(name).map(|it| it.units.as_slice()).unwrap_or_default();
        let when =
            |unit: &model::Unit| unit.when.as_ref().map_or(String::new(), |when| format!(" {}", self.condition(when)));
        units.iter().map(|unit| format!("{unit}{}", when(unit))).collect()
    }

    /// `while Spindle Pitch (2412:00) is not 0.00 mm`.
    fn condition(&self, when: &Condition) -> String {
        let verb = if when.equal { "is" } else { "is not" };
        let Some(entry) = self.values.device.entry(when.index, when.sub) else { return String::new() };
        let value = self.values.describe(entry, &Value::Integer(when.value));
        format!("while {} ({}) {verb} {value}", name(self.values.device, entry), address(entry))
    }

    /// `185h`, `$NODEID + 180h`.
    fn cob_id(&self, value: &Value) -> String {
        let id = |number| format!("{}h", PdoCobId(number).id());
        match self.at_node(value) {
            Value::NodeIdPlus(offset) => format!("$NODEID + {}", id(offset as u32)),
            value => id(value.as_integer().unwrap_or(0) as u32),
        }
    }

    /// The value for the node-ID of a DCF.
    fn at_node(&self, value: &Value) -> Value {
        let commissioning = self.values.device.commissioning.as_ref();
        let node = commissioning.and_then(|it| NodeId::new(it.node_id?));
        node.map_or_else(|| value.clone(), |node| resolved(value, node))
    }
}

/// A row in a table of values or bits.
fn named<T>(number: String, named: &model::Named<T>) -> [Markup; 3] {
    let description = named.description.as_deref().unwrap_or_default();
    [Markup::class("index", number), named.name.as_str().into(), description.into()]
}

/// Facts about the device as a whole; absent ones are left out.
fn facts(device: &Device) -> Vec<[Markup; 2]> {
    let (info, file, at) = (&device.info, &device.file, device.commissioning.clone().unwrap_or_default());
    let hex = |number: Option<u32>| number.map(|number| format!("{number:X}h"));
    let count = |count: Option<u16>, what: &str| count.map(|count| format!("{count} {what}"));
    let rates = info.bit_rates_kbit.iter().map(|rate| Some(format!("{rate} kbit/s"))).collect();
    let services = [
        (info.lss, "LSS"),
        (!info.lss, "no LSS"),
        (info.simple_boot_up_slave, "simple boot-up slave"),
        (info.simple_boot_up_master, "simple boot-up master"),
        (device.object(cia301::PRODUCER_HEARTBEAT_TIME).is_some(), "heartbeat"),
        (device.object(cia301::GUARD_TIME).is_some(), "node guarding"),
        (device.object(cia301::STORE_PARAMETERS).is_some(), "stores parameters"),
        (info.dynamic_channels, "dynamic channels"),
        (info.group_messaging, "group messaging"),
    ];
    let lines = [
        ("Vendor", vec![info.vendor_name.clone(), hex(info.vendor_number)]),
        ("Product", vec![info.product_name.clone(), hex(info.product_number)]),
        ("Revision", vec![hex(info.revision_number)]),
        ("Order code", vec![info.order_code.clone()]),
        ("Device profile", vec![device.profile.map(|number| format!("CiA {number}"))]),
        ("Bit rates", rates),
        ("Services", services.iter().map(|(has, what)| has.then(|| (*what).to_owned())).collect()),
        ("PDOs", vec![count(info.receive_pdos, "receive"), count(info.transmit_pdos, "transmit")]),
        ("Node", vec![at.node_id.map(|id| id.to_string()), at.node_name, hex(at.serial_number)]),
        ("Network", vec![at.network_name, count(at.bit_rate_kbit, "kbit/s")]),
        ("Data sheet", vec![file.name.clone(), file.description.clone(), file.modification_date.clone()]),
    ];
    let lines = lines.map(|(name, parts)| (name, parts.into_iter().flatten().collect::<Vec<_>>().join(", ")));
    lines.into_iter().filter(|line| !line.1.trim().is_empty()).map(|(name, text)| [name.into(), text.into()]).collect()
}
