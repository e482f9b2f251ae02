//! Quirks of real files that break readers, each reproduced in a few lines of our own.

use lexican_eds::model::{AccessType, Device, Entry, ObjectKind, ObjectList, Value};
use lexican_eds::types::DataType;
use lexican_eds::{Diagnostics, Input, Source, load, write};

fn read(text: &str) -> (Device, Diagnostics) {
    read_bytes(text.as_bytes())
}

fn read_bytes(bytes: &[u8]) -> (Device, Diagnostics) {
    let (device, diagnostics) = load(&Input::new(Source::from_bytes("quirk.eds", bytes)));
    survives_writing(device.clone());
    (device, diagnostics)
}

/// Checks that a device is the same when it is written and read back.
fn survives_writing(mut device: Device) {
    let text = write::dcf(&device);
    let (mut read, _) = load(&Input::new(Source::new("written.dcf", text.as_str())));
    read.clear_spans();
    device.clear_spans();
    assert_eq!(read, device, "{text}");
}

/// A VAR 2000h with additional keys.
fn variable(data_type: &str, keys: &str) -> (Entry, Diagnostics) {
    let text = format!("[2000]\nParameterName=x\nObjectType=7\nDataType={data_type}\nAccessType=rw\n{keys}\n");
    let (device, diagnostics) = read(&text);
    (device.entry(0x2000, 0).expect("the variable is read").clone(), diagnostics)
}

fn has(diagnostics: &Diagnostics, code: &str) -> bool {
    diagnostics.iter().any(|finding| finding.code == code)
}

#[test]
fn node_id_formulas_stay_symbolic_in_all_spellings_and_in_limits() {
    for (text, offset) in [
        ("$NODEID+0x180", 0x180),
        ("0x180+$NODEID", 0x180),
        ("$NODEID+1536", 1536),
        ("$NodeID + 0x200", 0x200),
        (" $nodeid ", 0),
        ("0x80000000+$NODEID", 0x8000_0000),
    ] {
        let (entry, _) = variable("7", &format!("DefaultValue={text}\nLowLimit={text}\nHighLimit={text}"));
        for value in [&entry.default, &entry.low, &entry.high] {
            assert_eq!(value, &Some(Value::NodeIdPlus(offset)), "{text:?}");
        }
    }
}

#[test]
fn the_parameter_value_of_a_dcf_goes_before_a_default_with_node_id() {
    let text = "[1800]\nParameterName=c\nObjectType=9\nSubNumber=1\n\
                [1800sub1]\nParameterName=i\nDataType=7\nAccessType=rw\n\
                DefaultValue=$NODEID+0x180\nParameterValue=0x220\n";
    let (device, _) = read(text);
    let entry = device.entry(0x1800, 1).unwrap();
    assert_eq!(entry.default, Some(Value::NodeIdPlus(0x180)));
    assert_eq!(entry.configured, Some(Value::Integer(0x220)));
    assert_eq!(device.pdos[0].cob_id, Some(Value::Integer(0x220)));
}

#[test]
fn empty_numbers_are_absent() {
    let (device, diagnostics) = read("[DeviceInfo]\nProductNumber=\nVendorNumber=7\n");
    assert_eq!((device.info.product_number, device.info.vendor_number), (None, Some(7)));
    assert!(has(&diagnostics, "eds::empty-number"));
    let (entry, _) = variable("7", "PDOMapping=\nDefaultValue=\nLowLimit=\nHighLimit=");
    assert!(!entry.pdo_mapping && entry.default.is_none() && entry.low.is_none() && entry.high.is_none());
}

#[test]
fn objects_without_data_type_are_kept() {
    let (device, diagnostics) = read("[290A]\nParameterName=x\nObjectType=7\nAccessType=ro\n");
    assert_eq!(device.entry(0x290A, 0).unwrap().data_type, DataType::Other(0));
    assert!(has(&diagnostics, "eds::missing-data-type"));
    let (device, diagnostics) = read("[201B]\nParameterName=x\nObjectType=0x2\nAccessType=ro\n");
    assert_eq!(device.entry(0x201B, 0).unwrap().data_type, DataType::Domain);
    assert!(!has(&diagnostics, "eds::missing-data-type"));
}

#[test]
fn leading_zeros_are_octal_as_the_standard_says_and_told() {
    let (device, diagnostics) = read("[DeviceInfo]\nVendorNumber=001\nProductNumber=014101\nRevisionNumber=0089\n");
    assert_eq!(device.info.vendor_number, Some(1));
    assert_eq!(device.info.product_number, Some(0o14101));
    assert_eq!(device.info.revision_number, Some(89));
    assert_eq!(diagnostics.iter().filter(|finding| finding.code == "eds::octal-number").count(), 2);
}

#[test]
fn keys_and_sections_are_read_in_any_case() {
    let (device, diagnostics) =
        read("[COMMENTS]\nlines=1\nLINE1=x\n[2000SUB1]\nPARAMETERNAME=y\ndatatype=5\naccesstype=RO\n");
    assert_eq!(device.comments, ["x"]);
    let entry = device.entry(0x2000, 1).unwrap();
    assert_eq!((entry.name.as_str(), entry.access), ("y", AccessType::Ro));
    assert!(!has(&diagnostics, "eds::unknown-key"));
}

#[test]
fn missing_lines_dummies_and_sections_are_told() {
    let (device, diagnostics) = read("[Comments]\nLines=3\nLine1=x\n[DummyUsage]\nDummy0005=1\n");
    assert_eq!(device.comments, ["x"]);
    assert_eq!(device.dummies, [DataType::Unsigned8]);
    assert!(has(&diagnostics, "eds::entry-count"));
    assert_eq!(diagnostics.iter().filter(|finding| finding.code == "eds::missing-section").count(), 3);
}

#[test]
fn code_page_1252_is_read() {
    let (device, diagnostics) = read_bytes(b"[2000]\nParameterName=Temp\xE9rature \xB0C\nDataType=7\nAccessType=ro\n");
    assert_eq!(device.object(0x2000).unwrap().name, "Température °C");
    assert!(has(&diagnostics, "eds::encoding"));
}

