//! The layout of XML: an element in each line, two blanks for each depth, one blank between attributes, which keep their order;
//! hexadecimal digits of objects in upper case. Texts stay as they are, and so do comments; empty lines stay single.

use roxmltree::Node;

use super::document::{document, local, start_tag, tag};
use crate::text::Source;

/// Attributes of objects that are hexadecimal (CiA 311).
const HEX: [&str; 4] = ["index", "subIndex", "dataType", "objFlags"];

/// The XML in this layout; as it is if it is broken.
pub(crate) fn normalise(xml: &Source) -> String {
    let Ok(document) = document(xml.text()) else { return xml.text().to_owned() };
    let end = xml.end_of_line();
    let mut writer = Writer { xml: xml.text(), end, out: String::new() };
    let head = xml.text().trim_start();
    if let Some(declaration) = head.strip_prefix("<?xml ").and_then(|rest| rest.split_once("?>")) {
        writer.out.extend(["<?xml ", declaration.0.trim_end(), "?>", end]);
    }
    document.root().children().for_each(|node| writer.node(node, 0));
    writer.out
}

struct Writer<'x> {
    xml: &'x str,
    end: &'static str,
    out: String,
}

impl Writer<'_> {
    fn node(&mut self, node: Node<'_, '_>, depth: usize) {
        let whole = &self.xml[node.range()];
        if node.is_text() {
            // Between elements, an empty line stays; other texts are written with their element.
            let has_neighbours = node.prev_sibling().is_some() && node.next_sibling().is_some();
            if whole.matches('\n').count() > 1 && has_neighbours {
                self.out.push_str(self.end);
            }
            return;
        }
        self.out.extend(std::iter::repeat_n("  ", depth));
        let is_plain = |child: Node<'_, '_>| child.is_text() && !child.text().unwrap_or_default().trim().is_empty();
        let start = if node.is_element() { self.start(node) } else { whole.to_owned() };
        if !node.is_element() {
            self.out.push_str(&start);
        } else if !node.has_children() {
            self.out.extend([&start, " />"]);
        } else if node.children().any(is_plain) || node.children().all(|child| child.is_text()) {
            // A text, or a text with elements in it: blanks may matter.
            let from = node.first_child().map_or(node.range().end, |child| child.range().start);
            self.out.extend([&start, ">", &self.xml[from..node.range().end]]);
        } else {
            self.out.extend([&start, ">", self.end]);
            node.children().for_each(|child| self.node(child, depth + 1));
            self.out.extend(std::iter::repeat_n("  ", depth));
            self.out.extend(["</", &self.xml[tag(node)], ">"]);
        }
        self.out.push_str(self.end);
    }

    /// The start tag without its end: the name and the attributes, namespaces among them.
    fn start(&self, node: Node<'_, '_>) -> String {
        let is_object = matches!(local(node), "CANopenObject" | "CANopenSubObject");
        let mut start = format!("<{}", &self.xml[tag(node)]);
        let mut rest = &start_tag(node)[start.len()..];
        while let Some((name, after)) = rest.split_once('=') {
            let after = after.trim_start();
            let quote = if after.starts_with('\'') { '\'' } else { '"' };
            let Some((value, others)) = after.get(1..).and_then(|after| after.split_once(quote)) else { break };
            let name = name.trim();
            let is_hex = is_object && HEX.contains(&name) && value.bytes().all(|byte| byte.is_ascii_hexdigit());
            let value = if is_hex { value.to_ascii_uppercase() } else { value.to_owned() };
            start.extend([" ", name, "="]);
            start.push(quote);
            start.push_str(&value);
            start.push(quote);
            rest = others;
        }
        start
    }
}
