//! Reads `bus.yml` as dcfgen of lely-core and cogen of ros2_canopen do. The machine is what these tools make of the
//! file; a finding reports each place where that differs from what the file says.

mod keys;
mod pdo;
mod tree;

use std::collections::BTreeSet;
use std::ops::Range;

use lexican_eds::model::{Device, Value};
use lexican_eds::{Diagnostics, Input, Severity, Source};
use lexican_runtime::object::{Address, Direction};
use lexican_runtime::{NodeId, cia301};
use lexican_toolbox::parameters::restore::not_restored;
use lexican_toolbox::values::wire::encode;

use self::keys::Keys;
use self::pdo::FREE;
use self::tree::Yaml;
use crate::at::At;
use crate::draft::{Draft, Found, entry_mut, identity, time};
use crate::files::Files;
use crate::nodes::{PATIENCE, is_name};
use crate::read::Out;

/// A machine that a `bus.yml` describes.
#[derive(Debug)]
pub struct BusYml {
    /// The machine.
    pub draft: Draft,
    /// What dcfgen or cogen drops, overrides or changes, and what a machine cannot express.
    pub findings: Diagnostics,
    /// The text, to render the findings.
    pub input: Input,
}

impl BusYml {
    /// Reads a `bus.yml` and its data sheets. `name` converts the file name of a data sheet to that in the machine.
    #[must_use]
    pub fn read(source: Source, files: Files<'_>, name: &dyn Fn(&str) -> String) -> Self {
        let mut out = Out::default();
        let root = if source.refusal().is_none() { tree::read(source.text(), &mut out) } else { None };
        let tables = root.as_ref().and_then(Yaml::map).unwrap_or_default();
        if tables.is_empty() && !out.findings.has_errors() {
            out.wrong("bus-yml::syntax", &(0..0), "this is no bus.yml: it has no tables", None);
        }
        let is_cogen = tables.iter().any(|(key, _)| key.value == "nodes");
        let tool = if is_cogen { "cogen" } else { "dcfgen" };
        let (draft, of_ros) = (Draft::default(), BTreeSet::new());
        let mut reader = Reader { files, name, tool, factor: PATIENCE.into(), free: FREE, draft, of_ros, out };
        reader.file(tables, is_cogen);
        reader.out.findings.finish();
        BusYml { draft: reader.draft, findings: reader.out.findings, input: Input::new(source) }
    }
}

struct Reader<'a> {
    files: Files<'a>,
    name: &'a dyn Fn(&str) -> String,
    tool: &'static str,
    /// The consumer time of nodes is the master's heartbeat times this number.
    factor: f64,
    /// The COB-IDs that are still free, for PDOs beyond the fourth.
    free: Range<u16>,
    draft: Draft,
    of_ros: BTreeSet<String>,
    out: Out,
}

/// Keys that only configure the master's own dictionary.
const OF_MASTER: &str = "vendor_id product_code revision_number serial_number sync_window sync_overflow emcy_inhibit_time \
    nmt_inhibit_time error_behavior time_cob_id";

