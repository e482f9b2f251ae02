//! The keys of the file. Editors show the documentation here, which is in the JSON Schema.

use std::collections::BTreeMap;
use std::path::PathBuf;

use lexican_runtime::manager::OnLoss;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::at::{At, BitRate, Id, Protection, Time, Transmission, Written, spelling};
use crate::model::Identity;

/// A CANopen machine: its bus and its nodes, how values go from one to another, and how it is simulated.
#[derive(JsonSchema)]
#[schemars(deny_unknown_fields, rename_all = "kebab-case")]
#[expect(dead_code, reason = "the sections are read one by one, so that each mistake is found")]
pub(crate) struct File {
    #[schemars(default)]
    machine: About,
    #[schemars(default)]
    bus: Buses,
    /// The nodes by their names.
    #[schemars(default)]
    node: BTreeMap<String, Node>,
    /// Kinds of nodes, by name: what several nodes have in common. A node of a kind gives only what is its own.
    #[schemars(default)]
    kind: BTreeMap<String, Node>,
    /// Values that go from an object of a node, or the manager, to objects of other nodes, or to the manager. PDOs are
    /// planned for them.
    #[schemars(default)]
    wire: BTreeMap<String, Wire>,
    /// How nodes are simulated, by their names. A real machine does not need this.
    #[schemars(default)]
    simulate: BTreeMap<String, Simulated>,
    /// What goes wrong between simulated nodes.
    #[schemars(default)]
    fault: Vec<Fault>,
    /// What the bench shows from the beginning.
    #[schemars(default)]
    bench: Bench,
}

/// What the machine is called.
#[derive(Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub(crate) struct About {
    /// Its name.
    pub(crate) name: Option<String>,
    /// What it is, in a sentence.
    pub(crate) note: Option<String>,
}

/// The bus of the machine; or its buses by their names, [bus.NAME].
#[derive(JsonSchema)]
#[schemars(untagged)]
#[expect(dead_code, reason = "it is the shape of the section for editors")]
enum Buses {
    One(Box<Bus>),
    Several(BTreeMap<String, Bus>),
}

impl Default for Buses {
    fn default() -> Self {
        Buses::One(Box::default())
    }
}

/// A bus, its manager, and how it boots (CiA 302-2).
#[derive(Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub(crate) struct Bus {
    /// The bus as `--bus` takes it: "can0", "slcan:/dev/ttyACM0". `--bus sim` simulates the machine instead.
    pub(crate) url: Option<At<String>>,
    /// Its reference designator in drawings (NetRefd of CiA 306).
    pub(crate) designator: Option<String>,
    /// Its bit rate.
    pub(crate) bit_rate: Option<At<BitRate>>,
    /// The node-ID of the manager. It has to have one when nodes watch its heartbeat.
    pub(crate) manager: Option<At<Id>>,
    /// The period of SYNC (1006h).
    pub(crate) sync: Option<At<Time>>,
    /// The period of TIME, by which nodes with a clock get the time of day.
    pub(crate) time: Option<At<Time>>,
    /// The heartbeat of the manager, which the nodes watch (1016h).
    pub(crate) heartbeat: Option<At<Time>>,
    /// The time within which the mandatory nodes must boot (1F89h).
    pub(crate) boot_time: Option<At<Time>>,
    /// What happens when a mandatory node is lost (1F80h).
    #[serde(deserialize_with = "OnLossName::deserialize")]
    #[schemars(with = "OnLossName")]
    pub(crate) on_loss: OnLoss,
    /// Start all nodes by one command, when all mandatory ones can be started (1F80h).
    pub(crate) start_all: bool,
}

/// What happens when a mandatory node is lost.
#[derive(Deserialize, JsonSchema)]
#[serde(remote = "OnLoss", rename_all = "kebab-case")]
enum OnLossName {
    /// The node is reset and booted again.
    ResetNode,
    /// All nodes are reset and booted again.
    ResetAll,
    /// All nodes are stopped.
    StopAll,
}

