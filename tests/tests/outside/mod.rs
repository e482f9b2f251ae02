//! Crates outside of the workspace, which know of it what a user's crate knows.
#![allow(dead_code, reason = "every test file uses its own part")]

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

/// Cargo in a folder below `tests/`, with the versions of dependencies that the workspace has.
pub(crate) fn cargo(folder: &str) -> Command {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = root.join(folder);
    // Cargo drops what is not needed.
    let lock = fs::read(root.join("../Cargo.lock")).expect("the workspace has a lock file");
    fs::write(folder.join("Cargo.lock"), lock).expect("the folder can be written to");
    let mut command = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command
        .current_dir(folder)
        .env("CARGO_TARGET_DIR", target_folder())
        // What the workspace has compiled of the same dependencies is used again (from Cargo 1.91 on), which it is
        // when neither side has debug information of them.
        .env("CARGO_BUILD_BUILD_DIR", workspace_folder())
        .env("CARGO_PROFILE_DEV_DEBUG", "false")
        .env("RUSTDOCFLAGS", "-D warnings")
        // Those of the outer build would make this one start from the beginning.
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

/// Where programs, libraries and documentation of all of them go.
pub(crate) fn target_folder() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("outside")
}

/// Where the workspace is built.
fn workspace_folder() -> &'static Path {
    Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("it is a folder in the target folder")
}
