//! CAN databases (DBC, read by Vector's tools and Python's cantools): the PDOs of nodes by the mapping in data sheet or
//! DCF, and the services of CiA 301.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use lexican_eds::cia301;
use lexican_eds::model::{Device, Direction, Entry, Meaning, Pdo, Value};
use lexican_eds::standard::{self, Numbers};
use lexican_eds::text::Encoding;
use lexican_eds::types::{Class, DataType};
use lexican_runtime::NodeId;
use lexican_runtime::cia301::connection;
use lexican_runtime::object::Address;

use crate::values::{DeviceValues, given, name, resolved};

/// A node of a CAN database.
#[derive(Clone, Debug)]
pub struct Node<'a> {
    name: String,
    id: NodeId,
    device: &'a Device,
}

impl<'a> Node<'a> {
    /// A node named after its node-ID.
    #[must_use]
    pub fn new(id: NodeId, device: &'a Device) -> Self {
        Node { name: format!("Node{}", id.get()), id, device }
    }

    /// A node with this name.
    #[must_use]
    pub fn named(name: &str, id: NodeId, device: &'a Device) -> Self {
        Node { name: identifier_of(name), id, device }
    }
}

/// A CAN database, ready to be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Database {
    text: String,
    /// Messages that are left out because another one has the same identifier.
    pub left_out: Vec<String>,
}

impl Database {
    /// The database of these nodes. PDOs that are disabled or map nothing are left out. A PDO that one node sends and
    /// another one receives is one message of the sender.
    #[must_use]
    pub fn new(nodes: &[Node<'_>]) -> Self {
        let mut messages = network(nodes);
        for node in nodes {
            messages.extend(pdos(node));
            messages.extend(services(node));
        }
        // Senders first: a node may receive from one that comes later.
        let (sent, received): (Vec<_>, Vec<_>) =
            messages.into_iter().enumerate().partition(|(_, it)| it.taker.is_none());
        let mut messages: Vec<(usize, Message)> = Vec::new();
        let mut left_out = Vec::new();
        for (at, message) in sent.into_iter().chain(received) {
            match (messages.iter_mut().find(|(_, other)| other.id == message.id), &message.taker) {
                (None, _) => messages.push((at, message)),
                (Some((_, other)), Some(taker)) if other.taker.is_none() => other.is_taken_by(taker, &message),
                (Some(_), _) => left_out.push(message.name),
            }
        }
        messages.sort_by_key(|(at, _)| *at);
        let messages: Vec<Message> = messages.into_iter().map(|(_, message)| message).collect();
        Self { text: text(nodes, &messages), left_out }
    }

    /// The file in code page 1252, as readers expect. Other characters become question marks.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let encoded = |letter: char| Encoding::Windows1252.encode(letter.encode_utf8(&mut [0; 4]));
        self.text.chars().flat_map(|letter| encoded(letter).unwrap_or_else(|| b"?".to_vec())).collect()
    }
}

/// A message: all frames with one COB-ID.
struct Message {
    /// Bit 31 is set for a 29-bit identifier.
    id: u32,
    name: String,
    bytes: u8,
    sender: String,
    /// For an RPDO, the node that receives it.
    taker: Option<String>,
    comment: String,
    cycle_ms: Option<i128>,
    signals: Vec<Signal>,
}

impl Message {
    /// Adds a receiver to the signals that its PDO maps to objects.
    fn is_taken_by(&mut self, taker: &str, pdo: &Message) {
        for signal in &mut self.signals {
            let end = signal.start + u16::from(signal.bits);
            if pdo.signals.iter().any(|it| it.start < end && signal.start < it.start + u16::from(it.bits)) {
                signal.receiver += &format!(",{taker}");
            }
        }
    }
}

/// A part of a message, little-endian.
#[derive(Default)]
struct Signal {
    name: String,
    start: u16,
    bits: u8,
    signed: bool,
    /// 1 for REAL32, 2 for REAL64, else 0.
    real: u8,
    factor: f64,
    range: [f64; 2],
    unit: String,
    receiver: String,
    comment: String,
    values: Vec<(i128, String)>,
}

/// The sender of what devices receive.
const MANAGER: &str = "Manager";

