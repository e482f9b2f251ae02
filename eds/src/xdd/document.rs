//! The XML as a tree, within bounds.

use std::ops::Range;

use roxmltree::{Attribute, Document, Error, Node, ParsingOptions};

use super::NAMESPACES;

/// The largest XML that is read, in bytes: some ten times as much as the largest data sheet known would be.
const MAX_BYTES: usize = 16 << 20;
const MAX_NODES: u32 = 1_000_000;
/// Attributes of one element are compared with each other, so that their number counts twice.
const MAX_ATTRIBUTES: usize = 1000;
/// An element that declares namespaces gets a list of its own, of all prefixes that hold there.
const MAX_NAMESPACES: usize = 10_000;
const MAX_PREFIXES: usize = 100;

/// Why an XML is not read, where, and what to do.
pub(super) struct Refused {
    pub(super) why: String,
    pub(super) at: usize,
    pub(super) help: &'static str,
}

/// The tree of an XDD, XDC or XPD.
pub(super) fn document(text: &str) -> Result<Document<'_>, Refused> {
    const BROKEN: &str = "export the file again, or mend it with an editor for XML";
    bounds(text)?;
    let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| {
        let why = match &error {
            Error::DtdDetected => "the XML has a document type definition, which no data sheet needs".to_owned(),
            Error::NodesLimitReached => format!("the XML has more than {MAX_NODES} nodes"),
            other => format!("the XML is broken: {other}"),
        };
        Refused { why, at: offset(text, &error), help: BROKEN }
    })?;
    let root = document.root_element();
    let (name, namespace, at) = (local(root), root.tag_name().namespace(), root.range().start);
    if !matches!(name, "ISO15745ProfileContainer" | "ISO15745Profile") {
        let why = format!("this is XML, but no data sheet: it begins with `{name}`");
        return Err(Refused { why, at, help: "an XDD, XDC or XPD begins with `ISO15745ProfileContainer`" });
    }
    if let Some(unknown) = namespace.filter(|namespace| !NAMESPACES.contains(namespace)) {
        let why = format!("the namespace `{unknown}` is none of CiA 311");
        let help =
            "CANopen FD (CiA 1311) and other formats are not read: ask the vendor for an XDD of CiA 311, or for an EDS";
        return Err(Refused { why, at, help });
    }
    Ok(document)
}

/// What would cost too much time or memory before the first node is counted.
fn bounds(text: &str) -> Result<(), Refused> {
    const LARGE: &str = "a data sheet is far smaller: see whether it is one";
    let refused = |why: String, at: usize| Err(Refused { why, at, help: LARGE });
    if text.len() > MAX_BYTES {
        return refused(format!("the XML has more than {MAX_BYTES} bytes, which is as many as are read"), 0);
    }
    let (mut elements, mut attributes) = (0, 0);
    for (at, byte) in text.bytes().enumerate() {
        match byte {
            b'<' => (elements, attributes) = (elements + 1, 0),
            b'=' => attributes += 1,
            _ => continue,
        }
        if elements > 2 * MAX_NODES {
            return refused(format!("the XML has more than {MAX_NODES} nodes"), at);
        }
        if attributes > MAX_ATTRIBUTES {
            return refused(format!("an element has more than {MAX_ATTRIBUTES} attributes"), at);
        }
    }
    for (word, most) in [("xmlns", MAX_NAMESPACES), ("xmlns:", MAX_PREFIXES)] {
        if let Some((at, _)) = text.match_indices(word).nth(most) {
            return refused(format!("the XML has `{word}` more than {most} times"), at);
        }
    }
    Ok(())
}

/// Where an error is, in bytes; its columns count characters.
fn offset(text: &str, error: &Error) -> usize {
    let place = error.pos();
    let lines = text.split_inclusive('\n').take(place.row.saturating_sub(1) as usize);
    let start: usize = lines.map(str::len).sum();
    let column = text[start..].char_indices().nth(place.col.saturating_sub(1) as usize);
    column.map_or(text.len(), |(at, _)| start + at)
}

/// Tools differ in which elements they put into the namespace, so it says nothing.
pub(super) fn local<'i>(node: Node<'_, 'i>) -> &'i str {
    node.tag_name().name()
}

pub(super) fn children<'d, 'i>(node: Node<'d, 'i>, name: &str) -> impl Iterator<Item = Node<'d, 'i>> {
    node.children().filter(move |child| child.is_element() && local(*child) == name)
}

/// The first element on a path.
pub(super) fn find<'d, 'i>(node: Node<'d, 'i>, path: &[&str]) -> Option<Node<'d, 'i>> {
    match path {
        [] => Some(node),
        [name, rest @ ..] => children(node, name).find_map(|child| find(child, rest)),
    }
}

/// A text or a value, and its place.
#[derive(Clone, Debug)]
pub(super) struct Said<'d> {
    pub(super) text: &'d str,
    pub(super) at: Range<usize>,
}

pub(super) fn attribute<'d>(node: Node<'d, '_>, name: &str) -> Option<Said<'d>> {
    node.attributes().find(|attribute| attribute.name() == name).as_ref().map(said)
}

fn said<'d>(attribute: &Attribute<'d, '_>) -> Said<'d> {
    Said { text: attribute.value(), at: attribute.range_value() }
}

/// The text in an element; empty if there is none.
pub(super) fn text<'d>(node: Node<'d, '_>) -> Said<'d> {
    let inner = node.children().find(Node::is_text);
    Said { text: node.text().unwrap_or_default(), at: inner.map_or(tag(node), |inner| inner.range()) }
}

/// The name of an element in its start tag.
pub(super) fn tag(node: Node<'_, '_>) -> Range<usize> {
    let start = node.range().start + 1;
    let name = &node.document().input_text()[start..];
    start..start + name.find(|c: char| c.is_whitespace() || matches!(c, '/' | '>')).unwrap_or(name.len())
}

/// The start tag of an element, without the `>` or `/>` that ends it.
pub(super) fn start_tag<'d>(node: Node<'d, '_>) -> &'d str {
    let (text, at) = (node.document().input_text(), node.range());
    let tag = match node.first_child() {
        Some(child) => &text[at.start..child.range().start],
        // Values of attributes have no `<`, but they may have `>`.
        None => text[at.clone()].rsplit_once("</").map_or(&text[at], |(tag, _)| tag),
    };
    tag.strip_suffix("/>").or(tag.strip_suffix('>')).unwrap_or(tag).trim_end()
}
