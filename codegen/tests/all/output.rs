//! Properties of all generated code, shown on a device with one of everything.

use std::collections::BTreeMap;

use lexican_codegen::{Options, Output, compile};
use lexican_eds::Span;
use lexican_eds::model::{
    AccessType, BitField, Bits, Condition, ConditionalRange, Device, Direction, Entry, Enumeration, Mapped, Meaning,
    Named, NmtState, Object, ObjectKind, Pdo, Quantity, Unit, Value,
};
use lexican_eds::types::DataType;
use proc_macro2::{Delimiter, TokenTree};
use proptest::prelude::*;

fn entry(index: u16, sub: u8, name: &str, data_type: DataType, access: AccessType) -> Entry {
    let mut entry = Entry::new(index, sub, Span::default());
    (entry.name, entry.data_type, entry.access) = (name.into(), data_type, access);
    entry
}

fn object(name: &str, kind: ObjectKind, entries: Vec<Entry>) -> Object {
    let mut object = Object::new(entries[0].index, kind, Span::default());
    (object.name, object.entries) = (name.into(), entries);
    object
}

fn variable(entry: Entry) -> Object {
    object(&entry.name.clone(), ObjectKind::Variable, vec![entry])
}

fn named<T>(name: &str, value: T) -> Named<T> {
    Named { name: name.into(), description: None, value }
}

fn device() -> Device {
    use AccessType::{Const, Ro, Rw, Rww, Wo};
    let mut controlword = entry(0x6040, 0, "Controlword", DataType::Unsigned16, Rww);
    controlword.pdo_mapping = true;
    controlword.meaning = Meaning::BitField("control word".into());
    controlword.default = Some(Value::Integer(6));
    let mut mode = entry(0x6060, 0, "Modes of operation", DataType::Integer8, Wo);
    mode.pdo_mapping = true;
    mode.meaning = Meaning::Enumeration("operation mode".into());
    let mut voltage = entry(0x2000, 0, "Motor voltage", DataType::Unsigned16, Ro);
    voltage.meaning = Meaning::Quantity("voltage".into());
    voltage.pdo_mapping = true;
    let mut gain = entry(0x2410, 1, "Controller parameter P", DataType::Unsigned16, Rw);
    (gain.low, gain.high, gain.default) =
        (Some(Value::Integer(1)), Some(Value::Integer(500)), Some(Value::Integer(100)));
    gain.persistent = true;
    gain.writable_in = Some(Box::from([NmtState::PreOperational]));
    gain.ranges =
        vec![ConditionalRange { when: Condition { index: 0x6060, sub: 0, equal: true, value: -1 }, low: 1, high: 200 }];
    let mut cob_id = entry(0x1014, 0, "COB-ID EMCY", DataType::Unsigned32, Rw);
    cob_id.default = Some(Value::NodeIdPlus(0x80));
    let mut text = entry(0x1008, 0, "Device name", DataType::VisibleString, Const);
    text.default = Some(Value::Text("Größe [1]".into()));
    let errors = |sub| entry(0x1003, sub, &format!("Error {sub}"), DataType::Unsigned32, Ro);
    let unit = |symbol: &str, method: &str, num, den| Unit {
        symbol: symbol.into(),
        method: method.into(),
        num,
        den,
        when: None,
    };
    Device {
        objects: vec![
            object(
                "Error field",
                ObjectKind::Array,
                vec![entry(0x1003, 0, "Number of errors", DataType::Unsigned8, Rw), errors(1), errors(2), errors(3)],
            ),
            variable(text),
            variable(cob_id),
            variable(voltage),
            object(
                "Motor parameter set",
                ObjectKind::Record,
                vec![
                    entry(0x2410, 0, "Number of entries", DataType::Unsigned8, Ro),
                    gain,
                    entry(0x2410, 3, "type", DataType::Real32, Rw),
                    entry(0x2410, 4, "odd", DataType::Integer24, Rw),
                    entry(0x2410, 5, "odd", DataType::TimeOfDay, Rw),
                ],
            ),
            variable(controlword),
            variable(mode),
        ],
        enumerations: BTreeMap::from([(
            "operation mode".into(),
            Enumeration {
                description: None,
                values: vec![named("none", -1), named("position", 1), named("velocity", 2)],
                is_hex: false,
                span: Span::default(),
            },
        )]),
        bit_fields: BTreeMap::from([(
            "control word".into(),
            BitField {
                description: Some("Commands to the drive.".into()),
                fields: vec![named("switch on", Bits { low: 0, high: 0 }), named("mode", Bits { low: 4, high: 6 })],
                not_simulated: BTreeMap::new(),
                span: Span::default(),
            },
        )]),
        quantities: BTreeMap::from([(
            "voltage".into(),
            Quantity { description: None, units: vec![unit("V", "volts", 1, 10)], span: Span::default() },
        )]),
        pdos: vec![
            Pdo {
                direction: Direction::Receive,
                number: 1,
                cob_id: Some(Value::NodeIdPlus(0x200)),
                transmission_type: Some(255),
                mapping: vec![
                    Mapped { index: 0x6040, sub: 0, bits: 16 },
                    Mapped { index: 5, sub: 0, bits: 8 },
                    Mapped { index: 0x6060, sub: 0, bits: 8 },
                ],
                dynamic: false,
            },
            Pdo {
                direction: Direction::Transmit,
                number: 3,
                cob_id: None,
                transmission_type: None,
                mapping: vec![Mapped { index: 0x2000, sub: 0, bits: 16 }, Mapped { index: 0x5555, sub: 1, bits: 1 }],
                dynamic: false,
            },
        ],
        ..Device::default()
    }
}

