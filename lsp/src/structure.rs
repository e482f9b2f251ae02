//! Outline, folding, go to definition, and rename.

use lexican_eds::edit::renumber;
use lexican_eds::outline::{Outline, Section};
use lexican_eds::{Source, Span};
use lexican_machine::Machine;
use lexican_toolbox::values::text::parse_hex;
use serde_json::{Value, json};

use crate::document::{Document, Kind, uri_of};
use crate::hover::object;
use crate::place::{Part, place};

/// Groups the sections: those of an object together, each other one alone.
fn objects<'o>(outline: &'o Outline<'_>) -> impl Iterator<Item = &'o [Section]> {
    let index = |section: &Section| section.object.map(|(index, _)| index);
    outline.sections.chunk_by(move |section, next| index(section).is_some() && index(section) == index(next))
}

fn lines_of(object: &[Section]) -> [u32; 2] {
    [object[0].lines[0], object[object.len() - 1].lines[1]]
}

/// The `DocumentSymbol`s: sections with sub-indices nested in their objects, or the tables of TOML.
pub(crate) fn symbols(document: &Document) -> Vec<Value> {
    const OBJECT: u8 = 19;
    let symbol = |section: &Section, [first, last]: [u32; 2], children: Vec<Value>| {
        let named = section.object.and_then(|(index, sub)| {
            let object = document.device.object(index)?;
            Some(sub.map_or(Some(&object.name), |sub| object.entry(sub).map(|entry| &entry.name))?.as_str())
        });
        // Clients refuse a symbol without a name.
        let name = document.source().get(section.name).trim_start_matches('[');
        let name = [&[if name.is_empty() { "[]" } else { name }], named.as_slice()].concat().join(" ");
        let [(start, _), (_, end)] = [first, last].map(|line| document.source().line_range(line as usize));
        json!({
            "name": name,
            "kind": OBJECT,
            "range": document.range(Span::eds(start, end)),
            "selectionRange": document.range(section.name),
            "children": children,
        })
    };
    let whole = |object: &[Section]| {
        let below = object[1..].iter().map(|section| symbol(section, section.lines, Vec::new()));
        symbol(&object[0], lines_of(object), below.collect())
    };
    objects(&Outline::new(document.source())).map(whole).collect()
}

/// The `FoldingRange`s: objects including their sub-indices, each sub-index, and every other section.
pub(crate) fn folds(document: &Document) -> Vec<Value> {
    let below = |object: &[Section]| object[1..].iter().map(|section| section.lines).collect();
    let of_object = |object: &[Section]| [vec![lines_of(object)], below(object)].concat();
    let outline = Outline::new(document.source());
    let all = objects(&outline).flat_map(of_object).filter(|[first, last]| first < last);
    all.map(|[first, last]| json!({ "startLine": first, "endLine": last })).collect()
}

/// The `Location` of the object or file that is named at an offset.
pub(crate) fn definition(document: &Document, offset: u32) -> Option<Value> {
    let source = document.source();
    if document.kind == Kind::Sheet {
        let outline = Outline::new(source);
        let mention = outline.mention_at(offset)?;
        return section(document, source, &document.uri, mention.index, mention.sub);
    }
    let place = place(source.text(), offset as usize)?;
    let word = &source.text()[place.word.clone()];
    if let Some((device, address, sub)) = object(document, &place, word) {
        let mut nodes = document.machine.iter().flat_map(Machine::buses).flat_map(|machine| &machine.nodes);
        let of_node = nodes.find_map(|node| node.sheet.as_ref().filter(|sheet| std::ptr::eq(&sheet.device, device)));
        let sheet = of_node.map_or(&document.input.eds, |sheet| &sheet.input.eds);
        return section(document, sheet, &uri_of(sheet.name().as_ref())?, address.index(), sub);
    }
    let uri = uri_of(&document.path.with_file_name(word)).filter(|_| place.part == Part::Value)?;
    let start = json!({ "line": 0, "character": 0 });
    Some(json!({ "uri": uri, "range": { "start": start, "end": start } }))
}

fn section(document: &Document, sheet: &Source, uri: &str, index: u16, sub: Option<u8>) -> Option<Value> {
    let outline = Outline::new(sheet);
    let name = outline.describing(index, sub)?.name;
    Some(json!({ "uri": uri, "range": document.range_in(sheet, name) }))
}

/// The `Range` of an index of a data sheet, if one is at this offset: only indices can be renamed.
pub(crate) fn prepare_rename(document: &Document, offset: u32) -> Option<Value> {
    let here = Outline::new(document.source()).mention_at(offset)?;
    let range = document.range(here.span);
    Some(json!({ "range": range, "placeholder": format!("{:04X}", here.index) }))
}

/// The `WorkspaceEdit` that gives the object at an offset another index, or the reason why not.
pub(crate) fn rename(document: &Document, offset: u32, name: &str) -> Result<Value, String> {
    let here = Outline::new(document.source()).mention_at(offset).ok_or("there is no index of an object here")?;
    let to = parse_hex(name.trim(), 4).ok_or_else(|| format!("{name:?} is no index: write four hexadecimal digits"))?;
    let patch = renumber(document.source(), here.index, to).map_err(|error| error.to_string())?;
    Ok(document.workspace_edit(&patch.apply(document.source())))
}
