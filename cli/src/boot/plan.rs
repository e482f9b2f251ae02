//! What a network is to be: from a file, or from the command line.

use std::path::{Path, PathBuf};

use lexican_eds::model::{Device, Entry};
use lexican_runtime::host::Plan;
use lexican_runtime::manager::{Assignment, Guarding, OnLoss};
use lexican_runtime::object::Address;
use lexican_runtime::procedure::{ConciseDcf, Data, Step};
use lexican_runtime::{Duration, NodeId};
use toml::{Table, Value as Toml};

use crate::bus::node_id;
use crate::bus::object::resolve;
use crate::device::{Loaded, read, read_up_to};
use crate::output::Failure;
use crate::values::wire::encode;
use crate::values::{Known, resolved};

/// A network, and how long it may take to boot.
pub(super) struct Network {
    pub(super) nodes: Vec<Node>,
    pub(super) on_loss: OnLoss,
    pub(super) start_all: bool,
    /// `None`: what the command line says.
    pub(super) boot_time: Option<Duration>,
}

/// What a node is to be.
pub(super) struct Node {
    pub(super) id: NodeId,
    /// A data sheet, or a device that lexican knows; the node must have its identity, and gets the values of a DCF.
    pub(super) device: Option<String>,
    /// A file with a concise DCF.
    pub(super) dcf: Option<PathBuf>,
    /// `6060 = profile velocity`.
    pub(super) settings: Vec<String>,
    pub(super) heartbeat: Option<Duration>,
    pub(super) guarding: Option<Guarding>,
    pub(super) mandatory: bool,
    pub(super) start: bool,
    pub(super) keep_alive: bool,
    pub(super) boots_again: bool,
}

/// How many heartbeats, or answers to guarding, may be missing.
const PATIENCE: u8 = 3;
/// No node has a longer configuration.
const LONGEST_DCF: usize = 16 * 1024 * 1024;

impl Node {
    /// A mandatory node that is started and booted again.
    pub(super) const fn new(id: NodeId) -> Self {
        Node {
            id,
            device: None,
            dcf: None,
            settings: Vec::new(),
            heartbeat: None,
            guarding: None,
            mandatory: true,
            start: true,
            keep_alive: false,
            boots_again: true,
        }
    }

    fn assignment(&self) -> Result<Assignment<Vec<u8>>, Failure> {
        let loaded = self.device.as_deref().map(Loaded::named).transpose()?;
        let device = loaded.as_ref().map(|loaded| &loaded.device);
        let configuration = self.configuration(device)?;
        let steps = configuration.iter().map(|(address, data)| Step::bytes(*address, data));
        let configuration = ConciseDcf::to_vec(steps).expect("these are writes");
        let mut assignment = Assignment::new(self.id, configuration);
        if let Some(heartbeat) = self.heartbeat {
            assignment = assignment.with_heartbeat(heartbeat.times(PATIENCE.into()));
        }
        if let Some(guarding) = self.guarding {
            assignment = assignment.with_guarding(guarding);
        }
        assignment.mandatory = self.mandatory;
        assignment.boots_again = self.boots_again;
        let plan = &mut assignment.plan;
        (plan.start, plan.keep_alive) = (self.start, self.keep_alive);
        let number = |index, sub| {
            let entry = device?.entry(index, sub)?;
            let value = resolved(entry.configured.as_ref().or(entry.default.as_ref())?, self.id).as_integer()?;
            u32::try_from(value).ok().filter(|value| *value != 0)
        };
        plan.device_type = number(0x1000, 0);
        (plan.vendor, plan.product) = (number(0x1018, 1), number(0x1018, 2));
        Ok(assignment)
    }

