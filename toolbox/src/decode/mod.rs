//! Frames as text and JSON: the service, the node, and the values by name and unit.

mod decoded;
pub mod duplicates;
pub mod lss;
mod network;
pub(crate) mod pdo;
mod sdo;
pub mod wireshark;

use std::collections::{BTreeMap, HashMap};

use lexican_eds::model::{Device, Mapped};
use lexican_runtime::cia301::connection;
use lexican_runtime::wire::lss as wire;
use lexican_runtime::{CobId, Frame, NodeId};

use crate::values::DeviceValues;

pub use decoded::{Decoded, Detail, Emcy, Pdo, Sdo, Service, Side, Step};
pub use pdo::content;

use sdo::Channel;

/// Decodes the frames of a bus. It remembers what SDO transfers carry, so that it can decode segments, units that depend
/// on settings, and PDOs that are configured over SDO.
#[derive(Default)]
pub struct Decoder<'a> {
    nodes: BTreeMap<NodeId, DeviceValues<'a>>,
    channels: BTreeMap<NodeId, Channel>,
    pdos: HashMap<CobId, pdo::Configured>,
}

impl<'a> Decoder<'a> {
    /// A decoder that knows no device.
    pub fn new() -> Self {
        Decoder::default()
    }

    /// Sets the device of a node.
    pub fn introduce(&mut self, node: NodeId, device: &'a Device) {
        self.nodes.insert(node, DeviceValues::new(device));
        self.pdos = pdo::table(&self.nodes);
    }

