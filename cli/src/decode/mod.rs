//! Frames in words and in fields: which service, which node, and what it says by name and unit.

mod decoded;
mod detail;
pub(crate) mod lss;
mod network;
mod pdo;
mod sdo;
pub(crate) mod twins;

use std::collections::BTreeMap;

use lexican_eds::model::Device;
use lexican_runtime::{Frame, NodeId};

use crate::values::Known;

pub(crate) use decoded::{Decoded, Service};
pub(crate) use detail::{Detail, Emcy, Pdo, Sdo, Side};

use sdo::Channel;

/// Listens to a bus and says what it hears. What transfers have told about a device is remembered, so
/// that segments, units that depend on settings, and reconfigured PDOs are understood.
#[derive(Default)]
pub(crate) struct Decoder<'a> {
    nodes: BTreeMap<NodeId, Known<'a>>,
    channels: BTreeMap<NodeId, Channel>,
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
        if let Some(decoded) = pdo::configured(&mut self.nodes, frame) {
            return decoded;
        }
        if frame.id().is_extended() {
            return Decoded::new(Service::Unknown, "", None);
        }
        let id = frame.id().raw() as u16;
        let node = NodeId::new((id & 0x7F) as u8);
        match (id & 0x780, node) {
            (0x000, None) => network::nmt(frame),
            (0x080, None) => network::sync(frame),
            (0x100, None) => network::time(frame),
            (0x080, Some(node)) => network::emergency(node, self.nodes.get(&node), frame),
            (0x580, Some(node)) => self.sdo(node, Side::Server, frame),
            (0x600, Some(node)) => self.sdo(node, Side::Client, frame),
            (0x700, Some(node)) => network::error_control(node, frame),
            // Which PDO a device of ours sends or receives was asked above.
            (base @ 0x180..=0x500, Some(node)) if !self.nodes.contains_key(&node) => pdo::predefined(base, node, frame),
            _ if id == 0x7E5 => network::lss_request(frame),
            _ if id == 0x7E4 => network::lss_response(frame),
            _ => Decoded::new(Service::Unknown, "", None),
        }
    }

    fn sdo(&mut self, node: NodeId, side: Side, frame: &Frame) -> Decoded {
        let name = match side {
            Side::Client => "SDO request",
            Side::Server => "SDO response",
        };
        let said = self.channels.entry(node).or_default().decode(side, frame.data(), self.nodes.get_mut(&node));
        Decoded {
            text: said.text,
            alarming: said.detail.abort.is_some(),
            detail: Detail::Sdo(Box::new(said.detail)),
            ..Decoded::new(Service::Sdo, name, Some(node))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Loaded;
    use lexican_runtime::CobId;

    const NODE: NodeId = NodeId::literal(5);

    /// Decodes the frames one after the other, as one bus; the device of node 5 is known.
    #[track_caller]
    fn check(script: &[(&str, &str)]) {
        let device = Loaded::named("siko/ag03-1").unwrap().device;
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
            ("7E5#0401000000000000", "LSS request: all devices enter LSS configuration"),
            ("7E4#1101000000000000", "!LSS response: refused: node-ID out of range"),
            ("7E4#FF", "!LSS response: not readable: 1 bytes FF"),
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
            ("205#0601000000000000", "RPDO1 5: Controlword = shutdown + stop, 8 bytes instead of 2"),
            ("185#370200", "!TPDO1 5: Statusword = OPERATION ENABLED + voltage enabled + remote, 3 bytes instead of 2"),
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
        let device = Loaded::named("siko/ag03-1").unwrap().device;
        let mut decoder = Decoder::new();
        decoder.introduce(NODE, &device);
        let mut twins = twins::Twins::default();
        let mut now = lexican_runtime::Instant::ZERO;
        let mut listen = |frame: &Frame| {
            now += lexican_runtime::Duration::from_millis(1);
            let decoded = decoder.decode(frame);
            twins.notice(now, &decoded);
            let _ = decoded.detail.json();
        };
        let mut noise = 1_u64;
        for round in 0..40 {
            for id in (0..0x800).filter(|id| round < 2 || matches!(id & 0x7F, 0 | 5 | 6)) {
                // Knuth's multiplicative generator: any bytes will do, as long as they are the same every time.
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
