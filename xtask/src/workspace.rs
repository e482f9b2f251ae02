//! Where things lie in the workspace.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde::Deserialize;
use serde_json::Value;

use crate::command;

/// The workspace's root: the folder above this crate's.
pub(crate) fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().expect("xtask lies in the workspace").to_path_buf()
}

/// Where cargo puts what it makes.
pub(crate) fn target_folder(root: &Path) -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), |folder| root.join(folder))
}

/// A program of the workspace, where a debug build puts it.
pub(crate) fn program(root: &Path, name: &str) -> PathBuf {
    target_folder(root).join("debug").join(format!("{name}{}", std::env::consts::EXE_SUFFIX))
}

/// A package, as `cargo metadata` has it.
#[derive(Clone, Deserialize)]
pub(crate) struct Package {
    pub(crate) name: String,
    pub(crate) manifest_path: PathBuf,
    /// All else that it says.
    #[serde(flatten)]
    pub(crate) says: Value,
}

/// What `cargo metadata` says of a manifest's workspace.
pub(crate) fn metadata(root: &Path, manifest: &str, options: &[&str]) -> Result<Value, String> {
    let mut cargo = command::cargo();
    cargo.args(["metadata", "--format-version", "1", "--manifest-path", manifest]).args(options).current_dir(root);
    serde_json::from_slice(&command::output(&mut cargo)?.stdout)
        .map_err(|error| format!("cargo metadata of {manifest}: {error}"))
}

/// The packages of a manifest's workspace.
pub(crate) fn packages(root: &Path, manifest: &str) -> Result<Vec<Package>, String> {
    let mut metadata = metadata(root, manifest, &["--no-deps"])?;
    serde_json::from_value(metadata["packages"].take())
        .map_err(|error| format!("cargo metadata of {manifest}: {error}"))
}

/// The elements of an array in JSON; of anything else none.
pub(crate) fn all(list: &Value) -> impl Iterator<Item = &Value> {
    list.as_array().into_iter().flatten()
}

/// Whether the toolchain compiles for a target; without rustup it is not known to.
pub(crate) fn has_target(target: &str) -> bool {
    let installed = Command::new("rustup").args(["target", "list", "--installed"]).output();
    installed.is_ok_and(|it| String::from_utf8_lossy(&it.stdout).lines().any(|line| line == target))
}

/// The entries of a folder, by name.
pub(crate) fn entries(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let read = fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut paths: Vec<PathBuf> = read.filter_map(Result::ok).map(|entry| entry.path()).collect();
    paths.sort();
    Ok(paths)
}
