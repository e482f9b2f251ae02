//! The description of a network: from a file, or from the command line.

use std::path::{Path, PathBuf};

use lexican_eds::model::Device;
use lexican_runtime::host::Plan;
use lexican_runtime::manager::{Assignment, Guarding, OnLoss};
use lexican_runtime::object::Address;
use lexican_runtime::procedure::{ConciseDcf, Data, Step};
use lexican_runtime::{Duration, NodeId, cia301};
use serde::Deserialize;
use serde::de::{Deserializer, Error as _};

use crate::bus::node_id;
use crate::device::load;
use crate::output::{Failure, note};
use crate::toml_text::parse;
use lexican_toolbox::data_sheet::beside;
use lexican_toolbox::node::identity::{PRODUCT, VENDOR};
use lexican_toolbox::parameters::LeftOut;
use lexican_toolbox::parameters::order::in_order;
use lexican_toolbox::parameters::restore::{configured, not_restored};
use lexican_toolbox::text::duration::{in_milliseconds, milliseconds};
use lexican_toolbox::text::files::{read, read_up_to};
use lexican_toolbox::values::lookup::resolve;
use lexican_toolbox::values::wire::written;
use lexican_toolbox::values::{DeviceValues, given, resolved};

/// A network, and how long it may take to boot.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Network {
    #[serde(rename = "node", default)]
    pub(super) nodes: Vec<Node>,
    #[serde(with = "OnLossName", default)]
    pub(super) on_loss: OnLoss,
    #[serde(default)]
    pub(super) start_all: bool,
    /// `None`: as on the command line.
    #[serde(default, deserialize_with = "ms")]
    pub(super) boot_time: Option<Duration>,
}

#[derive(Deserialize)]
#[serde(remote = "OnLoss", rename_all = "kebab-case")]
enum OnLossName {
    ResetNode,
    ResetAll,
    StopAll,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Node {
    #[serde(deserialize_with = "id")]
    pub(super) id: NodeId,
    /// A data sheet, or a device that lexican knows. Its identity is checked; a DCF has values to write.
    pub(super) device: Option<String>,
    /// Overlays of its data sheet.
    #[serde(default)]
    pub(super) overlay: Vec<PathBuf>,
    /// A file with a concise DCF.
    pub(super) dcf: Option<PathBuf>,
    /// `6060 = profile velocity`.
    #[serde(default)]
    pub(super) settings: Vec<String>,
    #[serde(default, deserialize_with = "ms")]
    pub(super) heartbeat: Option<Duration>,
    /// The guard time.
    #[serde(default, deserialize_with = "ms")]
    pub(super) guarding: Option<Duration>,
    /// How many responses to guarding may be missing.
    #[serde(default = "retry")]
    pub(super) retry: u8,
    #[serde(default = "yes")]
    pub(super) mandatory: bool,
    #[serde(default = "yes")]
    pub(super) start: bool,
    #[serde(default)]
    pub(super) keep_alive: bool,
    #[serde(default = "yes")]
    pub(super) boots_again: bool,
}

const fn retry() -> u8 {
    PATIENCE
}

const fn yes() -> bool {
    true
}

fn id<'de, D: Deserializer<'de>>(deserializer: D) -> Result<NodeId, D::Error> {
    node_id(&i64::deserialize(deserializer)?.to_string()).map_err(D::Error::custom)
}

/// A time as on the command line, or a number of milliseconds.
fn ms<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Duration>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged, expecting = "expected a time such as \"200ms\", or milliseconds")]
    enum Time {
        Milliseconds(i64),
        WithUnit(String),
    }
    let time = match Time::deserialize(deserializer)? {
        Time::Milliseconds(ms) => milliseconds(&format!("{ms}ms")),
        Time::WithUnit(text) => milliseconds(&text),
    };
    time.map(Some).map_err(D::Error::custom)
}

/// How many heartbeats, or responses to guarding, may be missing.
const PATIENCE: u8 = 3;
/// The most bytes of a concise DCF.
const LONGEST_DCF: usize = 16 * 1024 * 1024;

