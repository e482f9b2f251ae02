//! What git says of the checkout: a job of CI leaves it as it is.

use std::path::Path;
use std::process::Command;

/// What differs from the last commit, a line for each file, as `git status --porcelain` has it; nothing when the
/// checkout is clean.
///
/// # Errors
///
/// There is no git, or this is no checkout.
pub(crate) fn changes(root: &Path) -> Result<String, String> {
    let output = Command::new("git").args(["status", "--porcelain"]).current_dir(root).output();
    let output = output.map_err(|error| format!("git: {error}"))?;
    if output.status.success() {
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    } else {
        Err(format!("git status: {}", String::from_utf8_lossy(&output.stderr).trim()))
    }
}
