//! Every rule has a case that shows its findings (see `cases.rs`). `LEXICAN_BLESS=1 cargo test -p lexican-eds` rewrites
//! the findings of the cases.

use std::path::Path;
use std::{env, fs};

use crate::cases::{Case, cases};
use lexican_eds::{Diagnostics, load, rules};

/// Rules that a file of a few lines cannot break; each has a test elsewhere.
const WITHOUT_CASE: [&str; 4] = ["eds::file-size", "eds::more-findings", "eds::tokenizer", "eds::too-many-entries"];

#[test]
fn findings_are_what_they_were() {
    let bless = env::var_os("LEXICAN_BLESS").is_some();
    let mut different = Vec::new();
    for case in cases() {
        let found = findings(&case).render(&case.input);
        if bless {
            let text = format!("{}findings:\n{found}", case.given);
            fs::write(&case.path, text).expect("the case is writable");
        } else if case.found != found {
            different.push(format!("{}:\n{found}", case.path.display()));
        }
    }
    let hint = "run `LEXICAN_BLESS=1 cargo test -p lexican-eds` when this is what you want";
    assert!(different.is_empty(), "{}\n{hint}", different.join("\n"));
}

#[test]
fn every_finding_in_a_data_sheet_says_where_it_is_and_how_to_mend_it() {
    for case in cases() {
        let of_sheet = |code: &str| !code.starts_with("overlay::") && code != "eds::xml";
        for finding in findings(&case).iter().filter(|finding| of_sheet(finding.code)) {
            assert!(finding.span().is_some(), "{} has no place", finding.code);
            assert!(finding.help.is_some(), "{} has no help", finding.code);
        }
    }
}

#[test]
fn every_rule_has_a_case_that_it_finds_something_in() {
    let cases = cases();
    for rule in rules::rules().iter().filter(|rule| !WITHOUT_CASE.contains(&rule.code)) {
        let case = cases.iter().find(|case| case.code == rule.code);
        let case = case.unwrap_or_else(|| panic!("{} has no case", rule.code));
        assert!(findings(case).iter().any(|finding| finding.code == rule.code), "{} finds nothing", rule.code);
    }
}

#[test]
fn every_case_belongs_to_a_rule_and_shows_little_else() {
    for case in cases() {
        assert!(rules::rule(&case.code).is_some(), "there is no rule {}", case.code);
        let others = findings(&case).iter().filter(|finding| finding.code != case.code).count();
        assert!(others <= 1, "{} shows {others} other findings", case.code);
    }
}

#[test]
fn a_rule_says_whether_it_fixes_something() {
    let cases = cases();
    for rule in rules::rules() {
        let fixes = |case: &Case| findings(case).iter().any(|it| it.code == rule.code && it.fix.is_some());
        assert_eq!(cases.iter().any(fixes), rule.fixes.is_some(), "{}", rule.code);
    }
}

#[test]
fn the_list_of_rules_is_up_to_date() {
    let mut list = String::from(
        "# What lexican finds in data sheets and overlays\n\n\
         Made from the rules by `LEXICAN_BLESS=1 cargo test -p lexican-eds`; each has an example under `tests/golden/`.\n\
         `lexican eds lint --fix` mends what has one right answer; the rules say below what that is.\n",
    );
    for rule in rules::rules() {
        let (code, severity) = (rule.code, rule.severity.name());
        list += &format!("\n## `{code}` ({severity})\n\n**{}** {}\n", rule.holds, rule.why);
        list += &rule.fixes.map(|fixes| format!("\n`--fix`: {fixes}\n")).unwrap_or_default();
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
    for rule in rules::rules() {
        let (family, words) = rule.code.split_once("::").expect("codes have two parts");
        assert!(["eds", "xdd", "overlay", "pdo", "cia301", "cia402"].contains(&family), "{}", rule.code);
        assert!(words.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-'), "{}", rule.code);
        assert!(rule.holds.ends_with('.') && rule.why.ends_with('.'), "{}", rule.code);
        assert!(rule.why.len() > 60, "{} needs a paragraph", rule.code);
        let twins = rules::rules().iter().filter(|other| other.code == rule.code);
        assert_eq!(twins.count(), 1, "{} is there twice", rule.code);
    }
}

fn findings(case: &Case) -> Diagnostics {
    load(&case.input).1
}
