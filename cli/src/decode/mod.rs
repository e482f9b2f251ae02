//! Frames in words: which service, which node, and what it says by name and unit.

mod sdo;

use std::collections::BTreeMap;

use lexican_eds::model::{Device, Direction, Mapped, Value};
use lexican_eds::types::DataType;
use lexican_runtime::wire::emcy::{CodeOrder, Emergency};
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::nmt::{NmtMessage, NmtState};
use lexican_runtime::wire::pdo::PdoCobId;
use lexican_runtime::wire::sync::Sync;
use lexican_runtime::{CobId, Frame, NodeId};

use crate::values::{self, Known};
use sdo::{Channel, Side};

/// Listens to a bus and says what it hears. What transfers have told about a device is remembered, so
/// that segments, units that depend on settings, and reconfigured PDOs are understood.
#[derive(Default)]
pub(crate) struct Decoder<'a> {
    nodes: BTreeMap<NodeId, Known<'a>>,
    channels: BTreeMap<NodeId, Channel>,
}

/// What a frame says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Decoded {
    pub(crate) service: Service,
    /// `RPDO3`, `SDO request`.
    pub(crate) name: String,
    /// Whom it concerns; `None` for everybody.
    pub(crate) node: Option<NodeId>,
    /// In words; may be empty.
    pub(crate) text: String,
    /// Whether something went wrong.
    pub(crate) alarming: bool,
}

/// The services of CiA 301.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Service {
    Nmt,
    Sync,
    Time,
    Emcy,
    Rpdo,
    Tpdo,
    Sdo,
    ErrorControl,
    Lss,
    Unknown,
}

impl<'a> Decoder<'a> {
    pub(crate) fn new() -> Self {
        Decoder::default()
    }

    /// Makes known which device has a node-ID.
    pub(crate) fn introduce(&mut self, node: NodeId, device: &'a Device) {
        self.nodes.insert(node, Known::new(device));
    }

    /// What a frame says.
    pub(crate) fn decode(&mut self, frame: &Frame) -> Decoded {
        if let Some(decoded) = self.configured_pdo(frame) {
            return decoded;
        }
        if frame.id().is_extended() {
            return Decoded::new(Service::Unknown, "", None);
        }
        let id = frame.id().raw() as u16;
        let node = NodeId::new((id & 0x7F) as u8);
        match (id & 0x780, node) {
            (0x000, None) => nmt(frame),
            (0x080, None) => sync(frame),
            (0x100, None) => time(frame),
            (0x080, Some(node)) => self.emergency(node, frame),
            (0x580, Some(node)) => self.sdo(node, Side::Server, frame),
            (0x600, Some(node)) => self.sdo(node, Side::Client, frame),
            (0x700, Some(node)) => error_control(node, frame),
            // Which PDO a device of ours sends or receives was asked above.
            (base @ 0x180..=0x500, Some(node)) if !self.nodes.contains_key(&node) => predefined_pdo(base, node, frame),
            _ if matches!(id, 0x7E4 | 0x7E5) => {
                Decoded::new(Service::Lss, if id == 0x7E5 { "LSS request" } else { "LSS response" }, None)
            }
            _ => Decoded::new(Service::Unknown, "", None),
        }
    }

    /// A PDO of a known device, wherever it was configured to.
    fn configured_pdo(&mut self, frame: &Frame) -> Option<Decoded> {
        let (node, known, direction, number, mapping) = self.nodes.iter_mut().find_map(|(node, known)| {
            let pdo = known.device.pdos.iter().find(|pdo| cob_id(known, *node, pdo) == Some(frame.id()))?;
            let mapping = mapping(known, pdo);
            Some((*node, known, pdo.direction, pdo.number, mapping))
        })?;
        let (service, letter) = match direction {
            Direction::Receive => (Service::Rpdo, 'R'),
            Direction::Transmit => (Service::Tpdo, 'T'),
        };
        let mut decoded = Decoded::new(service, format!("{letter}PDO{number}"), Some(node));
        if frame.is_remote() {
            "asked for".clone_into(&mut decoded.text);
            return Some(decoded);
        }
        let bits: u32 = mapping.iter().map(|mapped| u32::from(mapped.bits)).sum();
        if bits.div_ceil(8) != u32::from(frame.dlc()) {
            decoded.text = format!("{} bytes instead of {}", frame.dlc(), bits.div_ceil(8));
            decoded.alarming = true;
            return Some(decoded);
        }
        decoded.text = content(known, &mapping, frame.data());
        Some(decoded)
    }

