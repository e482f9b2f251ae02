//! The AG03/1 against every table of its manual, and `drives/siko-ag03-1/VERIFICATION.md`.

use std::path::Path;

use crate::{command, workspace};

/// Writes the report anew; with `check` only looks whether it is right.
pub(crate) fn run(root: &Path, check: bool) -> Result<(), String> {
    // With the features that the workspace's tests have been built with, and not with fewer: it is there already.
    command::run_cargo(root, &["build", "--quiet", "--workspace", "--bin", "lexican-verify"], &[])?;
    let program =
        workspace::target_folder(root).join("debug").join(format!("lexican-verify{}", std::env::consts::EXE_SUFFIX));
    let program = program.to_string_lossy();
    let line: &[&str] = if check { &[&program, "--check"] } else { &[&program] };
    command::run(line)
}