impl Reader<'_> {
    fn warn(&mut self, at: &Range<usize>, what: impl Into<String>, help: Option<&str>) {
        self.out.push(Severity::Warning, "bus-yml::differs", at, what, help.map(str::to_owned));
    }

    fn end(&mut self, keys: &Keys) {
        keys.end(self.tool, &mut self.of_ros, &mut self.out);
    }

    fn file(&mut self, tables: &[(At<String>, Yaml)], is_cogen: bool) {
        let top = Keys::new(tables.to_vec());
        if let Some(options) = top.get("options") {
            let options = Keys::of(options, &mut self.out);
            self.error_control(&options);
            self.end(&options);
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
        let is_slave = |key: &str| !["options", "master"].contains(&key) && !key.starts_with('.');
        let mut slaves: Vec<_> = tables.iter().filter(|(key, _)| is_slave(key)).collect();
        if let Some(nodes) = top.get("nodes").filter(|_| is_cogen) {
            if nodes.list().is_some() {
                let help = "its documentation draws a list, but cogen reads `nodes:` with a table for each name";
                self.out.wrong("bus-yml::value", &nodes.at, "nodes are no list", Some(help.to_owned()));
            }
            self.end(&top);
            slaves = nodes.map().unwrap_or_default().iter().collect();
            if let Some(pair) = slaves.windows(2).find(|pair| pair[0].0.value > pair[1].0.value) {
                let at = &pair[1].0.span;
                self.warn(at, "cogen sorts the nodes by their names, and so does the machine", None);
            }
            slaves.sort_by_key(|(name, _)| &name.value);
        }
        let watching: Vec<_> = slaves
            .iter()
            .filter_map(|(name, slave)| self.slave(name, slave, defaults.as_ref(), heartbeat.as_ref()))
            .collect();
        if let Some((at, ms)) = heartbeat {
            let (some, all) = (watching.iter().filter(|watches| **watches).count(), watching.len());
            if some > 0 {
                self.draft.bus.put_time("heartbeat", ms.into());
            }
            if some < all {
                let what = format!("{some} of {all} nodes watch it; in a machine, all that can, or none");
                self.warn(&at, what, Some("[bus] heartbeat = \"…\", and protection = \"none\" of a node"));
            }
        }
        if !self.of_ros.is_empty() {
            let keys = self.of_ros.iter().map(String::as_str).collect::<Vec<_>>().join(", ");
            let what = format!("left out, since only ros2_canopen reads it when it runs: {keys}");
            self.out.push(Severity::Note, "bus-yml::left-out", &(0..0), what, None);
        }
    }

    /// Reads the factors for missing heartbeats and guarding responses.
    fn error_control(&mut self, keys: &Keys) {
        keys.leave_out(&[("retry_factor", "the life time factor of a node counts")], &mut self.out);
        let Some(value) = keys.get("heartbeat_multiplier") else { return };
        self.factor = value.text().and_then(|text| text.parse().ok()).unwrap_or(self.factor);
        if self.factor != f64::from(PATIENCE) {
            let what = format!("{} heartbeats of a node are missing; in a machine, {PATIENCE}", self.factor);
            self.warn(&value.at, what, None);
        }
    }

    /// Reads the master; returns its heartbeat in ms, with the place of that key.
    fn master(&mut self, master: &Yaml) -> Option<(Range<usize>, u16)> {
        let (keys, out) = (Keys::of(master, &mut self.out), &mut self.out);
        let bus = &mut self.draft.bus;
        let bit_rate = keys.number("baudrate", out).filter(|rate| (10..=1000).contains(rate));
        bus.put_bit_rate(bit_rate.unwrap_or(1000));
        if let Some(id) = keys.number("node_id", out).and_then(NodeId::new) {
            bus.put("manager", id.to_string());
        }
        for (key, ours, us) in [("sync_period", "sync", 1), ("boot_time", "boot-time", 1000)] {
            let time = keys.number::<u32>(key, out).map_or(0, |time| u64::from(time) * us);
            if !time.is_multiple_of(1000) || time > 3_600_000_000 {
                keys.leave_out(&[(key, "a machine has whole milliseconds, up to an hour")], out);
            } else if time > 0 {
                bus.put_time(ours, time / 1000);
            }
        }
        let heartbeat = keys.number::<u16>("heartbeat_producer", out).filter(|ms| *ms > 0);
        for (key, ours, value) in [
            ("start_all_nodes", "start-all", "true"),
            ("reset_all_nodes", "on-loss", "\"reset-all\""),
            ("stop_all_nodes", "on-loss", "\"stop-all\""),
        ] {
            if keys.flag(key, false, out) {
                bus.put(ours, value);
            }
        }
        for key in ["start", "start_nodes", "heartbeat_consumer"] {
            if !keys.flag(key, true, out) {
                keys.leave_out(&[(key, "the manager of a machine boots, starts and watches its nodes")], out);
            }
        }
        for key in OF_MASTER.split(' ') {
            keys.leave_out(&[(key, "the manager of a machine has no dictionary of its own")], out);
        }
        self.error_control(&keys);
        self.end(&keys);
        heartbeat.map(|ms| (keys.get("heartbeat_producer").unwrap_or(master).at.clone(), ms))
    }

    /// The keys of a slave, completed by those of `defaults`.
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

    /// Adds a slave with all records of its concise DCF applied; returns whether it watches the master.
    fn slave(
        &mut self,
        name: &At<String>,
        slave: &Yaml,
        defaults: Option<&Keys>,
        heartbeat: Option<&(Range<usize>, u16)>,
    ) -> Option<bool> {
        let keys = self.with_defaults(slave, defaults);
        let sheet = self.sheet(&keys, name);
        let (info, commissioning) = match &sheet {
            Some((_, sheet)) => (sheet.info.clone(), sheet.commissioning.clone().unwrap_or_default()),
            None => Default::default(),
        };
        let Some(id) = keys.number("node_id", &mut self.out).or(commissioning.node_id).and_then(NodeId::new) else {
            let what = format!("{} has no node-ID: {} leaves it out, and so does the machine", name.value, self.tool);
            self.warn(&name.span, what, Some("node_id: 1 to 127"));
            return None;
        };
        if !is_name(name) {
            self.warn(&name.span, format!("{:?} cannot be the name of a node", name.value), None);
        }
        let sheet = sheet.map(|(file, sheet)| ((self.name)(&file), sheet.clone(), sheet));
        let mut found = Found { name: Some(name.value.clone()), ..Found::new(id, [None; 4], sheet, 0) };
        let known = [("revision_number", info.revision_number, 3), ("serial_number", commissioning.serial_number, 4)];
        let [revision, serial] = known.map(|(key, known, sub)| {
            let held = || u32::try_from(found.held(Address::new(cia301::IDENTITY, sub))?).ok();
            let given = keys.number::<u32>(key, &mut self.out);
            given.or(known.filter(|number| *number != 0)).or_else(held).filter(|number| *number != 0)
        });
        found.lines.extend(identity([None, None, revision, serial]).map(|it| ("identity", it)));
        for (key, usual, ours, value) in [
            ("mandatory", false, "optional", "true"),
            ("boot", true, "boots-again", "false"),
            ("reset_communication", true, "keep-alive", "true"),
        ] {
            if !keys.flag(key, usual, &mut self.out) {
                found.lines.push((ours, value.to_owned()));
            }
        }
        let watches = keys.flag("heartbeat_consumer", false, &mut self.out) && heartbeat.is_some();
        self.error_control(&keys);
        let within = heartbeat.map_or(0.0, |(_, ms)| f64::from(*ms) * self.factor);
        if self.factor != f64::from(PATIENCE) && (1.0..=65_535.0).contains(&within) {
            found.lines.push(("protection", time(within as u64)));
        }
        self.records(&keys, &mut found, &name.span);
        let left_out = [
            ("software_file", "`lexican flash` writes it"),
            ("software_version", "`lexican flash` writes it"),
            ("configuration_file", "dcfgen means to take it for the concise DCF, but does not"),
            ("restore_configuration", "nodes are not restored before they are configured"),
        ];
        keys.leave_out(&left_out, &mut self.out);
        self.end(&keys);
        for refused in self.draft.add(&found, true) {
            self.out.wrong("bus-yml::value", &name.span, format!("left out: {refused}"), None);
        }
        Some(watches)
    }

    /// The data sheet of a slave, with its file.
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

    /// Reads the values to write into a slave.
    fn records(&mut self, keys: &Keys, found: &mut Found, at: &Range<usize>) {
        for (key, index) in [
            ("heartbeat_producer", cia301::PRODUCER_HEARTBEAT_TIME),
            ("guard_time", cia301::GUARD_TIME),
            ("life_time_factor", cia301::LIFE_TIME_FACTOR),
            ("time_cob_id", cia301::COB_ID_TIME),
        ] {
            if let Some(value) = keys.number::<u32>(key, &mut self.out) {
                self.record(found, Address::new(index, 0), value.into(), at);
            }
        }
        for (sub, value) in keys.get("error_behavior").and_then(Yaml::map).unwrap_or_default() {
            if let (Ok(sub), Some(value)) = (sub.parse(), value.integer()) {
                self.record(found, Address::new(cia301::ERROR_BEHAVIOUR, sub), value, at);
            }
        }
        self.pdos(keys, found, Direction::Receive);
        self.pdos(keys, found, Direction::Transmit);
        let mut sdo: Vec<Address> = Vec::new();
        for item in keys.get("sdo").and_then(Yaml::list).unwrap_or_default() {
            let (item_keys, address) = self.item(item);
            let value = self.value(&item_keys);
            self.end(&item_keys);
            let Some(address) = address else { continue };
            if sdo.contains(&address) {
                self.warn(&item.at, format!("{address} is written twice: the last value is kept"), None);
            } else if sdo.last().is_some_and(|last| address < *last) {
                let what = format!("{} writes these in their order, a boot by their indices", self.tool);
                self.warn(&item.at, what, None);
            }
            sdo.push(address);
            self.record(found, address, value, &item.at);
        }
        if let Some((.., device)) = &found.sheet {
            for (address, reason) in not_restored(device, found.id) {
                if sdo.contains(&address) {
                    let what = format!("{address} is left out: {}", reason.words(1));
                    self.out.wrong("bus-yml::left-out", at, what, None);
                }
            }
        }
        found.written.extend(sdo);
    }

    /// The keys of a list's item, and the entry that it addresses.
    fn item(&mut self, item: &Yaml) -> (Keys, Option<Address>) {
        let keys = Keys::of(item, &mut self.out);
        let index = keys.number("index", &mut self.out);
        let sub = keys.number("sub_index", &mut self.out).unwrap_or(0);
        (keys, index.map(|index| Address::new(index, sub)))
    }

    /// Adds a record of the slave's concise DCF.
    fn record(&mut self, found: &mut Found, address: Address, value: i64, at: &Range<usize>) {
        let Some((.., device)) = &mut found.sheet else { return };
        let number = Value::Integer(value.into());
        match entry_mut(device, address) {
            Some(entry) if encode(entry.data_type, &number).is_some() => entry.configured = Some(number),
            Some(entry) => {
                let what = format!("{value} is no {}, which {address} has", entry.data_type);
                self.out.wrong("bus-yml::value", at, what, None);
            }
            None => {
                let what = format!("the data sheet has no {address}, which {} does not write, either", self.tool);
                self.out.wrong("bus-yml::value", at, what, None);
            }
        }
    }

    /// The value of an `sdo` item. The tools write only integers.
    fn value(&mut self, keys: &Keys) -> i64 {
        let Some(value) = keys.get("value") else { return 0 };
        let real = || value.text()?.parse::<f64>().ok();
        match (value.integer().or(value.boolean().map(i64::from)), real()) {
            (Some(number), _) => return number,
            (None, Some(real)) => {
                self.warn(&value.at, format!("{} writes {} for this", self.tool, real as i64), None);
                return real as i64;
            }
            _ => self.out.wrong("bus-yml::value", &value.at, format!("no number: {} stops here", self.tool), None),
        }
        0
    }
}