#[test]
fn the_first_of_two_sections_or_keys_counts() {
    let text = "[2000]\nParameterName=a\nParameterName=b\nDataType=5\nAccessType=ro\n\
                [2000]\nParameterName=c\nDataType=6\nAccessType=ro\n";
    let (device, diagnostics) = read(text);
    let entry = device.entry(0x2000, 0).unwrap();
    assert_eq!((entry.name.as_str(), entry.data_type), ("a", DataType::Unsigned8));
    assert!(has(&diagnostics, "eds::duplicate-section") && has(&diagnostics, "eds::duplicate-key"));
}

#[test]
fn an_identity_that_is_an_array_keeps_its_entries() {
    let text = "[1018]\nParameterName=Identity\nObjectType=8\nSubNumber=2\n\
                [1018sub0]\nParameterName=n\nDataType=5\nAccessType=ro\n[1018sub1]\nParameterName=v\nDataType=7\nAccessType=ro\n";
    let (device, diagnostics) = read(text);
    assert_eq!(device.object(0x1018).unwrap().kind, ObjectKind::Array);
    assert_eq!(device.object(0x1018).unwrap().entries.len(), 2);
    assert!(has(&diagnostics, "cia301::object-type"));
}

#[test]
fn gaps_wrong_counts_and_missing_parents_lose_no_sub_index() {
    let sub = |sub: u8| format!("[1402sub{sub}]\nParameterName=s{sub}\nDataType=5\nAccessType=rw\n");
    let subs: String = [0, 1, 2, 5].map(sub).concat();
    for head in [
        "[1402]\nParameterName=c\nObjectType=9\nSubNumber=2\n",
        "[1402]\nParameterName=c\nObjectType=9\nSubNumber=9\n",
        "",
    ] {
        let (device, diagnostics) = read(&format!("{head}{subs}"));
        let found: Vec<u8> = device.object(0x1402).unwrap().entries.iter().map(|entry| entry.sub).collect();
        assert_eq!(found, [0, 1, 2, 5]);
        let code = if head.is_empty() { "eds::sub-without-object" } else { "eds::sub-count" };
        assert!(has(&diagnostics, code), "{head}");
    }
}

#[test]
fn blanks_in_lists_and_text_behind_sections_do_no_harm() {
    let text = "[OptionalObjects] ;list\nSupported Objects = 1\n 1 = 0x1003 \n[1003] junk\nParameterName=e\nObjectType=7\nDataType=7\nAccessType=ro\n";
    let (device, diagnostics) = read(text);
    assert_eq!(device.object(0x1003).unwrap().list, ObjectList::Optional);
    assert!(!has(&diagnostics, "eds::list-count") && !has(&diagnostics, "eds::object-not-listed"));
    assert!(has(&diagnostics, "eds::text-after-section"));
}

#[test]
fn modules_of_modular_devices_are_read() {
    let text = "[SupportedModules]\nNrOfEntries=1\n[M1ModuleInfo]\nProductName=8 inputs\nProductVersion=1\n\
                [M1Comments]\nLines=1\nLine1=about\n\
                [M1FixedObjects]\nNrOfEntries=1\n1=0x1027\n\
                [M1Fixed1027]\nParameterName=Modules\nObjectType=8\nSubNumber=1\n\
                [M1Fixed1027sub0]\nParameterName=n\nDataType=5\nAccessType=ro\n\
                [M1SubExtends]\nNrOfEntries=1\n1=0x6000\n\
                [M1SubExt6000]\nParameterName=Inputs\nObjectType=8\nDataType=5\nAccessType=ro\nPDOMapping=1\nCount=1,2\nObjExtend=0\n\
                [ConnectedModules]\nNrOfEntries=2\n1=1\n2=1\n";
    let (device, diagnostics) = read(text);
    let module = &device.modules[0];
    assert_eq!((module.number, module.product_name.as_deref()), (1, Some("8 inputs")));
    assert_eq!((module.comments.len(), module.fixed[0].index, module.fixed[0].entries.len()), (1, 0x1027, 1));
    assert_eq!((module.extends[0].entry.index, module.extends[0].count.as_slice()), (0x6000, [1, 2].as_slice()));
    assert!(module.extends[0].entry.pdo_mapping);
    assert_eq!(device.connected_modules, [1, 1]);
    assert!(!has(&diagnostics, "eds::unknown-section") && !has(&diagnostics, "eds::unknown-key"));
}

/// Each finding as `2:7 eds::bad-number`.
fn places(diagnostics: &Diagnostics, text: &str) -> Vec<String> {
    let source = Source::new("quirk.eds", text);
    let place = |finding: &lexican_eds::Diagnostic| source.position(finding.span().expect("has a place").start);
    diagnostics.iter().map(|finding| format!("{} {}", place(finding), finding.code)).collect()
}

/// Checks that the findings of these codes are exactly the expected ones, at these places.
#[track_caller]
fn check_places(text: &str, codes: &[&str], expected: &[&str]) -> Device {
    let (device, diagnostics) = read(text);
    let mut found = places(&diagnostics, text);
    found.retain(|place| codes.iter().any(|code| place.ends_with(code)));
    assert_eq!(found, expected, "{text}");
    device
}

#[test]
fn nothing_odd_in_a_sub_extension_is_dropped_in_silence() {
    let text = "[M1SubExt6000]\nDataType=5\nAccessType=ro\nObjectType=99\nCount=abc\n\
                [M1SubExt6001]\nDataType=5\nAccessType=ro\nCount=2,0x3;\n";
    let expected = ["4:12 eds::bad-object-type", "5:7 eds::bad-number"];
    let device = check_places(text, &["eds::bad-object-type", "eds::bad-number"], &expected);
    let counts: Vec<_> = device.modules[0].extends.iter().map(|extension| extension.count.clone()).collect();
    assert_eq!(counts, [vec![], vec![2, 3]]);
}

#[test]
fn nothing_odd_in_dynamic_channels_is_dropped_in_silence() {
    let text = "[DynamicChannels]\nNrOfSeg=1\nType1=5\nType1=9999\nDir1=zz\nRange1=0xA000-0xA03F\nPPOffset1=0\n\
                Type2=9999\nRange2=0xA040-0xA07F\n";
    let codes = ["eds::duplicate-key", "eds::bad-access-type", "eds::unknown-data-type", "eds::entry-count"];
    let expected =
        ["2:9 eds::entry-count", "4:1 eds::duplicate-key", "5:6 eds::bad-access-type", "8:7 eds::unknown-data-type"];
    let device = check_places(text, &codes, &expected);
    assert_eq!(device.channels[0].data_type, DataType::Unsigned8);
}

