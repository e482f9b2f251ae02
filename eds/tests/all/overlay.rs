//! The effects of overlays, and that findings which they correct are gone.

use lexican_eds::model::{AccessType, Direction, Mapped, Meaning, NmtState, Value};
use lexican_eds::types::DataType;
use lexican_eds::{Diagnostics, Input, Source, load, model::Device};

const EDS: &str = "\
[2000]
ParameterName=Speed
ObjectType=7
DataType=6
AccessType=UNKNOWN
DefaultValue=twelve
LowLimit=10
HighLimit=1

[2001]
ParameterName=Table
ObjectType=8
SubNumber=3
[2001sub0]
ParameterName=Count
DataType=5
AccessType=ro
DefaultValue=2
[2001sub1]
ParameterName=One
DataType=6
AccessType=rw
[2001sub2]
ParameterName=Two
DataType=6
AccessType=rw
";

fn read(overlays: &[&str]) -> (Device, Diagnostics) {
    let mut input = Input::new(Source::new("x.eds", EDS));
    for overlay in overlays {
        input = input.overlay(Source::new("x.toml", format!("[overlay]\nformat = 1\n{overlay}")));
    }
    load(&input)
}

fn codes(diagnostics: &Diagnostics) -> Vec<&str> {
    // A file of two objects lacks much that these tests are not about.
    let general =
        ["eds::missing-section", "cia301::missing-object", "cia301::no-error-control", "eds::object-not-listed"];
    diagnostics.iter().map(|finding| finding.code).filter(|code| !general.contains(code)).collect()
}

