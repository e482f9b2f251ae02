//! The file of a plant.

use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

use lexican_runtime::{CobId, Duration, NodeId};
use serde::{Deserialize, Deserializer};
use toml::{Spanned, Table};

use super::segment::{Action, Fault};
use super::{BIT_RATE_KBIT, Line, Plant, PlantDevice, ScriptText};
use crate::bus::node_id::node_id;
use crate::device::{Loaded, beside, input, read as read_text, with_overlays};
use crate::output::Failure;
use crate::toml_text::{line, parse};

const HELP: &str = "`lexican simulate --help` shows a plant";

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct PlantTable {
    /// In kbit/s.
    bit_rate: Option<NonZeroU32>,
    #[serde(rename = "node", default)]
    nodes: Vec<NodeTable>,
    #[serde(rename = "fault", default)]
    faults: Vec<FaultTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct NodeTable {
    /// None for a device that gets one by LSS.
    #[serde(deserialize_with = "id")]
    id: Spanned<Option<NodeId>>,
    name: Option<Spanned<String>>,
    /// A data sheet, or a device that lexican knows.
    device: Spanned<String>,
    #[serde(default)]
    overlay: Vec<PathBuf>,
    #[serde(default)]
    settings: Vec<Spanned<String>>,
    #[serde(default)]
    inputs: Vec<Spanned<String>>,
    eeprom: Option<PathBuf>,
    script: Option<Spanned<PathBuf>>,
    /// The steps of a script.
    #[serde(rename = "step", default)]
    steps: Vec<Spanned<Table>>,
    #[serde(default)]
    power: PowerName,
}

#[derive(Default, Deserialize, PartialEq)]
#[serde(rename_all = "kebab-case")]
enum PowerName {
    #[default]
    On,
    Off,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct FaultTable {
    action: Spanned<ActionName>,
    /// A node-ID or a name.
    from: Option<Spanned<Who>>,
    cob_id: Option<Spanned<u32>>,
    every: Option<NonZeroU32>,
    /// How many are lost, repeated or delayed one after another.
    in_a_row: Option<NonZeroU32>,
    /// In ms.
    delay: Option<u32>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum ActionName {
    Lose,
    Repeat,
    Delay,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Who {
    Node(i64),
    Name(String),
}

impl std::fmt::Display for Who {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Who::Node(node) => write!(f, "node {node}"),
            Who::Name(name) => write!(f, "{name:?}"),
        }
    }
}

fn id<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Spanned<Option<NodeId>>, D::Error> {
    let who = Spanned::<Who>::deserialize(deserializer)?;
    let node = match who.get_ref() {
        Who::Node(node) => node_id(&node.to_string()).map(Some),
        Who::Name(none) if none == "none" => Ok(None),
        Who::Name(other) => Err(format!("{other:?} is no node-ID: write a number, or \"none\" for one by LSS")),
    };
    let span = who.span();
    node.map(|node| Spanned::new(span, node)).map_err(serde::de::Error::custom)
}

/// The file that is read.
struct Reader<'a> {
    path: &'a Path,
    text: &'a str,
}

impl Plant {
    /// Reads a plant from a file (TOML). Its paths are relative to the file.
    pub(crate) fn read(path: &Path) -> Result<Self, Failure> {
        let source = read_text(path)?;
        let table = parse::<PlantTable>(source.text())
            .map_err(|error| Failure::new(format_args!("{}{error}", path.display())).help(HELP))?;
        let reader = Reader { path, text: source.text() };
        if table.nodes.is_empty() {
            let failure = Failure::new(format_args!("{}: it has no devices", path.display()));
            return Err(failure.help(format!("each one is a table [[node]] with id and device; {HELP}")));
        }
        let mut devices: Vec<PlantDevice> = Vec::new();
        for node in table.nodes {
            let at = reader.place(&node.id);
            let device = reader.device(node)?;
            if let Some(node) = device.node.filter(|node| devices.iter().any(|other| other.node == Some(*node))) {
                return Err(Failure::new(format_args!("{at}: there are two devices with node-ID {node}")));
            }
            if let Some(name) =
                device.name.as_ref().filter(|name| devices.iter().any(|it| it.name.as_ref() == Some(*name)))
            {
                return Err(Failure::new(format_args!("{at}: there are two devices with the name {name:?}")));
            }
            devices.push(device);
        }
        let faults = table.faults.iter().map(|fault| reader.fault(fault, &devices)).collect::<Result<_, _>>()?;
        let bit_rate_kbit = table.bit_rate.map_or(BIT_RATE_KBIT, NonZeroU32::get);
        Ok(Plant { bit_rate_kbit, devices, faults })
    }
}

impl Reader<'_> {
    fn line<T>(&self, of: &Spanned<T>) -> usize {
        line(self.text, of.span().start)
    }

    /// `plant.toml:7`.
    fn place<T>(&self, of: &Spanned<T>) -> String {
        format!("{}:{}", self.path.display(), self.line(of))
    }

    fn device(&self, table: NodeTable) -> Result<PlantDevice, Failure> {
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let node = *table.id.get_ref();
        let name = table.name.as_ref().map(Spanned::get_ref);
        let who = match (name, node) {
            (Some(name), _) => name.clone(),
            (None, Some(node)) => format!("node {node}"),
            (None, None) => "the device without node-ID".to_owned(),
        };
        let wrong =
            |place: String, reason: &dyn std::fmt::Display| Failure::new(format_args!("{place}: {who}: {reason}"));
        if let Some(name) = &table.name
            && (name.get_ref().parse::<i64>().is_ok()
                || name.get_ref().is_empty()
                || name.get_ref().contains([':', '=', ' ']))
        {
            let failure = wrong(self.place(name), &"this cannot be the name of a device");
            return Err(failure.help("a name begins the lines on stdin: it is a word, and no number"));
        }
        let device = beside(folder, table.device.get_ref());
        let overlays: Vec<PathBuf> = table.overlay.iter().map(|overlay| folder.join(overlay)).collect();
        let loaded = input(&device).and_then(|input| Loaded::with_warning(with_overlays(input, &overlays)?));
        let loaded = loaded.map_err(|failure| failure.at(&format!("{}: {who}", self.place(&table.device))))?;
        let lines = |texts: &[Spanned<String>]| {
            let text = |text: &Spanned<String>| Line {
                place: format!("{}: {who}", self.place(text)),
                text: text.get_ref().clone(),
            };
            texts.iter().map(text).collect()
        };
        let script = match (&table.script, table.steps.as_slice()) {
            (None, []) => None,
            (Some(script), []) => {
                let path = folder.join(script.get_ref());
                let source =
                    read_text(&path).map_err(|failure| failure.at(&format!("{}: {who}", self.place(script))))?;
                let (file, text) = (path.display().to_string(), source.text().to_owned());
                Some(ScriptText { file, text, steps: None })
            }
            (None, steps) => {
                let text = steps.iter().map(|step| format!("[[step]]\n{}", step.get_ref())).collect();
                let steps = steps.iter().map(|step| self.line(step)).collect();
                Some(ScriptText { file: self.path.display().to_string(), text, steps: Some(steps) })
            }
            (Some(script), _) => {
                return Err(wrong(self.place(script), &"it has either a script or steps"));
            }
        };
        Ok(PlantDevice {
            name: name.cloned(),
            eeprom: table.eeprom.as_ref().map(|path| folder.join(path)),
            script,
            settings: lines(&table.settings),
            inputs: lines(&table.inputs),
            is_off: table.power == PowerName::Off,
            ..PlantDevice::new(node, &device, loaded)
        })
    }

    fn fault(&self, table: &FaultTable, devices: &[PlantDevice]) -> Result<Fault, Failure> {
        let sender = table.from.as_ref().map(|from| {
            let is_meant = |device: &PlantDevice| match from.get_ref() {
                Who::Node(node) => device.node.is_some_and(|id| i64::from(id.get()) == *node),
                Who::Name(name) => device.name.as_ref() == Some(name),
            };
            devices.iter().position(is_meant).ok_or_else(|| {
                Failure::new(format_args!("{}: {} is none of the devices", self.place(from), from.get_ref()))
            })
        });
        let id = table.cob_id.as_ref().map(|id| {
            let wrong = || Failure::new(format_args!("{}: {:X}h is no COB-ID", self.place(id), id.get_ref()));
            cob_id(*id.get_ref()).ok_or_else(wrong)
        });
        let wrong = |reason| Err(Failure::new(format_args!("{}: {reason}", self.place(&table.action))));
        let action = match (table.action.get_ref(), table.delay) {
            (ActionName::Delay, None) => return wrong("a delay needs its time in ms: delay = 20"),
            (ActionName::Delay, Some(ms)) => Action::Delay(Duration::from_millis(ms.into())),
            (_, Some(_)) => return wrong("the time of a delay belongs to action = \"delay\""),
            (ActionName::Lose, None) => Action::Lose,
            (ActionName::Repeat, None) => Action::Repeat,
        };
        let [every, in_a_row] = [table.every, table.in_a_row].map(|number| number.map_or(1, NonZeroU32::get));
        if in_a_row > every {
            return wrong("there cannot be more in a row than there are frames: in-a-row is at most every");
        }
        Ok(Fault { sender: sender.transpose()?, id: id.transpose()?, every, in_a_row, action })
    }
}

/// An identifier of 11 bits, or of 29 if it is above them.
fn cob_id(raw: u32) -> Option<CobId> {
    match u16::try_from(raw).ok().and_then(CobId::standard) {
        Some(id) => Some(id),
        None => CobId::extended(raw),
    }
}
