//! Exports a machine: DCFs, the list of nodes and a CAN database for other tools, a page and a picture for people.

mod page;
mod picture;

use std::fmt::Write as _;
use std::path::Path;

use lexican_eds::model::{Commissioning, Device};
use lexican_runtime::NodeId;
use lexican_toolbox::decode::wireshark;
use lexican_toolbox::pdo::dbc::{self, Database};
use lexican_toolbox::values::wire::parse_padded;

use crate::draft::entry_mut;
use crate::model::{Machine, Node};

impl Machine {
    /// The contents of a node's DCF: its data sheet with everything that a boot writes, node-ID, name and bit rate.
    /// `None` without a data sheet.
    #[must_use]
    pub fn configured(&self, node: &Node) -> Option<Device> {
        let mut device = node.device()?.clone();
        // If an entry is written several times, the last value counts.
        for write in self.writes(node) {
            if let Some(entry) = entry_mut(&mut device, write.address) {
                entry.configured = parse_padded(entry.data_type, &write.data);
            }
        }
        device.describe_pdos();
        let serial = node.identity.serial;
        let known = device.commissioning.take().unwrap_or_default();
        device.commissioning = Some(Commissioning {
            node_id: node.id.map(NodeId::get).or(known.node_id),
            node_name: Some(node.name.value.clone()),
            node_designator: node.designator.clone().or(known.node_designator),
            bit_rate_kbit: self.bus.bit_rate.and_then(|rate| u16::try_from(rate / 1000).ok()).or(known.bit_rate_kbit),
            network_name: self.network_name().map(str::to_owned).or(known.network_name),
            network_designator: self.bus.designator.clone().or(known.network_designator),
            serial_number: serial.or(known.serial_number),
            ..known
        });
        device.file.last_eds = device.file.name.replace(format!("{}.dcf", node.name.value));
        Some(device)
    }

    /// The DCF of a node (CiA 306-1); `None` without a data sheet.
    #[must_use]
    pub fn dcf(&self, node: &Node) -> Option<String> {
        self.configured(node).as_ref().map(lexican_eds::write::dcf)
    }

    /// The name of the bus, or else of the machine.
    fn network_name(&self) -> Option<&str> {
        self.bus.name.as_ref().map(|name| name.as_str()).or(self.name.as_deref())
    }

    /// The list of all nodes on all buses, with their DCFs (CiA 306-3, `nodelist.cpj`).
    #[must_use]
    pub fn node_list(&self) -> String {
        let mut list = String::new();
        let mut line = |text: std::fmt::Arguments<'_>| {
            let _ = write!(list, "{}\r\n", text.to_string().replace(char::is_control, " "));
        };
        for (machine, number) in self.buses().zip(1..) {
            match number {
                1 => line(format_args!("[Topology]")),
                number => line(format_args!("[Topology{number}]")),
            }
            if let Some(name) = machine.network_name() {
                line(format_args!("NetName={name}"));
            }
            if let Some(designator) = &machine.bus.designator {
                line(format_args!("NetRefd={designator}"));
            }
            let mut nodes: Vec<_> = machine.nodes.iter().filter_map(|node| Some((node.id?.get(), node))).collect();
            nodes.sort_by_key(|(id, _)| *id);
            line(format_args!("Nodes=0x{:02X}", nodes.len()));
            for (id, node) in nodes {
                let name = &node.name.value;
                line(format_args!("Node{id}Present=0x01"));
                line(format_args!("Node{id}Name={name}"));
                let known = || node.device()?.commissioning.as_ref()?.node_designator.as_ref();
                if let Some(designator) = node.designator.as_ref().or_else(known) {
                    line(format_args!("Node{id}Refd={designator}"));
                }
                if node.sheet.is_some() {
                    line(format_args!("Node{id}DCFName={name}.dcf"));
                }
            }
        }
        list
    }

    /// The CAN database of the nodes that have both a data sheet and a node-ID.
    #[must_use]
    pub fn database(&self) -> Database {
        let devices = self.configured_nodes();
        let nodes: Vec<_> =
            devices.iter().map(|(node, id, device)| dbc::Node::named(&node.name, *id, device)).collect();
        Database::new(&nodes)
    }

    /// A Wireshark script for the nodes that have both a data sheet and a node-ID.
    #[must_use]
    pub fn wireshark_script(&self) -> String {
        let devices = self.configured_nodes();
        wireshark::script(devices.iter().map(|(node, id, device)| (node.name.value.clone(), *id, device)))
    }

    /// The nodes that have both a data sheet and a node-ID, with their contents after a boot.
    fn configured_nodes(&self) -> Vec<(&Node, NodeId, Device)> {
        self.nodes.iter().filter_map(|node| Some((node, node.id?, self.configured(node)?))).collect()
    }

    /// The bus in a sentence: `500 kbit/s, SYNC every 10 ms, busy for 12.0 % in the worst case`.
    fn bus_in_words(&self) -> String {
        let bus = &self.bus;
        let mut parts = Vec::new();
        parts.extend(bus.bit_rate.map(|rate| format!("{} kbit/s", rate / 1000)));
        parts.extend(bus.sync.map(|sync| format!("SYNC every {sync}")));
        parts.extend(self.load().map(|load| format!("busy for {:.1} % in the worst case", load.percent)));
        parts.join(", ")
    }
}

impl Node {
    /// How the node is watched: `heartbeat 100 ms`.
    fn error_control(&self) -> String {
        match (self.heartbeat, self.guarding) {
            (Some(time), _) => format!("heartbeat {time}"),
            (None, Some(time)) => format!("guarding {time}, retry {}", self.retry),
            (None, None) => "not watched".to_owned(),
        }
    }

    /// Its id in the library, or the name of its file.
    fn sheet_in_words(&self) -> String {
        let Some(name) = &self.sheet_name else { return "no data sheet".to_owned() };
        let is_known = self.sheet.as_ref().is_some_and(|sheet| sheet.library.is_some());
        let file = Path::new(name).file_name().filter(|_| !is_known);
        file.map_or_else(|| name.clone(), |file| file.to_string_lossy().into_owned())
    }

    fn id_in_words(&self) -> String {
        self.id.map_or_else(|| "by LSS".to_owned(), |id| id.to_string())
    }
}
