//! A picture of the network.

use lexican_pictures::network::{Message, Network, Node};
use lexican_runtime::object::Direction;
use lexican_toolbox::pdo::{summary, title};

use crate::model::Machine;
use crate::nodes::MANAGER;
use crate::wire::{Sent, active};

impl Machine {
    /// A picture of the network as SVG: the nodes on the bus, and senders and receivers of each PDO.
    #[must_use]
    pub fn picture(&self) -> String {
        let mut lines = Vec::new();
        lines.extend(self.bus.manager.map(|id| format!("node {id}")));
        lines.extend(self.bus.heartbeat.as_ref().map(|time| format!("heartbeat {}", time.value)));
        let mut nodes = vec![Node { name: MANAGER.to_owned(), lines, messages: Vec::new() }];
        for node in &self.nodes {
            let id = node.id.map_or_else(|| "node-ID by LSS".to_owned(), |id| format!("node {id}"));
            let optional = if node.optional { ", optional" } else { "" };
            let is_sent = |sent: &Sent<'_>| sent.state.name.direction == Direction::Transmit;
            let messages = [Direction::Transmit, Direction::Receive].into_iter().flat_map(|way| active(node, way));
            // An RPDO that the file does not mention is sent by nobody.
            let messages = messages.filter(|sent| is_sent(sent) || sent.place.is_some());
            let message = |sent: Sent<'_>| {
                let objects: Vec<_> = sent.state.mapping.iter().map(|it| title(it, node.device())).collect();
                Message {
                    id: sent.state.cob_id.id().raw(),
                    is_sent: is_sent(&sent),
                    what: objects.join(", "),
                    note: format!("{}  {}", sent.state.name, summary(&sent.state)),
                }
            };
            nodes.push(Node {
                name: node.name.value.clone(),
                lines: vec![format!("{id}{optional}"), node.sheet_in_words(), node.error_control()],
                messages: messages.map(message).collect(),
            });
        }
        let title = self.name.clone().unwrap_or_else(|| "Machine".to_owned());
        Network { title, subtitle: self.bus_in_words(), nodes }.svg()
    }
}