#[test]
fn tools_are_counted_and_have_a_number() {
    let text = "[Tools]\nItems=3\n[Tool1]\nName=a\nCommand=b\n[Tool+2]\nName=c\n";
    check_places(
        text,
        &["eds::entry-count", "eds::unknown-section"],
        &["2:7 eds::entry-count", "6:2 eds::unknown-section"],
    );
}

#[test]
fn a_section_without_name_is_told_where_it_is() {
    let code = ["eds::key-outside-section"];
    check_places("[FileInfo]\n[]\n", &code, &["2:2 eds::key-outside-section"]);
    check_places("[FileInfo]\n[]\nx=1\n", &code, &["3:1 eds::key-outside-section"]);
}

#[test]
fn odd_access_words_are_read_as_what_they_mean() {
    for (word, access, odd) in [
        ("R", AccessType::Ro, true),
        ("RW", AccessType::Rw, false),
        ("UNKNOWN", AccessType::Rw, true),
        ("rwr", AccessType::Rwr, false),
        ("Rww", AccessType::Rww, false),
        ("CONST", AccessType::Const, false),
    ] {
        let (device, diagnostics) = read(&format!("[2000]\nParameterName=x\nDataType=5\nAccessType={word}\n"));
        assert_eq!(device.entry(0x2000, 0).unwrap().access, access, "{word}");
        assert_eq!(has(&diagnostics, "eds::bad-access-type"), odd, "{word}");
    }
}

#[test]
fn odd_defaults_are_read_where_they_mean_one_thing() {
    let check = |data_type: &str, text: &str, value: Option<Value>, code: &str| {
        let (entry, diagnostics) = variable(data_type, &format!("DefaultValue={text}"));
        assert_eq!(entry.default, value, "{text}");
        let of_values = ["eds::odd-number", "eds::inline-comment", "eds::bad-value", "eds::unknown-variable"];
        let found: Vec<&str> = diagnostics.iter().map(|it| it.code).filter(|code| of_values.contains(code)).collect();
        assert_eq!(found, Vec::from_iter(Some(code).filter(|code| !code.is_empty())), "{text}");
    };
    check("7", "NULL", None, "eds::odd-number");
    check("1", "false", Some(Value::Integer(0)), "eds::odd-number");
    check("8", "0.0f", Some(Value::Real(0.0)), "eds::odd-number");
    check("4", "+384", Some(Value::Integer(384)), "");
    check("7", "0x10 ; prevent homing", Some(Value::Integer(16)), "eds::inline-comment");
    check("6", "twelve", None, "eds::bad-value");
    check("9", "V1.0 ; beta", Some(Value::Text("V1.0 ; beta".into())), "");
    check("7", "$MY_NODE_ID+0x200", Some(Value::NodeIdPlus(0x200)), "eds::unknown-variable");
    check("0x0C", "2 3600000", Some(Value::Integer(2 << 32 | 3_600_000)), "");
    check("6", "2 3", None, "eds::bad-value");
}

#[test]
fn types_of_the_device_itself_are_kept() {
    let text = "[40]\nParameterName=Own type\nObjectType=5\nDataType=7\nDefaultValue=48\n\
                [200B]\nParameterName=x\nObjectType=9\nSubNumber=1\n[200Bsub1]\nParameterName=y\nDataType=0x40\nAccessType=ro\n";
    let (device, diagnostics) = read(text);
    assert_eq!(device.object(0x40).unwrap().kind, ObjectKind::DefType);
    assert_eq!(device.entry(0x200B, 1).unwrap().data_type, DataType::Other(0x40));
    assert_eq!(device.bits(DataType::Other(0x40)), Some(48));
    assert!(!has(&diagnostics, "eds::undescribed-type") && !has(&diagnostics, "eds::unknown-data-type"));
}

#[test]
fn compact_objects_are_written_out() {
    let text = "[2000]\nParameterName=Speed\nObjectType=8\nDataType=6\nAccessType=rw\nDefaultValue=5\nPDOMapping=1\nCompactSubObj=3\n\
                [2000Name]\nNrOfEntries=1\n2=Second speed\n[2000Value]\nNrOfEntries=1\n3=0x30\n[2000Denotation]\nNrOfEntries=1\n1=Conveyor\n";
    let (device, diagnostics) = read(text);
    let names: Vec<&str> = device.object(0x2000).unwrap().entries.iter().map(|entry| entry.name.as_str()).collect();
    assert_eq!(names, ["NrOfObjects", "Speed1", "Second speed", "Speed3"]);
    let entry = |sub| device.entry(0x2000, sub).unwrap();
    assert_eq!((entry(0).data_type, entry(0).default.clone()), (DataType::Unsigned8, Some(Value::Integer(3))));
    assert_eq!((entry(1).data_type, entry(1).default.clone()), (DataType::Unsigned16, Some(Value::Integer(5))));
    assert_eq!(entry(3).configured, Some(Value::Integer(0x30)));
    assert_eq!(entry(1).denotation.as_deref(), Some("Conveyor"));
    assert!(!has(&diagnostics, "eds::key-without-effect"));
}

