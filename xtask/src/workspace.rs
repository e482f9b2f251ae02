//! Where things lie in the workspace.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The workspace's root: the folder above this crate's.
pub(crate) fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().expect("xtask lies in the workspace").to_path_buf()
}

/// Where cargo puts what it makes.
pub(crate) fn target_folder(root: &Path) -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), |folder| root.join(folder))
}

/// The manifests of all members of the workspace.
pub(crate) fn manifests(root: &Path) -> Result<Vec<PathBuf>, String> {
    let workspace = read_toml(&root.join("Cargo.toml"))?;
    let list = |name| {
        let list = workspace.get("workspace").and_then(|workspace| workspace.get(name)?.as_array());
        list.map(|list| list.iter().filter_map(toml::Value::as_str))
    };
    let mut manifests = Vec::new();
    for member in list("members").ok_or("Cargo.toml: the workspace has no members")? {
        match member.strip_suffix("/*") {
            Some(folder) => manifests.extend(entries(&root.join(folder))?.iter().map(|path| path.join("Cargo.toml"))),
            None => manifests.push(root.join(member).join("Cargo.toml")),
        }
    }
    let excluded: Vec<PathBuf> = list("exclude").into_iter().flatten().map(|folder| root.join(folder)).collect();
    manifests.retain(|manifest| manifest.exists() && !excluded.iter().any(|folder| manifest.starts_with(folder)));
    Ok(manifests)
}

/// Whether the toolchain compiles for a target; without rustup it is not known to.
pub(crate) fn has_target(target: &str) -> bool {
    let installed = Command::new("rustup").args(["target", "list", "--installed"]).output();
    installed.is_ok_and(|it| String::from_utf8_lossy(&it.stdout).lines().any(|line| line == target))
}

pub(crate) fn read_toml(path: &Path) -> Result<toml::Table, String> {
    let text = fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
    text.parse().map_err(|error| format!("{}: {error}", path.display()))
}

/// The entries of a folder, by name.
pub(crate) fn entries(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let read = fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut paths: Vec<PathBuf> = read.filter_map(Result::ok).map(|entry| entry.path()).collect();
    paths.sort();
    Ok(paths)
}
