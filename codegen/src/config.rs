//! The interface for build scripts: reads files, calls [`compile`], writes files.

use std::collections::BTreeSet;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::{env, fs};

use lexican_eds::{Diagnostic, Diagnostics, Input, Severity, Source, drive, library, rules, text};

use crate::compile::compile;
use crate::error::Error;
use crate::findings::FINDINGS;
use crate::name::{self, Case};
use crate::options::Options;

/// What to generate, and where to write it. Methods can be chained.
///
/// Each data sheet becomes one file, named after it in snake case: `eds/Drive-2.eds` becomes `drive_2.rs`, to be
/// included by `lexican_runtime::include_od!("drive_2")`.
#[derive(Clone, Debug, Default)]
#[must_use = "nothing happens before `generate`"]
pub struct Config {
    sheets: Vec<Sheet>,
    /// A setting that was given before any data sheet; [`generate`](Self::generate) reports it.
    stray: Option<Stray>,
    rules: Vec<Rule>,
    out_dir: Option<PathBuf>,
    options: Options,
}

#[derive(Clone, Debug)]
struct Sheet {
    origin: Origin,
    overlays: Vec<PathBuf>,
    module: Option<String>,
}

#[derive(Clone, Debug)]
enum Stray {
    Overlay(PathBuf),
    Module(String),
}

#[derive(Clone, Debug)]
enum Origin {
    File(PathBuf),
    Library(String),
}

#[derive(Clone, Debug)]
struct Rule {
    code: String,
    severity: Option<Severity>,
}

impl Config {
    /// A configuration without data sheets that generates the manager's side only.
    pub fn new() -> Self {
        Config::default()
    }

    /// Adds a data sheet or DCF. Relative paths start at the folder of the package.
    pub fn eds(self, path: impl AsRef<Path>) -> Self {
        self.sheet(Origin::File(path.as_ref().to_owned()))
    }

    /// Adds a device of lexican's library, `vendor/device`, with its overlay.
    pub fn device(self, name: &str) -> Self {
        self.sheet(Origin::Library(name.to_owned()))
    }

    /// Adds an overlay to the latest data sheet. Several overlays are applied in order.
    pub fn overlay(mut self, path: impl AsRef<Path>) -> Self {
        match self.sheets.last_mut() {
            Some(sheet) => sheet.overlays.push(path.as_ref().to_owned()),
            None => self.stray = Some(Stray::Overlay(path.as_ref().to_owned())),
        }
        self
    }

    /// Sets the name of the file that the latest data sheet becomes, without `.rs`.
    pub fn module(mut self, name: &str) -> Self {
        match self.sheets.last_mut() {
            Some(sheet) => sheet.module = Some(name.to_owned()),
            None => self.stray = Some(Stray::Module(name.to_owned())),
        }
        self
    }

    /// Makes all findings with this code (`eds::missing-key`) errors.
    pub fn deny(self, code: &str) -> Self {
        self.rule(code, Some(Severity::Error))
    }

    /// Removes all findings with this code.
    pub fn allow(self, code: &str) -> Self {
        self.rule(code, None)
    }

    /// Whether the device's side is generated as well: `TABLE`, `Storage` and `storage(node)`. Off by default.
    ///
    /// A new `Storage` holds the values that a DCF configures (`ParameterValue`), and otherwise the defaults
    /// (`DefaultValue`). `default` of a handle is the default even so.
    pub fn storage(mut self, on: bool) -> Self {
        self.options.storage = on;
        self
    }

    /// Whether the table `NAMES` is generated, with which tools show names and units. Off by default.
    pub fn names(mut self, on: bool) -> Self {
        self.options.names = on;
        self
    }

    /// Whether the module `driver` is generated, for a drive of CiA 402: `DESCRIPTION` holds what the data sheet says
    /// of the drive, `Kind` is the type with that description, and `Drive` its driver. The crate then depends on
    /// `lexican-driver`. Off by default.
    ///
    /// It is an error if the data sheet does not describe a drive; the findings say what is missing or contradictory.
    pub fn driver(mut self, on: bool) -> Self {
        self.options.driver = on;
        self
    }