/// NMT and SYNC.
fn network(nodes: &[Node<'_>]) -> Vec<Message> {
    let receivers = nodes.iter().map(|node| node.name.as_str()).collect::<Vec<_>>().join(",");
    let commands =
        [(1, "start"), (2, "stop"), (128, "enter pre-operational"), (129, "reset node"), (130, "reset communication")];
    let signals = vec![
        Signal { values: named(&commands), ..unsigned("Command", 0, 8) },
        Signal { values: named(&[(0, "all nodes")]), ..unsigned("Node", 8, 8) },
    ];
    let signals = received_by(&receivers, signals);
    let mut messages =
        vec![Message { signals, ..manager(0, "NMT".to_owned(), 2, "NMT: a command to a node, or to all") }];
    // Bit 31 is not used in 1005h.
    let sync = |node: &Node<'_>| {
        let cob_id = given(node.device.entry(cia301::COB_ID_SYNC, 0)?)?.as_integer()?;
        identifier(cob_id & !i128::from(cia301::INVALID))
    };
    messages.extend(nodes.iter().find_map(sync).map(|id| manager(id, "SYNC".to_owned(), 0, "SYNC")));
    messages
}

/// EMCY, SDO and error control.
fn services(&Node { ref name, id: node, device }: &Node<'_>) -> Vec<Message> {
    let of_node = |id: u16, what: &str, bytes, comment: &str| Message {
        sender: name.clone(),
        ..manager(u32::from(id) + u32::from(node.get()), format!("{name}_{what}"), bytes, comment)
    };
    let held = |index, sub| given(device.entry(index, sub)?).map(|value| resolved(value, node))?.as_integer();
    let sdo = || {
        vec![
            Signal {
                comment: "The lowest byte is the command specifier (CiA 301, 7.2.4.3)".to_owned(),
                ..unsigned("Command", 0, 8)
            },
            unsigned("Index", 8, 16),
            unsigned("Sub_index", 24, 8),
            unsigned("Data", 32, 32),
        ]
    };
    let states = [(0, "boot-up"), (4, "stopped"), (5, "operational"), (127, "pre-operational")];
    let emcy = vec![
        unsigned("Error_code", 0, 16),
        unsigned("Error_register", 16, 8),
        unsigned("Manufacturer_specific", 24, 40),
    ];
    let heartbeat = vec![Signal { values: named(&states), ..unsigned("State", 0, 7) }, unsigned("Toggle", 7, 1)];
    let mut messages = Vec::new();
    // A device without 1014h, or with bit 31 set in it, sends no EMCY.
    let predefined = i128::from(connection::EMCY) + i128::from(node.get());
    let emergencies = device.object(cia301::COB_ID_EMCY).map(|_| held(cia301::COB_ID_EMCY, 0).unwrap_or(predefined));
    if let Some(id) = emergencies.and_then(identifier) {
        messages.push(Message { id, signals: emcy, ..of_node(0, "EMCY", 8, "Emergency") });
    }
    let request = of_node(connection::SDO_REQUEST, "SDO_request", 8, "Request to the SDO server");
    messages.push(Message { signals: received_by(name, sdo()), sender: MANAGER.to_owned(), ..request });
    messages.push(Message {
        signals: sdo(),
        ..of_node(connection::SDO_RESPONSE, "SDO_response", 8, "Response of the SDO server")
    });
    messages.push(Message {
        signals: heartbeat,
        cycle_ms: held(cia301::PRODUCER_HEARTBEAT_TIME, 0).filter(|&ms| ms > 0),
        ..of_node(connection::ERROR_CONTROL, "Heartbeat", 1, "Heartbeat, boot-up or the response to guarding")
    });
    messages
}