#[test]
fn compact_storage_is_read_as_each_tool_writes_it() {
    // Sub-indices with their default, and name and value if they have their own.
    let check = |text: &str, expected: &[(u8, &str, Option<i128>, Option<i128>)]| {
        let (device, diagnostics) = read(text);
        assert!(!has(&diagnostics, "eds::key-without-effect"), "{text}");
        let number = |value: &Option<Value>| value.as_ref().and_then(Value::as_integer);
        let entries = device.objects[0].entries.iter();
        let found: Vec<_> =
            entries.map(|it| (it.sub, it.name.as_str(), number(&it.default), number(&it.configured))).collect();
        assert_eq!(found, expected, "{text}");
        assert!(device.objects[0].entries[1..].iter().all(|it| it.data_type == DataType::Unsigned32), "{text}");
    };
    // dcfgen of lely-core: an array with a default, and a mapping, which is a record. Values that are not named are
    // missing.
    let dcfgen = "[1028]\nParameterName=Emergency consumer object\nObjectType=0x08\nDataType=0x0007\nAccessType=rw\n\
        DefaultValue=0x80000000\nCompactSubObj=2\n\n[1028Value]\nNrOfEntries=1\n2=0x00000082\n";
    let (name, off) = ("Emergency consumer object", Some(0x8000_0000));
    let all = [
        (0, "NrOfObjects", Some(2), None),
        (1, &*format!("{name}1"), off, None),
        (2, &*format!("{name}2"), off, Some(0x82)),
    ];
    check(dcfgen, &all);
    let mapping = "[1600]\nParameterName=Mapping\nObjectType=0x09\nDataType=0x0007\nAccessType=rw\nCompactSubObj=1\n\n\
        [1600Value]\nNrOfEntries=1\n1=0x22000120\n";
    check(mapping, &[(0, "NrOfObjects", Some(1), None), (1, "Mapping1", None, Some(0x2200_0120))]);
    // The samples of python-canopen: the count first, names for all, and one sub-index more than there can be.
    let sample = "[3004]\nCompactSubObj=2\nParameterName=Sensor\nObjectType=8\nDataType=7\nAccessType=ro\nDefaultValue=3\nPDOMapping=0\n\
        [3004Name]\nNrOfEntries=2\n1=Left\n2=Right\n";
    check(sample, &[(0, "NrOfObjects", Some(2), None), (1, "Left", Some(3), None), (2, "Right", Some(3), None)]);
    let (device, _) =
        read("[1003]\nParameterName=x\nObjectType=0x8\nCompactSubObj=255\nDataType=0x7\nAccessType=ro\nPDOMapping=0\n");
    assert_eq!(device.objects[0].entries.len(), 255, "sub-indices end with 254");
    // EdsDcfNet: sections of sub-indices besides the count; they take precedence.
    let both = "[6000]\nParameterName=Input\nSubNumber=2\nObjectType=0x8\nDataType=0x0007\nAccessType=ro\nDefaultValue=0\nPDOMapping=1\n\
        CompactSubObj=2\n[6000sub0]\nParameterName=Count\nDataType=0x0005\nAccessType=ro\nDefaultValue=2\n\
        [6000sub2]\nParameterName=Own\nDataType=0x0007\nAccessType=ro\nDefaultValue=7\n";
    check(both, &[(0, "Count", Some(2), None), (1, "Input1", Some(0), None), (2, "Own", Some(7), None)]);
}

#[test]
fn pdo_parameters_that_compact_pdo_leaves_out_are_there() {
    let (device, diagnostics) = read(
        "[DeviceInfo]\nGranularity=16\nNrOfRXPDO=5\nNrOfTXPDO=1\nCompactPDO=0x17\n\
         [1401]\nParameterName=Own\nObjectType=9\nSubNumber=2\n\
         [1401sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=1\n\
         [1401sub1]\nParameterName=Own COB-ID\nDataType=7\nAccessType=rw\nDefaultValue=0x321\n",
    );
    let indices: Vec<u16> = device.objects.iter().map(|object| object.index).collect();
    let expected = [0x1400, 0x1401, 0x1402, 0x1403, 0x1404, 0x1600, 0x1601, 0x1602, 0x1603, 0x1604, 0x1800, 0x1A00];
    assert_eq!(indices, expected);

    // Bits 0, 1, 2 and 4 are sub-indices 1, 2, 3 and 5; 1401h is as described in the file.
    let subs = |index: u16| device.object(index).unwrap().entries.iter().map(|entry| entry.sub).collect::<Vec<_>>();
    assert_eq!(subs(0x1400), [0, 1, 2, 3, 5]);
    assert_eq!(subs(0x1401), [0, 1]);
    assert_eq!(subs(0x1600), [0, 1, 2, 3, 4], "a frame has four pieces of 16 bits");
    assert_eq!(device.entry(0x1800, 0).unwrap().default, Some(Value::Integer(5)));

    let cob_id = |index: u16| device.entry(index, 1).unwrap().default.clone();
    assert_eq!(cob_id(0x1400), Some(Value::NodeIdPlus(0x200)));
    assert_eq!(cob_id(0x1401), Some(Value::Integer(0x321)));
    assert_eq!(cob_id(0x1403), Some(Value::NodeIdPlus(0x500)));
    assert_eq!(cob_id(0x1404), Some(Value::Integer(0x8000_0000)), "beyond the predefined connection set it is off");
    assert_eq!(cob_id(0x1800), Some(Value::NodeIdPlus(0x180)));
    assert_eq!(device.pdos.len(), 6);
    assert!(device.pdos.iter().all(|pdo| pdo.dynamic && pdo.mapping.is_empty()));

    let findings: Vec<&str> = diagnostics.iter().map(|finding| finding.code).collect();
    for code in ["pdo::count", "pdo::half-described", "eds::bad-compact-pdo", "eds::same-name"] {
        assert!(!findings.contains(&code), "{findings:?}");
    }
}

#[test]
fn compact_pdo_stands_for_nothing_where_all_is_written_out() {
    let pdo = "[1800]\nParameterName=c\nObjectType=9\nSubNumber=1\n[1800sub0]\nParameterName=n\nDataType=5\n\
               AccessType=ro\nDefaultValue=0\n[1A00]\nParameterName=m\nObjectType=9\nSubNumber=1\n[1A00sub0]\n\
               ParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=0\n";
    for (counts, objects) in [("NrOfTXPDO=1", 2), ("NrOfTXPDO=0", 2), ("NrOfTXPDO=65535", 1024)] {
        let (device, diagnostics) = read(&format!("[DeviceInfo]\nNrOfRXPDO=0\n{counts}\nCompactPDO=23\n{pdo}"));
        assert_eq!(device.objects.len(), objects);
        assert_eq!(has(&diagnostics, "eds::compact-pdo"), objects > 2, "{counts}");
    }
}

#[test]
fn values_of_a_dcf_are_read_without_compact_storage_as_well() {
    let text = "[2000]\nParameterName=x\nObjectType=9\nSubNumber=1\n[2000sub1]\nParameterName=y\nDataType=6\nAccessType=rw\n\
                [2000Value]\nNrOfEntries=1\n1=7\n";
    assert_eq!(read(text).0.entry(0x2000, 1).unwrap().configured, Some(Value::Integer(7)));
}

