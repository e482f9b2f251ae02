//! `cargo xtask verify [DRIVE]`: writes each drive's VERIFICATION.md; with `--check`, only compares it.

use std::path::Path;
use std::process::ExitCode;

use lexican_registry::KnownDrive;
use lexican_verify::{DRIVES, Drive, Inputs, verify};

fn main() -> ExitCode {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let check = arguments.iter().any(|argument| argument == "--check");
    arguments.retain(|argument| argument != "--check");
    if let Some(unknown) = arguments.iter().find(|name| DRIVES.iter().all(|drive| drive.name != name.as_str())) {
        let names: Vec<_> = DRIVES.iter().map(|drive| drive.name).collect();
        eprintln!("no drive is called {unknown:?}\nthere are: {}", names.join(", "));
        return ExitCode::FAILURE;
    }
    let mut code = ExitCode::SUCCESS;
    let is_compared = |known: &KnownDrive| DRIVES.iter().any(|drive| drive.name == known.library);
    for known in lexican_registry::DRIVES.iter().filter(|known| !is_compared(known)) {
        eprintln!("{}: no file in tests/verify/src/drives compares it with its manual", known.library);
        code = ExitCode::FAILURE;
    }
    for drive in DRIVES.iter().filter(|drive| arguments.is_empty() || arguments.iter().any(|name| name == drive.name)) {
        match run(drive, check) {
            Ok(summary) => println!("{}: {summary}", drive.name),
            Err(message) => {
                eprintln!("{message}");
                code = ExitCode::FAILURE;
            }
        }
    }
    code
}

fn run(drive: &Drive, check: bool) -> Result<String, String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let report = verify(drive, &Inputs::read(drive, &root)?);
    if !report.findings.is_empty() {
        return Err(format!("{}\n{}: {} findings", report.findings.join("\n"), drive.name, report.findings.len()));
    }
    let (path, text) = (root.join(drive.report), report.to_markdown(drive));
    if !check {
        std::fs::write(&path, text).map_err(|error| format!("{}: {error}", drive.report))?;
    } else if std::fs::read_to_string(&path).ok().as_deref() != Some(text.as_str()) {
        return Err(format!("{} is stale\nmend it: cargo xtask verify", drive.report));
    }
    let (rows, checked, agreeing) = report.totals();
    Ok(format!("{rows} rows, {checked} checked, {agreeing} agree; {} errata", report.errata.len()))
}
