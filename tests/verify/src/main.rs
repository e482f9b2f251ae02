//! `cargo xtask verify`: writes `drives/siko-ag03-1/VERIFICATION.md`, or with `--check` looks whether it is right.

use std::path::Path;
use std::process::ExitCode;

use lexican_verify::{Inputs, verify};

const REPORT: &str = "drives/siko-ag03-1/VERIFICATION.md";

fn main() -> ExitCode {
    match run(std::env::args().any(|argument| argument == "--check")) {
        Ok(summary) => {
            println!("{summary}");
            ExitCode::SUCCESS
        }
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

fn run(check: bool) -> Result<String, String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let report = verify(&Inputs::read(&root)?);
    if !report.findings.is_empty() {
        let count = report.findings.len();
        return Err(format!("{}\nverify: {count} findings", report.findings.join("\n")));
    }
    let (path, text) = (root.join(REPORT), report.to_markdown());
    if check && std::fs::read_to_string(&path).ok().as_deref() != Some(text.as_str()) {
        return Err(format!("{REPORT} is stale\nmend it: cargo xtask verify"));
    }
    if !check {
        std::fs::write(&path, text).map_err(|error| format!("{REPORT}: {error}"))?;
    }
    let (rows, checked, agreeing) = report.totals();
    Ok(format!("verify: {rows} rows, {checked} checked, {agreeing} agree; {} errata", report.errata.len()))
}