#[test]
fn links_denotations_and_files_of_a_dcf_are_read() {
    let text = "[2000]\nParameterName=x\nObjectType=2\nAccessType=rw\nDenotation=Program\nUploadFile=a.bin\nDownloadFile=b.bin\nObjFlags=3\n\
                [2000ObjectLinks]\nObjectLinks=1\n1=0x2001\n";
    let (device, diagnostics) = read(text);
    let (object, entry) = (device.object(0x2000).unwrap(), device.entry(0x2000, 0).unwrap());
    assert_eq!((object.links.as_slice(), object.flags), ([0x2001].as_slice(), 3));
    assert_eq!(entry.denotation.as_deref(), Some("Program"));
    assert_eq!((entry.upload_file.as_deref(), entry.download_file.as_deref()), (Some("a.bin"), Some("b.bin")));
    assert!(has(&diagnostics, "eds::broken-link"));
}

#[test]
fn commissioning_is_read_in_both_spellings() {
    for name in ["DeviceComissioning", "DeviceCommissioning"] {
        let text = format!(
            "[{name}]\nNodeID=5\nNodeName=Axis\nNodeRefd=-K5\nBaudrate=500\nNetNumber=1\nNetworkName=Line\nNetRefd=W1\nCANopenManager=1\nLSS_SerialNumber=0x10\n"
        );
        let (device, diagnostics) = read(&text);
        assert!(!has(&diagnostics, "eds::unknown-key"));
        let commissioning = device.commissioning.expect("it is read");
        assert_eq!((commissioning.node_id, commissioning.bit_rate_kbit), (Some(5), Some(500)));
        assert_eq!((commissioning.manager, commissioning.serial_number), (Some(true), Some(16)));
        assert_eq!(commissioning.network_name.as_deref(), Some("Line"));
        let designators = [commissioning.node_designator.as_deref(), commissioning.network_designator.as_deref()];
        assert_eq!(designators, [Some("-K5"), Some("W1")]);
    }
}

/// The keys of CiA 306-1 for a value in a DCF.
const VALUE: &str = "ParameterName=Word\nObjectType=0x7\nDataType=0x0006\nAccessType=rw\nDefaultValue=1\nLowLimit=0\nHighLimit=9\n\
    PDOMapping=1\nSRDOMapping=1\nInvertedSRAD=0x210000\nParameterValue=2\nDenotation=Level\nParamRefd=-B7\nUploadFile=up.bin\n\
    DownloadFile=down.bin\n";

/// All sections and keys of a DCF in CiA 306-1, except for compact storage.
fn with_all_keys() -> String {
    let rates = [10, 20, 50, 100, 125, 250, 500, 800, 1000].map(|rate| format!("BaudRate_{rate}=1\n")).concat();
    format!(
        "[FileInfo]\nFileName=a.dcf\nFileVersion=1\nFileRevision=2\nEDSVersion=4.0\nDescription=all keys\nCreationTime=09:00AM\n\
         CreationDate=01-02-2026\nCreatedBy=me\nModificationTime=10:00AM\nModificationDate=01-03-2026\nModifiedBy=you\nLastEDS=a.eds\n\
         [DeviceInfo]\nVendorName=v\nVendorNumber=0x1\nProductName=p\nProductNumber=0x2\nRevisionNumber=0x3\nOrderCode=o\n{rates}\
         SimpleBootUpMaster=1\nSimpleBootUpSlave=1\nGranularity=8\nDynamicChannelsSupported=1\nGroupMessaging=1\nNrOfRXPDO=0\n\
         NrOfTXPDO=0\nLSS_Supported=1\nCANopenSafetySupported=1\nProductVersion=1\nProductRevision=2\nLMT_ManufacturerName=m\n\
         LMT_ProductName=l\nExtendedBootUpMaster=1\nExtendedBootUpSlave=0\nNG_Slave=1\nNG_Master=0\nNrOfNG_MonitoredNodes=0\n\
         [DeviceComissioning]\nNodeID=5\nNodeName=Axis\nNodeRefd=-K5\nBaudrate=500\nNetNumber=1\nNetworkName=Line\nNetRefd=W1\n\
         CANopenManager=0\nLSS_SerialNumber=16\n[DummyUsage]\nDummy0005=1\n[Comments]\nLines=1\nLine1=one\n\
         [Tools]\nItems=1\n[Tool1]\nName=t\nCommand=t $EDS\n\
         [DynamicChannels]\nNrOfSeg=1\nType1=0x0007\nDir1=rww\nRange1=0xA080-0xA0BF\nPPOffset1=1\n\
         [SupportedModules]\nNrOfEntries=1\n[ConnectedModules]\nNrOfEntries=1\n1=1\n\
         [M1ModuleInfo]\nProductName=m\nProductVersion=1\nProductRevision=2\nOrderCode=o\n[M1Comments]\nLines=1\nLine1=one\n\
         [M1FixedObjects]\nNrOfEntries=1\n1=0x6200\n[M1Fixed6200]\n{VALUE}[M1SubExtends]\nNrOfEntries=1\n1=0x6000\n\
         [M1SubExt6000]\nCount=1\nObjExtend=0\n{VALUE}\
         [ManufacturerObjects]\nSupportedObjects=2\n1=0x2000\n2=0x2100\n[2000]\nObjFlags=0x1\n{VALUE}[2000ObjectLinks]\n\
         ObjectLinks=1\n1=0x2100\n[2100]\nParameterName=a\nObjectType=0x9\nSubNumber=2\nDenotation=d\nParamRefd=-B8\n\
         [2100sub0]\n{VALUE}[2100sub1]\n{VALUE}"
    )
}

#[test]
fn every_key_of_cia_306_is_known_and_written_again() {
    let text = with_all_keys();
    let (device, diagnostics) = read(&text);
    let found = ["unknown-key", "unknown-section", "key-without-effect", "bad-number", "bad-flag"];
    for finding in diagnostics.iter() {
        assert!(!found.iter().any(|code| finding.code.ends_with(code)), "{} {}", finding.code, finding.message);
    }
    let keys = |text: &str| -> Vec<String> {
        let mut section = String::new();
        let line = |line: &str| match line.starts_with('[') {
            true => (section = line.to_owned(), None).1,
            false => (!line.is_empty()).then(|| format!("{section}{line}")),
        };
        text.lines().filter_map(line).collect()
    };
    let again = keys(&write::dcf(&device));
    let lost: Vec<_> = keys(&text).into_iter().filter(|key| !again.contains(key)).collect();
    assert!(lost.is_empty(), "{lost:#?}");
    assert_eq!(device.entry(0x2000, 0).and_then(|entry| entry.inverted), Some((0x2100, 0)));
}

