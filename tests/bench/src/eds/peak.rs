//! The most memory that a reader takes, found by running it alone in a process of its own.

use std::path::Path;
use std::process::Command;

use super::readers;

/// The most memory, in bytes, that `reader` takes beyond what the process takes that only has the file's bytes.
/// `None` if the kernel does not report it (`VmHWM` of Linux).
pub(super) fn measured(reader: &str, path: &Path) -> Option<u64> {
    Some(high_water(reader, path)?.saturating_sub(high_water("nothing", path)?))
}

fn high_water(reader: &str, path: &Path) -> Option<u64> {
    let this = std::env::current_exe().ok()?;
    let output = Command::new(this).args(["peak", reader]).arg(path).output().ok()?;
    String::from_utf8(output.stdout).ok()?.trim().parse().ok()
}

/// The process that is measured: reads once, and prints its own high-water mark in bytes.
pub(crate) fn child(reader: &str, path: &str) {
    let bytes = std::fs::read(path).expect("the parent has read it too");
    let kept: Box<dyn std::any::Any> = match reader {
        "lexican" => Box::new(readers::lexican(&bytes)),
        "rust-ini" => Box::new(readers::rust_ini(&readers::text(&bytes)).expect("it was read before")),
        "canopen-host" => Box::new(readers::canopen_host(&readers::text(&bytes)).expect("it was read before")),
        _ => Box::new(()),
    };
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    if let Some(kib) = line.and_then(|line| line.trim().trim_end_matches("kB").trim().parse::<u64>().ok()) {
        println!("{}", kib * 1024);
    }
    drop((kept, bytes));
}
