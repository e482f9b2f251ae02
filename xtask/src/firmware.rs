//! The firmware of `examples/firmware`, on a microcontroller that QEMU plays.

use std::path::{Path, PathBuf};

use crate::qemu::{self, Board};
use crate::{command, workspace};

/// What the firmware is compiled for.
const TARGET: &str = "thumbv7em-none-eabihf";

pub(crate) fn run(root: &Path) -> Result<(), String> {
    let ready = qemu::is_installed().and_then(|()| target_is_installed());
    if let Err(reason) = ready {
        println!("skipped: firmware on a microcontroller: {reason}");
        return Ok(());
    }
    let elf = build(root, "firmware-mps2")?;
    let folder = workspace::target_folder(root).join("firmware");
    let printed = Board { elf: &elf, folder: &folder, icount: None, seconds: 10 }.run()?;
    println!("{printed}");
    Ok(())
}

/// Builds a program of `examples/firmware` for QEMU's board.
pub(crate) fn build(root: &Path, program: &str) -> Result<PathBuf, String> {
    // In the workspace's folder: what both depend on is compiled once.
    let folder = workspace::target_folder(root);
    let target = folder.to_string_lossy();
    let manifest = ["--manifest-path", "examples/firmware/Cargo.toml", "--target-dir", &target];
    let build = ["build", "--locked", "--release", "--target", TARGET, "-p", program];
    command::run_cargo(root, &[&build[..], &manifest].concat(), &[])?;
    Ok(folder.join(TARGET).join("release").join(program))
}

fn target_is_installed() -> Result<(), String> {
    let targets = workspace::installed_targets();
    let is_installed = targets.lines().any(|target| target == TARGET);
    is_installed.then_some(()).ok_or_else(|| format!("{TARGET} is not installed: rustup target add {TARGET}"))
}