impl Node {
    /// A mandatory node that is started and booted again.
    pub(super) const fn new(id: NodeId) -> Self {
        Node {
            id,
            device: None,
            overlay: Vec::new(),
            dcf: None,
            settings: Vec::new(),
            heartbeat: None,
            guarding: None,
            retry: PATIENCE,
            mandatory: true,
            start: true,
            keep_alive: false,
            boots_again: true,
        }
    }

    fn assignment(&self) -> Result<Assignment<Vec<u8>>, Failure> {
        if self.guarding.is_some() && self.heartbeat.is_some() {
            return Err(self.wrong("a node has either heartbeat or guarding"));
        }
        if self.device.is_none() && !self.overlay.is_empty() {
            return Err(self.wrong("an overlay adds to a data sheet").help("name the data sheet as its device"));
        }
        let sheet = self.device.as_deref().map(|name| load(name, &self.overlay)).transpose()?;
        let device = sheet.as_ref().map(|sheet| &sheet.device);
        let configuration = self.configuration(device)?;
        let steps = configuration.iter().map(|(address, data)| Step::bytes(*address, data));
        let configuration = ConciseDcf::to_vec(steps).expect("these are writes");
        let mut assignment = Assignment::new(self.id, configuration);
        if let Some(heartbeat) = self.heartbeat {
            assignment = assignment.with_heartbeat(heartbeat.times(PATIENCE.into()));
        }
        if let Some(guard_time) = self.guarding {
            assignment = assignment.with_guarding(Guarding { guard_time, retry_factor: self.retry });
        }
        assignment.mandatory = self.mandatory;
        assignment.boots_again = self.boots_again;
        let plan = &mut assignment.plan;
        (plan.start, plan.keep_alive) = (self.start, self.keep_alive);
        let number = |address: Address| {
            let value = resolved(given(device?.entry(address.index(), address.sub())?)?, self.id).as_integer()?;
            u32::try_from(value).ok().filter(|value| *value != 0)
        };
        plan.device_type = number(Address::new(cia301::DEVICE_TYPE, 0));
        (plan.vendor, plan.product) = (number(VENDOR), number(PRODUCT));
        Ok(assignment)
    }

    /// The entries to write, in this order: the concise DCF, the values of a DCF, the settings, the heartbeat.
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
        let configured = device.map(|device| configured(device, self.id)).unwrap_or_default();
        let left_out = device.map(|device| not_restored(device, self.id)).unwrap_or_default();
        left_out.iter().filter(|(_, reason)| **reason != LeftOut::ReadOnly).for_each(|(address, reason)| {
            note(format_args!("node {}: {address} of the DCF is left out: {}", self.id, reason.words(1)));
        });
        entries.extend(in_order(configured).into_iter().map(|write| (write.address, write.data)));
        for setting in &self.settings {
            entries.push(self.setting(device, setting)?);
        }
        if let Some(heartbeat) = self.heartbeat {
            let ms = u16::try_from(in_milliseconds(heartbeat));
            let ms = ms.map_err(|_| self.wrong(format_args!("a heartbeat of {heartbeat} is beyond 65535 ms")))?;
            if device.is_some_and(|device| device.entry(cia301::PRODUCER_HEARTBEAT_TIME, 0).is_none()) {
                return Err(self.wrong("its data sheet has no heartbeat (1017h)").help("let it be guarded instead"));
            }
            entries.push((Address::new(cia301::PRODUCER_HEARTBEAT_TIME, 0), ms.to_le_bytes().to_vec()));
        }
        Ok(entries.into_iter().map(|(address, data)| (address, written(device, data))).collect())
    }

    fn setting(&self, device: Option<&Device>, setting: &str) -> Result<(Address, Vec<u8>), Failure> {
        let (object, value) =
            setting.split_once('=').ok_or_else(|| self.wrong(format_args!("{setting:?} is no OBJECT = VALUE")))?;
        let device = device.ok_or_else(|| {
            self.wrong("settings need a data sheet, because of their data types").help("name it as its device")
        })?;
        let address = resolve(Some(device), object.trim())?;
        let data = DeviceValues::new(device).encode(address, value.trim()).map_err(|error| self.wrong(error))?;
        Ok((address, data))
    }

    fn wrong(&self, what: impl std::fmt::Display) -> Failure {
        Failure::new(format_args!("node {}: {what}", self.id))
    }
}

