//! The file of a plant.

use std::io;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

use lexican_eds::{Input, Source};
use lexican_runtime::host::Fate;
use lexican_runtime::{CobId, Duration, NodeId};
use lexican_toolbox::data_sheet::{DataSheet, DataSheetError, beside, find_known, find_shipped};
use lexican_toolbox::text::files::{ReadError, read};
use lexican_toolbox::text::node_id::node_id;
use lexican_toolbox::text::toml_text::{line, parse};
use serde::{Deserialize, Deserializer};
use toml::{Spanned, Table};

use super::error::{Place, PlantError, Problem};
use super::{BIT_RATE_KBIT, Line, Plant, PlantDevice, ScriptText};
use crate::segment::Fault;

/// Where the files are that a plant names.
#[derive(Clone, Copy, Debug)]
pub enum Files<'a> {
    /// In this folder.
    Folder(&'a Path),
    /// In the program: their names and texts.
    Embedded(&'a [(&'a str, &'a str)]),
}

impl Files<'_> {
    fn embedded(&self, name: &Path) -> Option<Source> {
        let Files::Embedded(files) = self else { return None };
        let (name, text) = files.iter().find(|(known, _)| Path::new(known) == name)?;
        Some(Source::new(*name, *text))
    }

    fn read(&self, name: &Path) -> Result<Source, ReadError> {
        match self {
            Files::Folder(folder) => read(&folder.join(name)),
            Files::Embedded(_) => self
                .embedded(name)
                .ok_or_else(|| ReadError { path: name.to_owned(), error: io::ErrorKind::NotFound.into() }),
        }
    }

    /// The path of a file that a device writes.
    fn path(&self, name: &Path) -> PathBuf {
        match self {
            Files::Folder(folder) => folder.join(name),
            Files::Embedded(_) => name.to_owned(),
        }
    }

    /// A data sheet with its overlays, and what it is called.
    fn data_sheet(&self, name: &str, overlays: &[PathBuf]) -> Result<(String, DataSheet), DataSheetError> {
        let (name, (input, library)) = match self {
            Files::Folder(folder) => {
                let name = beside(folder, name);
                let found = find_known(&name)?;
                (name, found)
            }
            Files::Embedded(_) => {
                let found = self.embedded(Path::new(name)).map(|eds| (Input::new(eds), None));
                (name.to_owned(), found.map_or_else(|| find_shipped(name), Ok)?)
            }
        };
        let with = |input: Input, overlay: &PathBuf| Ok::<_, ReadError>(input.overlay(self.read(overlay)?));
        let sheet = DataSheet::new(overlays.iter().try_fold(input, with)?)?;
        Ok((name, DataSheet { library, ..sheet }))
    }
}

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
        Who::Node(node) => node_id(&node.to_string()).map(Some).map_err(|error| error.to_string()),
        Who::Name(none) if none == "none" => Ok(None),
        Who::Name(other) => Err(format!("{other:?} is no node-ID: write a number, or \"none\" for one by LSS")),
    };
    let span = who.span();
    node.map(|node| Spanned::new(span, node)).map_err(serde::de::Error::custom)
}

/// The file that is read.
struct Reader<'a> {
    name: &'a str,
    text: &'a str,
    files: Files<'a>,
}

impl Plant {
    /// Reads a plant from a file (TOML). Its paths are relative to the file.
    pub fn read(path: &Path) -> Result<Self, PlantError> {
        let source = read(path).map_err(|error| PlantError { place: None, problem: Box::new(error.into()) })?;
        let folder = path.parent().unwrap_or(Path::new(""));
        Plant::parse(source.text(), &path.display().to_string(), Files::Folder(folder))
    }

