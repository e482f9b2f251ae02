//! Editing and formatting data sheets in XML, which leaves everything else as it is.

use std::collections::BTreeSet;

use lexican_eds::edit::{EditError, Place, set};
use lexican_eds::fmt::normalise;
use lexican_eds::model::{Device, ObjectKind};
use lexican_eds::types::DataType;
use lexican_eds::{Input, Source, library, load, write, xdd};

const EDITOR: &str = include_str!("../xdd/editor.xdd");
const INLINE: &str = include_str!("../xdd/inline.xdc");

fn device(sheet: &Source) -> Device {
    let mut device = load(&Input::new(sheet.clone())).0;
    device.clear_spans();
    device
}

/// The fixtures, and the library's devices as they are written.
fn sheets() -> Vec<Source> {
    let shipped = library::all().iter().map(|it| Source::new(it.id, xdd::xdc(&load(&it.input()).0)));
    [("editor.xdd", EDITOR), ("inline.xdc", INLINE)]
        .map(|(name, text)| Source::new(name, text))
        .into_iter()
        .chain(shipped)
        .collect()
}

/// The lines that were added, and those that were removed.
fn difference(before: &str, after: &str) -> [Vec<String>; 2] {
    let lines = |text: &str| text.lines().map(|line| line.trim().to_owned()).collect::<BTreeSet<_>>();
    let (before, after) = (lines(before), lines(after));
    [after.difference(&before).cloned().collect(), before.difference(&after).cloned().collect()]
}

#[test]
fn a_key_is_set_where_xml_says_it() {
    use Place::{Commissioning, DeviceInfo, FileInfo, Object, Sub};
    for (text, place, key, value, expected) in [
        (
            EDITOR,
            Object(0x1014),
            "DefaultValue",
            Some("$NODEID+0x90"),
            "UID_OBJ_1014\" access=\"readWrite\"><UDINT /><q1:defaultValue value=\"$NODEID+0x90\" />",
        ),
        (EDITOR, Object(0x1014), "DefaultValue", None, "UID_OBJ_1014\" access=\"readWrite\"><UDINT /></q1:parameter>"),
        (EDITOR, Object(0x1017), "DefaultValue", Some("500"), "<UINT /><q1:defaultValue value=\"500\" /><q1:property"),
        (EDITOR, Object(0x1001), "DefaultValue", Some("0"), "<BYTE /><q1:defaultValue value=\"0\" /></q1:parameter>"),
        (EDITOR, Object(0x1001), "AccessType", Some("const"), "UID_OBJ_1001\" access=\"const\"><BYTE />"),
        (EDITOR, Object(0x2000), "AccessType", Some("rwr"), "PDOmapping=\"TPDO\" uniqueIDRef=\"UID_OBJ_2000\""),
        (EDITOR, Object(0x2000), "PDOMapping", Some("0"), "PDOmapping=\"no\" uniqueIDRef=\"UID_OBJ_2000\""),
        (EDITOR, Object(0x1017), "DataType", Some("0x0007"), "persistent=\"true\"><UDINT /><q1:property"),
        (EDITOR, Object(0x1017), "DataType", Some("0x0016"), "uniqueIDRef=\"UID_OBJ_1017\" dataType=\"0016\" />"),
        (EDITOR, Sub(0x2001, 1), "ParameterName", Some("Upper <end>"), "<label lang=\"en\">Upper &lt;end&gt;</label>"),
        (EDITOR, Sub(0x2001, 1), "HighLimit", Some("17"), "<minValue value=\"-10\" /><maxValue value=\"17\" />"),
        (EDITOR, Sub(0x2001, 1), "HighLimit", None, "uniqueIDRef=\"UID_SUB_200101\" lowLimit=\"-10\" />"),
        (EDITOR, Object(0x1001), "HighLimit", Some("3"), "uniqueIDRef=\"UID_OBJ_1001\" highLimit=\"3\" />"),
        (EDITOR, Object(0x2000), "ObjFlags", Some("1"), "objFlags=\"0001\""),
        (EDITOR, FileInfo, "FileVersion", Some("4"), "fileVersion=\"4.1.4\""),
        (EDITOR, FileInfo, "FileRevision", Some("2"), "fileVersion=\"3.2.4\""),
        (EDITOR, FileInfo, "CreationDate", Some("12-24-2026"), "fileCreationDate=\"2026-12-24\""),
        (
            EDITOR,
            FileInfo,
            "Description",
            Some("A valve & more."),
            "<description lang=\"en\">A valve &amp; more.</description>",
        ),
        (EDITOR, DeviceInfo, "ProductName", Some("Gate"), "<q1:productName>Gate</q1:productName>"),
        (EDITOR, DeviceInfo, "OrderCode", Some("G1"), "<orderNumber>G1</orderNumber>"),
        (
            INLINE,
            DeviceInfo,
            "BaudRate_250",
            Some("1"),
            "<supportedBaudRate value=\"500 Kbps\"/><supportedBaudRate value=\"250 Kbps\" />",
        ),
        (INLINE, DeviceInfo, "BaudRate_500", Some("0"), "<baudRate></baudRate>"),
        (INLINE, DeviceInfo, "SimpleBootUpMaster", Some("0"), "bootUpMaster=\"false\""),
        (INLINE, DeviceInfo, "LSS_Supported", Some("1"), "granularity=\"8\" layerSettingServiceSlave=\"true\""),
        (INLINE, Commissioning, "NodeID", Some("6"), "nodeID=\"6\""),
        (INLINE, Commissioning, "Baudrate", Some("250"), "actualBaudRate=\"250 Kbps\""),
        (INLINE, Object(0x1017), "ParameterValue", Some("250"), "actualValue=\"250\""),
        (INLINE, Object(0x1017), "Denotation", None, "actualValue=\"500\"/>"),
        (INLINE, Object(0x2000), "AccessType", Some("ro"), "accessType=\"ro\" PDOmapping=\"optional\""),
        (INLINE, Object(0x2002), "PDOMapping", Some("1"), "accessType=\"wo\" PDOmapping=\"optional\""),
    ] {
        let sheet = Source::new("valve", text);
        let patch = set(&sheet, place, key, value).unwrap_or_else(|error| panic!("{place:?} {key}: {error}"));
        let after = patch.apply(&sheet);
        assert!(after.contains(expected), "{place:?} {key}={value:?}: {:?}", difference(text, &after));
        // One line, or one for the parameter and one for the object.
        let [came, went] = difference(text, &after);
        assert!(came.len() <= 2 && went.len() <= 2, "{came:?}\n{went:?}");
        let again = sheet.with_text(&*after);
        assert_eq!(set(&again, place, key, value).unwrap().apply(&again), after, "{place:?} {key}");
    }
}

