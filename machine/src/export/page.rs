//! A page about a machine, in Markdown.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use lexican_runtime::CobId;
use lexican_runtime::object::Direction;
use lexican_toolbox::node::identity::words;
use lexican_toolbox::pdo::{summary, title};
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::report::ValueReport;

use crate::model::Machine;
use crate::nodes::MANAGER;
use crate::plan::Why;
use crate::wire::active;

impl Machine {
    /// A page about it in Markdown: bus, nodes, PDOs, what is written, how it boots. `picture` is the name of its picture.
    #[must_use]
    pub fn page(&self, picture: Option<&str>) -> String {
        // Writing to a string cannot fail.
        let mut page = format!("# {}\n", self.name.as_deref().unwrap_or("Machine"));
        if let Some(note) = &self.note {
            let _ = write!(page, "\n{note}\n");
        }
        let url = self.bus.url.as_ref().map(|url| format!("`{}`", url.value));
        let parts: Vec<_> =
            url.into_iter().chain(Some(self.bus_in_words()).filter(|words| !words.is_empty())).collect();
        let _ =
            write!(page, "\nBus: {}\n", if parts.is_empty() { "not described".to_owned() } else { parts.join(", ") });
        let unbounded = self.load().map(|load| load.unbounded).unwrap_or_default();
        if !unbounded.is_empty() {
            let _ = write!(page, "\nNot counted in that, since it may come at any time: {}.\n", unbounded.join(", "));
        }
        if let Some(picture) = picture {
            let _ = write!(page, "\n![The network]({picture})\n");
        }
        self.nodes_of_page(&mut page);
        self.pdos_of_page(&mut page);
        self.writes_of_page(&mut page);
        page
    }

    fn nodes_of_page(&self, page: &mut String) {
        page.push_str(
            "\n## Nodes\n\n| node | ID | data sheet | identity | error control |\n| --- | ---: | --- | --- | --- |\n",
        );
        let manager = self.bus.manager.map_or_else(|| "none".to_owned(), |id| id.to_string());
        let heartbeat =
            self.bus.heartbeat.as_ref().map_or_else(String::new, |time| format!("heartbeat {}", time.value));
        row(page, &[MANAGER, &manager, "", "", &heartbeat]);
        for node in &self.nodes {
            let name = if node.optional { format!("{} (optional)", node.name.value) } else { node.name.value.clone() };
            let identity = words(node.identity.parts()).collect::<Vec<_>>().join(", ");
            row(page, &[&name, &node.id_in_words(), &node.sheet_in_words(), &identity, &node.error_control()]);
        }
    }

    fn pdos_of_page(&self, page: &mut String) {
        let sent = self.sent();
        if sent.is_empty() {
            return;
        }
        page.push_str("\n## PDOs\n\n| from | to | PDO | objects |\n| --- | --- | --- | --- |\n");
        let mut takers: BTreeMap<CobId, Vec<&str>> = BTreeMap::new();
        for taken in self.nodes.iter().flat_map(|node| active(node, Direction::Receive)) {
            takers.entry(taken.state.cob_id.id()).or_default().push(&taken.node.name);
        }
        for it in &sent {
            let name = it.node.name.as_str();
            let (from, to) = match (it.state.name.direction, takers.get(&it.state.cob_id.id())) {
                (Direction::Receive, _) => (MANAGER, name.to_owned()),
                (Direction::Transmit, takers) => (name, takers.map_or_else(|| MANAGER.to_owned(), |it| it.join(", "))),
            };
            let objects: Vec<_> = it.state.mapping.iter().map(|mapped| title(mapped, it.node.device())).collect();
            let pdo = format!("{}: {}", it.state.name, summary(&it.state));
            row(page, &[from, &to, &pdo, &objects.join("; ")]);
        }
    }

    fn writes_of_page(&self, page: &mut String) {
        page.push_str("\n## What a boot writes\n");
        for node in &self.nodes {
            let _ = write!(page, "\n### {}\n\n", node.name.value);
            let mut values = node.device().map(DeviceValues::new);
            let (pdos, others): (Vec<_>, Vec<_>) =
                self.writes(node).into_iter().partition(|write| write.why == Why::Pdo);
            for write in &others {
                let report = ValueReport::of_bytes(values.as_ref(), write.address, &write.data);
                if let (Some(values), Some(value)) = (&mut values, &report.value) {
                    values.set(write.address, value);
                }
                let _ = writeln!(page, "- {} ({})", escaped(&report.equation()), write.why.name());
            }
            // The table of PDOs has them already.
            match pdos.len() {
                0 if others.is_empty() => page.push_str("Nothing.\n"),
                0 => {}
                count => _ = writeln!(page, "- {count} entries of PDOs"),
            }
        }
    }
}

fn row(page: &mut String, cells: &[&str]) {
    let cells: Vec<_> = cells.iter().map(|cell| escaped(cell)).collect();
    let _ = writeln!(page, "| {} |", cells.join(" | "));
}

/// A text in which nothing is Markdown.
fn escaped(text: &str) -> String {
    let mut out = String::new();
    for letter in text.chars() {
        if matches!(letter, '|' | '*' | '_' | '<' | '[' | '`' | '\\') {
            out.push('\\');
        }
        out.push(if letter.is_control() { ' ' } else { letter });
    }
    out
}
