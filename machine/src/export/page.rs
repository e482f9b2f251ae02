//! Documents a machine on a page, in HTML or Markdown.

use std::collections::BTreeMap;

use lexican_eds::meanings::complete;
use lexican_runtime::CobId;
use lexican_runtime::object::Direction;
use lexican_toolbox::doc::{Chapters, Format, Markup, Page};
use lexican_toolbox::node::identity::words;
use lexican_toolbox::pdo::{summary, title};
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::report::ValueReport;

use crate::model::{Machine, Node};
use crate::nodes::MANAGER;
use crate::plan::Why;
use crate::wire::active;

impl Machine {
    /// A page about bus, nodes, PDOs and values that are written. In HTML, it includes the data sheet of each node with
    /// these values. `picture` is the name of the network's picture, which HTML embeds.
    #[must_use]
    pub fn page(&self, format: Format, picture: Option<&str>) -> String {
        let mut page = Page::new(format, self.name.as_deref().unwrap_or("Machine"));
        page.paragraph(self.note.as_deref().unwrap_or_default());
        let url = self.bus.url.as_ref().map(|url| url.value.clone());
        let parts: Vec<_> = url.into_iter().chain([self.bus_in_words()]).filter(|words| !words.is_empty()).collect();
        page.paragraph(if parts.is_empty() {
            "Bus: not described".into()
        } else {
            "Bus: ".to_owned() + &parts.join(", ")
        });
        let unbounded = self.load().map(|load| load.unbounded).unwrap_or_default();
        if !unbounded.is_empty() {
            let all = unbounded.join(", ");
            page.paragraph(format!("Not counted in that, since it may come at any time: {all}."));
        }
        if let Some(picture) = picture {
            page.picture("The network", picture, || self.picture());
        }
        self.nodes_of_page(&mut page);
        self.pdos_of_page(&mut page);
        self.nodes.iter().for_each(|node| self.node_of_page(node, &mut page));
        page.finish()
    }

    fn nodes_of_page(&self, page: &mut Page) {
        page.heading(2, "nodes", "Nodes", "");
        let manager = self.bus.manager.map_or_else(|| "none".to_owned(), |id| id.to_string());
        let heartbeat =
            self.bus.heartbeat.as_ref().map_or_else(String::new, |time| format!("heartbeat {}", time.value));
        let mut rows = vec![[MANAGER, &manager, "", "", &heartbeat].map(Markup::from)];
        for node in &self.nodes {
            let name = Markup::link(node.name.as_str(), node.name.as_str());
            let name = if node.optional { name.and("(optional)") } else { name };
            let identity = words(node.identity.parts()).collect::<Vec<_>>().join(", ");
            let rest = [node.id_in_words(), node.sheet_in_words(), identity, node.error_control()];
            let [id, sheet, identity, error_control] = rest.map(Markup::from);
            rows.push([name, id, sheet, identity, error_control]);
        }
        page.table("", ["node", "ID", "data sheet", "identity", "error control"], rows);
    }

    fn pdos_of_page(&self, page: &mut Page) {
        let sent = self.sent();
        if sent.is_empty() {
            return;
        }
        page.heading(2, "wires", "PDOs", "");
        let mut takers: BTreeMap<CobId, Vec<&str>> = BTreeMap::new();
        for taken in self.nodes.iter().flat_map(|node| active(node, Direction::Receive)) {
            takers.entry(taken.state.cob_id.id()).or_default().push(&taken.node.name);
        }
        let rows = sent.iter().map(|it| {
            let name = it.node.name.as_str();
            let (from, to) = match (it.state.name.direction, takers.get(&it.state.cob_id.id())) {
                (Direction::Receive, _) => (MANAGER, name.to_owned()),
                (Direction::Transmit, takers) => (name, takers.map_or_else(|| MANAGER.to_owned(), |it| it.join(", "))),
            };
            let objects: Vec<_> = it.state.mapping.iter().map(|mapped| title(mapped, it.node.device())).collect();
            let pdo = format!("{}: {}", it.state.name, summary(&it.state));
            [from.into(), to.into(), pdo.into(), objects.join("; ").into()]
        });
        page.table("", ["from", "to", "PDO", "objects"], rows.collect());
    }

    /// The chapter of a node: what a boot writes, and the data sheet with these values.
    fn node_of_page(&self, node: &Node, page: &mut Page) {
        let name = node.name.as_str();
        page.heading(2, name, name, &format!("node-ID {}, {}", node.id_in_words(), node.sheet_in_words()));
        let mut values = node.device().map(DeviceValues::new);
        let (pdos, others): (Vec<_>, Vec<_>) = self.writes(node).into_iter().partition(|write| write.why == Why::Pdo);
        page.paragraph(match (others.len(), pdos.len()) {
            (0, 0) => "A boot writes nothing.".to_owned(),
            (_, 0) => "A boot writes:".to_owned(),
            (_, pdos) => format!("A boot writes {pdos} entries of PDOs, and:"),
        });
        let rows = others.iter().map(|write| {
            let report = ValueReport::of_bytes(values.as_ref(), write.address, &write.data);
            if let (Some(values), Some(value)) = (&mut values, &report.value) {
                values.set(write.address, value);
            }
            [report.title().into(), report.text().into(), write.why.name().into()]
        });
        page.table("", ["entry", "value", "why"], rows.collect());
        if let (Format::Html, Some(sheet), Some(device)) = (page.format, &node.sheet, self.configured(node)) {
            Chapters::new(page, &complete(&device), 3, &format!("{name}-")).all(sheet);
        }
    }
}