#[test]
fn a_single_quote_stays_whole() {
    let sheet = Source::new("valve", INLINE.replace("name=\"Set\"", "name='Set'"));
    let after = set(&sheet, Place::Object(0x2000), "ParameterName", Some("It's \"set\"")).unwrap().apply(&sheet);
    assert_eq!(device(&sheet.with_text(after)).object(0x2000).unwrap().name, "It's \"set\"");
}

#[test]
fn an_element_without_content_keeps_its_attributes() {
    let sheet = Source::new(
        "valve",
        INLINE.replace("<baudRate><supportedBaudRate value=\"500 Kbps\"/>", "<baudRate note=\"1 > 0\">"),
    );
    let after = set(&sheet, Place::DeviceInfo, "BaudRate_250", Some("1")).unwrap().apply(&sheet);
    let expected = "<baudRate note=\"1 > 0\"><supportedBaudRate value=\"250 Kbps\" /></baudRate>";
    assert!(after.contains(expected), "{:?}", difference(sheet.text(), &after));
}

#[test]
fn what_xml_cannot_say_is_refused() {
    let sheet = Source::new("valve.xdd", EDITOR);
    let error = set(&sheet, Place::DeviceInfo, "RevisionNumber", Some("3")).unwrap_err();
    assert_eq!(error, EditError::NotInXml { section: "DeviceInfo".to_owned(), key: "RevisionNumber" });
    assert_eq!(
        set(&sheet, Place::Object(0x2004), "DefaultValue", Some("1")),
        Err(EditError::NoSection("2004".to_owned()))
    );
    // In a file written by this library, the key is a characteristic.
    let written = Source::new("x.xdd", xdd::xdd(&load(&library::find("siko/ag03-1").unwrap().input()).0));
    let after = set(&written, Place::FileInfo, "FileRevision", Some("7")).unwrap().apply(&written);
    assert_eq!(device(&written.with_text(after)).file.revision, Some(7));
}

