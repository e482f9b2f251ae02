//! Habits that no compiler checks. Each is a function that returns what it found wrong.

mod circles;
mod house;
mod pages;

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::workspace::{Package, all, entries, packages};
use crate::{checkout, command};

/// Which of our packages each may depend on, by names without `lexican-`; there are no circles. `DRIVES` stands for the crates
/// of the library's drives. One without a row of its own may use [`OF_A_DRIVE`]; packages in `tests/` may use all.
const ARROWS: &str = "
lexican-cia:
lexican-eds: cia
lexican-codegen: eds
lexican-runtime: cia
lexican-profibus: runtime
lexican-pictures:
lexican-conform: eds runtime
lexican-toolbox: driver eds pictures registry runtime
lexican-lsp: eds machine runtime toolbox
lexican-machine: codegen driver eds pictures runtime toolbox
lexican-registry: driver runtime simulator DRIVES
lexican-simulation: eds machine profibus registry runtime siko-ag03-1 siko-profibus siko-serial simulator toolbox
lexican-bench: driver eds pictures runtime toolbox
lexican-driver: eds runtime
lexican-simulator: runtime
lexican-siko: driver runtime simulator
lexican-siko-ag02: siko driver runtime codegen
lexican-siko-ag03-1: siko driver runtime codegen
lexican-siko-serial: siko siko-ag02 driver runtime
lexican-siko-profibus: driver profibus siko siko-ag02 siko-ag03-1 runtime
lexican: bench eds codegen conform driver lsp machine pictures runtime profibus simulation simulator kollmorgen-akd siko-ag02 \
    siko-ag03-1 siko-profibus siko-serial toolbox
changeover: driver eds machine pictures profibus runtime simulation siko-profibus siko-serial
circle: driver eds machine runtime kollmorgen-akd pictures simulation
doors: pictures profibus runtime siko-ag02 siko-profibus siko-serial
lexican-python: conform driver eds machine runtime simulation toolbox
xtask:
";

/// What the crate of a drive may use.
const OF_A_DRIVE: &str = "driver runtime simulator codegen";

/// Files that may have more than 800 lines, and why.
const LONG: &[(&str, &str)] = &[];

/// Rooms whose files import each other in circles. The list may only get shorter.
const TIED: &[&str] = &["machine/"];

/// How many commits are looked at where there is no origin.
const NEW_COMMITS: usize = 500;

/// What is simulated in SIKO's crates: folders and files.
const SIMULATED: &[&str] = &["sim", "drive", "bus"];

/// The library's data sheets that have a crate in `drives/`, as `<vendor>/<drive>`.
fn drives(root: &Path) -> Result<Vec<String>, String> {
    let library = root.join("eds/devices");
    let vendors: Result<Vec<_>, _> = entries(&library)?.iter().map(|vendor| entries(vendor)).collect();
    let folders = vendors?.concat();
    let ids = folders.iter().filter_map(|folder| folder.strip_prefix(&library).ok()?.to_str());
    let ids = ids.map(|id| id.replace('\\', "/"));
    Ok(ids.filter(|id| root.join("drives").join(id.replace('/', "-")).exists()).collect())
}

/// Looks for what is wrong, prints what has grown, and with `record` writes how large everything is now.
pub(crate) fn run(root: &Path, record: bool) -> Result<(), String> {
    let sources = rust_files(root)?;
    let mut found = subjects(root)?;
    let drives = drives(root)?;
    found.extend(arrows(root, &drives)?);
    for source in &sources {
        found.extend(source.findings(&drives));
    }
    let texts = sources.iter().map(|source| (source.path.as_str(), source.text.as_str())).collect();
    house::run(root, &texts, record)?;
    let untied = texts.into_iter().filter(|(path, _)| !TIED.iter().any(|room| path.starts_with(room)));
    found.extend(circles::findings(&untied.collect())?);
    found.extend(pages::findings(root)?);
    for (path, _) in LONG {
        if !sources.iter().any(|source| source.path == *path && source.text.lines().count() > 800) {
            found.push(format!("xtask/src/tidy.rs: {path} need not stand among the long files any more"));
        }
    }
    if found.is_empty() {
        println!("tidy: {} files, nothing found", sources.len());
        return Ok(());
    }
    Err(format!("{}\ntidy: {} findings", found.join("\n"), found.len()))
}

/// Subjects of commits that are not at the origin yet have up to 72 characters.
fn subjects(root: &Path) -> Result<Vec<String>, String> {
    let mut log = Command::new("git");
    log.args(["log", "--format=%h %s", "HEAD", "--not", "--remotes"]).current_dir(root);
    let log = command::output(&mut log)?.stdout;
    let log = String::from_utf8_lossy(&log);
    // Without an origin, only the latest commits are looked at.
    let commits = log.lines().take(NEW_COMMITS).filter_map(|line| line.split_once(' '));
    let long = commits.filter(|(_, subject)| subject.chars().count() > 72);
    Ok(long.map(|(commit, subject)| format!("commit {commit}: more than 72 characters: {subject}")).collect())
}