    /// What is written, in this order: the concise DCF, the values of a DCF, the settings, the heartbeat.
    fn configuration(&self, device: Option<&Device>) -> Result<Vec<(Address, Vec<u8>)>, Failure> {
        let mut entries = Vec::new();
        if let Some(path) = &self.dcf {
            let bytes = read_up_to(path, LONGEST_DCF)?;
            let dcf = ConciseDcf::new(&bytes);
            dcf.check().map_err(|error| Failure::new(format_args!("{}: {error}", path.display())))?;
            entries.extend(dcf.filter_map(|step| match step {
                Step::Write { address, data: Data::Bytes(bytes) } => Some((address, bytes.to_vec())),
                _ => None,
            }));
        }
        entries.extend(device.map(|device| configured(device, self.id)).unwrap_or_default());
        for setting in &self.settings {
            entries.push(self.setting(device, setting)?);
        }
        if let Some(heartbeat) = self.heartbeat {
            let ms = u16::try_from(heartbeat.as_micros() / 1000);
            let ms = ms.map_err(|_| self.wrong(format_args!("a heartbeat of {heartbeat} is beyond 65535 ms")))?;
            if device.is_some_and(|device| device.entry(0x1017, 0).is_none()) {
                return Err(self.wrong("its data sheet has no heartbeat (1017h)").help("let it be guarded instead"));
            }
            entries.push((Address::new(0x1017, 0), ms.to_le_bytes().to_vec()));
        }
        Ok(entries)
    }

    fn setting(&self, device: Option<&Device>, setting: &str) -> Result<(Address, Vec<u8>), Failure> {
        let (object, value) =
            setting.split_once('=').ok_or_else(|| self.wrong(format_args!("{setting:?} is no OBJECT = VALUE")))?;
        let device = device.ok_or_else(|| {
            self.wrong("settings need a data sheet, which tells their data types").help("name it as its device")
        })?;
        let address = resolve(Some(device), object.trim())?;
        let entry = device.entry(address.index(), address.sub());
        let entry = entry.ok_or_else(|| self.wrong(format_args!("the data sheet has no {address}")))?;
        let value = Known::new(device).understand(entry, value.trim());
        let value = value.map_err(|error| self.wrong(format_args!("{address}: {error}")))?;
        let data = encode(entry.data_type, &value);
        let data = data.ok_or_else(|| self.wrong(format_args!("{address}: the value is no {}", entry.data_type)))?;
        Ok((address, data))
    }

    fn wrong(&self, what: impl std::fmt::Display) -> Failure {
        Failure::new(format_args!("node {}: {what}", self.id))
    }
}

/// The values of a DCF that can be written. A PDO is switched off first and on last, and its mapping is emptied before it
/// is changed (CiA 301, 7.5.2.36).
fn configured(device: &Device, node: NodeId) -> Vec<(Address, Vec<u8>)> {
    let (mut entries, mut counts, mut cob_ids) = (Vec::new(), Vec::new(), Vec::new());
    let data = |entry: &Entry| encode(entry.data_type, &resolved(entry.configured.as_ref()?, node));
    for entry in device.entries().filter(|entry| entry.access.writable()) {
        let Some(mut data) = data(entry) else { continue };
        let address = Address::new(entry.index, entry.sub);
        match (entry.index, entry.sub) {
            (0x1400..=0x15FF | 0x1800..=0x19FF, 1) => {
                cob_ids.push((address, data.clone()));
                data.last_mut().into_iter().for_each(|byte| *byte |= 0x80);
            }
            (0x1600..=0x17FF | 0x1A00..=0x1BFF, 0) => {
                counts.push((address, data.clone()));
                data.fill(0);
            }
            _ => {}
        }
        entries.push((address, data));
    }
    entries.into_iter().chain(counts).chain(cob_ids).collect()
}

impl Network {
    pub(super) fn plan(&self) -> Result<Plan, Failure> {
        let mut plan = Plan::new(self.on_loss).with_start_of_all(self.start_all);
        for node in &self.nodes {
            plan.assign(node.id, node.assignment()?).map_err(Failure::new)?;
        }
        Ok(plan)
    }

    /// A network from a file (TOML).
    pub(super) fn read(path: &Path) -> Result<Self, Failure> {
        let source = read(path)?;
        let wrong = |what: String| Failure::new(format_args!("{}: {what}", path.display()));
        let file: Table = source.text().parse().map_err(|error: toml::de::Error| wrong(error.message().to_owned()))?;
        let mut file = Keys { table: file, whose: "a network" };
        let folder = path.parent().unwrap_or(Path::new(""));
        let network = (|| {
            let nodes = match file.table.remove("node") {
                Some(Toml::Array(nodes)) => nodes.into_iter().map(|node| read_node(node, folder)).collect(),
                _ => Err("it lists no nodes: each is a table [[node]] with an id".to_owned()),
            }?;
            let on_loss = match file.text("on-loss")?.as_deref() {
                None | Some("reset-node") => OnLoss::ResetNode,
                Some("reset-all") => OnLoss::ResetAll,
                Some("stop-all") => OnLoss::StopAll,
                Some(other) => return Err(format!("on-loss is reset-node, reset-all or stop-all, and not {other:?}")),
            };
            let (start_all, boot_time) = (file.flag("start-all")?.unwrap_or(false), file.ms("boot-time")?);
            file.end()?;
            Ok(Network { nodes, on_loss, start_all, boot_time })
        })();
        network.map_err(wrong)
    }
}