/// Entries of every sheet accept each key; the device is then the same as for the EDS with that change.
#[test]
fn an_entry_that_is_set_is_that_of_the_eds() {
    let types = [DataType::Unsigned8, DataType::Integer32, DataType::Unsigned24, DataType::VisibleString]
        .map(|it| format!("0x{:04X}", it.code()));
    let access = ["ro", "wo", "rw", "rwr", "rww", "const"].map(str::to_owned);
    let ones = ["1".to_owned()];
    let values: [(&str, &[String]); 8] = [
        ("DataType", &types),
        ("AccessType", &access),
        ("PDOMapping", &["0".to_owned(), "1".to_owned()]),
        ("DefaultValue", &ones),
        ("LowLimit", &ones),
        ("HighLimit", &["0x64".to_owned()]),
        ("ParameterName", &["Other \"name\" & <more>".to_owned()]),
        ("ObjFlags", &ones),
    ];
    for sheet in sheets() {
        let before = device(&sheet);
        let eds = Source::new("x.dcf", write::dcf(&before));
        // About sixteen entries of each.
        let step = before.entries().count() / 16 + 1;
        for (at, entry) in before.entries().step_by(step).enumerate() {
            let has_subs = before.object(entry.index).is_some_and(|object| object.kind.has_subs());
            let place = if has_subs { Place::Sub(entry.index, entry.sub) } else { Place::Object(entry.index) };
            // One key for each entry, in turn: all combinations would take minutes.
            let (key, values) = values[at % values.len()];
            let value = &values[at / values.len() % values.len()];
            let changed = |sheet: &Source| {
                sheet.with_text(
                    set(sheet, place, key, Some(value))
                        .unwrap_or_else(|error| panic!("{} {place:?} {key}={value}: {error}", sheet.name()))
                        .apply(sheet),
                )
            };
            assert_eq!(
                write::dcf(&device(&changed(&sheet))),
                write::dcf(&device(&changed(&eds))),
                "{} {place:?} {key}={value}",
                sheet.name()
            );
        }
        assert!(before.objects.iter().any(|object| object.kind == ObjectKind::Record));
    }
}

#[test]
fn layout_changes_no_device_and_ends() {
    for sheet in sheets() {
        let formatted = normalise(&sheet);
        assert_eq!(device(&sheet.with_text(&*formatted)), device(&sheet), "{}", sheet.name());
        assert_eq!(normalise(&sheet.with_text(&*formatted)), formatted, "{}", sheet.name());
        if sheet.text() != EDITOR && sheet.text() != INLINE {
            assert_eq!(formatted, sheet.text(), "{} was written in another layout", sheet.name());
        }
    }
}

#[test]
fn layout_is_by_depth_and_keeps_what_is_no_blank() {
    let before = "<?xml version='1.0' ?>\r\n<!--a--><ISO15745ProfileContainer  xmlns = \"http://www.canopen.org/xml/1.1\"><p a='>'\r\n b=\"1\"><!-- c\r\n d --></p>\r\n\r\n\r\n<label> a <b/> </label>\
        <empty></empty><CANopenObject index=\"10ab\" name=\"10ab\"/></ISO15745ProfileContainer>\r\n";
    let after = "<?xml version='1.0'?>\r\n<!--a-->\r\n<ISO15745ProfileContainer xmlns=\"http://www.canopen.org/xml/1.1\">\r\n  <p a='>' b=\"1\">\r\n    <!-- c\r\n d -->\r\n  </p>\r\n\r\n  <label> a <b/> </label>\r\n  <empty />\r\n  <CANopenObject index=\"10AB\" name=\"10ab\" />\r\n</ISO15745ProfileContainer>\r\n";
    assert_eq!(normalise(&Source::new("x.xdd", before)), after);
    let broken = "<ISO15745ProfileContainer><a></ISO15745ProfileContainer>";
    assert_eq!(normalise(&Source::new("x.xdd", broken)), broken);
}