/// A node.
#[derive(Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub(crate) struct Node {
    /// Its node-ID, 1 to 127; or "none", for a device that gets one by LSS.
    pub(crate) id: Option<At<Id>>,
    /// Its reference designator in drawings (NodeRefd of CiA 306): "-A3".
    pub(crate) designator: Option<String>,
    /// The name of its bus, if the machine has several.
    pub(crate) bus: Option<At<String>>,
    /// Its kind.
    kind: Option<At<String>>,
    /// Its data sheet: an EDS, DCF, XDD or XDC file, or a device that lexican knows. A DCF has values that are written.
    pub(crate) sheet: Option<At<String>>,
    /// Corrections and meanings in addition to the data sheet (TOML files).
    pub(crate) overlay: Vec<At<PathBuf>>,
    /// The identity that it must have (1018h), where the data sheet does not say it.
    pub(crate) identity: Identity,
    /// It gets its node-ID by LSS when the machine boots (CiA 305): the device with this identity, of which all four numbers
    /// are given.
    pub(crate) lss: Option<At<bool>>,
    /// Its software version must be this one (100Ah).
    pub(crate) software: Option<String>,
    /// The machine runs without it, too.
    pub(crate) optional: bool,
    /// Its heartbeat (1017h). It is lost when three in a row are missing.
    pub(crate) heartbeat: Option<At<Time>>,
    /// The guard time, for a node without heartbeat.
    pub(crate) guarding: Option<At<Time>>,
    /// How many answers to guarding may be missing; three if it is not given.
    pub(crate) retry: Option<u8>,
    /// The time within which it notices that its manager is gone (1016h), by default three heartbeats of the manager; "none"
    /// for a drive that need not.
    pub(crate) protection: Option<At<Protection>>,
    /// Whether it is started; true if it is not given.
    pub(crate) start: Option<bool>,
    /// It is not reset while it is OPERATIONAL.
    pub(crate) keep_alive: bool,
    /// Whether it is booted again after it was lost; true if it is not given.
    pub(crate) boots_again: Option<bool>,
    /// A concise DCF (1F22h), written before all else.
    pub(crate) dcf: Option<At<PathBuf>>,
    /// Its parameters: objects by name or address, values with their units.
    pub(crate) settings: BTreeMap<At<String>, At<Written>>,
    /// Limits that are narrower than those of the data sheet: objects by name or address, the lowest and the highest value
    /// with their units. Nothing beyond them is written by any command.
    pub(crate) limits: BTreeMap<At<String>, At<[Written; 2]>>,
    /// PDOs that it sends, by number: objects in their order, "off", or a table.
    pub(crate) tpdo: BTreeMap<At<String>, At<Pdo>>,
    /// PDOs that it receives, by number.
    pub(crate) rpdo: BTreeMap<At<String>, At<Pdo>>,
}

/// A table, or its short form: one object or several; "off" for a PDO, "manager" for a wire.
#[derive(JsonSchema)]
#[schemars(untagged)]
#[expect(dead_code, reason = "it is the shape for editors")]
enum ShortOr<T> {
    Text(String),
    List(Vec<String>),
    Table(T),
}

/// A PDO: a table, or its short form.
#[derive(Default, JsonSchema)]
#[schemars(with = "ShortOr<PdoTable>")]
pub(crate) struct Pdo {
    pub(crate) is_off: bool,
    pub(crate) table: PdoTable,
}

/// A PDO.
#[derive(Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub(crate) struct PdoTable {
    /// The objects in their order; those of the data sheet if they are not given.
    pub(crate) map: Option<Vec<At<String>>>,
    /// Its COB-ID; that of the data sheet, or of the predefined connection set, if it is not given.
    pub(crate) cob_id: Option<At<u32>>,
    /// When it is sent or takes effect.
    pub(crate) transmission: Option<At<Transmission>>,
    /// The least time between two of them.
    pub(crate) inhibit: Option<At<Time>>,
    /// The most time between two of them (the event timer); of a PDO that is received, its deadline.
    pub(crate) every: Option<At<Time>>,
}

spelling!(Pdo, "\"off\", a list of objects, or a table",
    text: |text| match text {
        "off" => Ok(Pdo { is_off: true, ..Pdo::default() }),
        other => Err(format!("{other:?} is neither \"off\" nor a list: write [{other:?}]")),
    },
    list: |map| Pdo { is_off: false, table: PdoTable { map: Some(map), ..PdoTable::default() } },
    table: |table| Pdo { is_off: false, table });