fn pdos<'a>(&Node { ref name, id: node, device }: &'a Node<'_>) -> impl Iterator<Item = Message> + 'a {
    device.pdos.iter().filter_map(move |pdo| {
        let id = identifier(resolved(pdo.cob_id.as_ref()?, node).as_integer()?)?;
        let receiver = if pdo.direction == Direction::Receive { name } else { MANAGER };
        let signals = signals(device, receiver, pdo);
        if signals.is_empty() {
            return None;
        }
        let (what, sender, taker) = match pdo.direction {
            Direction::Receive => ("RPDO", MANAGER, Some(name.clone())),
            Direction::Transmit => ("TPDO", name.as_str(), None),
        };
        let bits: u32 = pdo.mapping.iter().map(|mapped| u32::from(mapped.bits)).sum();
        let timer = device.entry(pdo.direction.communication_parameter(pdo.number), 5).and_then(given);
        let timer = timer.filter(|_| pdo.direction == Direction::Transmit).and_then(Value::as_integer);
        Some(Message {
            signals,
            sender: sender.to_owned(),
            taker,
            cycle_ms: timer.filter(|&ms| ms > 0),
            ..manager(
                id,
                format!("{name}_{what}{}", pdo.number),
                bits.div_ceil(8).min(8) as u8,
                &format!("{what} {}", pdo.number),
            )
        })
    })
}

/// The signals of a PDO; dummy entries are gaps.
fn signals(device: &Device, receiver: &str, pdo: &Pdo) -> Vec<Signal> {
    let mut start = 0;
    let mut names = BTreeSet::new();
    let mut signals = Vec::new();
    for mapped in &pdo.mapping {
        let entry = device.entry(mapped.index, mapped.sub);
        let end = start + u16::from(mapped.bits);
        if (0x1000..).contains(&mapped.index) && mapped.bits > 0 && end <= 64 {
            let address = Address::new(mapped.index, mapped.sub);
            let long = entry.map_or_else(|| format!("Object {address}"), |entry| name(device, entry));
            let mut signal = Signal {
                start,
                bits: mapped.bits,
                receiver: receiver.to_owned(),
                ..unsigned(&identifier_of(&long), 0, 0)
            };
            if !names.insert(signal.name.clone()) {
                signal.name = identifier_of(&format!("{:.23}_{:04X}_{:02X}", signal.name, mapped.index, mapped.sub));
                names.insert(signal.name.clone());
            }
            signal.comment = format!("{address} {long}");
            if let Some(entry) = entry {
                describe(device, entry, &mut signal);
            }
            signals.push(signal);
        }
        start = end;
    }
    signals
}

/// Sets type, scaling, limits and names of a value.
fn describe(device: &Device, entry: &Entry, signal: &mut Signal) {
    signal.signed = matches!(entry.data_type.class(), Class::Signed | Class::Real);
    signal.real = match entry.data_type {
        DataType::Real32 if signal.bits == 32 => 1,
        DataType::Real64 if signal.bits == 64 => 2,
        _ => 0,
    };
    if let Some(unit) = DeviceValues::new(device).unit(entry) {
        signal.factor = unit.num as f64 / unit.den as f64;
        signal.unit.clone_from(&unit.symbol);
    }
    let limit = |limit: &Option<Value>| match limit.as_ref()? {
        Value::Integer(number) => Some(*number as f64 * signal.factor),
        Value::Real(number) => Some(*number),
        _ => None,
    };
    if let (Some(low), Some(high)) = (limit(&entry.low), limit(&entry.high)) {
        signal.range = [low, high];
    }
    let standard = || standard::object(entry.index, device.profile)?.meaning.map(|meaning| meaning.numbers);
    match &entry.meaning {
        Meaning::Enumeration(name) => {
            let values = device.enumerations.get(name).map(|it| it.values.as_slice()).unwrap_or_default();
            signal.values = values.iter().map(|value| (value.value, value.name.clone())).collect();
        }
        Meaning::BitField(name) => {
            let fields = device.bit_fields.get(name).map(|it| it.fields.as_slice()).unwrap_or_default();
            fields.iter().for_each(|bits| signal.comment_bits(bits.value.low, bits.value.high, &bits.name));
        }
        Meaning::Quantity(_) => {}
        Meaning::Plain => match standard() {
            Some(Numbers::Values(values)) => signal.values = named(values),
            Some(Numbers::Bits(bits)) => {
                bits.iter().for_each(|&(low, high, name)| signal.comment_bits(low, high, name));
            }
            None => {}
        },
    }
    if let Some(description) = &entry.description {
        let _ = write!(signal.comment, "; {description}");
    }
}

impl Signal {
    /// Describes a named bit in the comment: bits cannot be signals of their own, because signals must not overlap.
    fn comment_bits(&mut self, low: u8, high: u8, name: &str) {
        let _ = match low == high {
            true => write!(self.comment, "; bit {low}: {name}"),
            false => write!(self.comment, "; bits {low} to {high}: {name}"),
        };
    }
}