    fn emergency(&self, node: NodeId, frame: &Frame) -> Decoded {
        let mut decoded = Decoded::new(Service::Emcy, "EMCY", Some(node));
        let Some(emergency) = Emergency::parse(frame.data(), CodeOrder::LowByteFirst) else {
            decoded.text = format!("{} bytes: an EMCY has 8", frame.data().len());
            return decoded;
        };
        let known = self.nodes.get(&node);
        let code = emergency.code.0;
        // The error history has the same codes as the messages, by the names of the device.
        let named = known.and_then(|known| known.name_of(known.device.entry(0x1003, 1)?, code.into()));
        let text = named.map_or_else(|| emergency.code.to_string(), |name| format!("{code:04X}h: {name}"));
        let register = known.and_then(|known| {
            let entry = known.device.entry(0x1001, 0)?;
            Some(known.describe(entry, &Value::Integer(emergency.register.0.into())))
        });
        let register = register.unwrap_or_else(|| format!("{:02X}h", emergency.register.0));
        decoded.text = format!("{text}, error register = {register}");
        if emergency.vendor != [0; 5] {
            decoded.text += &format!(", {}", values::hex(&emergency.vendor));
        }
        decoded.alarming = code != 0;
        decoded
    }

    fn sdo(&mut self, node: NodeId, side: Side, frame: &Frame) -> Decoded {
        let name = match side {
            Side::Client => "SDO request",
            Side::Server => "SDO response",
        };
        let said = self.channels.entry(node).or_default().decode(side, frame.data(), self.nodes.get_mut(&node));
        let decoded = Decoded::new(Service::Sdo, name, Some(node));
        Decoded { text: said.text, alarming: said.abort, ..decoded }
    }
}

impl Decoded {
    fn new(service: Service, name: impl Into<String>, node: Option<NodeId>) -> Self {
        Decoded { service, name: name.into(), node, text: String::new(), alarming: false }
    }
}

fn nmt(frame: &Frame) -> Decoded {
    match NmtMessage::parse(frame.data()) {
        Some(message) => {
            let all = if message.node.is_none() { ", all nodes" } else { "" };
            let text = match message.command.target() {
                NmtState::Initialising => message.command.to_string(),
                state => format!("enter {state}"),
            };
            Decoded { text: text + all, ..Decoded::new(Service::Nmt, "NMT", message.node) }
        }
        None => unreadable(Service::Nmt, "NMT", frame),
    }
}

fn sync(frame: &Frame) -> Decoded {
    match Sync::parse(frame.data()) {
        Some(sync) => {
            let text = sync.counter.map(|counter| format!("counter {counter}")).unwrap_or_default();
            Decoded { text, ..Decoded::new(Service::Sync, "SYNC", None) }
        }
        None => unreadable(Service::Sync, "SYNC", frame),
    }
}

fn time(frame: &Frame) -> Decoded {
    match lexican_runtime::wire::time::parse(frame.data()) {
        Some(time) => {
            let text = format!("day {} since 1 January 1984, {} ms after midnight", time.days, time.ms);
            Decoded { text, ..Decoded::new(Service::Time, "TIME", None) }
        }
        None => unreadable(Service::Time, "TIME", frame),
    }
}

