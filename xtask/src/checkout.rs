//! What git says of the checkout: a job of CI leaves it as it is.

use std::path::Path;
use std::process::Command;

use crate::command;

/// The folder of the records of what has passed (`proved.rs`). No job depends on them.
pub(crate) const RECORDS: &str = ".ci/proved";

/// What differs from the last commit, a line for each file, as `git status --porcelain` has it; nothing when the
/// checkout is clean. Records of what has passed are no changes.
pub(crate) fn changes(root: &Path) -> Result<String, String> {
    let records = format!(":(exclude){RECORDS}");
    let output = Command::new("git").args(["status", "--porcelain", "--", ".", &records]).current_dir(root).output();
    let output = output.map_err(|error| format!("git: {error}"))?;
    if output.status.success() {
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    } else {
        Err(format!("git status: {}", String::from_utf8_lossy(&output.stderr).trim()))
    }
}

/// The files that git tracks, and new ones that it does not ignore, relative to the root.
pub(crate) fn files(root: &Path) -> Result<Vec<String>, String> {
    let mut list = Command::new("git");
    list.args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"]).current_dir(root);
    let files = String::from_utf8_lossy(&command::output(&mut list)?.stdout).into_owned();
    // Git still lists files whose deletion is not committed.
    Ok(files.split_terminator('\0').filter(|file| root.join(file).is_file()).map(str::to_owned).collect())
}

/// Copies them to another folder.
pub(crate) fn copy(root: &Path, folder: &Path) -> Result<(), String> {
    for file in files(root)? {
        let to = folder.join(&file);
        std::fs::create_dir_all(to.parent().unwrap_or(folder))
            .and_then(|()| std::fs::copy(root.join(file), &to))
            .map_err(|error| format!("{}: {error}", to.display()))?;
    }
    Ok(())
}