#[test]
fn signed_limits_as_unsigned_hexadecimal_are_negative() {
    let (entry, diagnostics) = variable("4", "LowLimit=0x80000000\nHighLimit=0x7FFFFFFF");
    assert_eq!((&entry.low, &entry.high), (&Some(Value::Integer(-0x8000_0000)), &Some(Value::Integer(0x7FFF_FFFF))));
    assert!(!has(&diagnostics, "eds::limits-reversed") && !has(&diagnostics, "eds::limit-outside-type"));
}

#[test]
fn long_lines_are_read_whole() {
    let name = "x".repeat(5000);
    let (device, diagnostics) = read(&format!("[2000]\nParameterName={name}\nDataType=5\nAccessType=ro\n"));
    assert_eq!(device.object(0x2000).unwrap().name, name);
    assert!(has(&diagnostics, "eds::long-line") && has(&diagnostics, "eds::long-name"));
}

#[test]
fn hexadecimal_without_0x_is_no_value_and_the_finding_says_why() {
    for text in ["1F", "FF", "0F"] {
        let (entry, diagnostics) = variable("7", &format!("DefaultValue={text}"));
        assert_eq!(entry.default, None, "{text}");
        let finding = diagnostics.iter().find(|finding| finding.code == "eds::bad-value").expect("it is found");
        assert_eq!(finding.labels[0].text, "expected UNSIGNED32; hexadecimal numbers begin with `0x`");
    }
    let (_, diagnostics) = variable("7", "DefaultValue=twelve");
    let finding = diagnostics.iter().find(|finding| finding.code == "eds::bad-value").expect("it is found");
    assert_eq!(finding.labels[0].text, "expected UNSIGNED32");
}

#[test]
fn lines_and_names_are_as_long_as_their_characters_and_not_their_bytes() {
    let is_told = |code: &str, letters: usize| {
        let (_, diagnostics) = read(&format!("[2000]\nParameterName={}\n", "ü".repeat(letters)));
        has(&diagnostics, code)
    };
    let key = "ParameterName=".len();
    assert_eq!([255, 256].map(|letters| is_told("eds::long-line", letters - key)), [false, true]);
    assert_eq!([241, 242].map(|letters| is_told("eds::long-name", letters)), [false, true]);
}

#[test]
fn keys_and_sections_of_editors_are_told_once() {
    let text = "[2000]\nParameterName=x\nDataType=5\nAccessType=ro\nUnit=mm\nFactor=0.1\n[2001]\nParameterName=y\nDataType=5\nAccessType=ro\nUnit=m\n[PreDefines]\npp=1\n";
    let (_, diagnostics) = read(text);
    let messages: Vec<&str> = diagnostics
        .iter()
        .filter(|finding| finding.code.starts_with("eds::unknown"))
        .map(|finding| finding.message.as_str())
        .collect();
    assert_eq!(
        messages,
        [
            "the key `Unit` is unknown and ignored (2 times)",
            "the key `Factor` is unknown and ignored",
            "the section `PreDefines` with 1 key is unknown",
        ]
    );
}

#[test]
fn a_disabled_pdo_collides_with_nothing() {
    let parameter = |index: u16, id: &str| {
        format!(
            "[{index:04X}]\nParameterName=c{index}\nObjectType=9\nSubNumber=1\n[{index:04X}sub1]\nParameterName=i\nDataType=7\nAccessType=rw\nDefaultValue={id}\n"
        )
    };
    let on = parameter(0x1800, "$NODEID+0x180");
    let (device, diagnostics) = read(&format!("{on}{}", parameter(0x1801, "$NODEID+0x80000180")));
    assert_eq!(device.pdos.len(), 2);
    assert!(!has(&diagnostics, "pdo::cob-id-collision"));
    let (_, diagnostics) = read(&format!("{on}{}", parameter(0x1801, "$NODEID+0x40000180")));
    assert!(has(&diagnostics, "pdo::cob-id-collision"));
}

#[test]
fn tables_without_object_are_an_object_without_entries() {
    let (device, diagnostics) = read("[3004Name]\nNrOfEntries=1\n1=x\n");
    assert_eq!(device.object(0x3004).map(|object| object.entries.len()), Some(0));
    assert!(has(&diagnostics, "eds::sub-without-object") && has(&diagnostics, "eds::value-without-entry"));
}

#[test]
fn xml_is_recognised() {
    let (device, diagnostics) = read("\u{feff}<?xml version=\"1.0\"?>\n<project/>\n");
    assert_eq!(device, Device::default());
    assert!(diagnostics.has_errors() && has(&diagnostics, "eds::xml"));
}

#[test]
fn nothing_at_all_is_a_device_without_objects() {
    let (device, diagnostics) = read("");
    assert_eq!(device, Device::default());
    assert!(!diagnostics.has_errors());
}

#[test]
fn one_cause_is_told_once() {
    let mut text = "[DeviceInfo]\nGranularity=64\n[OptionalObjects]\nSupportedObjects=0\n".to_owned();
    text += "[1A00]\nParameterName=m\nObjectType=9\nSubNumber=9\n[1A00sub0]\nParameterName=n\nDataType=5\n\
             AccessType=rw\nDefaultValue=8\n";
    for sub in 1..=8 {
        text += &format!("[1A00sub{sub}]\nParameterName=m{sub}\nDataType=7\nAccessType=rw\nDefaultValue=0x20000008\n");
    }
    for index in 0x2000..0x2020 {
        text += &format!("[{index:X}]\nParameterName=Same\nObjectType=8\nDataType=5\nAccessType=rw\nCompactSubObj=3\n");
    }
    let (_, diagnostics) = read(&text);
    for (code, message) in [
        ("pdo::granularity", "8 mapped lengths are no multiple of the granularity of 64 bits"),
        ("eds::same-name", "the objects 2000, 2001, 2002, 2003, 2004 and 27 more have the same name"),
        ("eds::object-not-listed", "33 objects are in none of the lists: 1A00, 2000, 2001, 2002, 2003 and 28 more"),
    ] {
        let found: Vec<&str> =
            diagnostics.iter().filter(|finding| finding.code == code).map(|finding| finding.message.as_str()).collect();
        assert_eq!(found, [message]);
    }
}