fn read_node(node: Toml, folder: &Path) -> Result<Node, String> {
    let Toml::Table(table) = node else { return Err("a node is a table [[node]]".to_owned()) };
    let mut keys = Keys { table, whose: "a node" };
    let id = keys.number("id")?.ok_or("a node has no id")?;
    let mut node = Node::new(node_id(&id.to_string())?);
    let read = |keys: &mut Keys, node: &mut Node| {
        // A file beside this one, else a device that lexican knows.
        node.device = keys.text("device")?.map(|name| {
            let beside = folder.join(&name);
            if beside.is_file() { beside.display().to_string() } else { name }
        });
        node.dcf = keys.text("dcf")?.map(|name| folder.join(name));
        node.settings = keys.texts("settings")?;
        node.heartbeat = keys.ms("heartbeat")?;
        let retry_factor = keys.number("retry")?.map_or(Ok(PATIENCE), u8::try_from);
        let retry_factor = retry_factor.map_err(|_| "retry is 0 to 255".to_owned())?;
        node.guarding = keys.ms("guarding")?.map(|guard_time| Guarding { guard_time, retry_factor });
        if node.guarding.is_some() && node.heartbeat.is_some() {
            return Err("a node has either heartbeat or guarding".to_owned());
        }
        for (key, flag) in [
            ("mandatory", &mut node.mandatory),
            ("start", &mut node.start),
            ("keep-alive", &mut node.keep_alive),
            ("boots-again", &mut node.boots_again),
        ] {
            *flag = keys.flag(key)?.unwrap_or(*flag);
        }
        keys.end()
    };
    read(&mut keys, &mut node).map_err(|error| format!("node {id}: {error}"))?;
    Ok(node)
}

/// A guarding time from the command line.
pub(super) const fn guarding(guard_time: Duration) -> Guarding {
    Guarding { guard_time, retry_factor: PATIENCE }
}

/// The keys of a table that were not read yet.
struct Keys {
    table: Table,
    whose: &'static str,
}

impl Keys {
    fn text(&mut self, key: &str) -> Result<Option<String>, String> {
        match self.table.remove(key) {
            None => Ok(None),
            Some(Toml::String(text)) => Ok(Some(text)),
            Some(other) => Err(format!("{key} is a text in quotes, and not {other}")),
        }
    }

    fn texts(&mut self, key: &str) -> Result<Vec<String>, String> {
        let wrong = || format!("{key} is a list of texts, such as [\"6060 = profile velocity\"]");
        match self.table.remove(key) {
            None => Ok(Vec::new()),
            Some(Toml::Array(texts)) => {
                texts.into_iter().map(|text| text.as_str().map(str::to_owned).ok_or_else(wrong)).collect()
            }
            Some(_) => Err(wrong()),
        }
    }

    fn flag(&mut self, key: &str) -> Result<Option<bool>, String> {
        match self.table.remove(key) {
            None => Ok(None),
            Some(Toml::Boolean(flag)) => Ok(Some(flag)),
            Some(other) => Err(format!("{key} is true or false, and not {other}")),
        }
    }

    fn number(&mut self, key: &str) -> Result<Option<i64>, String> {
        match self.table.remove(key) {
            None => Ok(None),
            Some(Toml::Integer(number)) => Ok(Some(number)),
            Some(other) => Err(format!("{key} is a number, and not {other}")),
        }
    }

    fn ms(&mut self, key: &str) -> Result<Option<Duration>, String> {
        let number = self.number(key)?.map(|ms| crate::duration::milliseconds(&ms.to_string()));
        number.transpose().map_err(|error| format!("{key}: {error}"))
    }

