//! Code that violates the data sheet does not compile, and the compiler's message uses the words of the data sheet.
//!
//! Each `ui/examples/*.rs` contains the expected words (`// error: ...`). The rest of the message is the compiler's and
//! changes with it, so it is not compared.

use crate::cases;
use crate::outside;
use std::fs;
use std::path::Path;

#[test]
fn what_the_data_sheet_forbids_does_not_compile() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("ui/examples");
    let mut examples: Vec<_> = fs::read_dir(folder)
        .expect("tests/ui/examples can be read")
        .map(|entry| entry.expect("tests/ui/examples can be read").path())
        .collect();
    examples.sort();
    assert!(examples.len() > 5, "the examples are found");
    let code = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ui");
    fs::create_dir_all(&code).expect("the folder can be made");
    for name in ["access_and_mapping", "overlay", "data_types", "interfaces"] {
        fs::write(code.join(name).with_extension("rs"), cases::case(name).code()).expect("the code can be written");
    }
    let machine = Path::new(env!("CARGO_MANIFEST_DIR")).join("downstream/machine/machine.toml");
    let typed = lexican_machine::generate(machine, lexican_machine::Config::new().out_dir(&code));
    typed.expect("the machine has no mistake");
    let wrong: Vec<String> = examples.iter().filter_map(|example| check(example, &code)).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

/// What is wrong with an example, which uses the code in a folder.
fn check(example: &Path, code: &Path) -> Option<String> {
    let name = example.file_stem().unwrap_or_default().to_string_lossy();
    let source = fs::read_to_string(example).expect("an example can be read");
    let words: Vec<&str> = source.lines().filter_map(|line| line.strip_prefix("// error: ")).collect();
    let check = ["check", "--quiet", "--example", &name];
    let output = outside::cargo("ui").env("LEXICAN_CODE", code).args(check).output();
    let output = output.expect("cargo can be started");
    let said = String::from_utf8_lossy(&output.stderr);
    if output.status.success() != words.is_empty() {
        return Some(format!("{name}: compiles: {}, must: {}\n{said}", output.status.success(), words.is_empty()));
    }
    let missing: Vec<&str> = words.into_iter().filter(|words| !said.contains(words)).collect();
    (!missing.is_empty()).then(|| format!("{name}: the compiler does not say {missing:?}, but\n{said}"))
}
