//! Every rule has a case that shows what it finds: `golden/<code>/input.eds`, an `overlay.toml` where it takes one,
//! and the findings as text in `diagnostics.txt`. `LEXICAN_BLESS=1 cargo test -p lexican-eds` rewrites the texts.

use std::path::{Path, PathBuf};
use std::{env, fs};

use lexican_eds::{Diagnostics, Input, Source, check, load};

/// Rules that no file of a few lines can break; each has a test elsewhere.
const WITHOUT_CASE: [&str; 4] = ["eds::file-size", "eds::more-findings", "eds::tokenizer", "eds::too-many-entries"];

#[test]
fn findings_are_what_they_were() {
    let bless = env::var_os("LEXICAN_BLESS").is_some();
    let mut different = Vec::new();
    for folder in folders() {
        let (input, diagnostics) = findings(&folder);
        let found = diagnostics.render(&input);
        let path = folder.join("diagnostics.txt");
        if bless {
            fs::write(&path, &found).expect("the folder of the case is writable");
        } else if fs::read_to_string(&path).unwrap_or_default() != found {
            different.push(format!("{}:\n{found}", folder.display()));
        }
    }
    let hint = "run `LEXICAN_BLESS=1 cargo test -p lexican-eds` when this is what you want";
    assert!(different.is_empty(), "{}\n{hint}", different.join("\n"));
}

#[test]
fn every_finding_in_a_data_sheet_says_where_it_is_and_how_to_mend_it() {
    for folder in folders() {
        let (_, diagnostics) = findings(&folder);
        for finding in
            diagnostics.iter().filter(|finding| !finding.code.starts_with("overlay::") && finding.code != "eds::xml")
        {
            assert!(finding.span().is_some(), "{} has no place", finding.code);
            assert!(finding.help.is_some(), "{} has no help", finding.code);
        }
    }
}

#[test]
fn every_rule_has_a_case_that_it_finds_something_in() {
    for rule in check::rules().iter().filter(|rule| !WITHOUT_CASE.contains(&rule.code)) {
        let folder = root().join(rule.code.replace("::", "-"));
        assert!(folder.is_dir(), "{} has no case: {}", rule.code, folder.display());
        let (_, diagnostics) = findings(&folder);
        assert!(diagnostics.iter().any(|finding| finding.code == rule.code), "{} finds nothing", rule.code);
    }
}

#[test]
fn every_case_belongs_to_a_rule_and_shows_little_else() {
    for folder in folders() {
        let name = folder.file_name().unwrap_or_default().to_string_lossy().replacen('-', "::", 1);
        assert!(check::rule(&name).is_some(), "there is no rule {name}");
        let (_, diagnostics) = findings(&folder);
        let others = diagnostics.iter().filter(|finding| finding.code != name).count();
        assert!(others <= 1, "{name} shows {others} other findings");
    }
}

#[test]
fn the_list_of_rules_is_up_to_date() {
    let mut list = String::from(
        "# What lexican finds in data sheets and overlays\n\n\
         Made from the rules by `LEXICAN_BLESS=1 cargo test -p lexican-eds`; each has an example under `tests/golden/`.\n",
    );
    for rule in check::rules() {
        let (code, severity) = (rule.code, rule.severity.name());
        list += &format!("\n## `{code}` ({severity})\n\n**{}** {}\n", rule.holds, rule.explain);
        if !rule.help.is_empty() {
            list += &format!("\nHelp: {}.\n", rule.help);
        }
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("RULES.md");
    if env::var_os("LEXICAN_BLESS").is_some() {
        fs::write(&path, &list).expect("the folder of the crate is writable");
    }
    let found = fs::read_to_string(&path).unwrap_or_default();
    assert!(found == list, "RULES.md is out of date: run `LEXICAN_BLESS=1 cargo test -p lexican-eds`");
}

#[test]
fn rules_explain_themselves() {
    for rule in check::rules() {
        let (family, words) = rule.code.split_once("::").expect("codes have two parts");
        assert!(["eds", "overlay", "pdo", "cia301", "cia402"].contains(&family), "{}", rule.code);
        assert!(words.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-'), "{}", rule.code);
        assert!(rule.holds.ends_with('.') && rule.explain.ends_with('.'), "{}", rule.code);
        assert!(rule.explain.len() > 60, "{} needs a paragraph", rule.code);
        let twins = check::rules().iter().filter(|other| other.code == rule.code);
        assert_eq!(twins.count(), 1, "{} is there twice", rule.code);
    }
}

fn findings(folder: &Path) -> (Input, Diagnostics) {
    let bytes = fs::read(folder.join("input.eds")).expect("every case has an input.eds");
    let mut input = Input::new(Source::from_bytes("input.eds", &bytes));
    if let Ok(overlay) = fs::read_to_string(folder.join("overlay.toml")) {
        input = input.overlay(Source::new("overlay.toml", overlay));
    }
    let (_, diagnostics) = load(&input);
    (input, diagnostics)
}

fn folders() -> Vec<PathBuf> {
    let entries = fs::read_dir(root()).expect("the cases are beside this test");
    let mut folders: Vec<PathBuf> = entries.map(|entry| entry.expect("readable").path()).collect();
    folders.sort();
    folders
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/golden")
}