fn output() -> Output {
    compile(&device(), &Options { storage: true, names: true, ..Options::default() })
}

#[test]
fn two_runs_give_the_same_bytes() {
    assert_eq!(output().code, output().code);
}

#[test]
fn generated_code_can_be_included_anywhere() {
    let code = output().code;
    let file = syn::parse_file(&code).unwrap();
    assert!(file.attrs.is_empty(), "inner attributes cannot be included");
    assert!(!file.items.iter().any(|item| matches!(item, syn::Item::Mod(_))));
    // What is imported gives way to what else the module has: macros by names that only lexican has, and the glob of one.
    let imports: Vec<&str> = code.lines().filter(|line| line.starts_with("use ")).collect();
    let macros = "use ::lexican_runtime::{bit_field, device_model, enumeration, pdo, quantity};";
    assert_eq!(imports, [macros]);
    assert!(code.contains("\ndevice_model!(NAMES);\n"));
    assert!(!code.contains("unsafe"));
}

#[test]
fn the_runtime_is_named_only_by_its_path() {
    let options = Options { storage: true, names: true, driver: true, runtime_path: "crate::bus".into() };
    let code = compile(&device(), &options).code;
    assert!(!code.contains("lexican_runtime"));
    assert!(code.contains("use crate::bus::{"));
}

#[test]
fn findings_are_reported() {
    let codes: Vec<&str> = output().diagnostics.iter().map(|finding| finding.code).collect();
    assert_eq!(codes, ["od::name-collision", "pdo::untyped"]);
}

#[test]
fn what_a_dcf_configures_in_1000h_is_the_profile() {
    let dcf = "[MandatoryObjects]\nSupportedObjects=1\n1=0x1000\n[OptionalObjects]\nSupportedObjects=1\n1=0x6060\n\
               [1000]\nParameterName=Device type\nObjectType=7\nDataType=7\nAccessType=ro\nDefaultValue=0\n\
               ParameterValue=0x20192\n[6060]\nParameterName=Mode\nObjectType=7\nDataType=2\nAccessType=rw\n";
    let (device, _) = lexican_eds::load(&lexican_eds::Input::new(lexican_eds::Source::new("x.dcf", dcf)));
    let code = compile(&device, &Options::default()).code;
    assert!(code.contains("pub const DEVICE_PROFILE: u16 = 402;"), "{code}");
    assert!(code.contains("pub struct ModeOfOperation(i8): Integer8 {"), "{code}");
}

