//! Edits of a data sheet: they change the necessary lines, and no others.

use crate::cases::cases;
use lexican_eds::edit::{EditError, Place, add_entry, add_object, remove_entry, remove_object, renumber, set};
use lexican_eds::fmt::normalise;
use lexican_eds::model::{Device, Entry, Object, ObjectKind, ObjectList};
use lexican_eds::outline::Outline;
use lexican_eds::patch::Patch;
use lexican_eds::types::DataType;
use lexican_eds::xdd::is_xml;
use lexican_eds::{Input, Source, Span, load};
use similar::{ChangeTag, TextDiff};

/// A data sheet with everything that an edit must not touch.
const SHEET: &str = "\
; a data sheet\r
[DeviceInfo]\r
NrOfTXPDO = 1\r
[OptionalObjects]\r
SupportedObjects=3\r
2=0x1800\r
; the first\r
1 = 0x1005\r
3=0x1a00\r
[ManufacturerObjects]\r
SupportedObjects=0x1\r
1=0x2000\r
\r
; of CiA 301\r
[1005]\r
ParameterName=SYNC\r
DATATYPE = 7\r
\r
[1800]\r
ObjectType=9\r
SubNumber=2\r
[1800sub0]\r
DefaultValue=0x02\r
[1800sub2]\r
DefaultValue=255\r
\r
; of the manufacturer\r
[2000]\r
ParameterName=Value ; as shipped\r
ObjectType=0x7\r
DataType=0x6\r
AccessType=rw\r
; the end";

/// Compares the lines that a patch removes and adds, without empty lines.
#[track_caller]
fn check(patch: Result<Patch, EditError>, expected: &str) {
    let after = patch.unwrap().apply(&sheet());
    let diff = TextDiff::from_lines(SHEET, &after);
    let changed = diff.iter_all_changes().filter(|change| change.tag() != ChangeTag::Equal);
    let changed = changed.filter(|change| !change.value().trim().is_empty());
    let found: String = changed.map(|change| format!("{}{}\n", change.tag(), change.value().trim_end())).collect();
    assert_eq!(found, expected);
}

fn sheet() -> Source {
    Source::new("x.eds", SHEET)
}

fn entry(index: u16, sub: u8, data_type: DataType) -> Entry {
    let mut entry = Entry::new(index, sub, Span::default());
    (entry.name, entry.data_type) = ("New".to_owned(), data_type);
    entry
}

fn object(index: u16, list: ObjectList) -> Object {
    let mut object = Object::new(index, ObjectKind::Variable, Span::default());
    (object.list, object.entries) = (list, vec![entry(index, 0, DataType::Unsigned8)]);
    object
}

#[test]
fn a_key_is_set_where_it_stands_or_belongs() {
    let set = |place, key, value| set(&sheet(), place, key, value);
    check(set(Place::Object(0x1005), "DataType", Some("5")), "-DATATYPE = 7\n+DATATYPE = 5\n");
    check(
        set(Place::Object(0x2000), "parametername", Some("Y")),
        "-ParameterName=Value ; as shipped\n+ParameterName=Y\n",
    );
    check(set(Place::Object(0x2000), "DefaultValue", Some("9")), "+DefaultValue=9\n");
    check(set(Place::Object(0x1005), "AccessType", Some("rw")), "+AccessType = rw\n");
    check(set(Place::Sub(0x1800, 2), "DataType", Some("5")), "+DataType=5\n");
    check(set(Place::Object(0x2000), "AccessType", None), "-AccessType=rw\n");
    check(set(Place::Object(0x2000), "LowLimit", None), "");
    check(set(Place::DeviceInfo, "VendorName", Some("Nobody")), "+VendorName = Nobody\n");
}