/// Where a value goes, and when.
#[derive(JsonSchema)]
#[schemars(with = "ShortOr<WireTable>")]
pub(crate) struct Wire(pub(crate) WireTable);

/// Where a value goes, and when.
#[derive(Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub(crate) struct WireTable {
    /// "manager", or NODE.OBJECT.
    pub(crate) to: Vec<At<String>>,
    /// When it is sent: "event", "sync", "sync 4".
    pub(crate) transmission: Option<At<Transmission>>,
    /// The most time between two of them.
    pub(crate) every: Option<At<Time>>,
    /// The least time between two of them.
    pub(crate) inhibit: Option<At<Time>>,
}

spelling!(Wire, "where the value goes: \"manager\", \"NODE.OBJECT\", a list of these, or a table",
    text: |text| Ok(Wire(WireTable { to: vec![At { value: text.to_owned(), span: 0..0 }], ..WireTable::default() })),
    list: |to| Wire(WireTable { to, ..WireTable::default() }),
    table: Wire);

/// What the bench shows from the beginning: objects as NODE.OBJECT, or the PDOs of a node, NODE.tpdo1.
#[derive(Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub(crate) struct Bench {
    /// Objects whose values are watched.
    pub(crate) watch: Vec<At<String>>,
    /// Objects, and PDOs, of which curves are drawn.
    pub(crate) plot: Vec<At<String>>,
    /// How often objects are read.
    pub(crate) every: Option<At<Time>>,
    /// The files of sequences that it plays.
    pub(crate) sequences: Vec<At<PathBuf>>,
    /// Messages to send, by name: each a line of a sequence, such as "nmt start feeder".
    pub(crate) messages: BTreeMap<String, String>,
    /// Filters of its trace, by name.
    pub(crate) filters: BTreeMap<String, At<Filter>>,
}

/// Which frames of a trace are shown, in the words of `lexican monitor`'s options.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct Filter {
    /// Those of these nodes: "feeder, 7".
    pub nodes: String,
    /// Only these services: "sdo, emcy".
    pub services: String,
    /// All but these: "sync, heartbeat".
    pub without: String,
    /// Only those with this object: "statusword", "6041".
    pub object: String,
    /// Only these COB-IDs: "180-1FF".
    pub ids: String,
    /// Only lines with this text.
    pub text: String,
    /// Only those that report an error.
    pub alarming: bool,
    /// SDO transfers as one line each.
    pub transfers: bool,
}

/// How a node is simulated.
#[derive(Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub(crate) struct Simulated {
    /// What it has before it boots for the first time: objects by name or address, values with their units.
    pub(crate) settings: BTreeMap<At<String>, At<Written>>,
    /// Inputs of a drive, as `lexican simulate` takes them on stdin: "blocked = true".
    pub(crate) inputs: Vec<At<String>>,
    /// The file for what it stores.
    pub(crate) eeprom: Option<PathBuf>,
    /// A script of events for a drive.
    pub(crate) script: Option<At<PathBuf>>,
    /// The steps of a script.
    #[schemars(with = "Vec<BTreeMap<String, serde_json::Value>>")]
    pub(crate) step: Vec<At<toml::Table>>,
    /// Whether it is switched on.
    pub(crate) power: Power,
}

/// Whether a node is switched on.
#[derive(Clone, Copy, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Power {
    /// Switched on.
    #[default]
    On,
    /// Switched off.
    Off,
}

/// What goes wrong between simulated nodes.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(crate) struct Fault {
    /// What happens to the frames.
    pub(crate) action: At<Action>,
    /// Only those that this node sends.
    pub(crate) from: Option<At<String>>,
    /// Only those with this identifier.
    pub(crate) cob_id: Option<At<u32>>,
    /// Every nth of them.
    pub(crate) every: Option<std::num::NonZeroU32>,
    /// How many in a row.
    pub(crate) in_a_row: Option<std::num::NonZeroU32>,
    /// By how much they are delayed.
    pub(crate) delay: Option<At<Time>>,
}

/// What happens to frames.
#[derive(Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Action {
    /// They are lost.
    Lose,
    /// They come twice.
    Repeat,
    /// They come later.
    Delay,
}
