//! Golden cases: `golden/<case>.txt` has a data sheet, the findings in it and the code generated from it (`cases.rs`
//! describes the format). The whole code of each case is compiled and linted in each edition.
//!
//! `cargo xtask bless` writes the files anew.

use crate::outside;
use std::fmt::Write as _;
use std::path::Path;
use std::{env, fs};

use crate::cases::{Case, case, cases};

const BLESS: &str = "LEXICAN_BLESS";

#[test]
fn what_is_generated_is_what_was_reviewed() {
    let differing: Vec<String> = cases().iter().filter_map(compare).collect();
    assert!(differing.is_empty(), "{}\nreview and accept: cargo xtask bless", differing.join("\n"));
}

#[test]
fn every_finding_of_the_generator_has_a_case() {
    let found: String = cases().iter().map(Case::expected).collect();
    for finding in lexican_codegen::FINDINGS {
        assert!(found.contains(&format!("[{}]", finding.code)), "no case under golden/ shows {}", finding.code);
    }
}

#[test]
fn the_output_does_not_depend_on_where_the_input_lies() {
    for case in cases() {
        assert_eq!(case.code_of(&case.input("/somewhere/else/")), case.code());
    }
}

#[test]
fn all_code_is_clean_in_edition_2021() {
    is_clean("2021");
}

#[test]
fn all_code_is_clean_in_edition_2024() {
    is_clean("2024");
}

/// All cases as modules of a crate outside of the workspace, with `missing_docs`. The code of one case is also included
/// in a module with other items.
fn is_clean(edition: &str) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("golden-{edition}"));
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).expect("the folder can be written to");
    fs::create_dir_all(folder.join("src")).expect("the folder can be made");
    let [runtime, driver] =
        ["../runtime", "../drives/driver"].map(|crate_| Path::new(env!("CARGO_MANIFEST_DIR")).join(crate_));
    write(
        "Cargo.toml",
        &format!(
            "[package]\nname = \"golden-{edition}\"\nversion = \"0.0.0\"\nedition = \"{edition}\"\npublish = false\n\n\
             [dependencies]\nlexican-runtime = {{ path = {runtime:?} }}\nlexican-driver = {{ path = {driver:?} }}\n\n[lints.rust]\nmissing_docs = \"warn\"\n\n\
             [workspace]\n"
        ),
    );
    let mut lib = format!("//! All golden cases, in edition {edition}.\n#![no_std]\n{AMONG_OTHERS}");
    for case in cases().into_iter().chain([shadowing()]) {
        let _ = write!(lib, "\n/// `{0}`.\npub mod {0};\n", case.name);
        write(&format!("src/{}.rs", case.name), &case.code());
    }
    write("src/lib.rs", &lib);
    let folder = folder.to_str().expect("the target folder is text");
    outside::succeeds(folder, &["doc", "--no-deps"]);
    outside::succeeds(folder, &["clippy", "--all-targets", "--", "-D", "warnings"]);
}

const AMONG_OTHERS: &str = "
/// Included into a module that has imported names that the code uses.
pub mod among_others {
    use lexican_runtime::object::{Object, Ro};

    include!(\"overlay.rs\");

    /// Not of the data sheet.
    pub const OF_THE_USER: Object<u8, Ro> = Object::new(0x5FFF, 0x00);
}
";

/// A data sheet with a type for each name that generated code imports, and with everything that may use these types.
fn shadowing() -> Case {
    let exports = include_str!("../../../runtime/src/object/mod.rs");
    let exports = exports.lines().skip_while(|line| !line.starts_with("pub use")).take_while(|line| !line.is_empty());
    let words = exports.flat_map(|line| line.split(|c: char| !c.is_alphanumeric()));
    let names: Vec<&str> =
        words.filter(|word| word.starts_with(|c: char| c.is_uppercase())).chain(["Option"]).collect();
    assert!(names.contains(&"Object") && names.contains(&"Entry") && names.len() > 40, "{names:?}");
    let mut given = format!("generate: storage, names\n{BESIDE_NAMES}[2000] Values ; ObjectType=9 ; SubNumber=99\n");
    let mut overlay = BESIDE_NAMES_OVERLAY.to_owned();
    for (name, sub) in names.iter().zip(1..) {
        let keys = "DataType=5 ; AccessType=rw ; DefaultValue=1 ; HighLimit=2 ; PDOMapping=1";
        let _ = writeln!(given, "[2000sub{sub:X}] {name} value ; {keys}");
        let _ = writeln!(overlay, "[object.\"2000:{sub:02X}\"]\nenumeration = \"{name}\"");
        let _ = writeln!(overlay, "[enumeration.{name}]\nvalues = [{{ value = 1, name = \"Some\" }}]");
    }
    Case::of("shadowing", given + &overlay)
}

const BESIDE_NAMES: &str = "
[1016] List ; ObjectType=8 ; SubNumber=3
[1016sub0] Length ; DataType=5 ; AccessType=rw ; DefaultValue=2
[1016sub1] Value 1 ; DataType=7 ; AccessType=ro ; PDOMapping=1
[1016sub2] Value 2 ; DataType=7 ; AccessType=ro ; PDOMapping=1
[2001] Flags ; DataType=6 ; AccessType=rw ; DefaultValue=$NODEID ; PDOMapping=1
[2002] Distance ; DataType=0x16 ; AccessType=rw ; DefaultValue=0
[2003] Text ; DataType=9 ; AccessType=const ; DefaultValue=text
[2004] Time ; DataType=0xC ; AccessType=wo
[2005] Bytes ; DataType=0xA ; AccessType=rw
";

const BESIDE_NAMES_OVERLAY: &str = "overlay:
[overlay]
format = 1
[object.\"2001\"]
bit_field = \"flags\"
ranges = [{ when = \"2002:00 != 0\", low = 0, high = 1 }]
writable_in = [\"operational\"]
persistent = true
[object.\"2002\"]
quantity = \"distance\"
[bit_field.flags]
fields = [{ bits = 0, name = \"take\" }, { bits = \"1..3\", name = \"field\" }]
[quantity.distance]
units = [{ symbol = \"m\", method = \"metres\", scale = \"1\", when = \"2001:00 == 0\" }, \
         { symbol = \"km\", method = \"kilometres\", scale = \"1\", when = \"2001:00 != 0\" }]
[[pdo]]
direction = \"transmit\"
number = 1
mapping = [\"2001:00\", \"2000:01\"]
";

/// Says where the file differs; writes it if asked to.
fn compare(case: &Case) -> Option<String> {
    let (old, text) = (&case.text, case.expected());
    if *old == text {
        return None;
    }
    if env::var_os(BLESS).is_some() {
        fs::write(&case.path, text).unwrap_or_else(|error| panic!("{}: {error}", case.path.display()));
        return None;
    }
    let same = old.lines().zip(text.lines()).take_while(|(old, new)| old == new).count();
    let line = |text: &str| text.lines().nth(same).unwrap_or("(end of the file)").to_owned();
    Some(format!("{}:{}\n  expected: {}\n  got:      {}", case.path.display(), same + 1, line(old), line(&text)))
}

#[test]
fn a_case_shows_what_the_base_has_not() {
    let (base, arrays) = (case("base"), case("arrays"));
    assert!(base.text.contains("pub const DEVICE_TYPE") && base.text.contains("pub const IDENTITY_OBJECT"));
    assert!(!arrays.text.contains("pub const DEVICE_TYPE") && arrays.text.contains("pub const DIGITAL_OUTPUTS"));
    assert!(arrays.code().contains("pub const DEVICE_TYPE"));
}