#[test]
fn corrections_mend_what_was_found() {
    assert_eq!(codes(&read(&[]).1), ["eds::bad-access-type", "eds::bad-value", "eds::limits-reversed"]);
    let (device, diagnostics) = read(&["
        [object.\"2000\"]
        reason = \"manual, page 12\"
        name = \"Target speed\"
        data_type = \"INTEGER16\"
        access = \"rww\"
        pdo_mapping = true
        default = 12
        low = -100
        high = \"0x64\"
    "]);
    assert_eq!(codes(&diagnostics), [] as [&str; 0]);
    let entry = device.entry(0x2000, 0).unwrap();
    assert_eq!(
        (entry.name.as_str(), entry.data_type, entry.access),
        ("Target speed", DataType::Integer16, AccessType::Rww)
    );
    assert_eq!(device.object(0x2000).unwrap().name, "Target speed");
    assert!(entry.pdo_mapping);
    let values = [&entry.default, &entry.low, &entry.high].map(|value| value.as_ref().and_then(Value::as_integer));
    assert_eq!(values, [Some(12), Some(-100), Some(100)]);
}

#[test]
fn meanings_of_an_array_are_those_of_its_entries() {
    let (device, diagnostics) = read(&["
        [object.\"2001\"]
        description = \"Two speeds.\"
        quantity = \"Speed\"
        first_character_high = true
        persistent = true
        writable_in = [\"pre-operational\"]
        [object.\"2001:02\"]
        name = \"Second\"
        ranges = [{ when = \"2001:01 == 2\", low = 1, high = 200 }]
        [quantity.Speed]
        units = [{ symbol = \"rev/min\", method = \"revolutions_per_minute\", scale = \"1/2\" }]
    "]);
    assert_eq!(codes(&diagnostics), codes(&read(&[]).1));
    let object = device.object(0x2001).unwrap();
    assert_eq!(object.description.as_deref(), Some("Two speeds."));
    assert_eq!(object.entries[0].meaning, Meaning::Plain);
    for entry in &object.entries[1..] {
        assert_eq!(entry.meaning, Meaning::Quantity("Speed".into()));
        assert!(entry.persistent && entry.first_character_high && entry.description.is_none());
        assert_eq!(entry.writable_in, Some(Box::from([NmtState::PreOperational])));
    }
    assert_eq!((object.entries[1].name.as_str(), object.entries[2].name.as_str()), ("One", "Second"));
    assert_eq!((object.entries[2].ranges[0].when.index, object.entries[2].ranges[0].high), (0x2001, 200));
    assert_eq!((device.quantities["Speed"].units[0].num, device.quantities["Speed"].units[0].den), (1, 2));
}

#[test]
fn what_is_not_simulated_says_why() {
    let (device, diagnostics) = read(&["
        [object.\"2000..2001\"]
        simulated = false
        reason = \"ours\"
        [object.\"2001:02\"]
        simulated = true
        bit_field = \"Word\"
        reason = \"it is\"
        [bit_field.Word]
        fields = [
            { bits = 0, name = \"on\" },
            { bits = \"4..7\", name = \"mode\", simulated = false, reason = \"nobody asks\" },
        ]
    "]);
    assert_eq!(codes(&diagnostics), codes(&read(&[]).1));
    let why = |index, sub| device.entry(index, sub).unwrap().not_simulated.as_deref();
    let all = [why(0x2000, 0), why(0x2001, 0), why(0x2001, 1), why(0x2001, 2)];
    assert_eq!(all, [Some("ours"), None, Some("ours"), None]);
    assert_eq!(device.bit_fields["Word"].not_simulated, [(4, "nobody asks".to_owned())].into());
    for (overlay, code) in [
        ("[object.\"2000\"]\nsimulated = false", "overlay::missing-reason"),
        ("[object.\"2000..2001\"]\nsimulated = false", "overlay::missing-reason"),
        ("[object.\"2000..2001\"]\nname = \"x\"", "overlay::unknown-key"),
        ("[object.\"5000..5001\"]\nsimulated = false\nreason = \"x\"", "overlay::unknown-object"),
        ("[object.\"2000..x\"]\nsimulated = false\nreason = \"x\"", "overlay::bad-value"),
        ("[bit_field.Word]\nfields = [{ bits = 0, name = \"on\", simulated = false }]", "overlay::bad-value"),
    ] {
        let (_, diagnostics) = read(&[overlay]);
        assert!(codes(&diagnostics).contains(&code), "{overlay}: {:?}", codes(&diagnostics));
    }
}

#[test]
fn what_is_accepted_is_not_found() {
    let accept = |address: &str, code: &str| {
        format!("[object.\"{address}\"]\nreason = \"the manual says so\"\naccept = [\"{code}\"]\n")
    };
    let (_, diagnostics) = read(&[&accept("2000", "eds::limits-reversed")]);
    assert_eq!(codes(&diagnostics), ["eds::bad-access-type", "eds::bad-value"]);
    let (_, diagnostics) = read(&[&accept("2001:02", "eds::limits-reversed")]);
    assert!(codes(&diagnostics).contains(&"overlay::accepted-in-vain"));
    let (_, diagnostics) = read(&[&accept("2000", "eds::no-such-rule")]);
    assert!(codes(&diagnostics).contains(&"overlay::bad-value"));
    let (_, diagnostics) = read(&["[object.\"2000\"]\naccept = [\"eds::limits-reversed\"]\n"]);
    assert!(codes(&diagnostics).contains(&"overlay::missing-reason"));
}

#[test]
fn pdos_are_added_and_the_device_is_described() {
    let (device, _) = read(&["
        profile = 402
        sdo_writes_four_bytes = true
        [[pdo]]
        direction = \"transmit\"
        number = 2
        cob_id = \"$NODEID+0x280\"
        transmission_type = 255
        mapping = [\"2000:00\", \"0005:00\", \"2001:02\"]
    "]);
    let pdo = &device.pdos[0];
    assert_eq!((pdo.direction, pdo.number, pdo.transmission_type), (Direction::Transmit, 2, Some(255)));
    assert_eq!(pdo.cob_id, Some(Value::NodeIdPlus(0x280)));
    let mapped = |index, sub, bits| Mapped { index, sub, bits };
    assert_eq!(pdo.mapping, [mapped(0x2000, 0, 16), mapped(5, 0, 8), mapped(0x2001, 2, 16)]);
    assert_eq!((device.profile, device.sdo_writes_four_bytes), (Some(402), true));
    assert!(!read(&[]).0.sdo_writes_four_bytes);
}

#[test]
fn the_last_overlay_wins() {
    let name = |name: &str| format!("[object.\"2000\"]\nname = \"{name}\"\n");
    let (device, _) = read(&[&name("first"), &name("second")]);
    assert_eq!(device.object(0x2000).unwrap().name, "second");
}

#[test]
fn findings_in_an_overlay_name_its_lines() {
    let input = Input::new(Source::new("x.eds", EDS))
        .overlay(Source::new("x.toml", "[overlay]\nformat = 1\n\n[object.\"2000\"]\nlow = true\n"));
    let text = load(&input).1.render(&input);
    assert!(text.contains("error[overlay::missing-reason]") && text.contains(" --> x.toml:4:9"), "{text}");
}

/// Checks what the findings about wrong values in an overlay say is expected.
#[track_caller]
fn check_expected(overlay: &str, expected: &[&str]) {
    let (_, diagnostics) = read(&[overlay]);
    let wrong = diagnostics.iter().filter(|finding| finding.code == "overlay::bad-value");
    assert_eq!(wrong.map(|finding| finding.message.as_str()).collect::<Vec<_>>(), expected, "{overlay}");
}

#[test]
fn one_wrong_value_is_one_finding_that_says_what_is_right() {
    let object = |key: &str| format!("[object.\"2000\"]\nreason = \"r\"\n{key}\n");
    check_expected(&object("name = 5"), &["expected a text"]);
    check_expected(&object("description = 5"), &["expected a text"]);
    check_expected(&object("default = \"\""), &["expected a value of UNSIGNED16"]);
    check_expected(&object("low = \"NULL\""), &["expected a value of UNSIGNED16"]);
    check_expected(&object("data_type = -1"), &["expected a number from 0 to 65535"]);
    check_expected(&object("data_type = 0x99999"), &["expected a number from 0 to 65535"]);
    check_expected(&object("data_type = 0x400"), &["expected the name of a data type of CiA 301, or its number"]);
    check_expected(&object("data_type = \"WORD\""), &["expected the name of a data type of CiA 301, or its number"]);
    check_expected(&object("writable_in = []"), &["expected at least one state"]);
    check_expected(
        &object("ranges = [ { when = \"x\", low = 1, high = 2 } ]"),
        &["expected a condition such as \"2102:00 == 2\""],
    );
    check_expected(
        "[quantity.Speed]\nunits = [ { symbol = \"m\", method = \"metres\", scale = \"x\" } ]\n",
        &["expected a scale such as \"1/100\""],
    );
    check_expected(
        "[[pdo]]\ndirection = \"up\"\nnumber = 1\n[[pdo]]\ndirection = \"receive\"\nnumber = 513\n",
        &["expected \"receive\" or \"transmit\"", "expected a number from 1 to 512"],
    );
    check_expected("[[pdo]]\nnumber = 1\n", &["expected a PDO with `direction` and `number`"]);
    check_expected(
        &object("default = 1\nranges = [ { low = 1 } ]"),
        &["expected a range with `when`, `low` and `high`"],
    );
}

#[test]
fn an_array_is_corrected_element_by_element_each_with_its_own_findings() {
    let codes_and_messages = |overlay: &str| {
        let (device, diagnostics) = read(&[overlay]);
        let of_overlay = diagnostics.iter().filter(|finding| finding.code.starts_with("overlay::"));
        let found: Vec<String> = of_overlay.map(|finding| format!("{} {}", finding.code, finding.message)).collect();
        (device, found)
    };
    // The first element differs, so only the second element has a finding.
    let first = "[object.\"2001:01\"]\nreason = \"r\"\ndata_type = \"UNSIGNED8\"\n";
    let second = "[object.\"2001\"]\nreason = \"r\"\ndata_type = \"UNSIGNED16\"\n";
    let input = Input::new(Source::new("x.eds", EDS));
    let sheet = |text: &str| Source::new("x.toml", format!("[overlay]\nformat = 1\n{text}"));
    let (device, diagnostics) = load(&input.overlay(sheet(first)).overlay(sheet(second)));
    let found: Vec<&str> =
        diagnostics.iter().filter(|f| f.code == "overlay::no-effect").map(|f| f.message.as_str()).collect();
    assert_eq!(found, ["the data sheet has the same `DataType` for 2001:02"]);
    assert_eq!(device.entry(0x2001, 1).map(|entry| entry.data_type), Some(DataType::Unsigned16));
    // Each element has a finding of its own.
    let (_, found) = codes_and_messages(second);
    let same = |sub: u8| format!("overlay::no-effect the data sheet has the same `DataType` for 2001:{sub:02X}");
    assert_eq!(found, [same(1), same(2)]);
    // Mistakes of the overlay itself are reported once, not for each element.
    let (_, found) = codes_and_messages("[object.\"2001\"]\nreason = \"r\"\nlow = true\nunit = 1\naccess = \"x\"\n");
    assert_eq!(
        found,
        [
            "overlay::unknown-key the key `unit` is unknown here",
            "overlay::bad-value expected ro, wo, rw, rwr, rww or const"
        ]
    );
    // A value that is invalid only for the second element.
    let wide = "[object.\"2001:01\"]\nreason = \"r\"\ndata_type = \"VISIBLE_STRING\"\n";
    let text = "[object.\"2001\"]\nreason = \"r\"\ndefault = \"text\"\n";
    let input = Input::new(Source::new("x.eds", EDS)).overlay(sheet(wide)).overlay(sheet(text));
    let (_, diagnostics) = load(&input);
    let found: Vec<&str> =
        diagnostics.iter().filter(|f| f.code == "overlay::bad-value").map(|f| f.message.as_str()).collect();
    assert_eq!(found, ["expected a value of UNSIGNED16"]);
}

#[test]
fn an_unknown_key_is_answered_with_the_keys_that_are_known() {
    let sections = [
        "KEY = 1",
        "[[pdo]]\nKEY = 1",
        "[object.\"2000\"]\nKEY = 1",
        "[object.\"2000\"]\nranges = [{ KEY = 1 }]",
        "[enumeration.E]\nKEY = 1",
        "[enumeration.E]\nvalues = [{ KEY = 1 }]",
        "[bit_field.B]\nfields = [{ KEY = 1 }]",
        "[quantity.Q]\nunits = [{ KEY = 1 }]",
    ];
    for section in sections {
        let unknown = |key: &str| {
            let sheet = Source::new("x.toml", format!("[overlay]\nformat = 1\n{}", section.replace("KEY", key)));
            let (_, diagnostics) = load(&Input::new(Source::new("x.eds", EDS)).overlay(sheet));
            let finding = diagnostics.iter().find(|finding| finding.code == "overlay::unknown-key");
            finding.map(|finding| finding.help.clone().expect("it has a help"))
        };
        let help = unknown("colour").expect(section);
        let known: Vec<&str> = help.split('`').skip(1).step_by(2).collect();
        assert!(known.len() > 1, "{help}");
        for key in known {
            assert_eq!(unknown(key), None, "{key} in {section}");
        }
    }
}