    /// The path of the runtime, if a crate re-exports it; `::lexican_runtime` by default.
    pub fn runtime_path(mut self, path: &str) -> Self {
        self.options.runtime_path = path.to_owned();
        self
    }

    /// The output folder; the build script's `OUT_DIR` by default.
    pub fn out_dir(mut self, path: impl AsRef<Path>) -> Self {
        self.out_dir = Some(path.as_ref().to_owned());
        self
    }

    /// Reads the data sheets, generates code and writes it.
    ///
    /// Tells Cargo which files to watch, and shows one warning for each data sheet with findings; several findings are
    /// written to `NAME.findings.txt` beside the code, with their lines. Files are written whole or not at all, and
    /// only if their content changes.
    ///
    /// After an error nothing is written, not even for data sheets without errors.
    pub fn generate(self) -> Result<(), Error> {
        match self.stray {
            Some(Stray::Overlay(path)) => return Err(Error::OverlayFirst(path)),
            Some(Stray::Module(name)) => return Err(Error::ModuleFirst(name)),
            None => {}
        }
        if self.sheets.is_empty() {
            return Err(Error::NoDataSheet);
        }
        let out_dir = self.begin()?;
        let mut files: Vec<(String, String)> = Vec::new();
        let mut warnings = Vec::new();
        for sheet in &self.sheets {
            let (name, input) = sheet.read()?;
            if files.iter().any(|(other, _)| *other == name) {
                return Err(Error::SameName(name));
            }
            let (code, findings) = generate(&input, &self.options, &self.rules)?;
            warnings.push(Warnings { report: out_dir.join(format!("{name}.findings.txt")), findings, input });
            files.push((name, code));
        }
        finish(&out_dir, files, &warnings)
    }

    /// Writes the code that another generator makes from a file, in the same way as [`generate`](Config::generate): a
    /// finding that is an error fails the build, warnings are shown, and `include_od!(name)` includes the code.
    pub fn emit(
        self,
        name: &str,
        input: Input,
        mut findings: Diagnostics,
        code: impl FnOnce(&Options) -> String,
    ) -> Result<(), Error> {
        let out_dir = self.begin()?;
        self.rules.iter().for_each(|rule| findings.set_severity(&rule.code, rule.severity));
        let findings = without_errors(&findings, &input, "")?;
        let warnings = Warnings { report: out_dir.join(format!("{name}.findings.txt")), findings, input };
        finish(&out_dir, vec![(name.to_owned(), code(&self.options))], &[warnings])
    }

    /// Checks the settings, and returns the output folder.
    fn begin(&self) -> Result<PathBuf, Error> {
        if !name::is_path(&self.options.runtime_path) {
            return Err(Error::RuntimePath(self.options.runtime_path.clone()));
        }
        if let Some(Rule { code, .. }) = self.rules.iter().find(|rule| !codes().any(|code| code == rule.code)) {
            return Err(Error::UnknownCode { code: code.clone(), near: near(code, codes()) });
        }
        // Without any such line, Cargo would watch every file of the package. It always watches the build script
        // itself, whatever its name; a file that does not exist would run the script every time.
        println!("cargo:rerun-if-changed=Cargo.toml");
        self.out_dir.clone().or_else(|| env::var_os("OUT_DIR").map(PathBuf::from)).ok_or(Error::NoOutDir)
    }

    fn sheet(mut self, origin: Origin) -> Self {
        self.sheets.push(Sheet { origin, overlays: Vec::new(), module: None });
        self
    }

    fn rule(mut self, code: &str, severity: Option<Severity>) -> Self {
        self.rules.push(Rule { code: code.to_owned(), severity });
        self
    }
}