    /// Reads a plant from a text (TOML), which errors call `name`.
    pub fn parse(text: &str, name: &str, files: Files<'_>) -> Result<Self, PlantError> {
        let reader = Reader { name, text, files };
        let table = parse::<PlantTable>(text)
            .map_err(|error| reader.wrong(Some(error.line), None, Problem::Syntax(error.reason)))?;
        if table.nodes.is_empty() {
            return Err(reader.wrong(None, None, Problem::NoDevices));
        }
        let mut devices: Vec<PlantDevice> = Vec::new();
        for node in table.nodes {
            let line = reader.line(&node.id);
            let device = reader.device(node)?;
            let wrong = |problem| Err(reader.wrong(Some(line), None, problem));
            if let Some(node) = device.node.filter(|node| devices.iter().any(|other| other.node == Some(*node))) {
                return wrong(Problem::TwoNodes(node));
            }
            if let Some(name) =
                device.name.as_ref().filter(|name| devices.iter().any(|it| it.name.as_ref() == Some(*name)))
            {
                return wrong(Problem::TwoNames(name.clone()));
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

    fn place(&self, line: Option<usize>, who: Option<&str>) -> Place {
        Place { file: self.name.to_owned(), line, who: who.map(str::to_owned) }
    }

    fn wrong(&self, line: Option<usize>, who: Option<&str>, problem: Problem) -> PlantError {
        PlantError { place: Some(self.place(line, who)), problem: problem.into() }
    }

    fn wrong_at<T>(&self, of: &Spanned<T>, problem: Problem) -> PlantError {
        self.wrong(Some(self.line(of)), None, problem)
    }

    fn device(&self, table: NodeTable) -> Result<PlantDevice, PlantError> {
        let node = *table.id.get_ref();
        let name = table.name.as_ref().map(Spanned::get_ref);
        let who = match (name, node) {
            (Some(name), _) => name.clone(),
            (None, Some(node)) => format!("node {node}"),
            (None, None) => "the device without node-ID".to_owned(),
        };
        let wrong = |line, problem| self.wrong(Some(line), Some(&who), problem);
        if let Some(name) = &table.name
            && (name.get_ref().parse::<i64>().is_ok()
                || name.get_ref().is_empty()
                || name.get_ref().contains([':', '=', ' ']))
        {
            return Err(wrong(self.line(name), Problem::NoName));
        }
        let sheet = self.files.data_sheet(table.device.get_ref(), &table.overlay);
        let (device, sheet) = sheet.map_err(|error| wrong(self.line(&table.device), error.into()))?;
        let lines = |texts: &[Spanned<String>]| {
            let text = |text: &Spanned<String>| Line {
                place: self.place(Some(self.line(text)), Some(&who)),
                text: text.get_ref().clone(),
            };
            texts.iter().map(text).collect()
        };
        let script = match (&table.script, table.steps.as_slice()) {
            (None, []) => None,
            (Some(script), []) => {
                let source = self.files.read(script.get_ref());
                let source = source.map_err(|error| wrong(self.line(script), error.into()))?;
                Some(ScriptText::new(source.name().to_owned(), source.text().to_owned()))
            }
            (None, steps) => {
                let text = steps.iter().map(|step| format!("[[step]]\n{}", step.get_ref())).collect();
                let steps = steps.iter().map(|step| self.line(step)).collect();
                Some(ScriptText { file: self.name.to_owned(), text, steps: Some(steps) })
            }
            (Some(script), _) => return Err(wrong(self.line(script), Problem::ScriptAndSteps)),
        };
        Ok(PlantDevice {
            name: name.cloned(),
            eeprom: table.eeprom.as_ref().map(|path| self.files.path(path)),
            script,
            settings: lines(&table.settings),
            inputs: lines(&table.inputs),
            is_off: table.power == PowerName::Off,
            place: Some(self.place(Some(self.line(&table.id)), Some(&who))),
            ..PlantDevice::new(node, &device, sheet)
        })
    }

    fn fault(&self, table: &FaultTable, devices: &[PlantDevice]) -> Result<Fault, PlantError> {
        let sender = table.from.as_ref().map(|from| {
            let is_meant = |device: &PlantDevice| match from.get_ref() {
                Who::Node(node) => device.node.is_some_and(|id| i64::from(id.get()) == *node),
                Who::Name(name) => device.name.as_ref() == Some(name),
            };
            let unknown = || self.wrong_at(from, Problem::NoSender(from.get_ref().to_string()));
            devices.iter().position(is_meant).ok_or_else(unknown)
        });
        let id = table
            .cob_id
            .as_ref()
            .map(|id| cob_id(*id.get_ref()).ok_or_else(|| self.wrong_at(id, Problem::NoCobId(*id.get_ref()))));
        let wrong = |problem| Err(self.wrong_at(&table.action, problem));
        let fate = match (table.action.get_ref(), table.delay) {
            (ActionName::Delay, None) => return wrong(Problem::NoDelay),
            (ActionName::Delay, Some(ms)) => Fate::Delay(Duration::from_millis(ms.into())),
            (_, Some(_)) => return wrong(Problem::OnlyDelay),
            (ActionName::Lose, None) => Fate::Lose,
            (ActionName::Repeat, None) => Fate::Repeat,
        };
        let [every, in_a_row] = [table.every, table.in_a_row].map(|number| number.map_or(1, NonZeroU32::get));
        if in_a_row > every {
            return wrong(Problem::TooManyInARow);
        }
        Ok(Fault { sender: sender.transpose()?, id: id.transpose()?, every, in_a_row, fate })
    }
}

/// An identifier of 11 bits, or of 29 if it is above them.
fn cob_id(raw: u32) -> Option<CobId> {
    match u16::try_from(raw).ok().and_then(CobId::standard) {
        Some(id) => Some(id),
        None => CobId::extended(raw),
    }
}