fn error_control(node: NodeId, frame: &Frame) -> Decoded {
    if frame.is_remote() {
        let decoded = Decoded::new(Service::ErrorControl, "guarding", Some(node));
        return Decoded { text: "state asked for".to_owned(), ..decoded };
    }
    match ErrorControl::parse(frame.data()) {
        Some(ErrorControl { state: NmtState::Initialising, toggle: false }) => {
            Decoded::new(Service::ErrorControl, "boot-up", Some(node))
        }
        Some(ErrorControl { state, toggle }) => {
            let toggle = if toggle { ", toggle bit set" } else { "" };
            let decoded = Decoded::new(Service::ErrorControl, "heartbeat", Some(node));
            Decoded { text: format!("{state}{toggle}"), ..decoded }
        }
        None => Decoded { node: Some(node), ..unreadable(Service::ErrorControl, "heartbeat", frame) },
    }
}

fn unreadable(service: Service, name: &str, frame: &Frame) -> Decoded {
    let text = format!("not readable: {} bytes {}", frame.dlc(), values::hex(frame.data()));
    Decoded { text, alarming: true, ..Decoded::new(service, name, None) }
}

/// A PDO of a device that nobody introduced, by the predefined connection set (CiA 301, 7.3.5).
fn predefined_pdo(base: u16, node: NodeId, frame: &Frame) -> Decoded {
    let number = (base - 0x180) / 0x100 + 1;
    let (service, letter) = if base & 0x80 != 0 { (Service::Tpdo, 'T') } else { (Service::Rpdo, 'R') };
    let text = if frame.is_remote() { "asked for".to_owned() } else { String::new() };
    Decoded { text, ..Decoded::new(service, format!("{letter}PDO{number}"), Some(node)) }
}

/// The COB-ID of a PDO: as seen on the bus, else by default.
fn cob_id(known: &Known<'_>, node: NodeId, pdo: &lexican_eds::model::Pdo) -> Option<CobId> {
    let index = parameter(pdo, 0x1400, 0x1800)?;
    let parameter = known.seen(index, 1).and_then(|seen| u32::try_from(seen).ok()).or_else(|| match pdo.cob_id {
        Some(Value::Integer(number)) => u32::try_from(number).ok(),
        Some(Value::NodeIdPlus(offset)) => u32::try_from(offset + i64::from(node.get())).ok(),
        _ => None,
    })?;
    let parameter = PdoCobId(parameter);
    parameter.is_valid().then(|| parameter.id())
}

/// The mapping of a PDO: as seen on the bus, else by default.
fn mapping(known: &Known<'_>, pdo: &lexican_eds::model::Pdo) -> Vec<Mapped> {
    let seen = parameter(pdo, 0x1600, 0x1A00).and_then(|index| {
        let count = u8::try_from(known.seen(index, 0)?).ok()?;
        (1..=count.min(64)).map(|sub| known.seen(index, sub).map(mapped)).collect::<Option<Vec<_>>>()
    });
    seen.unwrap_or_else(|| pdo.mapping.clone())
}

fn mapped(entry: i128) -> Mapped {
    Mapped { index: (entry >> 16) as u16, sub: (entry >> 8) as u8, bits: entry as u8 }
}

fn parameter(pdo: &lexican_eds::model::Pdo, receive: u16, transmit: u16) -> Option<u16> {
    let base = match pdo.direction {
        Direction::Receive => receive,
        Direction::Transmit => transmit,
    };
    base.checked_add(pdo.number.checked_sub(1)?)
}

