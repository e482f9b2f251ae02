//! Parses YAML with places, in the dialect of PyYAML, which dcfgen and cogen use: merge keys, and the numbers of YAML
//! 1.1.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::rc::Rc;

use lexican_eds::Severity;
use saphyr_parser::{Event, Marker, Parser};

use crate::at::At;
use crate::read::Out;

/// The deepest nesting that is read, more than any such file has.
const DEEPEST: usize = 32;

/// A value with its place. Aliases share their value.
#[derive(Clone, Debug)]
pub(super) struct Yaml {
    pub(super) at: Range<usize>,
    pub(super) node: Rc<Node>,
}

#[derive(Debug)]
pub(super) enum Node {
    Scalar(String),
    List(Vec<Yaml>),
    Map(Vec<(At<String>, Yaml)>),
}

impl Yaml {
    pub(super) fn text(&self) -> Option<&str> {
        if let Node::Scalar(text) = &*self.node { Some(text) } else { None }
    }

    pub(super) fn list(&self) -> Option<&[Yaml]> {
        if let Node::List(list) = &*self.node { Some(list) } else { None }
    }

    pub(super) fn map(&self) -> Option<&[(At<String>, Yaml)]> {
        if let Node::Map(map) = &*self.node { Some(map) } else { None }
    }

    /// An integer: `10`, `0x6040`, `1_000`, or octal `010`.
    pub(super) fn integer(&self) -> Option<i64> {
        let text = self.text()?.replace('_', "");
        let (sign, digits) = text.strip_prefix('-').map_or((1, text.as_str()), |digits| (-1, digits));
        let number = match digits.strip_prefix("0x") {
            Some(digits) => i64::from_str_radix(digits, 16),
            None if digits.len() > 1 && digits.starts_with('0') => i64::from_str_radix(digits, 8),
            None => digits.parse(),
        };
        number.ok().filter(|number| *number >= 0).map(|number| sign * number)
    }

    pub(super) fn boolean(&self) -> Option<bool> {
        match self.text()?.to_lowercase().as_str() {
            "true" | "yes" | "on" => Some(true),
            "false" | "no" | "off" => Some(false),
            _ => None,
        }
    }
}

/// A list or table that is still being read.
struct Open {
    anchor: usize,
    start: usize,
    is_map: bool,
    values: Vec<Yaml>,
}

/// Reads the first document of a text.
pub(super) fn read(text: &str, out: &mut Out) -> Option<Yaml> {
    // The parser counts characters, findings count bytes.
    let places: Vec<usize> = text.char_indices().map(|(at, _)| at).collect();
    let place = |marker: &Marker| places.get(marker.index()).copied().unwrap_or(text.len());
    let mut anchors: BTreeMap<usize, Yaml> = BTreeMap::new();
    let mut open: Vec<Open> = Vec::new();
    for event in Parser::new_from_str(text) {
        let (event, span) = match event {
            Ok(event) => event,
            Err(error) => {
                let at = place(error.marker());
                out.wrong("bus-yml::syntax", &(at..at), error.info(), None);
                return None;
            }
        };
        let at = place(&span.start)..place(&span.end);
        let (anchor, yaml) = match event {
            Event::SequenceStart(anchor, _) | Event::MappingStart(anchor, _) => {
                if open.len() == DEEPEST {
                    out.wrong("bus-yml::syntax", &at, "this is too deep for a bus.yml", None);
                    return None;
                }
                let is_map = matches!(event, Event::MappingStart(..));
                open.push(Open { anchor, start: at.start, is_map, values: Vec::new() });
                continue;
            }
            Event::Scalar(text, _, anchor, _) => (anchor, Yaml { at, node: Rc::new(Node::Scalar(text.into_owned())) }),
            Event::Alias(anchor) => match anchors.get(&anchor) {
                Some(known) => (0, known.clone()),
                None => {
                    out.wrong("bus-yml::syntax", &at, "this names what has not ended yet", None);
                    return None;
                }
            },
            Event::SequenceEnd | Event::MappingEnd => {
                let Open { anchor, start, is_map, values } = open.pop()?;
                let node = if is_map { Node::Map(table(values, out)) } else { Node::List(values) };
                (anchor, Yaml { at: start..at.end.max(start), node: Rc::new(node) })
            }
            _ => continue,
        };
        if anchor > 0 {
            anchors.insert(anchor, yaml.clone());
        }
        match open.last_mut() {
            Some(outer) => outer.values.push(yaml),
            None => return Some(yaml),
        }
    }
    None
}

/// Makes a table of alternating keys and values. The last of equal keys counts; merged keys are overridden by the
/// table's own.
fn table(values: Vec<Yaml>, out: &mut Out) -> Vec<(At<String>, Yaml)> {
    let (mut own, mut merged) = (Vec::new(), Vec::new());
    for pair in values.chunks_exact(2) {
        let [key, value] = pair else { continue };
        match key.text() {
            Some("<<") => merged.extend(match &*value.node {
                Node::List(several) => several.clone(),
                _ => vec![value.clone()],
            }),
            Some(name) => own.push((At { value: name.to_owned(), span: key.at.clone() }, value.clone())),
            None => out.wrong("bus-yml::key", &key.at, "a key is a word", None),
        }
    }
    let mut names = BTreeSet::new();
    own.reverse();
    own.retain(|(key, _)| {
        let is_first = names.insert(key.value.clone());
        if !is_first {
            let what = format!("`{}` comes again below, and only that counts", key.value);
            out.push(Severity::Warning, "bus-yml::key", &key.span, what, None);
        }
        is_first
    });
    own.reverse();
    for (key, value) in merged.iter().filter_map(Yaml::map).flatten() {
        if names.insert(key.value.clone()) {
            own.push((key.clone(), value.clone()));
        }
    }
    own
}
