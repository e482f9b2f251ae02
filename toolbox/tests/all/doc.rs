//! Pages about devices: an XML parser accepts them, and they contain what `eds dump --json` has. For the library, the
//! golden cases of all rules, and real data sheets, if there are any (`eds/tests/corpus_files`).

use std::collections::BTreeSet;
use std::{fs, thread};

use lexican_eds::dump::json;
use lexican_eds::model::Meaning;
use lexican_eds::{Input, Source, library};
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::doc::{Format, page};
use roxmltree::{Document, Node, ParsingOptions};
use serde_json::Value as Json;

use crate::{cases, corpus_files};

/// The largest page of a real data sheet, in bytes.
const LARGEST: usize = 2_500_000;

fn with_class<'d>(document: &'d Document<'d>, class: &str) -> Vec<Node<'d, 'd>> {
    let is = |node: &Node<'_, '_>| node.attribute("class").is_some_and(|all| all.split(' ').any(|it| it == class));
    document.descendants().filter(is).collect()
}

fn text(node: Node<'_, '_>) -> String {
    node.descendants().filter(Node::is_text).filter_map(|node| node.text()).collect::<Vec<_>>().join(" ")
}

fn count(json: &Json, list: &str, of_each: &str) -> usize {
    let all = json[list].as_array().into_iter().flatten();
    all.map(|it| it[of_each].as_array().map_or(0, Vec::len)).sum()
}

/// Compares the page of a data sheet with the command's output for programs. Returns its length.
#[track_caller]
fn check(sheet: &DataSheet) -> usize {
    let (page, name, json) = (page(sheet, Format::Html), sheet.input.eds.name(), json(&sheet.device));
    let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
    let document = Document::parse_with_options(&page, options).unwrap_or_else(|error| panic!("{name}: {error}"));
    // Objects, entries, and the content of PDOs.
    let rows = |class: &str| -> Vec<_> {
        let bodies = with_class(&document, class).into_iter().flat_map(|table| table.children());
        bodies
            .filter(|it| it.has_tag_name(("http://www.w3.org/1999/xhtml", "tbody")))
            .flat_map(|it| it.children())
            .collect()
    };
    let elements = |class: &str| rows(class).into_iter().filter(Node::is_element).count();
    let objects: Vec<_> = json["objects"].as_array().unwrap().iter().map(|it| it["index"].as_str().unwrap()).collect();
    let ids: Vec<_> = document.descendants().filter_map(|node| node.attribute("id")).collect();
    assert!(objects.iter().all(|index| ids.iter().filter(|id| *id == index).count() == 1), "{name}: {ids:?}");
    assert_eq!(elements("entries"), count(&json, "objects", "entries"), "{name}");
    let spans = with_class(&document, "pdo").into_iter().flat_map(|it| it.children());
    let spans = spans.filter(|it| it.tag_name().name() == "span" && it.attribute("class").is_none()).count();
    assert_eq!(spans, count(&json, "pdos", "mapping"), "{name}");
    assert_eq!(elements("findings"), sheet.diagnostics.len(), "{name}");
    // Nothing is loaded, and every link has a target.
    let unique: BTreeSet<_> = ids.iter().collect();
    assert_eq!(unique.len(), ids.len(), "{name}: an id is there twice");
    for node in document.descendants() {
        assert_eq!((node.attribute("src"), node.attribute("onclick")), (None, None));
        let Some(link) = node.attribute("href") else { continue };
        assert!(link.strip_prefix('#').is_some_and(|id| unique.contains(&id)), "{name}: {link}");
    }
    // Markdown has a heading for each object, and tables whose rows all have as many cells as the head.
    let markdown = lexican_toolbox::doc::page(sheet, Format::Markdown);
    for index in objects {
        assert!(markdown.contains(&format!("\n<a id=\"{index}\"></a>\n### {index}")), "{name}: {index}");
    }
    let cells = |line: &str| line.replace("\\\\", "").replace("\\|", "").matches('|').count();
    let lines: Vec<_> = markdown.lines().collect();
    for two in lines.windows(2).filter(|two| two.iter().all(|line| line.starts_with("| "))) {
        assert_eq!(cells(two[0]), cells(two[1]), "{name}: {two:?}");
    }
    page.len()
}

