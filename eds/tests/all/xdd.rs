//! Data sheets in XML: reading them, and converting there and back without loss.

use lexican_eds::convert::{Format, losses};
use lexican_eds::model::{Device, Meaning, Value};
use lexican_eds::{Diagnostics, Input, Source, dump, library, load, write, xdd};
use proptest::prelude::*;

use crate::cases::cases;
use crate::exercise;

const EDITOR: &str = include_str!("../xdd/editor.xdd");
const INLINE: &str = include_str!("../xdd/inline.xdc");

fn read(name: &str, text: &str) -> (Device, Diagnostics) {
    let (mut device, findings) = load(&Input::new(Source::new(name, text)));
    device.clear_spans();
    (device, findings)
}

/// The rows of a dump, without the number of the object's flags and unconfigured values.
fn rows(device: &Device) -> Vec<String> {
    dump::csv(device).lines().skip(1).map(str::to_owned).collect()
}

#[test]
fn objects_are_what_their_parameters_say() {
    let (device, findings) = read("valve.xdd", EDITOR);
    let expected = [
        "1000,00,Device type,VAR,UNSIGNED32,ro,0,983441,,,,0",
        "1001,00,Error register,VAR,UNSIGNED8,ro,1,,,,,0",
        "1014,00,COB-ID EMCY,VAR,UNSIGNED32,rw,0,$NODEID+0x80,,,,0",
        "1017,00,Producer heartbeat time,VAR,UNSIGNED16,rw,0,,,,,0",
        "1018,00,Highest sub-index,RECORD,UNSIGNED8,const,0,1,,,,0",
        "1018,01,Vendor-ID,RECORD,UNSIGNED32,ro,0,405,,,,0",
        "2000,00,Mode,VAR,UNSIGNED8,rww,1,0,,,,2",
        "2001,00,Highest sub-index,ARRAY,UNSIGNED8,const,0,1,,,,0",
        "2001,01,Upper end,ARRAY,INTEGER16,rwr,1,-5,-10,16,,0",
        "2002,00,Key,VAR,OCTET_STRING,wo,0,563412,,,,0",
        "2003,00,Log,VAR,DOMAIN,rw,0,,,,,0",
    ];
    assert_eq!(rows(&device), expected);
    let (file, info) = (&device.file, &device.info);
    let text = |text: &Option<String>| text.clone().unwrap_or_default();
    assert_eq!((file.version, file.revision, text(&file.description)), (Some(3), Some(1), "A valve.".into()));
    assert_eq!((text(&file.creation_date), text(&file.creation_time)), ("03-01-2026".into(), "09:30PM".into()));
    assert_eq!((text(&info.vendor_name), info.vendor_number), ("Nobody & Sons".into(), Some(0x195)));
    assert_eq!((info.product_number, info.granularity, info.receive_pdos), (Some(7), Some(8), Some(0)));
    assert_eq!((info.bit_rates_kbit.as_slice(), info.lss), (&[250, 1000][..], true));
    assert_eq!(device.dummies.len(), 1);
    let codes: Vec<_> = findings.iter().map(|finding| finding.code).collect();
    assert_eq!(codes, ["xdd::not-read"], "the object that is off, and nothing else");
}

#[test]
fn what_xml_alone_can_say_is_what_an_overlay_says() {
    let (device, _) = read("valve.xdd", EDITOR);
    let mode = device.entry(0x2000, 0).expect("it is there");
    assert_eq!(mode.meaning, Meaning::Enumeration("Mode of the valve".into()));
    let values = device.enumerations["Mode of the valve"].values.iter();
    assert_eq!(values.map(|it| (it.value, it.name.as_str())).collect::<Vec<_>>(), [(0, "closed"), (1, "open")]);
    let end = device.entry(0x2001, 1).expect("it is there");
    let Meaning::Quantity(name) = &end.meaning else { panic!("{:?}", end.meaning) };
    let unit = &device.quantities[name].units[0];
    assert_eq!((unit.symbol.as_str(), unit.num, unit.den), ("mm", 1, 4));
    assert_eq!(end.description.as_deref(), Some("Counted from the lower one."));
    let limits = device.object(0x2001).expect("it is there");
    assert_eq!(limits.description.as_deref(), Some("Where it turns back."));
    assert_eq!(limits.properties.as_deref().unwrap().0, [("CO_storageGroup".to_owned(), "RAM".to_owned())]);
    let beat = device.entry(0x1017, 0).expect("it is there");
    assert!(beat.persistent && beat.properties.is_some());

    let overlay =
        "[overlay]\nformat = 1\n[object.\"2000\"]\nreason = \"tried\"\ndefault = 1\ndescription = \"Ours.\"\n";
    let input = Input::new(Source::new("valve.xdd", EDITOR)).overlay(Source::new("valve.toml", overlay));
    let mode = load(&input).0.entry(0x2000, 0).cloned().expect("it is there");
    assert_eq!((mode.default.as_ref(), mode.description.as_deref()), (Some(&Value::Integer(1)), Some("Ours.")));
}

