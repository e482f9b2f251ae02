//! Crates that tasks write below the target folder, outside of the workspace, to see what the compiler makes of
//! generated code.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use crate::{command, workspace};

/// The command as the tests of the workspace use it. Building an optimised one takes minutes, and would print the same.
pub(crate) fn lexican(root: &Path) -> Result<PathBuf, String> {
    command::output(command::cargo().args(["build", "--quiet", "--workspace", "--bin", "lexican"]).current_dir(root))?;
    Ok(workspace::program(root, "lexican"))
}

/// An empty folder of this name below the target folder.
pub(crate) fn empty_folder(root: &Path, name: &str) -> Result<PathBuf, String> {
    let folder = workspace::target_folder(root).join(name);
    if folder.exists() {
        fs::remove_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    }
    Ok(folder)
}

/// A library that depends on the runtime alone.
pub(crate) fn write_crate(root: &Path, folder: &Path, edition: &str, lib: &str) -> Result<(), String> {
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let runtime = root.join("runtime");
    let manifest = format!(
        "[package]\nname = \"{name}\"\nversion = \"0.0.0\"\nedition = \"{edition}\"\n\n[dependencies]\n\
         lexican-runtime = {{ path = {runtime:?} }}\n"
    );
    write(&folder.join("Cargo.toml"), &manifest)?;
    write(&folder.join("src/lib.rs"), lib)
}

pub(crate) fn write(path: &Path, text: &str) -> Result<(), String> {
    let parent = path.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(parent)
        .and_then(|()| fs::write(path, text))
        .map_err(|error| format!("{}: {error}", path.display()))
}

/// Cargo in `folder`, with the versions that the workspace has and a target folder of its own.
pub(crate) fn cargo_in(root: &Path, folder: &Path, arguments: &[&str]) -> Result<Output, String> {
    let lock = folder.join("Cargo.lock");
    if !lock.exists() {
        fs::copy(root.join("Cargo.lock"), &lock).map_err(|error| format!("{}: {error}", lock.display()))?;
    }
    let target = folder.join("target");
    command::output(command::cargo().args(arguments).current_dir(folder).env("CARGO_TARGET_DIR", target))
}