    /// Nothing may be left: a key that is mistyped would be ignored.
    fn end(&self) -> Result<(), String> {
        match self.table.keys().next() {
            None => Ok(()),
            Some(key) => Err(format!("{} has no key {key:?}; `lexican boot --help` lists them", self.whose)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NODE: NodeId = NodeId::literal(5);

    #[test]
    fn a_dcf_switches_pdos_off_first_and_on_last() {
        let sheet = include_str!("../../tests/sensor.eds");
        let value = |text: String, section: &str, value: &str| {
            let section = format!("[{section}]\n");
            assert!(text.contains(&section), "{section}");
            text.replace(&section, &format!("{section}ParameterValue={value}\n"))
        };
        let text = value(sheet.to_owned(), "1800sub1", "$NODEID+0x200");
        let text = value(value(text, "1800sub2", "255"), "1A00sub0", "1");
        let text = value(value(text, "1A00sub1", "0x20010010"), "1000", "7");
        let source = lexican_eds::Source::new("sensor.dcf", text);
        let device = lexican_eds::load(&lexican_eds::Input::new(source)).0;
        let entries = configured(&device, NODE).into_iter().map(|(address, data)| {
            let number = data.iter().rev().fold(0_u64, |number, byte| number << 8 | u64::from(*byte));
            format!("{address} {number:X}")
        });
        assert_eq!(
            entries.collect::<Vec<_>>(),
            ["1800:01 80000205", "1800:02 FF", "1A00:00 0", "1A00:01 20010010", "1A00:00 1", "1800:01 205",],
            "1000h cannot be written"
        );
    }

    #[test]
    fn what_a_file_says_is_what_a_node_gets() {
        let node =
            |keys: &str| -> Result<Node, String> { read_node(Toml::Table(keys.parse().unwrap()), Path::new("folder")) };
        let given = node("id = 5\ndcf = 'a.bin'\nguarding = 100\nmandatory = false\nkeep-alive = true").unwrap();
        assert_eq!((given.id, given.dcf.as_deref()), (NODE, Some(Path::new("folder/a.bin"))));
        assert_eq!(given.guarding, Some(guarding(Duration::from_millis(100))));
        assert_eq!((given.mandatory, given.keep_alive, given.start, given.boots_again), (false, true, true, true));
        for (keys, words) in [
            ("", "has no id"),
            ("id = 128", "node-IDs are 1 to 127"),
            ("id = 5\nhartbeat = 1", "has no key \"hartbeat\""),
            ("id = 5\nheartbeat = 1\nguarding = 1", "either heartbeat or guarding"),
            ("id = 5\nstart = 1", "start is true or false"),
            ("id = 5\nsettings = [1]", "a list of texts"),
            ("id = 5\nheartbeat = -1", "heartbeat: "),
            ("id = 5\nretry = 256\nguarding = 1", "retry is 0 to 255"),
        ] {
            let error = node(keys).err().unwrap_or_default();
            assert!(error.contains(words), "{keys}: {error}");
        }
    }

    #[test]
    fn a_node_is_checked_against_its_data_sheet_and_gets_its_settings() {
        let settings = vec!["6060 = profile velocity".to_owned(), "2412 = 2.5 mm".to_owned()];
        let heartbeat = Some(Duration::from_millis(100));
        let node = Node { device: Some("siko/ag03-1".to_owned()), settings, heartbeat, ..Node::new(NODE) };
        let assignment = node.assignment().unwrap();
        assert_eq!((assignment.plan.vendor, assignment.heartbeat), (Some(0x195), Duration::from_millis(300)));
        let steps: Vec<_> = ConciseDcf::new(&assignment.plan.configuration).map(|step| step.to_string()).collect();
        assert_eq!(steps, ["write 6060:00", "write 2412:00", "write 1017:00"]);
        let wrong = |settings: &str, device: Option<&str>| {
            let settings = vec![settings.to_owned()];
            let node = Node { device: device.map(str::to_owned), settings, ..Node::new(NODE) };
            node.assignment().err().map(|failure| failure.to_string()).unwrap_or_default()
        };
        let drive = Some("siko/ag03-1");
        assert!(wrong("6060 = 2", None).contains("node 5: settings need a data sheet"));
        assert!(wrong("6060", drive).contains("is no OBJECT = VALUE"));
        assert!(wrong("6060 = 300", drive).contains("node 5: 6060:00: 300 is no UNSIGNED8"));
        assert!(wrong("2FFF = 1", drive).contains("the data sheet has no 2FFF:00"));
    }
}
