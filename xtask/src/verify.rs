//! The AG03/1 against every table of its manual, and `drives/siko-ag03-1/VERIFICATION.md`.

use std::path::Path;

use crate::ci;

/// Writes the report anew; with `check` only looks whether it is right.
pub(crate) fn run(root: &Path, check: bool) -> Result<(), String> {
    let arguments = ["run", "-q", "-p", "lexican-verify"];
    let rest: &[&str] = if check { &["--", "--check"] } else { &[] };
    ci::cargo(root, &[&arguments[..], rest].concat(), &[])
}
