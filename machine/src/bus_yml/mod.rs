//! `bus.yml`, as dcfgen of lely-core and cogen of ros2_canopen read it. The machine is what these tools make of the file; where that
//! is not what it says, there is a finding.

mod keys;
mod pdo;
mod tree;

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use lexican_eds::model::{Device, Value};
use lexican_eds::{Diagnostics, Input, Severity, Source};
use lexican_runtime::object::{Address, Direction};
use lexican_runtime::{NodeId, cia301};
use lexican_toolbox::values::wire::encode;
use lexican_toolbox::values::{given, resolved};

use self::keys::Keys;
use self::pdo::FREE;
use self::tree::Yaml;
use crate::at::At;
use crate::draft::{Draft, Section, identity, put_settings, quoted};
use crate::files::Files;
use crate::nodes::PATIENCE;
use crate::read::Out;

/// A machine as a `bus.yml` describes it.
#[derive(Debug)]
pub struct BusYml {
    /// The machine.
    pub draft: Draft,
    /// What dcfgen or cogen drops, overrides or does otherwise, and what a machine does not have.
    pub findings: Diagnostics,
    /// The text, for the findings.
    pub input: Input,
}

impl BusYml {
    /// Reads a `bus.yml`, with the data sheets that it names. `name` is how the machine names the file of a data sheet.
    #[must_use]
    pub fn read(source: Source, files: Files<'_>, name: &dyn Fn(&str) -> String) -> Self {
        let mut out = Out { findings: Diagnostics::default() };
        let root = if source.refusal().is_none() { tree::read(source.text(), &mut out) } else { None };
        let tables = root.as_ref().and_then(Yaml::map).unwrap_or_default();
        if tables.is_empty() && !out.findings.has_errors() {
            out.wrong("bus-yml::syntax", &(0..0), "this is no bus.yml: it has no tables", None);
        }
        let is_cogen = tables.iter().any(|(key, _)| key.value == "nodes");
        let mut reader = Reader {
            files,
            name,
            tool: if is_cogen { "cogen" } else { "dcfgen" },
            retry: PATIENCE,
            factor: PATIENCE.into(),
            free: FREE,
            draft: Draft::default(),
            of_ros: BTreeSet::new(),
            watching: Vec::new(),
            out,
        };
        reader.file(tables, is_cogen);
        // What stands in `defaults`, or behind an anchor, is read for each node.
        let mut findings = Diagnostics::default();
        for finding in reader.out.findings.iter() {
            if !findings.contains(finding) {
                findings.push(finding.clone());
            }
        }
        findings.finish();
        BusYml { draft: reader.draft, findings, input: Input::new(source) }
    }
}

/// What of a master goes into its dictionary.
#[rustfmt::skip]
const OF_MASTER: [&str; 10] = [
    "vendor_id", "product_code", "revision_number", "serial_number", "sync_window", "sync_overflow", "emcy_inhibit_time",
    "nmt_inhibit_time", "error_behavior", "time_cob_id",
];

/// A value that is written, and where the file says so.
type Given = (Address, i64, Range<usize>);

/// A node of the network.
struct Slave {
    name: At<String>,
    keys: Keys,
    /// Its data sheet, which is empty if there is none.
    device: Device,
    id: NodeId,
    /// What becomes of it.
    section: Section,
}

struct Reader<'a> {
    files: Files<'a>,
    name: &'a dyn Fn(&str) -> String,
    tool: &'static str,
    retry: u8,
    /// How many heartbeats may be missing, which need not be whole.
    factor: f64,
    /// COB-IDs for PDOs beyond the fourth.
    free: Range<u16>,
    draft: Draft,
    of_ros: BTreeSet<String>,
    /// Which slaves watch the master.
    watching: Vec<bool>,
    out: Out,
}