impl Sheet {
    /// The name of the output file, and the input.
    fn read(&self) -> Result<(String, Input), Error> {
        let (stem, mut input) = match &self.origin {
            Origin::File(path) => {
                let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                let bytes = read(path)?;
                if let Some(what) = not_a_data_sheet(&bytes) {
                    return Err(Error::NotADataSheet { path: path.clone(), what });
                }
                (stem, Input::new(Source::from_bytes(path.display().to_string(), &bytes)))
            }
            Origin::Library(name) => match library::find(name) {
                Some(shipped) => (shipped.id.to_owned(), shipped.input()),
                None => {
                    return Err(Error::UnknownDevice {
                        name: name.clone(),
                        near: near(name, library::all().iter().map(|shipped| shipped.id)),
                    });
                }
            },
        };
        for path in &self.overlays {
            input = input.overlay(Source::from_bytes(path.display().to_string(), &read(path)?));
        }
        let name = name::identifier(self.module.as_deref().unwrap_or(&stem), Case::Snake);
        Ok((if name.is_empty() { "od".into() } else { name }, input))
    }
}

fn generate(input: &Input, options: &Options, rules: &[Rule]) -> Result<(String, Vec<Diagnostic>), Error> {
    let (device, mut findings) = lexican_eds::load(input);
    let output = compile(&device, options);
    findings.extend(output.diagnostics);
    findings.finish();
    for rule in rules {
        findings.set_severity(&rule.code, rule.severity);
    }
    let warnings = without_errors(&findings, input, " in the data sheet")?;
    if device.objects.is_empty() {
        let summary = format!("{}: there is no object in it; nothing was generated", input.eds.name());
        return Err(Error::Findings { summary, report: findings.render(input) });
    }
    Ok((output.code, warnings))
}

/// The findings below error; an error if there is one.
fn without_errors(findings: &Diagnostics, input: &Input, place: &str) -> Result<Vec<Diagnostic>, Error> {
    if findings.has_errors() {
        let errors = findings.count(Severity::Error);
        let summary = format!(
            "{}: {errors} {}{place}; nothing was generated",
            input.eds.name(),
            if errors == 1 { "error" } else { "errors" }
        );
        return Err(Error::Findings { summary, report: findings.render(input) });
    }
    Ok(findings.iter().filter(|finding| finding.severity == Severity::Warning).cloned().collect())
}

/// Writes the files and shows the warnings.
fn finish(out_dir: &Path, files: Vec<(String, String)>, warnings: &[Warnings]) -> Result<(), Error> {
    files.iter().try_for_each(|(name, code)| write(&out_dir.join(format!("{name}.rs")), code))?;
    warnings.iter().try_for_each(Warnings::show)?;
    announce(files.into_iter().map(|(name, _)| name));
    Ok(())
}

/// Tells `include_od!` the names of all files, for its message about an unknown one.
fn announce(names: impl Iterator<Item = String>) {
    static ALL: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
    let mut all = ALL.lock().unwrap_or_else(PoisonError::into_inner);
    all.extend(names);
    let list: Vec<String> = all.iter().map(|name| format!("`{name}`")).collect();
    println!("cargo:rustc-env=LEXICAN_OD={}", list.join(", "));
    for name in &*all {
        println!("cargo:rustc-env=LEXICAN_OD_{name}=generated");
    }
}

/// The warnings about a data sheet.
struct Warnings {
    /// The file with all warnings and their lines, if there are several.
    report: PathBuf,
    findings: Vec<Diagnostic>,
    input: Input,
}

impl Warnings {
    /// Shows one line through Cargo, which repeats it at every build; writes the rest to a file beside the code.
    fn show(&self) -> Result<(), Error> {
        let Some(line) = self.line() else { return self.forget() };
        println!("cargo:warning={line}");
        if self.findings.len() == 1 {
            return self.forget();
        }
        let report = self.findings.iter().map(|finding| finding.render(&self.input) + "\n\n");
        write(&self.report, &report.collect::<String>())
    }

    /// Removes the report of an earlier build.
    fn forget(&self) -> Result<(), Error> {
        match fs::remove_file(&self.report) {
            Err(reason) if reason.kind() != std::io::ErrorKind::NotFound => {
                Err(Error::Write { path: self.report.clone(), reason })
            }
            _ => Ok(()),
        }
    }