#[test]
fn attributes_of_objects_are_read_where_no_parameter_says_more() {
    let (device, findings) = read("valve.xdc", INLINE);
    let expected = [
        "1000,00,Device type,VAR,UNSIGNED32,const,0,0,,,,0",
        "1001,00,Error register,VAR,UNSIGNED8,ro,1,,,,,0",
        "1017,00,Producer heartbeat time,VAR,UNSIGNED16,rw,0,0,,,500,0",
        "1018,00,Highest sub-index,RECORD,UNSIGNED8,const,0,1,,,,0",
        "1018,01,Vendor-ID,RECORD,UNSIGNED32,ro,0,405,,,,0",
        "2000,00,Set,VAR,UNSIGNED24,rww,1,,1,9,5,0",
        "2001,00,Got,VAR,TIME_OF_DAY,rwr,1,,,,,0",
        "2002,00,Only written,VAR,BOOLEAN,wo,0,,,,,0",
    ];
    assert_eq!(rows(&device), expected);
    assert_eq!(device.entry(0x1017, 0).and_then(|entry| entry.denotation.as_deref()), Some("beat"));
    let commissioning = device.commissioning.expect("the file has it");
    assert_eq!((commissioning.node_id, commissioning.bit_rate_kbit), (Some(5), Some(500)));
    assert_eq!((commissioning.net_number, commissioning.manager), (Some(2), Some(false)));
    assert!(device.info.simple_boot_up_master);
    assert!(findings.is_empty(), "{findings:?}");
}

#[test]
fn a_finding_is_at_the_attribute_that_says_so() {
    let text = INLINE.replace("lowLimit=\"1\" highLimit=\"9\"", "lowLimit=\"19\"\n highLimit=\"9\"");
    let input = Input::new(Source::new("valve.xdc", text));
    let finding = load(&input).1.iter().find(|it| it.code == "eds::limits-reversed").cloned().expect("they are");
    let at = |label: usize| {
        let span = finding.labels[label].span;
        &input.eds.text()[span.start as usize..span.end as usize]
    };
    assert_eq!((at(0), at(1)), ("19", "9"));
    assert!(finding.fix.is_none());
}

#[test]
fn a_parameter_says_what_its_templates_say() {
    let (from, to) = ("<q1:parameter uniqueID=\"UID_SUB_200101\"", "<q1:parameter uniqueID=\"UID_OBJ_2002\"");
    let parameter = &EDITOR[EDITOR.find(from).unwrap()..EDITOR.find(to).unwrap()];
    let range = "<q1:range><minValue value=\"-10\" /><maxValue value=\"0x10\" /></q1:range>";
    let (labels, rest) = parameter.split_at(parameter.find("<INT />").unwrap());
    let labels = labels.replace(" access=\"readWriteInput\" multiplier=\"0.25\"", " templateIDRef=\"T\"");
    let rest = rest
        .replace(&format!("<q1:allowedValues>{range}</q1:allowedValues>"), "<q1:allowedValues templateIDRef=\"A\" />");
    let templates = format!(
        "<q1:templateList><q1:parameterTemplate uniqueID=\"T\" access=\"readWriteInput\" templateIDRef=\"U\">{}</q1:parameterTemplate>\
         <q1:parameterTemplate uniqueID=\"U\" access=\"write\" multiplier=\"0.25\"><q1:unit multiplier=\"1\"><label>km</label></q1:unit></q1:parameterTemplate>\
         <q1:allowedValuesTemplate uniqueID=\"A\">{range}</q1:allowedValuesTemplate></q1:templateList>",
        rest.replace("</q1:parameter>", "")
    );
    let text = EDITOR.replace(parameter, &format!("{labels}</q1:parameter>"));
    let text = text.replace("<q1:parameterList>", &format!("{templates}<q1:parameterList>"));
    let (device, findings) = read("valve.xdd", &text);
    assert_eq!(device, read("valve.xdd", EDITOR).0);
    assert_eq!(findings.iter().map(|finding| finding.code).collect::<Vec<_>>(), ["xdd::not-read"]);
    let (_, findings) = read("valve.xdd", &text.replace("uniqueID=\"U\"", "uniqueID=\"V\""));
    assert!(findings.iter().any(|finding| finding.code == "xdd::dangling-reference"));
}

#[test]
fn the_namespaces_of_both_versions_say_the_same() {
    let (expected, _) = read("valve.xdd", EDITOR);
    let names = "xmlns=\"http://www.canopen.org/xml/1.1\"";
    for (from, to) in [(names, ""), (names, "xmlns=\"http://www.canopen.org/xml/1.0\""), (" xmlns=\"\"", "")] {
        assert_eq!(read("valve.xdd", &EDITOR.replace(from, to)).0, expected, "{to:?}");
    }
    let utf_16: Vec<u8> = EDITOR.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let (mut device, _) = load(&Input::new(Source::from_bytes("valve.xdd", &utf_16)));
    device.clear_spans();
    assert_eq!(device, expected);
}

