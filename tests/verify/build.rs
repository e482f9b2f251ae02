//! Writes a function for each drive that takes all of its generated code, by the names in its data sheet.

use std::path::Path;
use std::{env, fs};

use lexican_eds::model::{Device, Direction, Entry, Object, ObjectKind};
use notation::snake;

#[path = "src/notation.rs"]
#[allow(dead_code, reason = "names are written here, and numbers read in the comparisons")]
mod notation;

fn main() {
    for shipped in lexican_eds::library::all() {
        let name = shipped.id.replace(['/', '-'], "_");
        let (device, _) = lexican_eds::load(&shipped.input());
        let file = Path::new(&env::var("OUT_DIR").unwrap()).join(format!("{name}.rs"));
        fs::write(file, function(&name, &device)).unwrap();
    }
}

fn function(name: &str, device: &Device) -> String {
    let mut lines: Vec<String> = device.objects.iter().flat_map(object).collect();
    let newtypes = [
        ("enumeration", device.enumerations.keys().collect::<Vec<_>>()),
        ("bit_field", device.bit_fields.keys().collect()),
        ("quantity", device.quantities.keys().collect()),
    ];
    for (kind, names) in newtypes {
        lines.extend(names.iter().map(|name| format!("code.{kind}::<od::{name}>();")));
    }
    for pdo in device.pdos.iter().filter(|pdo| !pdo.mapping.is_empty()) {
        let side = if pdo.direction == Direction::Receive { 'R' } else { 'T' };
        let (name, number) = (format!("{side}pdo{}", pdo.number), pdo.number);
        lines.push(format!(
            "code.pdos.insert(\"{side}PDO{number}\", (od::{name}::MAPPING, od::{name}::cob_id(node).raw()));"
        ));
    }
    format!("{}{}\ncode\n}}\n", BEGINNING.replace("DRIVE", name), lines.join("\n"))
}

const BEGINNING: &str = "fn generated(node: NodeId) -> Code {
    use DRIVE::od;
    let identity = Identity {
        names: [od::VENDOR_NAME, od::PRODUCT_NAME, od::ORDER_CODE],
        numbers: [od::VENDOR_ID, od::PRODUCT_CODE, od::REVISION_NUMBER],
        profile: od::DEVICE_PROFILE,
        bit_rates_kbit: od::BIT_RATES_KBIT,
    };
    let mut code = Code::new(node, &od::TABLE, identity, (od::RANGES, od::WRITABLE_IN, od::PERSISTENT));
";

/// The handles of an object: one constant, the methods of a record, or the elements of an array without names.
fn object(object: &Object) -> Vec<String> {
    let name = snake(&object.name).to_uppercase();
    // A text has no value of a fixed size.
    let call = |entry: &Entry| if entry.data_type.bits().is_some() { "object" } else { "text" };
    if let ([entry], false) = (object.entries.as_slice(), object.kind.has_subs()) {
        return vec![format!("code.{}(\"{name}\", od::{name});", call(entry))];
    }
    if object.kind == ObjectKind::Array && are_alike(&object.entries[1..]) {
        return vec![
            format!("code.object(\"{name}.len_object\", od::{name}.len_object());"),
            format!("od::{name}.iter().for_each(|element| code.object(\"{name}.at\", element));"),
        ];
    }
    let method = |entry: &Entry| {
        let member = snake(&entry.name);
        format!("code.{}(\"{name}.{member}\", od::{name}.{member}());", call(entry))
    };
    object.entries.iter().map(method).collect()
}

/// Whether elements differ in nothing but the numbers in their names.
fn are_alike(elements: &[Entry]) -> bool {
    let words = |entry: &Entry| {
        let name = snake(&entry.name);
        let words = name.split('_').map(|word| word.trim_end_matches(|c: char| c.is_ascii_digit()).to_owned());
        words.filter(|word| !word.is_empty()).collect::<Vec<_>>()
    };
    let what = |entry: &Entry| {
        let limits = (entry.low.clone(), entry.high.clone(), entry.default.clone());
        (words(entry), entry.data_type, entry.meaning.clone(), entry.access, entry.pdo_mapping, limits)
    };
    elements.windows(2).all(|pair| what(&pair[0]) == what(&pair[1]))
}
