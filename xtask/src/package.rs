//! What is published: every package is complete in itself, and builds from packages alone.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::{command, outside, workspace};

/// A package that is published.
pub(crate) struct Package {
    pub(crate) name: String,
    pub(crate) folder: PathBuf,
    manifest: toml::Table,
}

/// Those of the workspace.
pub(crate) fn published(root: &Path) -> Result<Vec<Package>, String> {
    let mut packages = Vec::new();
    for path in workspace::manifests(root)? {
        let manifest = workspace::read_toml(&path)?;
        let package = manifest.get("package").and_then(toml::Value::as_table).ok_or("a manifest has no package")?;
        if package.get("publish").and_then(toml::Value::as_bool) == Some(false) {
            continue;
        }
        let name = package.get("name").and_then(toml::Value::as_str).ok_or("a package has no name")?.to_owned();
        packages.push(Package { name, folder: path.parent().unwrap_or(root).to_path_buf(), manifest });
    }
    Ok(packages)
}

/// Packs all packages, and compiles each with all features from what was packed and from what cargo has loaded
/// already.
pub(crate) fn run(root: &Path) -> Result<(), String> {
    let packages = published(root)?;
    let mut found = Vec::new();
    for package in &packages {
        found.extend(package.findings(&package.files()?));
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

impl Package {
    /// The names of its features; the default ones are none.
    pub(crate) fn features(&self) -> Vec<&str> {
        let features = self.manifest.get("features").and_then(toml::Value::as_table);
        let names = features.into_iter().flat_map(toml::Table::keys).map(String::as_str);
        names.filter(|name| *name != "default").collect()
    }

    /// What is packed.
    fn files(&self) -> Result<String, String> {
        let mut command = command::cargo();
        command.args(["package", "--list", "--offline", "--allow-dirty"]).current_dir(&self.folder);
        Ok(String::from_utf8_lossy(&command::output(&mut command)?.stdout).into_owned())
    }

    fn findings(&self, files: &str) -> Vec<String> {
        let mut found = Vec::new();
        let mut find = |what: String| found.push(format!("{}: {what}", self.name));
        for file in ["LICENSE-APACHE", "LICENSE-MIT", "README.md"] {
            if !files.lines().any(|line| line == file) {
                find(format!("{file} is not in the package"));
            }
        }
        let package = &self.manifest["package"];
        for key in ["description", "license", "repository", "keywords", "categories"] {
            if package.get(key).is_none() {
                find(format!("the manifest has no {key}"));
            }
        }
        if package.get("readme").and_then(toml::Value::as_str) != Some("README.md") {
            find("the README must be the package's own".to_owned());
        }
        let docs = package.get("metadata").and_then(|metadata| metadata.get("docs")?.get("rs")?.get("all-features"));
        if !self.features().is_empty() && docs.and_then(toml::Value::as_bool) != Some(true) {
            find("docs.rs must show all features: [package.metadata.docs.rs]".to_owned());
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHOLE: &str = "[package]\nname = \"x\"\ndescription = \"\"\nlicense = \"\"\nrepository = \"\"\nkeywords = []\n\
                         categories = []\nreadme = \"README.md\"\nmetadata.docs.rs.all-features = true\n\
                         [features]\ndefault = []\nstd = []\n";
    const FILES: &str = "LICENSE-APACHE\nLICENSE-MIT\nREADME.md\nsrc/lib.rs\n";

    #[track_caller]
    fn findings(manifest: &str, files: &str) -> usize {
        let manifest = manifest.parse().unwrap();
        Package { name: "x".to_owned(), folder: PathBuf::new(), manifest }.findings(files).len()
    }

    #[test]
    fn a_package_is_complete_in_itself() {
        assert_eq!(findings(WHOLE, FILES), 0);
        for line in ["description", "license", "repository", "keywords", "categories", "readme", "metadata"] {
            let manifest: Vec<&str> = WHOLE.lines().filter(|other| !other.starts_with(line)).collect();
            assert_eq!(findings(&manifest.join("\n"), FILES), 1, "without {line}");
        }
        assert_eq!(findings(&WHOLE.replace("\"README.md\"", "\"../README.md\""), FILES), 1);
        for file in ["LICENSE-APACHE", "LICENSE-MIT", "README.md"] {
            assert_eq!(findings(WHOLE, &FILES.replace(file, "other")), 1, "without {file}");
        }
    }

    #[test]
    fn what_is_published_has_features_but_for_the_default_ones() {
        let packages = published(&workspace::root()).unwrap();
        let runtime = packages.iter().find(|package| package.name == "lexican-runtime").unwrap();
        let features = runtime.features();
        assert!(features.contains(&"std") && !features.contains(&"default"));
        assert!(!packages.iter().any(|package| package.name == "xtask"));
    }
}
