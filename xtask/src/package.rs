//! What is published: every package is complete in itself, and builds from packages alone.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::workspace::{self, Package};
use crate::{command, outside};

/// The packages of the workspace that are published.
pub(crate) fn published(root: &Path) -> Result<Vec<Package>, String> {
    let mut packages = workspace::packages(root, "Cargo.toml")?;
    packages.retain(|package| package.says["publish"].is_null());
    Ok(packages)
}

/// Packs all packages, and compiles each with all features against the packed others, without network.
pub(crate) fn run(root: &Path) -> Result<(), String> {
    let packages = published(root)?;
    let mut found = Vec::new();
    for package in &packages {
        found.extend(findings(package, &files(package)?));
    }
    if !found.is_empty() {
        return Err(found.join("\n"));
    }
    let folder = outside::empty_folder(root, "packages")?;
    let text = folder.to_string_lossy();
    let mut pack = vec!["package", "--quiet", "--no-verify", "--offline", "--allow-dirty", "--target-dir", &text];
    pack.extend(packages.iter().flat_map(|package| ["--package", &package.name]));
    command::run_cargo(root, &pack, &[])?;
    // A workspace of what was unpacked, in which each finds the others. Cargo's own verification takes the others from
    // a registry that it keeps between runs, and so from the run before.
    let (mut members, mut patches) = (String::new(), String::new());
    for Package { name, .. } in &packages {
        let unpacked = format!("{name}-{}", env!("CARGO_PKG_VERSION"));
        let archive = folder.join(format!("package/{unpacked}.crate"));
        // Touched: packed files all have the same old time, by which cargo would take those of the run before for these.
        command::output(Command::new("tar").arg("-xzmf").arg(archive).arg("-C").arg(&folder))?;
        members += &format!("    {unpacked:?},\n");
        patches += &format!("{name} = {{ path = {unpacked:?} }}\n");
    }
    let manifest = format!("[workspace]\nresolver = \"3\"\nmembers = [\n{members}]\n\n[patch.crates-io]\n{patches}");
    outside::write(&folder.join("Cargo.toml"), &manifest)?;
    let lock = std::fs::read_to_string(root.join("Cargo.lock")).map_err(|error| format!("Cargo.lock: {error}"))?;
    outside::write(&folder.join("Cargo.lock"), &lock)?;
    // What the workspace has compiled of the same dependencies is used again: neither has debug information of them.
    let target = workspace::target_folder(root).to_string_lossy().into_owned();
    let check = ["check", "--workspace", "--all-features", "--offline", "--target-dir", &target];
    command::run_cargo(&folder, &check, &[("CARGO_PROFILE_DEV_DEBUG", "false")])
}

/// The names of a package's features; the default ones are none.
pub(crate) fn features(package: &Package) -> impl Iterator<Item = &str> {
    let names = package.says["features"].as_object().into_iter().flat_map(|features| features.keys());
    names.map(String::as_str).filter(|name| *name != "default")
}

/// The files of a package.
fn files(package: &Package) -> Result<String, String> {
    let mut command = command::cargo();
    command.args(["package", "--list", "--offline", "--allow-dirty", "--manifest-path"]).arg(&package.manifest_path);
    Ok(String::from_utf8_lossy(&command::output(&mut command)?.stdout).into_owned())
}

fn findings(package: &Package, files: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut find = |what: String| found.push(format!("{}: {what}", package.name));
    for file in ["LICENSE-APACHE", "LICENSE-MIT", "README.md"] {
        if !files.lines().any(|line| line == file) {
            find(format!("{file} is not in the package"));
        }
    }
    for key in ["description", "license", "repository", "keywords", "categories"] {
        if package.says[key].is_null() || package.says[key].as_array().is_some_and(Vec::is_empty) {
            find(format!("the manifest has no {key}"));
        }
    }
    if package.says["readme"] != "README.md" {
        find("the README must be the package's own".to_owned());
    }
    let docs = package.says["metadata"].pointer("/docs/rs/all-features").and_then(Value::as_bool);
    if features(package).next().is_some() && docs != Some(true) {
        find("docs.rs must show all features: [package.metadata.docs.rs]".to_owned());
    }
    found
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    const FILES: &str = "LICENSE-APACHE\nLICENSE-MIT\nREADME.md\nsrc/lib.rs\n";

    #[track_caller]
    fn count(without: &str, readme: &str, files: &str) -> usize {
        let mut whole = json!({
            "name": "x", "manifest_path": "", "features": { "default": [], "std": [] }, "description": "", "license": "",
            "repository": "", "keywords": ["x"], "categories": ["x"], "readme": readme,
            "metadata": { "docs": { "rs": { "all-features": true } } },
        });
        whole.as_object_mut().unwrap().remove(without);
        findings(&serde_json::from_value(whole).unwrap(), files).len()
    }

    #[test]
    fn a_package_is_complete_in_itself() {
        assert_eq!(count("", "README.md", FILES), 0);
        for key in ["description", "license", "repository", "keywords", "categories", "readme", "metadata"] {
            assert_eq!(count(key, "README.md", FILES), 1, "without {key}");
        }
        assert_eq!(count("", "../README.md", FILES), 1);
        for file in ["LICENSE-APACHE", "LICENSE-MIT", "README.md"] {
            assert_eq!(count("", "README.md", &FILES.replace(file, "other")), 1, "without {file}");
        }
    }

    #[test]
    fn what_is_published_has_features_but_for_the_default_ones() {
        let packages = published(&workspace::root()).unwrap();
        let runtime = packages.iter().find(|package| package.name == "lexican-runtime").unwrap();
        let all: Vec<_> = features(runtime).collect();
        assert!(all.contains(&"std") && !all.contains(&"default"));
        assert!(!packages.iter().any(|package| package.name == "xtask"));
    }
}