impl Reader<'_> {
    fn warn(&mut self, at: &Range<usize>, what: impl Into<String>, help: Option<&str>) {
        self.out.push(Severity::Warning, "bus-yml::differs", at, what, help.map(str::to_owned));
    }

    fn file(&mut self, tables: &[(At<String>, Yaml)], is_cogen: bool) {
        let top = Keys::new(tables.to_vec());
        if let Some(options) = top.get("options") {
            let options = Keys::of(options, &mut self.out);
            self.retry = options.number("retry_factor", &mut self.out).unwrap_or(self.retry);
            self.multiplier(&options);
            options.end(self.tool, &mut self.of_ros, &mut self.out);
        }
        let heartbeat = top.get("master").and_then(|master| self.master(master));
        if top.get("master").is_none() && !tables.is_empty() {
            let what = match is_cogen {
                true => "there is no `master`: cogen says so in a line, writes nothing, and ends as if all were well",
                false => "there is no `master`: dcfgen stops here",
            };
            self.warn(&(0..0), what, None);
        }
        let defaults = top.get("defaults").filter(|_| is_cogen).map(|it| Keys::of(it, &mut self.out));
        let mut slaves: Vec<&(At<String>, Yaml)> = match top.get("nodes").filter(|_| is_cogen) {
            Some(nodes) => {
                if nodes.list().is_some() {
                    let help = "its documentation draws a list, but cogen reads `nodes:` with a table for each name";
                    self.out.wrong("bus-yml::value", &nodes.at, "nodes are no list", Some(help.to_owned()));
                }
                nodes.map().unwrap_or_default().iter().collect()
            }
            None => {
                let is_slave = |key: &str| !["options", "master"].contains(&key) && !key.starts_with('.');
                tables.iter().filter(|(key, _)| is_slave(key)).collect()
            }
        };
        if is_cogen {
            top.end(self.tool, &mut self.of_ros, &mut self.out);
            let is_sorted = slaves.is_sorted_by_key(|(name, _)| &name.value);
            slaves.sort_by_key(|(name, _)| &name.value);
            if let (false, Some((name, _))) = (is_sorted, slaves.first()) {
                self.warn(&name.span.clone(), "cogen sorts the nodes by their names, and so does the machine", None);
            }
        }
        for (name, slave) in slaves {
            self.slave(name, slave, defaults.as_ref());
        }
        if let Some((at, ms)) = heartbeat {
            self.heartbeat(&at, ms);
        }
        if !self.of_ros.is_empty() {
            let keys = self.of_ros.iter().map(String::as_str).collect::<Vec<_>>().join(", ");
            let what = format!("left out, since only ros2_canopen reads it when it runs: {keys}");
            self.out.push(Severity::Note, "bus-yml::left-out", &(0..0), what, None);
        }
    }

    /// After how many heartbeats a node is lost.
    fn multiplier(&mut self, keys: &Keys) {
        let Some(value) = keys.get("heartbeat_multiplier") else { return };
        self.factor = value.text().and_then(|text| text.parse().ok()).unwrap_or(self.factor);
        if self.factor != f64::from(PATIENCE) {
            let what =
                format!("a node is lost after {} times its heartbeat; in a machine, after {PATIENCE}", self.factor);
            self.warn(&value.at, what, None);
        }
    }

    /// The master; its heartbeat, and where it stands.
    fn master(&mut self, master: &Yaml) -> Option<(Range<usize>, u64)> {
        let (keys, out) = (Keys::of(master, &mut self.out), &mut self.out);
        let id = keys.number::<u8>("node_id", out).unwrap_or(255);
        let bus = &mut self.draft.bus;
        bus.put_bit_rate(keys.number("baudrate", out).filter(|rate| (10..=1000).contains(rate)).unwrap_or(1000));
        if let Some(id) = NodeId::new(id) {
            bus.put("manager", id.to_string());
        }
        for (key, ours, us) in [("sync_period", "sync", 1), ("boot_time", "boot-time", 1000)] {
            let time = keys.number::<u32>(key, out).map_or(0, |time| u64::from(time) * us);
            if time.is_multiple_of(1000) && time <= 3_600_000_000 {
                if time > 0 {
                    bus.put_time(ours, time / 1000);
                }
            } else {
                let what = format!("`{key}` is left out: a machine has whole milliseconds, up to an hour");
                out.push(Severity::Warning, "bus-yml::left-out", &keys.get(key).unwrap_or(master).at, what, None);
            }
        }
        let is_heard = keys.number::<u16>("heartbeat_producer", out).filter(|ms| *ms > 0);
        let [all, reset, stop] =
            ["start_all_nodes", "reset_all_nodes", "stop_all_nodes"].map(|key| keys.flag(key, false, out));
        if all {
            bus.put("start-all", "true");
        }
        if reset || stop {
            bus.put("on-loss", quoted(if stop { "stop-all" } else { "reset-all" }));
        }
        for key in ["start", "start_nodes", "heartbeat_consumer"] {
            if !keys.flag(key, true, out) {
                let at = &keys.get(key).unwrap_or(master).at;
                let what =
                    format!("`{key}: false` is left out: the manager of a machine boots, starts and watches its nodes");
                out.push(Severity::Warning, "bus-yml::left-out", at, what, None);
            }
        }
        let no_device = "the manager of a machine has no dictionary of its own";
        for key in OF_MASTER {
            keys.leave_out(&[(key, no_device)], out);
        }
        self.multiplier(&keys);
        let heard = is_heard.map(|ms| (keys.get("heartbeat_producer").unwrap_or(master).at.clone(), ms.into()));
        keys.end(self.tool, &mut self.of_ros, &mut self.out);
        heard
    }

    /// The heartbeat of the master, which all nodes of a machine watch, or none.
    fn heartbeat(&mut self, at: &Range<usize>, ms: u64) {
        let watching = self.watching.iter().filter(|it| **it).count();
        if watching == 0 {
            let help = "[bus] heartbeat = \"…\" lets them";
            self.warn(at, "left out, since no node watches it: none has `heartbeat_consumer: true`", Some(help));
            return;
        }
        self.draft.bus.put_time("heartbeat", ms);
        if watching < self.watching.len() {
            let what = format!("{watching} of {} nodes watch it; in a machine, all that can", self.watching.len());
            self.warn(at, what, None);
        }
    }

    /// The keys of a slave, with those of `defaults`.
    fn with_defaults(&mut self, slave: &Yaml, defaults: Option<&Keys>) -> Keys {
        let own = Keys::of(slave, &mut self.out);
        let Some(defaults) = defaults else { return own };
        let mut entries: Vec<_> = defaults.each().cloned().collect();
        for (key, value) in own.each() {
            match defaults.each().find(|(name, _)| name == key) {
                None => entries.push((key.clone(), value.clone())),
                Some((_, other)) if other.text().is_some() && other.text() == value.text() => {}
                Some(_) => {
                    let what =
                        format!("cogen takes `{}` of `defaults` and drops this, and so does the machine", key.value);
                    let help = "leave it out of `defaults`, and give it to each node";
                    self.warn(&key.span, what, Some(help));
                }
            }
        }
        Keys::new(entries)
    }

    fn slave(&mut self, name: &At<String>, slave: &Yaml, defaults: Option<&Keys>) {
        let keys = self.with_defaults(slave, defaults);
        let sheet = self.sheet(&keys, name);
        let commissioned = sheet.as_ref().and_then(|(_, device)| device.commissioning.as_ref()?.node_id);
        let id = keys.number::<u8>("node_id", &mut self.out).or(commissioned);
        let Some(id) = id.and_then(NodeId::new) else {
            let what = format!(
                "{} has no node-ID: {} leaves it out with a warning, and so does the machine",
                name.value, self.tool
            );
            self.warn(&name.span, what, Some("node_id: 1 to 127"));
            return;
        };
        let mut section = Section::default();
        section.put("id", id.to_string());
        if let Some((file, _)) = &sheet {
            section.put("sheet", quoted(&(self.name)(file)));
        }
        let device = sheet.map(|(_, device)| device).unwrap_or_default();
        let slave = &mut Slave { name: name.clone(), keys, device, id, section };
        let commissioned = slave.device.commissioning.as_ref().and_then(|it| it.serial_number);
        let known = [("revision_number", slave.device.info.revision_number, 3), ("serial_number", commissioned, 4)];
        let [revision, serial] = known.map(|(key, known, sub)| {
            let held = || u32::try_from(held(&slave.device, id, Address::new(cia301::IDENTITY, sub))?).ok();
            let given = slave.keys.number::<u32>(key, &mut self.out);
            given.or(known.filter(|number| *number != 0)).or_else(held).filter(|number| *number != 0)
        });
        if let Some(identity) = identity([None, None, revision, serial]) {
            slave.section.put("identity", identity);
        }
        for (key, usual, ours, value) in [
            ("mandatory", false, "optional", "true"),
            ("boot", true, "boots-again", "false"),
            ("reset_communication", true, "keep-alive", "true"),
        ] {
            if !slave.keys.flag(key, usual, &mut self.out) {
                slave.section.put(ours, value);
            }
        }
        let given = self.error_control(slave);
        self.pdos(slave, Direction::Receive);
        self.pdos(slave, Direction::Transmit);
        self.settings(slave, given);
        let left_out = [
            ("software_file", "`lexican flash` writes it"),
            ("software_version", "`lexican flash` writes it"),
            ("configuration_file", "dcfgen means to take it for the concise DCF, but does not"),
            ("restore_configuration", "nodes are not restored before they are configured"),
        ];
        slave.keys.leave_out(&left_out, &mut self.out);
        slave.keys.end(self.tool, &mut self.of_ros, &mut self.out);
        let added = self.draft.add(name, &format!("node{id}"), std::mem::take(&mut slave.section));
        if added != name.value {
            self.warn(&name.span, format!("{:?} cannot be the name of a node: it is {added}", name.value), None);
        }
    }

    /// The data sheet of a slave and its file.
    fn sheet(&mut self, keys: &Keys, name: &At<String>) -> Option<(String, Device)> {
        let Some(dcf) = keys.get("dcf") else {
            self.out.wrong("bus-yml::sheet", &name.span, format!("{} has no `dcf`", name.value), None);
            return None;
        };
        let file = self.files.name(dcf.text().unwrap_or_default().trim_start_matches("@BUS_CONFIG_PATH@/"));
        match self.files.data_sheet(&file, &[]) {
            Ok(sheet) => Some((file, sheet.device)),
            Err(error) => {
                self.out.wrong("bus-yml::sheet", &dcf.at, error.to_string(), error.remedy());
                None
            }
        }
    }

    /// Heartbeat or guarding, of which a machine has one; returns what else is written of them.
    fn error_control(&mut self, slave: &mut Slave) -> Vec<Given> {
        let Slave { name, keys, device, id, section } = slave;
        let parts = [
            ("heartbeat_producer", cia301::PRODUCER_HEARTBEAT_TIME),
            ("guard_time", cia301::GUARD_TIME),
            ("life_time_factor", cia301::LIFE_TIME_FACTOR),
        ];
        let [(heartbeat, own_heartbeat), (guard_time, own_time), (factor, own_factor)] = parts.map(|(key, index)| {
            let (address, own) = (Address::new(index, 0), keys.number::<u16>(key, &mut self.out));
            let known = held(device, *id, address).and_then(|known| u16::try_from(known).ok());
            let differs = own.filter(|own| Some(*own) != known);
            (own.or(known).unwrap_or(0), differs.map(|own| (address, own.into(), name.span.clone())))
        });
        let retry = keys.number("retry_factor", &mut self.out).unwrap_or(self.retry);
        self.watching.push(keys.flag("heartbeat_consumer", false, &mut self.out));
        self.multiplier(keys);
        let limit = f64::from(heartbeat) * self.factor;
        if limit > 65_535.0 {
            let what =
                format!("{} writes {} ms into its 1016h instead of {limit} ms", self.tool, limit as u64 & 0xFFFF);
            self.warn(&name.span, what, None);
        }
        if heartbeat > 0 {
            section.put_time("heartbeat", heartbeat.into());
            if guard_time > 0 {
                let what = format!("{} has heartbeat and guarding: it is not guarded", name.value);
                self.warn(&name.span, what, None);
            }
            [own_time, own_factor].into_iter().flatten().collect()
        } else if guard_time > 0 && factor > 0 {
            section.put_time("guarding", guard_time.into());
            if u16::from(retry) != factor {
                let what = format!(
                    "{} has retry_factor {retry} and life_time_factor {factor}, of which a machine has one",
                    name.value
                );
                self.warn(&name.span, what, None);
            }
            if factor != u16::from(PATIENCE) {
                section.put("retry", factor.min(255).to_string());
            }
            own_heartbeat.into_iter().collect()
        } else {
            [own_heartbeat, own_time, own_factor].into_iter().flatten().collect()
        }
    }

    /// What is written besides: error behaviour, the COB-ID of TIME, `sdo`.
    fn settings(&mut self, slave: &mut Slave, mut given: Vec<Given>) {
        let Slave { name, keys, device, id, section } = slave;
        let mut settings: BTreeMap<Address, Vec<u8>> = BTreeMap::new();
        let time = Address::new(cia301::COB_ID_TIME, 0);
        let time_id = keys.number::<u32>("time_cob_id", &mut self.out).filter(|id| *id != 0x100);
        given.extend(time_id.map(|id| (time, id.into(), name.span.clone())));
        for (sub, value) in keys.get("error_behavior").and_then(Yaml::map).unwrap_or_default() {
            if let (Ok(sub), Some(value)) = (sub.parse(), value.integer()) {
                let address = Address::new(cia301::ERROR_BEHAVIOUR, sub);
                if held(device, *id, address) != Some(value.into()) {
                    given.push((address, value, name.span.clone()));
                }
            }
        }
        let before = given.len();
        for item in keys.get("sdo").and_then(Yaml::list).unwrap_or_default() {
            let item_keys = Keys::of(item, &mut self.out);
            let index = item_keys.number::<u16>("index", &mut self.out);
            let sub = item_keys.number::<u8>("sub_index", &mut self.out).unwrap_or(0);
            let value = self.value(&item_keys);
            item_keys.end(self.tool, &mut self.of_ros, &mut self.out);
            given.extend(index.map(|index| (Address::new(index, sub), value, item.at.clone())));
        }
        if let Some((_, _, at)) = given[before..].windows(2).find(|pair| pair[1].0 < pair[0].0).map(|pair| &pair[1]) {
            self.warn(&at.clone(), format!("{} writes these in their order, a boot by their indices", self.tool), None);
        }
        for (address, value, at) in given {
            let Some(entry) = device.entry(address.index(), address.sub()) else {
                let what = format!("the data sheet has no {address}: {} stops here", self.tool);
                self.out.wrong("bus-yml::value", &at, what, None);
                continue;
            };
            let Some(data) = encode(entry.data_type, &Value::Integer(value.into())) else {
                let what = format!("{value} is no {}, which {address} has", entry.data_type);
                self.out.wrong("bus-yml::value", &at, what, None);
                continue;
            };
            if matches!(data.len(), 3 | 5..=7) {
                let what = format!(
                    "{} writes a concise DCF that no device can read, since {address} has {} bytes",
                    self.tool,
                    data.len()
                );
                self.warn(&at, what, None);
            }
            if settings.insert(address, data).is_some() {
                self.warn(&at, format!("{address} is written twice: the last value is kept"), None);
            }
        }
        for wrong in put_settings(section, device, *id, &settings) {
            self.out.wrong("bus-yml::value", &name.span, format!("left out: {wrong}"), None);
        }
    }

    /// The value of an `sdo`, of which the tools write whole numbers alone.
    fn value(&mut self, keys: &Keys) -> i64 {
        let Some(value) = keys.get("value") else { return 0 };
        if let Some(number) = value.integer().or(value.boolean().map(i64::from)) {
            return number;
        }
        match value.text().and_then(|text| text.parse::<f64>().ok()) {
            Some(real) => {
                self.warn(&value.at, format!("{} writes {} for this", self.tool, real as i64), None);
                real as i64
            }
            None => {
                let what = format!("this is no number: {} stops here", self.tool);
                self.out.wrong("bus-yml::value", &value.at, what, None);
                0
            }
        }
    }
}

/// What a data sheet gives an entry, as a number.
fn held(device: &Device, id: NodeId, address: Address) -> Option<i128> {
    resolved(given(device.entry(address.index(), address.sub())?)?, id).as_integer()
}