#[test]
fn an_object_comes_in_its_place_and_is_counted() {
    let new = |index: &str| {
        format!("+[{index}]\n+ObjectType=0x7\n+ParameterName=New\n+DataType=0x0005\n+AccessType=ro\n+PDOMapping=0\n")
    };
    check(
        add_object(&sheet(), &object(0x3000, ObjectList::Manufacturer)),
        &format!("-SupportedObjects=0x1\n+SupportedObjects=2\n+2=0x3000\n{}", new("3000")),
    );
    check(
        add_object(&sheet(), &object(0x1801, ObjectList::Optional)),
        &format!(
            "-NrOfTXPDO = 1\n+NrOfTXPDO = 2\n-SupportedObjects=3\n+SupportedObjects=4\n+4=0x1801\n{}",
            new("1801")
        ),
    );
    let list = "+[MandatoryObjects]\n+SupportedObjects=1\n+1=0x1000\n";
    check(add_object(&sheet(), &object(0x1000, ObjectList::Mandatory)), &(new("1000") + list));
}

#[test]
fn an_object_goes_and_the_others_close_up() {
    check(
        remove_object(&sheet(), 0x1005),
        "-SupportedObjects=3\n-2=0x1800\n+SupportedObjects=2\n+1=0x1800\n-1 = 0x1005\n-3=0x1a00\n+2=0x1a00\n\
         -[1005]\n-ParameterName=SYNC\n-DATATYPE = 7\n",
    );
    check(
        remove_object(&sheet(), 0x1800),
        "-NrOfTXPDO = 1\n+NrOfTXPDO = 0\n-SupportedObjects=3\n-2=0x1800\n+SupportedObjects=2\n-3=0x1a00\n+2=0x1a00\n\
         -[1800]\n-ObjectType=9\n-SubNumber=2\n-[1800sub0]\n-DefaultValue=0x02\n-[1800sub2]\n-DefaultValue=255\n",
    );
}

#[test]
fn a_sub_index_comes_and_goes_with_its_counts() {
    let entry = |sub| entry(0x1800, sub, DataType::Unsigned16);
    let lines = "+ParameterName=New\n+ObjectType=0x7\n+DataType=0x0006\n+AccessType=ro\n+PDOMapping=0\n";
    check(
        add_entry(&sheet(), &entry(3)),
        &format!("-SubNumber=2\n+SubNumber=3\n-DefaultValue=0x02\n+DefaultValue=0x03\n+[1800sub3]\n{lines}"),
    );
    check(add_entry(&sheet(), &entry(1)), &format!("-SubNumber=2\n+SubNumber=3\n+[1800sub1]\n{lines}"));
    check(
        remove_entry(&sheet(), 0x1800, 2),
        "-SubNumber=2\n+SubNumber=1\n-DefaultValue=0x02\n-[1800sub2]\n-DefaultValue=255\n+DefaultValue=0x00\n",
    );
}

#[test]
fn what_cannot_be_is_refused() {
    let new = object(0x2000, ObjectList::Manufacturer);
    let entry = Entry::new(0x1800, 2, Span::default());
    let twice = Source::new("x.eds", "[OptionalObjects]\n1=0x1005\n1=0x1006\n[1005]\nDataType=7\n");
    let compact = Source::new("x.eds", "[2000]\nObjectType=8\nCompactSubObj=3\nDataType=5\n");
    for (result, words) in [
        (set(&sheet(), Place::Object(0x2000), "Default", Some("1")), "2000 has no key \"Default\""),
        (set(&sheet(), Place::Object(0x2001), "DefaultValue", Some("1")), "there is no section [2001]"),
        (set(&sheet(), Place::FileInfo, "FileName", Some("1")), "there is no section [FileInfo]"),
        (set(&sheet(), Place::Object(0x2000), "ParameterName", Some("a\nb")), "a value has one line only"),
        (set(&compact, Place::Sub(0x2000, 1), "DefaultValue", Some("1")), "2000sub1 has no section of its own"),
        (add_object(&sheet(), &new), "[2000] is there already"),
        (add_entry(&sheet(), &entry), "[1800sub2] is there already"),
        (add_entry(&sheet(), &Entry::new(0x2000, 1, Span::default())), "2000 has no sub-indices"),
        (add_entry(&sheet(), &Entry::new(0x2001, 1, Span::default())), "there is no section [2001]"),
        (add_entry(&compact, &Entry::new(0x2000, 4, Span::default())), "the sub-indices of 2000 has no section"),
        (remove_object(&sheet(), 0x2001), "there is no section [2001]"),
        (remove_entry(&sheet(), 0x1800, 1), "there is no section [1800sub1]"),
        (remove_object(&twice, 0x1005), "[OptionalObjects] gives two objects the same number"),
    ] {
        let error = result.expect_err(words).to_string();
        assert!(error.contains(words), "{error:?} for {words:?}");
    }
}

