//! Every data sheet of a folder: as a simulated device, and as generated code under the compiler and clippy.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::{command, outside};

/// How many bytes of generated code go into one crate, so that no build is larger than that of a large user.
const MAX_BYTES: usize = 6_000_000;

/// Every file that loads becomes a simulated device, in virtual time: it boots, obeys NMT, and `check` finds nothing that
/// is not as the data sheet says. The test knows how.
pub(crate) fn simulate(root: &Path, folder: &Path) -> Result<(), String> {
    let test = "check::simulated::every_simulated_device_agrees_with_its_data_sheet";
    let folder = folder.canonicalize().map_err(|error| format!("{}: {error}", folder.display()))?;
    let arguments = ["test", "--workspace", "--bin", "lexican", "--", "--exact", "--nocapture", test];
    command::run_cargo(root, &arguments, &[("LEXICAN_SHEETS", &folder.to_string_lossy())])
}

/// Every file that loads must compile, without a warning, in both editions by turns.
pub(crate) fn compile(root: &Path, folder: &Path) -> Result<(), String> {
    let lexican = outside::lexican(root)?;
    let workspace = outside::empty_folder(root, "corpus")?;
    let mut files = Vec::new();
    data_sheets(folder, &mut files)?;
    files.sort();
    if files.is_empty() {
        return Err(format!("{}: there is no .eds or .dcf below", folder.display()));
    }
    let mut crates = Crates::new(root, &workspace);
    let mut refused = Vec::new();
    for file in &files {
        match generate(&lexican, file)? {
            Ok(code) => crates.add(file, &code)?,
            Err(why) => refused.push(format!("{}: {why}", file.display())),
        }
    }
    let (modules, members) = crates.finish()?;
    if modules == 0 {
        return Err(format!("all {} files were refused:\n{}", files.len(), refused.join("\n")));
    }
    outside::cargo_in(root, &workspace, &["clippy", "--quiet", "--workspace", "--", "-D", "warnings"])?;
    refused.iter().for_each(|line| println!("refused: {line}"));
    println!(
        "corpus: {} files, {} refused for errors of their own, {modules} different outputs in {members} crates: \
         all compile without a warning",
        files.len(),
        refused.len(),
    );
    Ok(())
}

/// The generated code, or the last line of the error.
fn generate(lexican: &Path, file: &Path) -> Result<Result<String, String>, String> {
    let output = Command::new(lexican)
        .args(["gen", "--storage", "--names"])
        .arg(file)
        .output()
        .map_err(|error| format!("{}: {error}", lexican.display()))?;
    if output.status.success() {
        return Ok(Ok(String::from_utf8_lossy(&output.stdout).into_owned()));
    }
    // 1: errors of the data sheet; 2: no data sheet. A panic would be 101.
    if matches!(output.status.code(), Some(1 | 2)) {
        let said = String::from_utf8_lossy(&output.stderr);
        let error = said.lines().find(|line| line.contains("error")).unwrap_or("no reason given");
        return Ok(Err(error.to_owned()));
    }
    Err(format!("{}: lexican gen ends with {}", file.display(), output.status))
}

/// Modules, gathered into crates.
struct Crates<'a> {
    root: &'a Path,
    workspace: &'a Path,
    seen: std::collections::BTreeSet<String>,
    lib: String,
    bytes: usize,
    members: usize,
}

impl<'a> Crates<'a> {
    fn new(root: &'a Path, workspace: &'a Path) -> Self {
        Crates { root, workspace, seen: Default::default(), lib: String::new(), bytes: 0, members: 0 }
    }

    fn add(&mut self, file: &Path, code: &str) -> Result<(), String> {
        if !self.seen.insert(code.to_owned()) {
            return Ok(());
        }
        if self.bytes + code.len() > MAX_BYTES {
            self.close()?;
        }
        let module = format!("m{}", self.seen.len());
        outside::write(&self.folder().join(format!("src/{module}.rs")), code)?;
        self.lib += &format!("\n/// {}\npub mod {module};\n", file.display());
        self.bytes += code.len();
        Ok(())
    }

    fn folder(&self) -> PathBuf {
        self.workspace.join(format!("part{}", self.members))
    }

    fn close(&mut self) -> Result<(), String> {
        let edition = if self.members.is_multiple_of(2) { "2024" } else { "2021" };
        let lib = format!("//! Generated from real data sheets.\n#![warn(missing_docs)]\n#![no_std]\n{}", self.lib);
        outside::write_crate(self.root, &self.folder(), edition, &lib)?;
        self.members += 1;
        self.lib.clear();
        self.bytes = 0;
        Ok(())
    }

    fn finish(mut self) -> Result<(usize, usize), String> {
        if self.bytes > 0 {
            self.close()?;
        }
        outside::write(&self.workspace.join("Cargo.toml"), "[workspace]\nresolver = \"3\"\nmembers = [\"part*\"]\n")?;
        Ok((self.seen.len(), self.members))
    }
}

fn data_sheets(folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), String> {
    let entries = fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    for entry in entries {
        let path = entry.map_err(|error| format!("{}: {error}", folder.display()))?.path();
        let is_sheet = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("eds") || e.eq_ignore_ascii_case("dcf"));
        if path.is_dir() {
            data_sheets(&path, files)?;
        } else if is_sheet {
            files.push(path);
        }
    }
    Ok(())
}
