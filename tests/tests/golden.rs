//! Golden cases: what is generated from `golden/<case>/input.eds` (and `overlay.toml`) is `expected.rs`, and
//! what is found is `diagnostics.txt`. All expected files are compiled and linted by `golden/edition-*`.
//!
//! `cargo xtask bless` writes the expected files anew.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs};

use lexican_codegen::{Options, compile};
use lexican_eds::{Input, Source};

const BLESS: &str = "LEXICAN_BLESS";
const EDITIONS: [&str; 2] = ["2021", "2024"];

#[test]
fn what_is_generated_is_what_was_reviewed() {
    let mut differing = Vec::new();
    for case in cases() {
        let (code, findings) = generate(&case);
        differing.extend(compare(&case.join("expected.rs"), &code));
        differing.extend(compare(&case.join("diagnostics.txt"), &findings));
    }
    assert!(differing.is_empty(), "{}\nreview and accept: cargo xtask bless", differing.join("\n"));
}

#[test]
fn every_case_is_compiled_in_every_edition() {
    let mut modules = String::new();
    for case in cases() {
        let name = name(&case);
        let _ = write!(modules, "\n/// `golden/{name}`.\n#[path = \"../../{name}/expected.rs\"]\npub mod {name};\n");
    }
    for edition in EDITIONS {
        let text = format!("//! All golden cases, in edition {edition}.\n#![no_std]\n{modules}");
        let path = golden().join(format!("edition-{edition}/src/lib.rs"));
        let differing = compare(&path, &text);
        assert_eq!(differing, None, "accept: cargo xtask bless");
    }
}

#[test]
fn every_finding_of_the_generator_has_a_case() {
    let found: String = cases().iter().map(|case| generate(case).1).collect();
    for finding in lexican_codegen::FINDINGS {
        assert!(found.contains(&format!("[{}]", finding.code)), "no case under golden/ shows {}", finding.code);
    }
}

#[test]
fn the_output_does_not_depend_on_where_the_input_lies() {
    for case in cases() {
        let elsewhere = |path: &Path| format!("/somewhere/else/{}", name(path));
        assert_eq!(load(&case, elsewhere), load(&case, |path| path.display().to_string()));
    }
}

/// The code and the findings of a case.
fn generate(case: &Path) -> (String, String) {
    let input = input(case, name);
    let (device, mut findings) = lexican_eds::load(&input);
    let output = compile(&device, &options(&input));
    findings.extend(output.diagnostics);
    findings.finish();
    (output.code, findings.render(&input))
}

fn load(case: &Path, name: impl Fn(&Path) -> String) -> String {
    let input = input(case, name);
    let (device, _) = lexican_eds::load(&input);
    compile(&device, &options(&input)).code
}

fn input(case: &Path, name: impl Fn(&Path) -> String) -> Input {
    let read = |path: &Path| fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let eds = case.join("input.eds");
    let overlay = case.join("overlay.toml");
    let input = Input::new(Source::from_bytes(name(&eds), &read(&eds)));
    if !overlay.exists() {
        return input;
    }
    let overlay = Source::from_bytes(name(&overlay), &read(&overlay));
    input.overlay(overlay)
}

/// What the first line asks for: `; generate: storage, names`.
fn options(input: &Input) -> Options {
    let wanted = input.eds.text().lines().next().and_then(|line| line.strip_prefix("; generate: ")).unwrap_or_default();
    let has = |option: &str| wanted.split(", ").any(|wanted| wanted == option);
    Options { storage: has("storage"), names: has("names"), ..Options::default() }
}

/// Says where the file differs; writes it when asked to.
fn compare(path: &Path, text: &str) -> Option<String> {
    let old = fs::read_to_string(path).unwrap_or_default();
    if old == text {
        return None;
    }
    if env::var_os(BLESS).is_some() {
        fs::write(path, text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        return None;
    }
    let same = old.lines().zip(text.lines()).take_while(|(old, new)| old == new).count();
    let line = |text: &str| text.lines().nth(same).unwrap_or("(end of the file)").to_owned();
    Some(format!("{}:{}\n  expected: {}\n  got:      {}", path.display(), same + 1, line(&old), line(text)))
}

fn cases() -> Vec<PathBuf> {
    let entries = fs::read_dir(golden()).expect("tests/golden can be read");
    let paths = entries.map(|entry| entry.expect("tests/golden can be read").path());
    let mut cases: Vec<PathBuf> = paths.filter(|path| path.join("input.eds").exists()).collect();
    cases.sort();
    cases
}

fn golden() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("golden")
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