    /// The values of a node that were seen, if its device is known.
    #[must_use]
    pub fn values(&self, node: NodeId) -> Option<&DeviceValues<'a>> {
        self.nodes.get(&node)
    }

    /// What a PDO of a known device carries, in order, as the frames so far have configured it; empty for other frames.
    #[must_use]
    pub fn mapping(&self, frame: &Frame) -> Vec<Mapped> {
        self.pdos.get(&frame.id()).map(|pdo| pdo.mapping.clone()).unwrap_or_default()
    }

    /// Decodes the next frame of the bus.
    pub fn decode(&mut self, frame: &Frame) -> Decoded {
        let pdo = self.pdos.get(&frame.id()).and_then(|pdo| pdo.decode(&mut self.nodes, frame));
        let decoded = pdo.unwrap_or_else(|| self.other_than_configured_pdo(frame));
        let node = decoded.node.and_then(|node| self.nodes.get_mut(&node));
        if node.is_some_and(DeviceValues::pdos_have_changed) {
            self.pdos = pdo::table(&self.nodes);
        }
        decoded
    }

    fn other_than_configured_pdo(&mut self, frame: &Frame) -> Decoded {
        match frame.id() {
            CobId::NMT => return network::nmt(frame),
            CobId::SYNC => return network::sync(frame),
            CobId::TIME => return network::time(frame),
            wire::REQUEST => return network::lss_request(frame),
            wire::RESPONSE => return network::lss_response(frame),
            _ => {}
        }
        let unknown = || Decoded::new(Service::Unknown, "", None);
        let (base, low) = (frame.id().raw() & !0x7F, (frame.id().raw() & 0x7F) as u8);
        let (Ok(base), Some(node), false) = (u16::try_from(base), NodeId::new(low), frame.id().is_extended()) else {
            return unknown();
        };
        match base {
            connection::EMCY => network::emergency(node, self.nodes.get(&node), frame),
            connection::SDO_RESPONSE => self.sdo(node, Side::Server, frame),
            connection::SDO_REQUEST => self.sdo(node, Side::Client, frame),
            connection::ERROR_CONTROL => network::error_control(node, frame),
            // The PDOs of a known device are those of its configuration.
            connection::TPDO_1..connection::SDO_RESPONSE if !self.nodes.contains_key(&node) => {
                pdo::predefined(base, node, frame)
            }
            _ => unknown(),
        }
    }

    fn sdo(&mut self, node: NodeId, side: Side, frame: &Frame) -> Decoded {
        let name = match side {
            Side::Client => "SDO request",
            Side::Server => "SDO response",
        };
        let channel = self.channels.entry(node).or_default();
        let (text, sdo) = channel.decode(side, frame.data(), self.nodes.get_mut(&node));
        let alarming = sdo.abort.is_some();
        let decoded = Decoded::new(Service::Sdo, name, Some(node)).with(text, Detail::Sdo(Box::new(sdo)));
        Decoded { alarming, ..decoded }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;
    use serde_json::{Value as Json, json};
    const NODE: NodeId = NodeId::literal(5);

    /// Decodes the frames of one bus: their name, node and text, and the fields of the service in JSON, of which others
    /// may be there, too. The device of node 5 is known.
    #[track_caller]
    fn check(script: &[(&str, &str, Json)]) {
        let device = samples::drive();
        let mut decoder = Decoder::new();
        decoder.introduce(NODE, &device);
        for (frame, text, fields) in script {
            let line = format!("(0.000000) can0 {frame}").parse::<lexican_runtime::host::candump::Line>().unwrap();
            let decoded = decoder.decode(&line.frame);
            let node = decoded.node.map(|node| format!(" {node}")).unwrap_or_default();
            let alarm = if decoded.alarming { "!" } else { "" };
            assert_eq!(format!("{alarm}{}{node}: {}", decoded.name, decoded.text), *text, "{frame}");
            contains(&decoded.detail.fields(), fields, frame);
        }
    }

    /// Compares all fields that are expected, `null` with those that are missing.
    #[track_caller]
    fn contains(json: &Json, expected: &Json, what: &str) {
        match (json, expected) {
            (_, Json::Object(fields)) => {
                fields.iter().for_each(|(key, field)| contains(&json[key], field, &format!("{what} .{key}")));
            }
            (Json::Array(list), Json::Array(expected)) => {
                assert_eq!(list.len(), expected.len(), "{what}: {list:?}");
                list.iter().zip(expected).for_each(|(json, expected)| contains(json, expected, what));
            }
            _ => assert_eq!(json, expected, "{what}"),
        }
    }

    #[test]
    fn network_management_is_decoded() {
        check(&[
            ("705#00", "boot-up 5: ", json!({ "kind": "boot-up", "state": "INITIALISING" })),
            (
                "000#0105",
                "NMT 5: enter OPERATIONAL",
                json!({ "command": "start", "code": "01", "state": "OPERATIONAL" }),
            ),
            (
                "000#8000",
                "NMT: enter PRE-OPERATIONAL, all nodes",
                json!({ "command": "enter PRE-OPERATIONAL", "code": "80" }),
            ),
            ("000#8105", "NMT 5: reset node", json!({ "command": "reset node" })),
            ("000#0180", "!NMT: not readable: 2 bytes 01 80", json!(null)),
            ("705#R1", "guarding 5: state asked for", json!({ "kind": "guarding" })),
            ("705#7F", "heartbeat 5: PRE-OPERATIONAL", json!({ "kind": "heartbeat", "toggle": false })),
            (
                "705#85",
                "heartbeat 5: OPERATIONAL, toggle bit set",
                json!({ "kind": "heartbeat", "state": "OPERATIONAL", "toggle": true }),
            ),
            ("705#0102", "!heartbeat 5: not readable: 2 bytes 01 02", json!(null)),
            ("080#", "SYNC: ", json!({ "counter": null })),
            ("080#07", "SYNC: counter 7", json!({ "counter": 7 })),
            (
                "100#E80300000100",
                "TIME: day 1 since 1 January 1984, 1000 ms after midnight",
                json!({ "ms": 1000, "days": 1 }),
            ),
            ("7E4#FF", "!LSS response: not readable: 1 bytes FF", json!(null)),
            ("1FFFFFFF#00", ": ", json!(null)),
        ]);
    }

    #[test]
    fn lss_is_decoded() {
        check(&[
            (
                "7E5#0401000000000000",
                "LSS request: all devices enter LSS configuration",
                json!({ "from": "manager", "command": "switch-global", "code": "04", "state": "configuration" }),
            ),
            (
                "7E5#4095010000000000",
                "LSS request: select by vendor = 195h",
                json!({ "command": "switch-selective", "part": "vendor", "value": 405 }),
            ),
            (
                "7E4#4400000000000000",
                "LSS response: selected",
                json!({ "from": "device", "command": "switch-selective" }),
            ),
            (
                "7E5#1105000000000000",
                "LSS request: take node-ID 5",
                json!({ "command": "configure-node-id", "node_id": 5 }),
            ),
            (
                "7E4#1101000000000000",
                "!LSS response: refused: node-ID out of range",
                json!({ "error": 1, "specific": 0 }),
            ),
            (
                "7E5#1300020000000000",
                "LSS request: take bit rate 500 kbit/s",
                json!({ "table": 0, "entry": 2, "kbit_per_s": 500 }),
            ),
            (
                "7E5#51950100001F0001",
                "LSS request: fastscan: whose vendor has the upper 1 bits of 00000195h? Then product",
                json!({ "command": "fastscan", "value": 405, "bit_checked": 31, "part": "vendor", "next": "product" }),
            ),
            (
                "7E5#4A07000000000000",
                "LSS request: who has serial >= 7h?",
                json!({ "command": "identify", "part": "serial-low", "value": 7 }),
            ),
            (
                "7E4#5EFF000000000000",
                "LSS response: node-ID none",
                json!({ "command": "inquire-node-id", "node_id": null }),
            ),
        ]);
    }

    #[test]
    fn pdos_are_decoded_by_name_and_unit() {
        let unknown = |number, direction| json!({ "number": number, "direction": direction, "fields": [] });
        check(&[
            ("205#0601", "RPDO1 5: Controlword = shutdown + stop", json!({})),
            ("205#0701", "RPDO1 5: Controlword = switch on + stop", json!({})),
            ("185#3702", "TPDO1 5: Statusword = OPERATION ENABLED + voltage enabled + remote", json!({})),
            ("205#0701", "RPDO1 5: Controlword = disable operation + stop", json!({})),
            (
                "405#1F0088130000",
                "RPDO3 5: Controlword = enable operation + new setpoint, Target Position = +5000 increments",
                json!({ "number": 3, "direction": "receive", "fields": [
                    { "address": "6040:00", "index": "6040", "sub": "00", "name": "Controlword", "type": "UNSIGNED16",
                        "value": 31 },
                    { "name": "Target Position", "value": 5000, "unit": "increments", "scaled": 5000.0,
                        "text": "+5000 increments" },
                ] }),
            ),
            ("505#0F00B8FFFFFF", "RPDO4 5: Controlword = enable operation, Target Velocity = -72 rev/min", json!({})),
            ("385#R6", "TPDO3 5: asked for", unknown(3, "transmit")),
            ("405#1F00", "!RPDO3 5: 2 bytes instead of 6", unknown(3, "receive")),
            ("205#0601000000000000", "RPDO1 5: Controlword = shutdown + stop, 8 bytes instead of 2", json!({})),
            (
                "185#370200",
                "!TPDO1 5: Statusword = OPERATION ENABLED + voltage enabled + remote, 3 bytes instead of 2",
                json!({}),
            ),
            ("186#3702", "TPDO1 6: ", unknown(1, "transmit")),
            ("501#00", "RPDO4 1: ", unknown(4, "receive")),
        ]);
    }

    #[test]
    fn transfers_are_decoded_by_name_and_unit() {
        check(&[
            (
                "605#4060600000000000",
                "SDO request 5: read 6060:00 Modes of Operation",
                json!({ "access": "read", "index": "6060", "sub": "00" }),
            ),
            (
                "585#4260600001000000",
                "SDO response 5: 6060:00 Modes of Operation = profile position (1)",
                json!({ "from": "server", "command": "initiate-upload", "complete": true }),
            ),
            (
                "605#2F60600002000000",
                "SDO request 5: write 6060:00 Modes of Operation = profile velocity (2)",
                json!({}),
            ),
            (
                "585#6060600000000000",
                "SDO response 5: taken 6060:00 Modes of Operation",
                json!({ "from": "server", "value": 2, "complete": true }),
            ),
            ("585#4B1B240118010000", "SDO response 5: 241B:01 Power Supply Voltage, Output Stage = 28.0 V", json!({})),
            (
                "585#8060600031000906",
                "!SDO response 5: abort 6060:00 Modes of Operation: 0609 0031: value of parameter written too high",
                json!({ "command": "abort", "abort_code": "06090031",
                    "abort": "value of parameter written too high", "complete": true }),
            ),
            (
                "585#8000000000000000",
                "!SDO response 5: abort 0000:00: 0000 0000: code unknown to CiA 301",
                json!({ "abort_code": "00000000", "abort": null }),
            ),
            ("605#40", "SDO request 5: 1 bytes: an SDO has 8", json!({ "command": "unknown", "complete": false })),
            ("605#FF00000000000000", "SDO request 5: unknown SDO command", json!({ "command": "unknown" })),
        ]);
    }

    #[test]
    fn units_follow_the_settings_seen_on_the_bus() {
        let status = "TPDO3 5: Statusword = OPERATION ENABLED + voltage enabled + remote, Position Actual Value = ";
        check(&[
            ("385#370290010000", &format!("{status}+400 increments"), json!({})),
            (
                "605#2B122400C8000000",
                "SDO request 5: write 2412:00 Spindle Pitch = 2.00 mm",
                json!({ "from": "client", "command": "initiate-download", "access": "write", "transfer": "expedited",
                    "address": "2412:00", "name": "Spindle Pitch", "value": 200, "text": "2.00 mm", "unit": "mm",
                    "scaled": 2.0, "raw": "C8 00", "complete": false }),
            ),
            ("585#6012240000000000", "SDO response 5: taken 2412:00 Spindle Pitch", json!({ "value": 200 })),
            ("385#370290010000", &format!("{status}+4.00 mm"), json!({})),
        ]);
    }

    #[test]
    fn a_pdo_is_decoded_after_its_cob_id_has_changed() {
        check(&[
            ("605#2300140111020000", "SDO request 5: write 1400:01 RPDO1 Parameter, COB-ID = 211h", json!({})),
            ("585#6000140100000000", "SDO response 5: taken 1400:01 RPDO1 Parameter, COB-ID", json!({})),
            ("211#0600", "RPDO1 5: Controlword = shutdown", json!({})),
            ("205#0600", ": ", json!(null)),
        ]);
    }

    #[test]
    fn segments_and_blocks_are_put_together() {
        check(&[
            ("606#4008100000000000", "SDO request 6: read 1008:00", json!({ "command": "initiate-upload" })),
            (
                "586#410810000A000000",
                "SDO response 6: 1008:00, 10 bytes to come",
                json!({ "transfer": "segmented", "size": 10, "complete": false }),
            ),
            (
                "606#6000000000000000",
                "SDO request 6: next segment of 1008:00",
                json!({ "command": "upload-segment", "toggle": false }),
            ),
            (
                "586#006465766963652D",
                "SDO response 6: segment, 7 bytes so far",
                json!({ "toggle": false, "last": false }),
            ),
            ("606#7000000000000000", "SDO request 6: next segment of 1008:00", json!({ "toggle": true })),
            (
                "586#1931323300000000",
                "SDO response 6: 1008:00 = \"device-123\"",
                json!({ "toggle": true, "last": true, "complete": true, "address": "1008:00", "value": "device-123",
                    "text": "\"device-123\"" }),
            ),
            (
                "606#A00810007F000000",
                "SDO request 6: read 1008:00 by blocks of 127",
                json!({ "command": "initiate-block-upload", "transfer": "block", "block_size": 127 }),
            ),
            ("586#C20810000A000000", "SDO response 6: 1008:00 by blocks, 10 bytes to come", json!({ "size": 10 })),
            ("606#A300000000000000", "SDO request 6: start of the blocks", json!({ "command": "start-block-upload" })),
            (
                "586#016465766963652D",
                "SDO response 6: block segment 1",
                json!({ "command": "block-segment", "sequence": 1, "last": false }),
            ),
            (
                "586#8231323300000000",
                "SDO response 6: block segment 2, the last",
                json!({ "sequence": 2, "last": true }),
            ),
            (
                "606#A2027F0000000000",
                "SDO request 6: 2 segments taken, next block of 127",
                json!({ "command": "confirm-block-upload", "sequence": 2 }),
            ),
            (
                "586#D100000000000000",
                "SDO response 6: end of blocks: 1008:00 = \"device-123\"",
                json!({ "command": "end-block-upload", "value": "device-123", "complete": false }),
            ),
            (
                "606#A100000000000000",
                "SDO request 6: end of blocks confirmed of 1008:00",
                json!({ "from": "client", "complete": true }),
            ),
        ]);
    }

    #[test]
    fn emergencies_have_the_meanings_of_the_data_sheet() {
        check(&[
            (
                "085#2031050000000000",
                "!EMCY 5: 3120h: undervoltage, error register = general error + voltage",
                json!({ "code": "3120", "meaning": "undervoltage", "register": "05",
                    "register_text": "general error + voltage", "msef": "00 00 00 00 00" }),
            ),
            ("085#0000000000000000", "EMCY 5: 0000h: no error, error register = 0", json!({})),
            (
                "086#3081110102030405",
                "!EMCY 6: 8130h: life guard error or heartbeat error, error register = 11h, 01 02 03 04 05",
                json!({ "code": "8130", "meaning": "life guard error or heartbeat error", "register": "11",
                    "msef": "01 02 03 04 05" }),
            ),
            (
                "086#3081110000000000",
                "!EMCY 6: 8130h: life guard error or heartbeat error, error register = 11h",
                json!({}),
            ),
            ("085#20", "EMCY 5: 1 bytes: an EMCY has 8", json!(null)),
        ]);
    }

    #[test]
    fn any_frame_can_be_decoded() {
        let device = samples::drive();
        let mut decoder = Decoder::new();
        decoder.introduce(NODE, &device);
        let mut duplicates = duplicates::DuplicateNodes::default();
        let mut now = lexican_runtime::Instant::ZERO;
        let mut listen = |frame: &Frame| {
            now += lexican_runtime::Duration::from_millis(1);
            let decoded = decoder.decode(frame);
            duplicates.observe(now, &decoded);
            let _ = decoded.detail.fields();
        };
        let mut noise = 1_u64;
        for round in 0..40 {
            for id in (0..0x800).filter(|id| round < 2 || matches!(id & 0x7F, 0 | 5 | 6)) {
                // Knuth's multiplicative generator.
                noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let len = (noise >> 60) as usize % 9;
                let data = noise.to_le_bytes();
                let id = CobId::standard(id).unwrap();
                listen(&Frame::new(id, &data[..len]).unwrap());
                listen(&Frame::remote(id, len as u8).unwrap());
            }
        }
    }
}