    /// The line for Cargo; `None` without a warning.
    fn line(&self) -> Option<String> {
        let first = self.findings.first()?.render_short(&self.input).replace(['\n', '\r'], " ");
        Some(match self.findings.len() {
            1 => first,
            2 => format!("{first}; one more warning, with their lines: {}", self.report.display()),
            count => format!("{first}; {} more warnings, with their lines: {}", count - 1, self.report.display()),
        })
    }
}

fn read(path: &Path) -> Result<Vec<u8>, Error> {
    println!("cargo:rerun-if-changed={}", path.display());
    // One byte more than allowed is enough for the finding that the file is too large.
    let bound = text::MAX_BYTES as u64 + 1;
    let mut bytes = Vec::new();
    let read = fs::File::open(path).and_then(|file| file.take(bound).read_to_end(&mut bytes));
    read.map(|_| bytes).map_err(|reason| Error::Read { path: path.to_owned(), reason })
}

fn not_a_data_sheet(bytes: &[u8]) -> Option<&'static str> {
    let encoding = Source::from_bytes("", &bytes[..bytes.len().min(64)]).encoding();
    let is_utf_16 = matches!(encoding, text::Encoding::Utf16Le { .. } | text::Encoding::Utf16Be { .. });
    if bytes.iter().all(u8::is_ascii_whitespace) {
        Some("empty")
    } else if bytes.contains(&0) && !is_utf_16 {
        Some("a binary file")
    } else {
        None
    }
}

/// Writes to a temporary file and renames it, so that no half-written file remains. A file that would not change is not
/// touched, so that nothing is compiled again.
fn write(path: &Path, code: &str) -> Result<(), Error> {
    if fs::read(path).is_ok_and(|old| old == code.as_bytes()) {
        return Ok(());
    }
    let beside = path.with_extension(format!("rs.{}", std::process::id()));
    let written = fs::write(&beside, code).and_then(|()| fs::rename(&beside, path));
    written.map_err(|reason| {
        // Report why the file could not be written, not why the temporary one remains.
        let _ = fs::remove_file(&beside);
        Error::Write { path: path.to_owned(), reason }
    })
}

/// The codes of all findings that can occur.
fn codes() -> impl Iterator<Item = &'static str> {
    let of_drives = drive::FINDINGS.iter().map(|finding| finding.code);
    rules::rules().iter().map(|rule| rule.code).chain(FINDINGS.iter().map(|finding| finding.code)).chain(of_drives)
}

/// Names similar to this one, the nearest first.
fn near(name: &str, all: impl Iterator<Item = &'static str>) -> Vec<&'static str> {
    let wanted = name.to_lowercase();
    let distances = all.map(|known| (strsim::levenshtein(&wanted, known), known));
    let mut near: Vec<_> = distances.filter(|&(distance, known)| distance <= 3.max(known.len() / 3)).collect();
    near.sort_unstable();
    near.into_iter().map(|(_, known)| known).take(3).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_build_shows_one_line_for_a_data_sheet() {
        let line = |objects: &str| {
            let eds =
                format!("[FileInfo]\n[DeviceInfo]\nBaudRate_500=1\n[MandatoryObjects]\nSupportedObjects=0\n{objects}");
            let input = Input::new(Source::new("drive.eds", eds));
            let (_, findings) = generate(&input, &Options::default(), &[]).expect("it has an object and no errors");
            let warnings = Warnings { report: "out/drive.findings.txt".into(), findings, input };
            (warnings.findings.len(), warnings.line().unwrap_or_default())
        };
        let (count, many) = line("[2000]\nParameterName=a\nDataType=6\nAccessType=rw\n");
        assert!(count > 2 && many.contains("drive.eds:") && many.ends_with("out/drive.findings.txt"), "{many}");
        assert!(many.contains(&format!("; {} more warnings", count - 1)) && !many.contains('\n'), "{many}");
    }
}