#[test]
fn pages_of_the_library_are_whole() {
    for shipped in library::all() {
        let sheet = DataSheet::load(shipped.id, &[]).unwrap();
        check(&sheet);
        // Each bit that the overlay names is a cell of a picture.
        let page = page(&sheet, Format::Html);
        let document =
            Document::parse_with_options(&page, ParsingOptions { allow_dtd: true, ..ParsingOptions::default() });
        let cells: BTreeSet<_> =
            with_class(document.as_ref().unwrap(), "word").into_iter().flat_map(|it| it.children()).map(text).collect();
        for entry in sheet.device.entries() {
            let Meaning::BitField(name) = &entry.meaning else { continue };
            for field in &sheet.device.bit_fields[name].fields {
                let cell = match (field.value.low, field.value.high) {
                    (low, high) if low == high => format!("{low} {}", field.name),
                    (low, high) if low / 16 == high / 16 => format!("{high}–{low} {}", field.name),
                    _ => continue,
                };
                assert!(cells.contains(&cell), "{}: {cell}\n{cells:?}", shipped.id);
            }
        }
    }
}

#[test]
fn a_page_says_what_a_manual_says() {
    let ag03 = DataSheet::load("siko/ag03-1", &[]).unwrap();
    let page = page(&ag03, Format::Markdown);
    for line in [
        "| Bit rates | 20 kbit/s, 50 kbit/s, 125 kbit/s, 250 kbit/s, 500 kbit/s, 1000 kbit/s |",
        "### RPDO3 ($NODEID + 400h, takes effect at once (255), fixed mapping)",
        "| 16–47 | [607A:00 Target Position](#607A) | INTEGER32 | increments while Spindle Pitch (2412:00) is 0.00 mm; 1/100 mm while Spindle Pitch (2412:00) is not 0.00 mm |",
        "| 4310h | overtemperature | Fault D: output stage above 90 °C. |",
        "| 10 | output stage without supply | Travelling is not possible. |",
        "| 01 | Output Stage<br/>Supply of the output stage.<br/>unit: 1/10 V | UNSIGNED16 | ro |  |  |  |",
        "Nothing is wrong with the data sheet.",
    ] {
        assert!(page.lines().any(|it| it == line), "{line}\n{page}");
    }
}

#[test]
fn a_configured_value_stands_beside_the_default_and_a_finding_beside_its_line() {
    let text = "[DeviceComissioning]\nNodeID=5\n[MandatoryObjects]\nSupportedObjects=2\n1=0x1001\n2=0x1014\n[1001]\n\
                ParameterName=<b>\"A\" & 'B'|]]>\nDataType=5\nAccessType=ro\n[1014]\nParameterName=EMCY\nDataType=7\n\
                AccessType=rw\nDefaultValue=$NODEID+0x80\nParameterValue=0x91\nLowLimit=5x\n";
    let sheet = DataSheet::parse(Input::new(Source::new("node.dcf", text)));
    check(&sheet);
    let page = page(&sheet, Format::Html);
    for part in [
        "085h <span class=\"small\">= 133 (00000085h)</span><br/><span class=\"set\">set to</span> 091h",
        "1001 &lt;b&gt;&quot;A&quot; &amp; 'B'|]]&gt;",
        "<td>node.dcf:17</td>",
        "eds::bad-value",
        // CiA 301 names the bits if no overlay does.
        "<i>3</i><b>temperature</b>",
    ] {
        assert!(page.contains(part), "{part}\n{page}");
    }
}

#[test]
fn every_data_sheet_has_a_page() {
    let mut inputs: Vec<_> = cases::cases().into_iter().map(|case| case.input).collect();
    inputs.extend(corpus_files::corpus().into_iter().flatten().step_by(8).filter_map(|path| {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        let is_sheet = ["eds", "dcf", "xdd", "xdc", "xpd"].contains(&extension.as_str());
        is_sheet
            .then(|| Input::new(Source::from_bytes(path.display().to_string(), &fs::read(path).unwrap_or_default())))
    }));
    thread::scope(|scope| {
        for half in inputs.chunks(inputs.len().div_ceil(4)) {
            scope.spawn(move || {
                for input in half {
                    let length = check(&DataSheet::parse(input.clone()));
                    assert!(length < LARGEST, "{}: {length}", input.eds.name());
                }
            });
        }
    });
}