#[test]
fn what_is_no_data_sheet_or_has_no_end_is_refused_with_a_reason() {
    let check = |text: &str, why: &str| {
        let (device, findings) = read("x.xdd", text);
        assert!(device.objects.is_empty());
        let found = findings.iter().map(|finding| finding.message.as_str()).collect::<Vec<_>>();
        assert!(found.len() == 1 && found[0].contains(why), "{found:?}");
    };
    let root = |inside: &str| format!("<ISO15745ProfileContainer>{inside}</ISO15745ProfileContainer>");
    check("<html/>", "no data sheet");
    check("<ISO15745ProfileContainer>", "broken");
    check("<!DOCTYPE x [<!ENTITY a \"b\">]><x>&a;</x>", "document type definition");
    check(&root(&" ".repeat(17 << 20)), "16777216 bytes");
    check(&root(&"<a></a>".repeat(1_000_001)), "1000000 nodes");
    check(&root(&format!("<a {}/>", "x=\"\" ".repeat(1001))), "1000 attributes");
    check(&root(&"<a xmlns:x=\"y\">".repeat(101)), "`xmlns:` more than 100 times");
    let shared = format!("<parameter uniqueID=\"p\">{}</parameter>", "<label>x</label>".repeat(50_000));
    let process = format!("<ApplicationProcess>{shared}</ApplicationProcess>");
    let objects: String =
        (0..2000).map(|it| format!("<CANopenObject index=\"{:04X}\" uniqueIDRef=\"p\"/>", 0x2000 + it)).collect();
    let layers = format!("<ApplicationLayers><CANopenObjectList>{objects}</CANopenObjectList></ApplicationLayers>");
    let profile = |body: String| format!("<ISO15745Profile><ProfileBody>{body}</ProfileBody></ISO15745Profile>");
    let (_, findings) = read("x.xdd", &root(&profile(process + &layers)));
    assert!(findings.iter().any(|finding| finding.message.contains("more than is read")));
}

#[test]
fn all_that_a_data_sheet_says_comes_back_from_xml() {
    let shipped = library::all().iter().map(|shipped| Input { overlays: Vec::new(), ..shipped.input() });
    let inputs = shipped.chain(cases().into_iter().map(|case| Input { overlays: Vec::new(), ..case.input }));
    for input in inputs {
        let (mut device, _) = load(&input);
        device.clear_spans();
        let text = xdd::xdc(&device);
        let (read, findings) = read("x.xdc", &text);
        assert!(read == device, "{}: {:?}\n{text}", input.eds.name(), losses(&device, &text));
        assert!(findings.iter().all(|finding| !finding.code.starts_with("xdd::")), "{findings:?}");
        assert_eq!(xdd::xdc(&read), text);
        let (back, _) = self::read("x.dcf", &write::dcf(&read));
        assert!(back == device, "{}", input.eds.name());
    }
}

#[test]
fn what_overlays_say_is_sound_in_xml_or_named() {
    for shipped in library::all() {
        let (device, _) = load(&shipped.input());
        let text = xdd::xdd(&device);
        let (read, findings) = read("x.xdd", &text);
        assert!(!findings.has_errors(), "{}: {findings:?}", shipped.id);
        assert_eq!(xdd::xdd(&read), text);
        let lost = losses(&device, &text);
        let said =
            ["the bit field", "the unit", "the conditional", "the NMT", "the parameters", "not being", "the order"];
        let said = [&said[..], &["the mapping", "writing four bytes"]].concat();
        assert!(lost.iter().all(|lost| said.iter().any(|said| lost.starts_with(said))), "{}: {lost:?}", shipped.id);
    }
}

#[test]
fn what_a_format_cannot_say_is_named() {
    let (device, _) = read("valve.xdd", EDITOR);
    assert_eq!(losses(&device, &Format::Xdd.write(&device)), [""; 0]);
    let expected = [
        "being persistent of 1017:00",
        "the description of 2001:01",
        "the description as a whole of 2001",
        "the enumeration of 2000:00",
        "the properties of 1017:00",
        "the properties as a whole of 2001",
        "the unit of 2001:01",
    ];
    assert_eq!(losses(&device, &Format::Eds.write(&device)), expected);
    let (device, _) = read("valve.xdc", INLINE);
    assert_eq!(losses(&device, &Format::Xdc.write(&device)), [""; 0]);
    assert_eq!(losses(&device, &Format::Dcf.write(&device)), [""; 0]);
    let lost = losses(&device, &Format::Xdd.write(&device));
    assert!(lost.contains(&"ParameterValue of [1017], [2000]".to_owned()), "{lost:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn no_xml_makes_the_reader_panic(edits in proptest::collection::vec((0.0..1.0, 0..40_usize, "[<>/=\"&;a-z0-9 ]{0,6}"), 1..4)) {
        let mut text = EDITOR.to_owned();
        for (at, length, other) in edits {
            let start = text.floor_char_boundary((text.len() as f64 * at) as usize);
            let end = text.floor_char_boundary((start + length).min(text.len()));
            text.replace_range(start..end, &other);
        }
        exercise::exercise(&Input::new(Source::new("x.xdd", text.as_str())));
        let written = xdd::xdc(&read("x.xdd", &text).0);
        prop_assert_eq!(xdd::xdc(&read("x.xdc", &written).0), written);
    }
}
