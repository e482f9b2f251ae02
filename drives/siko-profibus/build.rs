//! Makes constants of the tables of parameters.

use std::path::Path;
use std::{env, fs};

fn main() {
    for (file, name) in [("ag02", "AG02"), ("ag03-1", "AG03_1")] {
        let path = format!("parameters/{file}.csv");
        println!("cargo::rerun-if-changed={path}");
        let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
        let rows: Vec<String> = text.lines().skip(1).map(|line| row(&path, line)).collect();
        let doc = format!("The parameters of the {}, by number (`{path}`).", name.replace("_", "/"));
        let code = format!("#[doc = {doc:?}]\npub const {name}: &[Row] = &[\n{}];\n", rows.concat());
        let out = env::var("OUT_DIR").expect("set by Cargo");
        fs::write(Path::new(&out).join(format!("{file}.rs")), code)
            .unwrap_or_else(|error| panic!("{file}.rs: {error}"));
    }
    println!("cargo::rerun-if-changed=build.rs");
}

fn row(path: &str, line: &str) -> String {
    let cells: Vec<&str> = line.split(',').collect();
    let &[number, name, access, format, low, high, unit, parameter, content, values] = cells.as_slice() else {
        panic!("{path}: {line}");
    };
    let access = match access {
        "r" => "Read",
        "w" => "Write",
        "rw" => "ReadWrite",
        other => panic!("{path}: {other}"),
    };
    let (format, acknowledged_double) = match format {
        "word" => ("Word", false),
        "word*" => ("Word", true),
        "word[10]" => ("Words(10)", false),
        "double word" => ("DoubleWord", false),
        other => panic!("{path}: {other}"),
    };
    let range = if low.is_empty() { "None".to_owned() } else { format!("Some(({low}, {high}))") };
    let parameter = if parameter.is_empty() { "None".to_owned() } else { format!("Some({parameter})") };
    let content = match content {
        "address" => "Content::Address".to_owned(),
        "faults" => "Content::Faults".to_owned(),
        "load" => "Content::Load".to_owned(),
        "mode" => "Content::Mode".to_owned(),
        "own" => "Content::InchingStop".to_owned(),
        "version" => "Content::Version".to_owned(),
        object => {
            let (index, sub) = object.split_once(':').unwrap_or_else(|| panic!("{path}: {object}"));
            format!("Content::Object(Address::new(0x{index}, 0x{sub}))")
        }
    };
    let values: String = values
        .split("; ")
        .filter_map(|value| value.split_once(' '))
        .map(|(number, name)| format!("({number}, {name:?}), "))
        .collect();
    format!(
        "    Row {{ wire: Parameter {{ number: {number}, access: Access::{access}, format: Format::{format}, range: {range}, \
         acknowledged_double: {acknowledged_double} }}, name: {name:?}, unit: {unit:?}, parameter: {parameter}, \
         content: {content}, values: &[{values}] }},\n"
    )
}