/// The mapped values by name.
fn content(known: &mut Known<'_>, mapping: &[Mapped], data: &[u8]) -> String {
    let mut bytes = [0; 8];
    bytes.iter_mut().zip(data).for_each(|(to, from)| *to = *from);
    let mut rest = u64::from_le_bytes(bytes);
    let mut texts = Vec::new();
    for mapped in mapping {
        let bits = u32::from(mapped.bits.min(64));
        let raw = if bits == 64 { rest } else { rest & ((1 << bits) - 1) };
        rest = rest.checked_shr(bits).unwrap_or(0);
        let Some(entry) = known.device.entry(mapped.index, mapped.sub) else {
            if DataType::from_code(mapped.index).bits().is_none() {
                texts.push(format!("{:04X}:{:02X} = {raw:X}h", mapped.index, mapped.sub));
            }
            continue;
        };
        let value = values::wire::of_bits(entry.data_type, mapped.bits, raw);
        texts.push(format!("{} = {}", entry.name, known.describe(entry, &value)));
        known.learn(mapped.index, mapped.sub, &value);
    }
    texts.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    const NODE: NodeId = NodeId::literal(5);

    /// Decodes the frames one after the other, as one bus; the device of node 5 is known.
    #[track_caller]
    fn check(script: &[(&str, &str)]) {
        let (device, _) = lexican_eds::load(&lexican_eds::library::find("siko/ag03-1").unwrap().input());
        let mut decoder = Decoder::new();
        decoder.introduce(NODE, &device);
        for (frame, words) in script {
            let line = format!("(0.000000) can0 {frame}").parse::<lexican_runtime::host::candump::Line>().unwrap();
            let decoded = decoder.decode(&line.frame);
            let node = decoded.node.map(|node| format!(" {node}")).unwrap_or_default();
            let alarm = if decoded.alarming { "!" } else { "" };
            assert_eq!(format!("{alarm}{}{node}: {}", decoded.name, decoded.text), *words, "{frame}");
        }
    }

    #[test]
    fn network_management_is_told_in_the_words_of_the_standard() {
        check(&[
            ("705#00", "boot-up 5: "),
            ("000#0105", "NMT 5: enter OPERATIONAL"),
            ("000#8000", "NMT: enter PRE-OPERATIONAL, all nodes"),
            ("000#8105", "NMT 5: reset node"),
            ("000#0180", "!NMT: not readable: 2 bytes 01 80"),
            ("705#R1", "guarding 5: state asked for"),
            ("705#7F", "heartbeat 5: PRE-OPERATIONAL"),
            ("705#85", "heartbeat 5: OPERATIONAL, toggle bit set"),
            ("705#0102", "!heartbeat 5: not readable: 2 bytes 01 02"),
            ("080#", "SYNC: "),
            ("080#07", "SYNC: counter 7"),
            ("7E5#0401000000000000", "LSS request: "),
            ("1FFFFFFF#00", ": "),
        ]);
    }

    #[test]
    fn process_data_are_told_by_name_and_unit() {
        check(&[
            ("205#0601", "RPDO1 5: Controlword = shutdown + stop"),
            ("205#0701", "RPDO1 5: Controlword = switch on + stop"),
            ("185#3702", "TPDO1 5: Statusword = OPERATION ENABLED + voltage enabled + remote"),
            ("205#0701", "RPDO1 5: Controlword = disable operation + stop"),
            (
                "405#1F0088130000",
                "RPDO3 5: Controlword = enable operation + new setpoint, Target Position = +5000 increments",
            ),
            ("505#0F00B8FFFFFF", "RPDO4 5: Controlword = enable operation, Target Velocity = -72 rev/min"),
            ("385#R6", "TPDO3 5: asked for"),
            ("405#1F00", "!RPDO3 5: 2 bytes instead of 6"),
            ("186#3702", "TPDO1 6: "),
            ("501#00", "RPDO4 1: "),
        ]);
    }

    #[test]
    fn transfers_are_told_by_name_and_unit() {
        check(&[
            ("605#4060600000000000", "SDO request 5: read 6060:00 Modes of Operation"),
            ("585#4260600001000000", "SDO response 5: 6060:00 Modes of Operation = profile position (1)"),
            ("605#2F60600002000000", "SDO request 5: write 6060:00 Modes of Operation = profile velocity (2)"),
            ("585#6060600000000000", "SDO response 5: taken 6060:00 Modes of Operation"),
            ("585#4B1B240118010000", "SDO response 5: 241B:01 Power Supply Voltage, Output Stage = 28.0 V"),
            (
                "585#8060600031000906",
                "!SDO response 5: abort 6060:00 Modes of Operation: 0609 0031: value of parameter written too high",
            ),
            ("585#8000000000000000", "!SDO response 5: abort 0000:00: 0000 0000: code unknown to CiA 301"),
            ("605#40", "SDO request 5: 1 bytes: an SDO has 8"),
            ("605#FF00000000000000", "SDO request 5: unknown SDO command"),
        ]);
    }

    #[test]
    fn units_follow_the_settings_seen_on_the_bus() {
        check(&[
            (
                "385#370290010000",
                "TPDO3 5: Statusword = OPERATION ENABLED + voltage enabled + remote, Position Actual Value = +400 increments",
            ),
            ("605#2B122400C8000000", "SDO request 5: write 2412:00 Spindle Pitch = 2.00 mm"),
            ("585#6012240000000000", "SDO response 5: taken 2412:00 Spindle Pitch"),
            (
                "385#370290010000",
                "TPDO3 5: Statusword = OPERATION ENABLED + voltage enabled + remote, Position Actual Value = +4.00 mm",
            ),
        ]);
    }

    #[test]
    fn a_pdo_is_found_where_it_was_moved_to() {
        check(&[
            ("605#2300140111020000", "SDO request 5: write 1400:01 RPDO1 Parameter, COB-ID = 211h"),
            ("585#6000140100000000", "SDO response 5: taken 1400:01 RPDO1 Parameter, COB-ID"),
            ("211#0600", "RPDO1 5: Controlword = shutdown"),
            ("205#0600", ": "),
        ]);
    }

    #[test]
    fn segments_are_put_together() {
        check(&[
            ("606#4008100000000000", "SDO request 6: read 1008:00"),
            ("586#410810000A000000", "SDO response 6: 1008:00, 10 bytes to come"),
            ("606#6000000000000000", "SDO request 6: next segment of 1008:00"),
            ("586#006465766963652D", "SDO response 6: segment, 7 bytes so far"),
            ("606#7000000000000000", "SDO request 6: next segment of 1008:00"),
            ("586#1931323300000000", "SDO response 6: 1008:00 = \"device-123\""),
        ]);
    }

    #[test]
    fn emergencies_are_told_in_the_words_of_the_device() {
        check(&[
            ("085#2031050000000000", "!EMCY 5: 3120h: undervoltage, error register = general error + voltage"),
            ("085#0000000000000000", "EMCY 5: 0000h: no error, error register = 0"),
            ("086#3081110000000000", "!EMCY 6: 8130h: life guard error or heartbeat error, error register = 11h"),
            ("085#20", "EMCY 5: 1 bytes: an EMCY has 8"),
        ]);
    }

    #[test]
    fn no_frame_is_beyond_words() {
        let device = lexican_eds::load(&lexican_eds::library::find("siko/ag03-1").unwrap().input()).0;
        let mut decoder = Decoder::new();
        decoder.introduce(NODE, &device);
        let mut noise = 1_u64;
        for round in 0..40 {
            for id in (0..0x800).filter(|id| round < 2 || matches!(id & 0x7F, 0 | 5 | 6)) {
                // Knuth's multiplicative generator: any bytes will do, as long as they are the same every time.
                noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let len = (noise >> 60) as usize % 9;
                let data = noise.to_le_bytes();
                let id = CobId::standard(id).unwrap();
                decoder.decode(&Frame::new(id, &data[..len]).unwrap());
                decoder.decode(&Frame::remote(id, len as u8).unwrap());
            }
        }
    }
}