impl Network {
    pub(super) fn plan(&self) -> Result<Plan, Failure> {
        let mut plan = Plan::new(self.on_loss).with_start_of_all(self.start_all);
        for node in &self.nodes {
            plan.assign(node.id, node.assignment()?).map_err(Failure::new)?;
        }
        Ok(plan)
    }

    /// Reads a network from a file (TOML). Its paths are relative to the file.
    pub(super) fn read(path: &Path) -> Result<Self, Failure> {
        let source = read(path)?;
        let mut network = parse::<Network>(source.text())
            .map_err(|error| Failure::new(format_args!("{}{error}", path.display())).help(HELP))?;
        if network.nodes.is_empty() {
            let failure = Failure::new(format_args!("{}: it lists no nodes", path.display()));
            return Err(failure.help("each node is a table [[node]] with an id; `lexican boot --help` shows one"));
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        for node in &mut network.nodes {
            node.dcf = node.dcf.take().map(|dcf| folder.join(dcf));
            node.overlay.iter_mut().for_each(|overlay| *overlay = folder.join(&*overlay));
            node.device = node.device.take().map(|name| beside(folder, &name));
        }
        Ok(network)
    }
}

const HELP: &str = "`lexican boot --help` lists the keys";

#[cfg(test)]
mod tests {
    use super::*;

    const NODE: NodeId = NodeId::literal(5);

    #[test]
    fn a_node_has_the_keys_of_its_file() {
        let given =
            parse::<Node>("id = 5\ndcf = 'a.bin'\nguarding = 100\nmandatory = false\nkeep-alive = true").unwrap();
        assert_eq!((given.id, given.dcf.as_deref()), (NODE, Some(Path::new("a.bin"))));
        assert_eq!((given.guarding, given.retry), (Some(Duration::from_millis(100)), 3));
        assert_eq!((given.mandatory, given.keep_alive, given.start, given.boots_again), (false, true, true, true));
        for (keys, words) in [
            ("", ": missing field `id`"),
            ("id = 128", ":1: 128 is not a node-ID: node-IDs are 1 to 127"),
            ("id = 5\nhartbeat = 1", ":2: unknown field `hartbeat`, expected one of `id`, `device`"),
            ("id = 5\nstart = 1", ":2: invalid type: integer `1`, expected a boolean"),
            ("id = 5\nsettings = [1]", ":2: invalid type: integer `1`, expected a string"),
            ("id = 5\nheartbeat = -1", ":2: \"-1ms\" is not a time"),
            ("id = 5\nheartbeat = '200'", ":2: 200 of what? write 200ms, 200s or 200min"),
            ("id = 5\nguarding = '0.5ms'", ":2: 0.5ms is not a time of whole milliseconds"),
            ("id = 5\nheartbeat = 0.2", ":2: expected a time such as \"200ms\", or milliseconds"),
            ("id = 5\nretry = 256\nguarding = 1", ":2: invalid value: integer `256`, expected u8"),
        ] {
            let error = parse::<Node>(keys).err().unwrap_or_default();
            assert!(error.contains(words), "{keys}: {error}");
        }
        let both = parse::<Node>("id = 5\nheartbeat = 1\nguarding = 1").unwrap().assignment().unwrap_err();
        assert_eq!(both.to_string(), "node 5: a node has either heartbeat or guarding");
        for time in ["5", "'5ms'", "'0.005s'"] {
            let file = format!("on-loss = 'stop-all'\nboot-time = {time}\n[[node]]\nid = 5\nheartbeat = {time}");
            let network = parse::<Network>(&file).unwrap();
            let five = Some(Duration::from_millis(5));
            assert_eq!((network.on_loss, network.boot_time, network.nodes[0].heartbeat), (OnLoss::StopAll, five, five));
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