/// Dependencies between our packages go only where [`ARROWS`] allows.
fn arrows(root: &Path, drives: &[String]) -> Result<Vec<String>, String> {
    let packages = all_packages(root)?;
    let packages = packages.iter().filter(|package| !package.manifest_path.starts_with(root.join("tests")));
    Ok(packages.flat_map(|package| arrows_of(package, drives)).collect())
}

/// Those of the workspace, and the Python package, which is a workspace of its own.
fn all_packages(root: &Path) -> Result<Vec<Package>, String> {
    Ok([packages(root, "Cargo.toml")?, packages(root, "python/Cargo.toml")?].concat())
}

fn arrows_of(package: &Package, drives: &[String]) -> Vec<String> {
    let name = package.name.as_str();
    let is_drive = |name: &str| drives.iter().any(|drive| drive.replace('/', "-") == name);
    let mut rows = ARROWS.lines().filter_map(|row| row.split_once(':'));
    let row = rows.find(|(package, _)| *package == name).map(|(_, allowed)| allowed);
    let usual = name.strip_prefix("lexican-").filter(|name| is_drive(name)).map(|_| OF_A_DRIVE);
    let Some(allowed) = row.or(usual) else {
        return vec![format!("package {name} has no arrows in xtask/src/tidy.rs")];
    };
    let is_allowed = |used: &str| {
        let used = used.strip_prefix("lexican-").unwrap_or(used);
        allowed.split_whitespace().any(|name| name == used || name == "DRIVES" && is_drive(used))
    };
    // What tests use may point anywhere.
    let used = all(&package.says["dependencies"])
        .filter(|used| used["kind"] != "dev")
        .filter_map(|used| used["name"].as_str());
    let wrong = used.filter(|used| used.starts_with("lexican") && !is_allowed(used));
    wrong.map(|used| format!("{}: {name} must not use {used}", package.manifest_path.display())).collect()
}

struct Source {
    /// Relative to the root, with forward slashes.
    path: String,
    text: String,
}

impl Source {
    fn findings(&self, drives: &[String]) -> Vec<String> {
        // Of its vendor, and its own.
        let words = || drives.iter().flat_map(|id| id.split('/').filter_map(|part| part.split('-').next()));
        let mut found = Vec::new();
        let mut find = |line: usize, what: &str| found.push(format!("{}:{line}: {what}", self.path));
        if !self.text.trim_start().starts_with("//!") {
            find(1, "a file begins with `//!` and what it is for");
        }
        let lines = self.text.lines().count();
        if lines > 800 && !LONG.iter().any(|(path, _)| *path == self.path) {
            find(lines, "more than 800 lines: split it, or say in xtask/src/tidy.rs why not");
        }
        for (line, text) in self.text.lines().enumerate() {
            if self.is_generic() && words().any(|word| house::contains_word(text, word)) {
                find(line + 1, "names a drive: what is special about a device is data of its description");
            }
            if self.must_be_deterministic() && text.contains("HashMap") {
                find(line + 1, "HashMap has no order: the same input must give the same bytes");
            }
            if self.moves_real_drives() && names_simulator(text) {
                find(line + 1, "uses the simulated drive: what both share stands beside it");
            }
            if text.trim_start().starts_with("#[ignore") {
                find(line + 1, "an ignored test: mend it or remove it");
            }
        }
        found
    }

    fn is_generic(&self) -> bool {
        let rooms = ["cia", "eds", "codegen", "runtime", "profibus", "drives/driver", "drives/simulator"];
        rooms.iter().any(|room| self.path.starts_with(&format!("{room}/src/")))
    }

    /// SIKO's drives, without what is simulated: a program that moves a real drive has no use for that.
    fn moves_real_drives(&self) -> bool {
        let is_simulated = |part: &str| SIMULATED.contains(&part.trim_end_matches(".rs"));
        let inside = self.path.strip_prefix("drives/siko").and_then(|rest| rest.split_once("/src/"));
        inside.is_some_and(|(_, file)| !file.split('/').any(is_simulated))
    }

    fn must_be_deterministic(&self) -> bool {
        ["eds/src/", "codegen/src/"].iter().any(|room| self.path.starts_with(room))
    }
}

/// Whether a line of code, and not one of documentation, uses a module of what is simulated.
fn names_simulator(text: &str) -> bool {
    !text.trim_start().starts_with("//") && text.contains("sim::")
}

