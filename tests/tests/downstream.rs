//! Crates as users write them, outside of the workspace: they build, they pass, and clippy is silent.
//! The golden cases are among them, as modules of a crate in each edition.

use std::path::Path;
use std::process::Command;
use std::{env, fs};

#[test]
fn a_user_reads_and_writes_with_types() {
    check("downstream/basic", &["test"]);
}

#[test]
fn a_firmware_without_std_serves_its_dictionary() {
    check("downstream/no_std", &["test"]);
}

#[test]
fn two_devices_live_in_one_crate() {
    check("downstream/two_devices", &["run"]);
}

#[test]
fn a_crate_that_reexports_the_runtime_is_enough() {
    check("downstream/reexport", &["test"]);
}

#[test]
fn a_program_may_deny_every_lint() {
    check("downstream/strict", &["run"]);
}

#[test]
fn every_type_goes_through_a_pdo_at_every_bit() {
    check("downstream/bits", &["test"]);
}

#[test]
fn golden_code_is_clean_in_edition_2021() {
    check("golden/edition-2021", &["doc", "--no-deps"]);
}

#[test]
fn golden_code_is_clean_in_edition_2024() {
    check("golden/edition-2024", &["doc", "--no-deps"]);
}

#[track_caller]
fn check(folder: &str, task: &[&str]) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = root.join(folder);
    // The versions that the workspace has: Cargo drops what is not needed.
    let lock = fs::read(root.join("../Cargo.lock")).expect("the workspace has a lock file");
    fs::write(folder.join("Cargo.lock"), lock).expect("the folder can be written to");
    cargo(&folder, task);
    cargo(&folder, &["clippy", "--all-targets", "--", "-D", "warnings"]);
}

#[track_caller]
fn cargo(folder: &Path, task: &[&str]) {
    let cargo = env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(&task[..1])
        .arg("--quiet")
        .args(&task[1..])
        .current_dir(folder)
        .env("CARGO_TARGET_DIR", Path::new(env!("CARGO_TARGET_TMPDIR")).join("downstream"))
        .env("RUSTDOCFLAGS", "-D warnings")
        // Those of the outer build would make this one start from the beginning.
        .env_remove("RUSTFLAGS")
        .output()
        .expect("cargo can be started");
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said);
    assert!(output.status.success(), "in {}: cargo {}\n{said}", folder.display(), task.join(" "));
}