#[test]
fn limits_of_0_and_0_are_none_and_one_finding_says_so_to_a_build() {
    let (entry, diagnostics) = variable("6", "LowLimit=0\nHighLimit=0x0\nDefaultValue=5");
    assert_eq!((&entry.low, &entry.high), (&None, &None));
    assert!(has(&diagnostics, "eds::zero-limits") && !has(&diagnostics, "eds::default-outside-limits"));
    let found = diagnostics.iter().find(|finding| finding.code == "eds::zero-limits").unwrap();
    assert_eq!(found.severity, lexican_eds::Severity::Warning);
    assert_eq!(found.message, "the limits of 2000:00 are both 0, which is read as none");
    let (entry, diagnostics) = variable("8", "LowLimit=0.0\nHighLimit=0");
    assert!(entry.low.is_none() && has(&diagnostics, "eds::zero-limits"));
    for limits in ["LowLimit=0", "LowLimit=0\nHighLimit=1", "LowLimit=7\nHighLimit=7"] {
        let (entry, diagnostics) = variable("6", limits);
        assert!(entry.low.is_some() && !has(&diagnostics, "eds::zero-limits"), "{limits}");
    }
    let many: String = (0x2000..0x2020)
        .map(|index| {
            format!("[{index:X}]\nParameterName=p{index}\nDataType=6\nAccessType=rw\nLowLimit=0\nHighLimit=0\n")
        })
        .collect();
    let (_, diagnostics) = read(&many);
    let of_code: Vec<_> = diagnostics.iter().filter(|finding| finding.code == "eds::zero-limits").collect();
    assert_eq!(of_code.len(), 1);
    assert_eq!(of_code[0].message, "the limits of 32 entries are both 0, which is read as none");
}

#[test]
fn an_overlay_can_say_that_0_is_the_only_value() {
    let text = "[2000]\nParameterName=x\nObjectType=7\nDataType=6\nAccessType=rw\nLowLimit=0\nHighLimit=0\n";
    let overlay = "[overlay]\nformat = 1\n[object.\"2000\"]\nreason = \"r\"\nlow = 0\nhigh = 0\n";
    let input = Input::new(Source::new("x.eds", text)).overlay(Source::new("x.toml", overlay));
    let (device, diagnostics) = load(&input);
    assert_eq!(device.entry(0x2000, 0).unwrap().high, Some(Value::Integer(0)));
    assert!(!has(&diagnostics, "eds::zero-limits") && !has(&diagnostics, "overlay::no-effect"));
}

#[test]
fn bits_of_reals_are_read_and_noted() {
    let (entry, diagnostics) = variable("8", "LowLimit=0xC2C80000\nHighLimit=100.0");
    assert_eq!((&entry.low, &entry.high), (&Some(Value::Real(-100.0)), &Some(Value::Real(100.0))));
    let found = diagnostics.iter().find(|finding| finding.code == "eds::real-bits").unwrap();
    assert_eq!(
        (found.message.as_str(), found.labels[0].text.as_str()),
        ("`LowLimit` of a REAL is given by its bits", "read as -100.0")
    );
    let (entry, diagnostics) = variable("0x11", "DefaultValue=0x3FF8000000000000");
    assert_eq!(entry.default, Some(Value::Real(1.5)));
    assert!(has(&diagnostics, "eds::real-bits"));
    assert!(!has(&variable("8", "DefaultValue=1.5").1, "eds::real-bits"));
}

#[test]
fn the_description_of_a_network_is_no_data_sheet() {
    let (device, diagnostics) = read("[Topology]\nNetName=Line\nNodes=1\nNode2Present=1\nNode2DCFName=a.dcf\n");
    assert!(device.objects.is_empty());
    assert_eq!(diagnostics.iter().map(|finding| finding.code).collect::<Vec<_>>(), ["eds::project"]);
    let (_, diagnostics) = read("[1000]\nParameterName=x\nDataType=7\nAccessType=ro\n[Topology]\nNodes=1\n");
    assert!(has(&diagnostics, "eds::unknown-section") && !has(&diagnostics, "eds::project"));
}

#[test]
fn a_device_type_that_contradicts_the_objects_is_found() {
    let sheet = |device_type: &str, objects: &[u16]| {
        let objects = objects
            .iter()
            .map(|index| format!("[{index:X}]\nParameterName=p{index}\nObjectType=7\nDataType=6\nAccessType=rw\n"));
        let objects: String = objects.collect();
        format!(
            "[1000]\nParameterName=t\nObjectType=7\nDataType=7\nAccessType=ro\nDefaultValue={device_type}\n{objects}"
        )
    };
    let found = |device_type: &str, objects: &[u16]| has(&read(&sheet(device_type, objects)).1, "cia301::device-type");
    let drive = [0x6040, 0x6041];
    for wrong in ["0", "0x00020191", "0x92010000", "0x00009201", "0x01920002"] {
        assert!(found(wrong, &drive), "{wrong}");
    }
    for right in ["0x00020192", "402", "0x0004FFFF", "408", ""] {
        assert!(!found(right, &drive), "{right}");
    }
    assert!(found("0x91010000", &[0x6000]) && !found("401", &[0x6000]) && !found("0", &[0x6000]));
    assert!(found("0x00010191", &[0x6000, 0x6200]) && !found("0x00030191", &[0x6000, 0x6200]));
    let (_, diagnostics) = read(&sheet("0x92010200", &drive));
    let found = diagnostics.iter().find(|finding| finding.code == "cia301::device-type").unwrap();
    assert!(found.help.as_ref().is_some_and(|help| help.ends_with("default = 0x20192")), "{found:?}");
}