/// The device with one of everything, with arbitrary words and numbers.
fn strange(words: &[String], numbers: &[i64], sorts: &[u8]) -> Device {
    let mut device = device();
    let mut words = words.iter().cycle();
    let mut word = || words.next().cloned().unwrap_or_default();
    let mut numbers = numbers.iter().cycle();
    let mut number = || Some(Value::Integer(i128::from(*numbers.next().unwrap_or(&0))));
    let mut sorts = sorts.iter().cycle();
    for object in &mut device.objects {
        object.name = word();
        object.description = Some(word());
        for entry in &mut object.entries {
            (entry.name, entry.description) = (word(), Some(word()));
            (entry.default, entry.low, entry.high) = (number(), number(), number());
            entry.data_type = DataType::from_code(u16::from(*sorts.next().unwrap_or(&0)));
        }
    }
    let units: Vec<Unit> =
        (0..3).map(|_| Unit { symbol: word(), method: word(), num: 7, den: -3, when: None }).collect();
    device.quantities.values_mut().for_each(|quantity| quantity.units = units.clone());
    for enumeration in device.enumerations.values_mut() {
        enumeration.values.iter_mut().for_each(|value| value.name = word());
    }
    for field in device.bit_fields.values_mut() {
        field.fields.iter_mut().for_each(|bits| (bits.name, bits.description) = (word(), Some(word())));
    }
    for pdo in &mut device.pdos {
        pdo.cob_id = number();
        pdo.mapping.iter_mut().zip(&mut sorts).for_each(|(mapped, &bits)| mapped.bits = bits);
    }
    device.info.product_name = Some(word());
    device.file.name = Some(word());
    device
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn no_data_sheet_makes_code_that_does_not_parse(
        words in prop::collection::vec("\\PC{0,12}|[a-c_ ]{0,3}|(with|from|type|self|at|[0-9]) ?[a-b]?", 1..40),
        numbers in prop::collection::vec(any::<i64>(), 1..20),
        sorts in prop::collection::vec(0_u8..0x45, 1..20),
    ) {
        let device = strange(&words, &numbers, &sorts);
        let code = compile(&device, &Options { storage: true, names: true, ..Options::default() }).code;
        let file = syn::parse_file(&code).unwrap();
        for item in &file.items {
            let mut names = match item {
                syn::Item::Impl(item) => item.items.iter().filter_map(name_of).collect(),
                syn::Item::Macro(item) if !item.mac.path.is_ident("device_model") => names_of_rows(&item.mac),
                _ => continue,
            };
            let all = names.len();
            names.sort();
            names.dedup();
            prop_assert_eq!(names.len(), all, "two members have one name: {:?}", names);
        }
    }
}

/// The names in the rows of a newtype or PDO: all before the first `:` or `=` of each.
fn names_of_rows(mac: &syn::Macro) -> Vec<String> {
    let body = mac.tokens.clone().into_iter().find_map(|token| match token {
        TokenTree::Group(group) if group.delimiter() == Delimiter::Brace => Some(group.stream()),
        _ => None,
    });
    let mut names = Vec::new();
    let mut in_names = true;
    for token in body.expect("a macro of generated code has rows") {
        match token {
            TokenTree::Ident(name) if in_names => names.push(name.to_string()),
            TokenTree::Punct(mark) => {
                in_names = mark.as_char() == ';' || (in_names && !matches!(mark.as_char(), ':' | '='));
            }
            _ => {}
        }
    }
    names
}

fn name_of(item: &syn::ImplItem) -> Option<String> {
    match item {
        syn::ImplItem::Const(item) => Some(item.ident.to_string()),
        syn::ImplItem::Fn(item) => Some(item.sig.ident.to_string()),
        _ => None,
    }
}