fn rust_files(root: &Path) -> Result<Vec<Source>, String> {
    // Golden files and downstream crates are what a user gets and writes, not what we write.
    let is_ours = |part: &str| !["golden", "ui", "downstream"].contains(&part);
    let files = checkout::files(root)?.into_iter();
    let ours = files.filter(|path| path.ends_with(".rs") && path.split('/').all(is_ours));
    ours.map(|path| match fs::read_to_string(root.join(&path)) {
        Ok(text) => Ok(Source { path, text }),
        Err(error) => Err(format!("{path}: {error}")),
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn findings(path: &str, text: &str) -> Vec<String> {
        let drives = ["siko/ag02", "siko/ag03-1"].map(str::to_owned);
        Source { path: path.to_owned(), text: text.to_owned() }.findings(&drives)
    }

    #[test]
    fn a_drive_is_named_only_where_it_may_be() {
        let text = "//! Room.\n// as the AG03/1 does\n";
        assert_eq!(findings("runtime/src/device.rs", text).len(), 1);
        assert_eq!(findings("drives/driver/src/context.rs", text).len(), 1);
        assert_eq!(findings("drives/driver/tests/other_drives.rs", text), [""; 0]);
        assert_eq!(findings("drives/siko-ag03-1/src/lib.rs", text), [""; 0]);
        assert_eq!(findings("runtime/src/device.rs", "//! Room.\n// takes no damage\n"), [""; 0]);
    }

    #[test]
    fn what_must_be_deterministic_has_no_hash_map() {
        let text = "//! Room.\nuse std::collections::HashMap;\n";
        assert_eq!(findings("eds/src/model.rs", text).len(), 1);
        assert_eq!(findings("codegen/src/emit.rs", text).len(), 1);
        assert_eq!(findings("cli/src/main.rs", text), [""; 0]);
    }

    #[test]
    fn what_moves_real_drives_does_not_use_the_simulated_one() {
        let text = "//! As [`sim::Model`].\nuse siko::sim::parameters::Mode;\n";
        for (path, count) in [
            ("drives/siko/src/gateway/face.rs", 1),
            ("drives/siko-serial/src/gateway/mod.rs", 1),
            ("drives/siko-profibus/src/master.rs", 1),
            ("drives/siko-ag02/src/driver.rs", 1),
            ("drives/siko-ag02/src/sim.rs", 0),
            ("drives/siko/src/sim/node.rs", 0),
            ("drives/siko-profibus/src/drive.rs", 0),
            ("drives/siko-serial/tests/door.rs", 0),
            ("simulation/src/device.rs", 0),
        ] {
            assert_eq!(findings(path, text).len(), count, "{path}");
        }
    }

    #[test]
    fn a_test_is_not_ignored() {
        let text = concat!("//! Room.\n    #[", "ignore = \"later\"]\nfn test() {}\n");
        assert_eq!(findings("cli/tests/scan.rs", text).len(), 1);
    }

    #[test]
    fn a_file_has_800_lines_at_most() {
        let lines = |count: usize| "//! Room.\n".to_owned() + &"//\n".repeat(count - 1);
        assert_eq!(findings("cli/src/main.rs", &lines(800)), [""; 0]);
        assert_eq!(findings("cli/src/main.rs", &lines(801)).len(), 1);
    }

    fn arrows_to(package: &str, used: &str, kind: &str, drives: &[String]) -> usize {
        let package = json!({
            "name": package, "manifest_path": "",
            "dependencies": [{ "name": "thiserror" }, { "name": used, "kind": kind }],
        });
        arrows_of(&serde_json::from_value(package).unwrap(), drives).len()
    }

    #[test]
    fn dependencies_go_where_they_may() {
        let found = |used, kind| arrows_to("lexican-driver", used, kind, &[]);
        assert_eq!(found("lexican-runtime", "normal"), 0);
        assert_eq!(found("lexican-siko-ag03-1", "dev"), 0);
        assert_eq!(found("lexican-codegen", "normal"), 1);
        assert_eq!(found("lexican-codegen", "build"), 1);
        assert_eq!(arrows_to("lexican-new", "lexican-runtime", "dev", &[]), 1);
    }

    #[test]
    fn every_package_with_arrows_is_there() {
        let packages = all_packages(&crate::workspace::root()).unwrap();
        for (name, _) in ARROWS.lines().filter_map(|row| row.split_once(':')) {
            assert!(packages.iter().any(|package| package.name == name), "{name}");
        }
    }

    #[test]
    fn a_drive_of_the_library_needs_no_arrows() {
        let found = |package: &str, used: &str| arrows_to(package, used, "normal", &["acme/servo".to_owned()]);
        assert_eq!(found("lexican-acme-servo", "lexican-driver"), 0);
        assert_eq!(found("lexican-acme-servo", "lexican-toolbox"), 1);
        assert_eq!(found("lexican-registry", "lexican-acme-servo"), 0);
        assert_eq!(found("lexican-driver", "lexican-acme-servo"), 1);
    }

    #[test]
    fn a_file_says_what_it_is_for() {
        assert_eq!(findings("cli/src/main.rs", "fn main() {}\n").len(), 1);
    }
}
