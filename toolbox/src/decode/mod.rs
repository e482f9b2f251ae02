//! Decodes frames to text and JSON: service, node, values with names and units.

pub mod columns;
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

/// Decodes the frames of a bus in order. It remembers the values of SDO transfers, on which segments, units and PDO
/// mappings of later frames depend.
#[derive(Default)]
pub struct Decoder<'a> {
    nodes: BTreeMap<NodeId, DeviceValues<'a>>,
    channels: BTreeMap<NodeId, Channel>,
    pdos: HashMap<CobId, pdo::Configured<'a>>,
}

impl<'a> Decoder<'a> {
    /// A decoder without any data sheet.
    pub fn new() -> Self {
        Decoder::default()
    }

    /// Sets the data sheet of a node.
    pub fn introduce(&mut self, node: NodeId, device: &'a Device) {
        self.nodes.insert(node, DeviceValues::new(device));
        self.pdos = pdo::table(&self.nodes);
    }

    /// The values seen of a node; `None` without a data sheet.
    #[must_use]
    pub fn values(&self, node: NodeId) -> Option<&DeviceValues<'a>> {
        self.nodes.get(&node)
    }

    /// The current mapping of a PDO with a data sheet; empty for other frames.
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
            // The PDOs of a node with data sheet are decoded by its configuration.
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

/// The golden log in `cli/tests` checks the decoding of each kind of frame.
#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    const NODE: NodeId = NodeId::literal(5);

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
                // Knuth's linear congruential generator.
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
