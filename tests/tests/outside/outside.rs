//! Crates outside of the workspace, with the same knowledge of it as a user's crate.
#![allow(dead_code, reason = "every test file uses its own part")]

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

/// Cargo in a folder below `tests/`, with the versions of dependencies from the workspace.
pub(crate) fn cargo(folder: &str) -> Command {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = root.join(folder);
    // Cargo removes unused entries.
    let lock = fs::read(root.join("../Cargo.lock")).expect("the workspace has a lock file");
    fs::write(folder.join("Cargo.lock"), lock).expect("the folder can be written to");
    let mut command = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command
        .current_dir(folder)
        .env("CARGO_TARGET_DIR", target_folder())
        // From Cargo 1.91 on, this reuses what the workspace has compiled of the same dependencies, provided that
        // neither side has debug information for them.
        .env("CARGO_BUILD_BUILD_DIR", workspace_folder())
        .env("CARGO_PROFILE_DEV_DEBUG", "false")
        .env("RUSTDOCFLAGS", "-D warnings")
        // The flags of the outer build would cause a complete rebuild.
        .env_remove("RUSTFLAGS");
    command
}

/// Runs cargo, which must succeed.
#[track_caller]
pub(crate) fn succeeds(folder: &str, task: &[&str]) {
    let output = cargo(folder).args(task).output().expect("cargo can be started");
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said);
    assert!(output.status.success(), "in {folder}: cargo {}\n{said}", task.join(" "));
}

/// The target folder of all of them.
pub(crate) fn target_folder() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("outside")
}

/// The build folder of the workspace.
fn workspace_folder() -> &'static Path {
    Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("it is a folder in the target folder")
}

/// The blocks of code in a page, each with its language.
pub(crate) fn blocks(page: &'static str) -> impl Iterator<Item = (&'static str, &'static str)> {
    page.split("\n```").skip(1).step_by(2).filter_map(|block| block.split_once('\n'))
}

/// The content of a block of code that is a file: its first line is a comment with a path in this folder.
pub(crate) fn file(text: &'static str, folder: &str) -> Option<&'static str> {
    let first = text.lines().next()?;
    first.strip_prefix("// ").or(first.strip_prefix("# "))?.strip_prefix(folder)?.strip_prefix('/')
}

/// The files in a page for a folder.
pub(crate) fn files_of(page: &'static str, folder: &str) -> Vec<(&'static str, &'static str)> {
    blocks(page).filter_map(|(_, text)| Some((file(text, folder)?, text))).collect()
}

/// Checks that each block of a page is one of these files or a documentation test.
#[track_caller]
pub(crate) fn has_no_other_blocks(page: &str, files: &[(&str, &str)]) {
    let followed = files.iter().filter(|(path, _)| path.ends_with(".rs")).count();
    assert_eq!(page.matches("rust,ignore").count(), followed, "every other block is a test of documentation");
}

/// Writes a file of a page. Its paths to lexican are changed to this checkout, which may have any name and place.
pub(crate) fn write(folder: &Path, path: &str, text: &str) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the tests lie in the workspace");
    let path = folder.join(path);
    fs::create_dir_all(path.parent().expect("it is in a folder")).expect("a folder can be made");
    fs::write(path, text.replace("../lexican", &root.to_string_lossy())).expect("a file can be written");
}

/// The output of a program that cargo runs.
#[track_caller]
pub(crate) fn output(folder: &str, task: &[&str]) -> String {
    let output = cargo(folder).args(task).output().expect("cargo can be started");
    assert!(output.status.success(), "in {folder}: cargo {task:?}\n{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("it prints UTF-8")
}
