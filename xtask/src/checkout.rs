//! What git says of the checkout: a job of CI leaves it as it is.

use std::path::Path;
use std::process::Command;

use crate::{command, proved};

/// What differs from the last commit, a line for each file, as `git status --porcelain` has it; nothing when the
/// checkout is clean. Records of what has passed are no changes.
pub(crate) fn changes(root: &Path) -> Result<String, String> {
    let records = format!(":(exclude){}", proved::FOLDER);
    let output = Command::new("git").args(["status", "--porcelain", "--", ".", &records]).current_dir(root).output();
    let output = output.map_err(|error| format!("git: {error}"))?;
    if output.status.success() {
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    } else {
        Err(format!("git status: {}", String::from_utf8_lossy(&output.stderr).trim()))
    }
}

/// Copies the files that git knows, or would know, to another folder.
pub(crate) fn copy(root: &Path, folder: &Path) -> Result<(), String> {
    let mut list = Command::new("git");
    list.args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"]).current_dir(root);
    let files = command::output(&mut list)?.stdout;
    for file in String::from_utf8_lossy(&files).split_terminator('\0') {
        let (from, to) = (root.join(file), folder.join(file));
        // What is deleted is in the list until that is committed.
        if from.is_file() {
            let parent = to.parent().unwrap_or(folder);
            std::fs::create_dir_all(parent)
                .and_then(|()| std::fs::copy(&from, &to))
                .map_err(|error| format!("{}: {error}", to.display()))?;
        }
    }
    Ok(())
}
