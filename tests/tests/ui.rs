//! What a data sheet forbids does not compile, and the compiler says why in the words of the data sheet.
//!
//! Each `ui/examples/*.rs` names what must be said (`// error: ...`); the words around it are the
//! compiler's and change with it, so that they are not compared.

mod outside;

use std::fs;
use std::path::Path;

#[test]
fn what_the_data_sheet_forbids_does_not_compile() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("ui/examples");
    let mut cases: Vec<_> = fs::read_dir(folder)
        .expect("tests/ui/examples can be read")
        .map(|entry| entry.expect("tests/ui/examples can be read").path())
        .collect();
    cases.sort();
    assert!(cases.len() > 5, "the cases are found");
    let wrong: Vec<String> = cases.iter().filter_map(|case| check(case)).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

/// Says what is wrong about a case.
fn check(case: &Path) -> Option<String> {
    let name = case.file_stem().unwrap_or_default().to_string_lossy();
    let source = fs::read_to_string(case).expect("a case can be read");
    let words: Vec<&str> = source.lines().filter_map(|line| line.strip_prefix("// error: ")).collect();
    let output = outside::cargo("ui").args(["check", "--quiet", "--example", &name]).output();
    let output = output.expect("cargo can be started");
    let said = String::from_utf8_lossy(&output.stderr);
    if output.status.success() != words.is_empty() {
        return Some(format!("{name}: compiles: {}, must: {}\n{said}", output.status.success(), words.is_empty()));
    }
    let missing: Vec<&str> = words.into_iter().filter(|words| !said.contains(words)).collect();
    (!missing.is_empty()).then(|| format!("{name}: the compiler does not say {missing:?}, but\n{said}"))
}