fn unsigned(name: &str, start: u16, bits: u8) -> Signal {
    Signal { name: name.to_owned(), start, bits, factor: 1.0, receiver: MANAGER.to_owned(), ..Signal::default() }
}

fn received_by(node: &str, signals: Vec<Signal>) -> Vec<Signal> {
    signals.into_iter().map(|signal| Signal { receiver: node.to_owned(), ..signal }).collect()
}

fn manager(id: u32, name: String, bytes: u8, comment: &str) -> Message {
    let comment = comment.to_owned();
    Message { id, name, bytes, sender: MANAGER.to_owned(), taker: None, comment, cycle_ms: None, signals: Vec::new() }
}

fn named(values: &[(i128, &str)]) -> Vec<(i128, String)> {
    values.iter().map(|&(value, name)| (value, name.to_owned())).collect()
}

/// The identifier of a COB-ID, if it is enabled.
fn identifier(cob_id: i128) -> Option<u32> {
    let cob_id = u32::try_from(cob_id).ok().filter(|id| id & cia301::INVALID == 0)?;
    const EXTENDED_IN_DBC: u32 = 1 << 31;
    match cob_id & cia301::EXTENDED {
        0 => Some(cob_id & cia301::BASE_IDENTIFIER).filter(|&id| id > 0),
        _ => Some(cob_id & cia301::IDENTIFIER | EXTENDED_IN_DBC),
    }
}

/// A C identifier of at most 32 characters, the limit of old readers.
fn identifier_of(name: &str) -> String {
    let words = name.split(|letter: char| !letter.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    let name = words.collect::<Vec<_>>().join("_");
    let letter_first = if name.starts_with(|first: char| first.is_ascii_alphabetic()) { "" } else { "_" };
    let mut name = format!("{letter_first}{name}");
    name.truncate(32);
    name.trim_end_matches('_').to_owned()
}

/// Escapes a text for quotation marks.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "'").replace(['\r', '\n'], " ").replace('\\', "/"))
}

fn text(nodes: &[Node<'_>], messages: &[Message]) -> String {
    let mut out = "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: Manager".to_owned();
    nodes.iter().for_each(|node| out += &format!(" {}", node.name));
    out += "\n";
    for Message { id, name, bytes, sender, signals, .. } in messages {
        let _ = write!(out, "\nBO_ {id} {name}: {bytes} {sender}\n");
        for Signal { name, start, bits, signed, factor, range: [low, high], unit, receiver, .. } in signals {
            let sign = if *signed { '-' } else { '+' };
            let unit = quoted(unit);
            let _ = writeln!(out, " SG_ {name} : {start}|{bits}@1{sign} ({factor},0) [{low}|{high}] {unit} {receiver}");
        }
    }
    out.push('\n');
    let signals = || messages.iter().flat_map(|message| message.signals.iter().map(move |signal| (message.id, signal)));
    for Message { id, comment, .. } in messages {
        let _ = writeln!(out, "CM_ BO_ {id} {};", quoted(comment));
    }
    for (id, Signal { name, comment, .. }) in signals().filter(|(_, signal)| !signal.comment.is_empty()) {
        let _ = writeln!(out, "CM_ SG_ {id} {name} {};", quoted(comment));
    }
    out += "BA_DEF_ BO_ \"GenMsgCycleTime\" INT 0 65535;\nBA_DEF_DEF_ \"GenMsgCycleTime\" 0;\n";
    for Message { id, cycle_ms, .. } in messages {
        cycle_ms.iter().for_each(|ms| out += &format!("BA_ \"GenMsgCycleTime\" BO_ {id} {ms};\n"));
    }
    for (id, Signal { name, values, .. }) in signals().filter(|(_, signal)| !signal.values.is_empty()) {
        let values: String = values.iter().map(|(value, text)| format!(" {value} {}", quoted(text))).collect();
        let _ = writeln!(out, "VAL_ {id} {name}{values} ;");
    }
    for (id, Signal { name, real, .. }) in signals().filter(|(_, signal)| signal.real > 0) {
        let _ = writeln!(out, "SIG_VALTYPE_ {id} {name} : {real};");
    }
    out
}