/// In every golden data sheet, adding and removing an object leaves the text unchanged, except that it may be tidier.
#[test]
fn what_was_added_can_be_removed_again() {
    let mut same = 0;
    for case in cases() {
        let sheet = &case.input.eds;
        if is_xml(sheet) {
            continue;
        }
        let read = |text: &Source| {
            let mut device = load(&Input::new(text.clone())).0;
            device.clear_spans();
            device
        };
        let before = read(sheet);
        if before.objects.is_empty() {
            continue;
        }
        let new = object(0x5FFE, ObjectList::Manufacturer);
        let Ok(patch) = add_object(sheet, &new) else { continue };
        let with = sheet.with_text(patch.apply(sheet));
        assert_eq!(read(&with).object(0x5FFE).map(|object| &*object.entries[0].name), Some("New"), "{}", case.code);
        let without = remove_object(&with, 0x5FFE).unwrap().apply(&with);
        assert_eq!(read(&sheet.with_text(&*without)), before, "{}", case.code);
        same += usize::from(without == sheet.text());
    }
    assert!(same > 90, "{same} texts came back");
}

#[test]
fn an_object_with_another_index_is_the_same_object() {
    for shipped in lexican_eds::library::all() {
        let sheet = Source::new(shipped.file_name, normalise(&shipped.input().eds));
        let (device, before) = load(&Input::new(sheet.clone()));
        for object in device.objects.iter().filter(|object| (0x2000..0x5FF0).contains(&object.index)) {
            let moved = sheet.with_text(renumber(&sheet, object.index, 0x5FFF).unwrap().apply(&sheet));
            assert_eq!(renumber(&moved, 0x5FFF, object.index).unwrap().apply(&moved), sheet.text());
            let (after, found) = load(&Input::new(moved));
            assert_eq!(found.len(), before.len(), "{} {:04X}", shipped.id, object.index);
            assert!(after.object(object.index).is_none());
            let maps = |device: &Device, index| -> usize {
                device.pdos.iter().flat_map(|pdo| &pdo.mapping).filter(|mapped| mapped.index == index).count()
            };
            assert_eq!(maps(&after, 0x5FFF), maps(&device, object.index));
            let names = |entries: &[Entry]| -> Vec<_> {
                entries.iter().map(|entry| (entry.sub, entry.name.clone(), entry.default.clone())).collect()
            };
            assert_eq!(names(&after.object(0x5FFF).unwrap().entries), names(&object.entries));
        }
        assert!(matches!(renumber(&sheet, 0x1018, 0x1000), Err(EditError::AlreadyThere(_))));
    }
}

#[test]
fn what_names_an_object_is_found() {
    let text = "[ManufacturerObjects]\nSupportedObjects=1\n1=8192\n[2000ObjectLinks]\nObjectLinks=1\n1=0x2000\n[1A00sub1]\n\
                DefaultValue=0x20000108\nLowLimit=0x20000108\n[1A01Value]\nNrOfEntries=1\n1=0x20000208\n[2000sub1]\n";
    let sheet = Source::new("x.eds", text);
    let outline = Outline::new(&sheet);
    let found: Vec<_> = outline.mentions().filter(|it| it.index == 0x2000).collect();
    let texts: Vec<_> = found.iter().map(|it| (sheet.get(it.span), it.sub)).collect();
    let expected = [("8192", None), ("2000", None), ("0x2000", None), ("0x20000108", Some(1)), ("0x20000208", Some(2))];
    assert_eq!(texts, [&expected[..], &[("2000", Some(1))]].concat());
    assert_eq!(outline.describing(0x2000, Some(1)).map(|section| sheet.get(section.name)), Some("2000sub1"));
}