#[test]
fn names_that_the_standards_themselves_repeat_are_not_told() {
    let object = |index: u16, name: &str| {
        format!("[{index:X}]\nParameterName={name}\nObjectType=7\nDataType=6\nAccessType=rw\n")
    };
    let same =
        |a: u16, b: u16| has(&read(&[object(a, "Same name"), object(b, "Same name")].concat()).1, "eds::same-name");
    assert!(!same(0x1600, 0x1601) && !same(0x6040, 0x6840) && !same(0x1000, 0x67FF));
    assert!(same(0x2000, 0x2001) && same(0x6040, 0x6041) && same(0x1600, 0x2000));
}

#[test]
fn equal_limits_of_a_command_are_not_told() {
    let sheet =
        |index: &str| format!("[{index}]\nParameterName=x\nDataType=7\nAccessType=rw\nLowLimit=1\nHighLimit=1\n");
    assert!(!has(&read(&sheet("1010")).1, "eds::equal-limits") && has(&read(&sheet("2010")).1, "eds::equal-limits"));
}

#[test]
fn a_value_in_a_table_is_found_where_it_is() {
    let text = "[2000]\nParameterName=x\nObjectType=8\nCompactSubObj=2\nDataType=6\nAccessType=ro\nDefaultValue=1\n\
                [2000Value]\nNrOfEntries=1\n2=7\n";
    check_places(text, &["eds::value-not-writable"], &["10:3 eds::value-not-writable"]);
}

#[test]
fn the_shipped_data_sheets_are_as_every_reader_wants_them() {
    for shipped in lexican_eds::library::all() {
        let (_, diagnostics) = load(&Input { overlays: Vec::new(), ..shipped.input() });
        // lely's dcfgen and dcfchk refuse these.
        for code in ["eds::sub-0-type", "eds::missing-sub-0", "eds::sub-count", "eds::list-count"] {
            assert!(!has(&diagnostics, code), "{}: {code}", shipped.id);
        }
    }
}

/// Findings in real data sheets that were right, or had a harmful remedy.
#[test]
fn what_is_right_is_not_found_and_what_is_wrong_has_no_harmful_remedy() {
    let entry = |index: &str, keys: &str| {
        format!("[{index}]\nParameterName=x{index}\nObjectType=7\nDataType=7\nAccessType=rw\n{keys}\n")
    };
    let pdo = |index: &str, cob_id: &str| {
        entry(&format!("{index}sub1"), &format!("DefaultValue={cob_id}")) + &entry(&format!("{index}sub4"), "")
    };
    let found = |text: &str, code: &str| read(text).1.iter().find(|finding| finding.code == code).cloned();
    // CiA 301 allows these to be mapped.
    for index in ["1013", "1026sub1", "1200sub1", "1201sub2", "1280sub1", "1001"] {
        assert_eq!(found(&entry(index, "PDOMapping=1"), "eds::mappable-parameter"), None, "{index}");
    }
    assert!(found(&entry("1017", "PDOMapping=1"), "eds::mappable-parameter").is_some());
    let pdos = |a: &str, b: &str| found(&(pdo(a, "0x185") + &pdo(b, "0x185")), "pdo::cob-id-collision").is_some();
    assert!(!pdos("1400", "1401") && pdos("1800", "1801") && pdos("1400", "1800"));
    assert!(found(&pdo("1400", "0x185"), "cia301::reserved-sub-index").is_some());
    assert_eq!(found(&pdo("1400", "0x185"), "cia301::data-type"), None);
    let limits = |data_type: &str, keys: &str| {
        let text = entry("2000", keys).replace("DataType=7", &format!("DataType={data_type}"));
        let help = |code: &str| found(&text, code).map(|finding| finding.help.unwrap_or_default());
        (help("eds::limits-reversed"), help("eds::limit-outside-type"))
    };
    let (reversed, outside) = limits("3", "LowLimit=0\nHighLimit=0xFFFF");
    assert!(reversed.is_none() && outside.is_some_and(|help| help.ends_with("high = 32767")));
    let (reversed, _) = limits("4", "LowLimit=0xEC78\nHighLimit=0x1388");
    assert!(reversed.is_some_and(|help| help.ends_with("low = -5000")));
    let (_, outside) = limits("5", "LowLimit=6144\nHighLimit=49152\nDefaultValue=12288");
    assert!(outside.is_some_and(|help| help.contains("accept")));
    let (reversed, outside) = limits("8", "LowLimit=1\nHighLimit=0xFFFF");
    assert!(reversed.is_none() && outside.is_none());
    let emcy = entry("1014", "DefaultValue=0x81");
    assert!(found(&emcy, "cia301::emcy-cob-id").is_some());
    assert_eq!(found(&format!("[DeviceComissioning]\nNodeID=1\n{emcy}"), "cia301::emcy-cob-id"), None);
    // Real sub-indices 0 of another size would be misread.
    let count = "[2000]\nParameterName=x\nObjectType=9\nSubNumber=2\n".to_owned()
        + &entry("2000sub0", "DefaultValue=1")
        + &entry("2000sub1", "");
    assert!(found(&count, "eds::sub-0-type").is_some_and(|finding| finding.fix.is_none()));
    let writable = count.replace("DefaultValue=1", "DefaultValue=0");
    assert_eq!(found(&writable, "eds::highest-sub"), None);
}

#[test]
fn an_object_under_the_number_of_another_gets_the_number_that_is_free() {
    let text = "[ManufacturerObjects]\nSupportedObjects=3\n1=0x2000\n1=0x2001\n3=0x2002\n".to_owned()
        + &["2000", "2001", "2002"]
            .map(|index| format!("[{index}]\nParameterName=x{index}\nDataType=6\nAccessType=rw\n"))
            .concat();
    let (_, diagnostics) = read(&text);
    let found = |code: &str| diagnostics.iter().find(|finding| finding.code == code);
    assert_eq!(found("eds::list-count"), None);
    assert!(found("eds::list-gap").is_some_and(|finding| finding.fix.is_none()));
    let doubled = found("eds::duplicate-key").expect("the number comes twice");
    assert!(doubled.help.as_ref().is_some_and(|help| help.ends_with("line 4: 2=0x2001")), "{doubled:?}");
    assert_eq!(doubled.fix, None);
    let fixed = lexican_eds::fix::fix(&Input::new(Source::new("quirk.eds", text.as_str())));
    assert!(fixed.input.eds.text().contains("1=0x2001\n3=0x2002\n"), "{}", fixed.input.eds.text());
}
