//! What has been proved already: the heavy jobs of CI leave a record in the repository, `.ci/proved/<job>`, of
//! everything that their outcome depends on. A job whose record is still right is not run again.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::checkout::{self, RECORDS};
use crate::command;
use crate::workspace::{self, all};

/// What every job depends on, whatever it builds: how jobs are run, the lock file, the profiles and lints.
const COMMON: [&str; 12] = [
    ".cargo",
    ".ci/run",
    "Cargo.lock",
    "Cargo.toml",
    "clippy.toml",
    "xtask/Cargo.toml",
    "xtask/src/checkout.rs",
    "xtask/src/ci.rs",
    "xtask/src/command.rs",
    "xtask/src/outside.rs",
    "xtask/src/proved.rs",
    "xtask/src/workspace.rs",
];

/// What a job depends on.
pub(crate) struct Inputs {
    /// Files and folders of its own in `xtask/src`.
    pub(crate) own: &'static [&'static str],
    /// Manifests of packages or workspaces: each counts with all packages of ours that it depends on.
    pub(crate) manifests: &'static [&'static str],
    /// Files and folders besides.
    pub(crate) paths: &'static [&'static str],
    /// A file that is no part of this repository.
    pub(crate) outside: Option<PathBuf>,
}

impl Inputs {
    /// The files and folders of this repository, from its root.
    pub(crate) fn paths(&self, root: &Path) -> Result<BTreeSet<String>, String> {
        let mut paths: BTreeSet<String> = COMMON.iter().chain(self.paths).map(ToString::to_string).collect();
        paths.extend(self.own.iter().map(|own| format!("xtask/src/{own}")));
        for manifest in self.manifests {
            paths.extend(packages(root, manifest)?);
        }
        Ok(paths)
    }

    /// One hash of the compiler and of all inputs as they lie in the checkout, committed or not.
    pub(crate) fn hash(&self, root: &Path) -> Result<String, String> {
        let git = |arguments: &[&str]| {
            let mut git = Command::new("git");
            git.args(arguments).current_dir(root);
            git
        };
        let paths = self.paths(root)?;
        let is_input = |file: &Path| file.ancestors().any(|path| paths.contains(&*path.to_string_lossy()));
        let files = checkout::files(root)?;
        let names: String =
            files.iter().filter(|file| is_input(file.as_ref())).map(|file| format!("{file}\n")).collect();
        let mut text = fed(&mut git(&["hash-object", "--stdin-paths"]), names.as_bytes())?;
        text.extend(names.into_bytes());
        text.extend(command::output(Command::new("rustc").arg("-vV"))?.stdout);
        if let Some(outside) = &self.outside {
            text.extend(command::output(git(&["hash-object", "--"]).arg(outside))?.stdout);
        }
        let hash = fed(&mut git(&["hash-object", "--stdin"]), &text)?;
        Ok(String::from_utf8_lossy(&hash).trim().to_owned())
    }
}

/// The output of a command that is given an input.
fn fed(command: &mut Command, input: &[u8]) -> Result<Vec<u8>, String> {
    let failed = |error: std::io::Error| format!("git: {error}");
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().map_err(failed)?;
    let stdin = child.stdin.take();
    let output = std::thread::scope(|scope| {
        // In a thread: the command answers line by line, and would block as soon as a full pipe is not read.
        scope.spawn(move || stdin.map(|mut stdin| stdin.write_all(input)));
        child.wait_with_output()
    });
    Ok(output.map_err(failed)?.stdout)
}

/// Whether the record of a job has this hash.
pub(crate) fn is_right(root: &Path, job: &str, hash: &str) -> bool {
    std::fs::read_to_string(record(root, job)).is_ok_and(|text| text.trim() == hash)
}

/// Records that a job has passed.
pub(crate) fn write(root: &Path, job: &str, hash: &str) -> Result<(), String> {
    let path = record(root, job);
    let folder = path.parent().unwrap_or(root);
    std::fs::create_dir_all(folder)
        .and_then(|()| std::fs::write(&path, format!("{hash}\n")))
        .map_err(|error| format!("{}: {error}", path.display()))
}

fn record(root: &Path, job: &str) -> PathBuf {
    root.join(RECORDS).join(job)
}

/// The folders of a manifest's packages and of all packages of this repository that they depend on, for tests, too.
fn packages(root: &Path, manifest: &str) -> Result<BTreeSet<String>, String> {
    let metadata = workspace::metadata(root, manifest, &["--all-features", "--locked"])?;
    let id = |of: &Value| of["id"].as_str().unwrap_or_default().to_owned();
    let depends: BTreeMap<_, _> =
        all(&metadata["resolve"]["nodes"]).map(|node| (id(node), &node["dependencies"])).collect();
    // A manifest of a whole workspace has no package of its own: all its members count.
    let mut open: Vec<&str> = match metadata["resolve"]["root"].as_str() {
        Some(package) => vec![package],
        None => all(&metadata["workspace_members"]).filter_map(Value::as_str).collect(),
    };
    let mut reached = BTreeSet::new();
    while let Some(id) = open.pop() {
        if reached.insert(id) {
            open.extend(depends.get(id).into_iter().flat_map(|it| all(it)).filter_map(Value::as_str));
        }
    }
    let ours = all(&metadata["packages"]).filter(|it| it["source"].is_null() && reached.contains(id(it).as_str()));
    let folders = ours.filter_map(|it| Path::new(it["manifest_path"].as_str()?).parent()?.strip_prefix(root).ok());
    Ok(folders.map(|folder| folder.to_string_lossy().into_owned()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_package_depends_on_what_it_is_made_of_and_on_nothing_else() {
        let root = workspace::root();
        let fuzz = packages(&root, "fuzz/Cargo.toml").unwrap();
        for folder in ["fuzz", "eds", "runtime", "drives/siko-ag03-1"] {
            assert!(fuzz.contains(folder), "{folder} is not in {fuzz:?}");
        }
        assert!(!fuzz.contains("cli"), "{fuzz:?}");
        let firmware = packages(&root, "examples/firmware/Cargo.toml").unwrap();
        assert!(firmware.contains("examples/firmware/mps2") && firmware.contains("runtime"), "{firmware:?}");
    }

    #[test]
    fn an_edit_of_an_input_is_another_figure_and_an_edit_elsewhere_is_not() {
        let root = std::env::temp_dir().join(format!("lexican-proved-{}", std::process::id()));
        let file = |name: &str, text: &str| {
            let path = root.join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        file("job/a.rs", "1");
        file("elsewhere/b.rs", "1");
        file("target/.gitignore", "*");
        command::output(Command::new("git").arg("init").arg("--quiet").current_dir(&root)).unwrap();
        // The inputs of every job are missing in this repository: git takes paths that do not exist.
        let inputs = Inputs { own: &[], manifests: &[], paths: &["job"], outside: Some(root.join("outside")) };
        file("outside", "1");
        let hash = || inputs.hash(&root).unwrap();
        let first = hash();
        file("elsewhere/b.rs", "2");
        assert_eq!(hash(), first);
        write(&root, "job", &first).unwrap();
        assert!(is_right(&root, "job", &hash()), "the record itself is no input");
        file("job/a.rs", "2");
        assert_ne!(hash(), first);
        assert!(!is_right(&root, "job", &hash()));
        file("job/a.rs", "1");
        assert_eq!(hash(), first);
        file("outside", "2");
        assert_ne!(hash(), first);
        file("outside", "1");
        file("job/new.rs", "");
        assert_ne!(hash(), first, "a file that is not yet added counts");
        std::fs::remove_dir_all(&root).unwrap();
    }
}
