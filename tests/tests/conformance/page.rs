//! The pages that list the faults by which each case is made to fail. `LEXICAN_BLESS=1` writes them.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use lexican_conform::Case;

/// Compares a page of `tests/conformance` with rows of cases and the faults that each notices. Another test checks that
/// it does.
/// test has seen.
#[track_caller]
pub fn is_current<'a>(file: &str, head: &str, rows: impl Iterator<Item = (&'a Case, Vec<&'a str>)>) {
    let mut page = format!("# {head}\n\n| case | what has to hold | faults that make it fail |\n| --- | --- | --- |\n");
    for (case, faults) in rows {
        let _ = writeln!(page, "| {} | {} | {} |", case.id, case.title, faults.join("; "));
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("conformance").join(file);
    if std::env::var_os("LEXICAN_BLESS").is_some() {
        fs::write(&path, page).expect("the page can be written");
    } else {
        let written = fs::read_to_string(&path).unwrap_or_default();
        assert!(written == page, "tests/conformance/{file} is stale: run this test with LEXICAN_BLESS=1");
    }
}
