//! Drives against every table of their manuals, and their VERIFICATION.md.

use std::path::Path;

use crate::{command, workspace};

/// Writes the report of a drive, or of all, anew; with `check` only looks whether it is right.
pub(crate) fn run(root: &Path, drive: Option<&str>, check: bool) -> Result<(), String> {
    // With the features that the workspace's tests have been built with, and not with fewer: it is there already.
    command::run_cargo(root, &["build", "--quiet", "--workspace", "--bin", "lexican-verify"], &[])?;
    let program = workspace::program(root, "lexican-verify");
    let program = program.to_string_lossy();
    let mut line = vec![program.as_ref()];
    line.extend(drive);
    line.extend(check.then_some("--check"));
    command::run(&line)
}
