//! `cargo xtask ci python`: the Python package `lexican`, built, tested and type-checked in a fresh environment.

use std::path::Path;
use std::process::Command;

use crate::{command, workspace};

/// Whether there is a Python that can have an environment; if not, what to do.
pub(crate) fn is_possible() -> Result<(), String> {
    let test = "import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 10))";
    let has_venv = Command::new("python3").args(["-c", test]).output().is_ok_and(|output| output.status.success());
    let help = "there is no Python 3.10 with venv: apt-get install python3-venv";
    if has_venv { Ok(()) } else { Err(help.to_owned()) }
}

pub(crate) fn run(root: &Path) -> Result<(), String> {
    if let Err(why) = is_possible() {
        println!("skipped: the Python package: {why}");
        return Ok(());
    }
    let folder = workspace::target_folder(root);
    let words = |path: &Path| path.to_string_lossy().into_owned();
    let (venv, target) = (folder.join("python-package"), words(&folder.join("python")));
    let manifest = ["--manifest-path", "python/Cargo.toml"];
    command::run_cargo(root, &[&["fmt"], &manifest[..], &["--check"]].concat(), &[])?;
    let clippy = [&["clippy", "--locked"], &manifest[..], &["--target-dir", &target, "--profile", "quick"]].concat();
    command::run_cargo(root, &[&clippy[..], &["--", "-D", "warnings"]].concat(), &[])?;
    command::run(&["python3", "-m", "venv", "--clear", &words(&venv)])?;
    let program = |name: &str| words(&venv.join("bin").join(name));
    let (python, package) = (program("python"), format!("{}[test]", words(&root.join("python"))));
    // As its users install it, but for the profile.
    let build = [format!("CARGO_TARGET_DIR={target}"), "MATURIN_PEP517_ARGS=--profile quick --locked".to_owned()];
    let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", &package];
    command::run(&[&["env", &build[0], &build[1], &python], &install[..]].concat())?;
    // Not `python -m pytest`, which would import the sources and not what is installed; and no byte code beside them.
    let within = words(&root.join("python"));
    let here = ["env", "-C", &within, "PYTHONDONTWRITEBYTECODE=1"];
    command::run(&[&here[..], &[&program("pytest"), "-q"]].concat())?;
    command::run(&[&here[..], &[&program("mypy"), "--cache-dir", &format!("{target}/mypy")]].concat())?;
    command::run(&[&here[..], &[&program("pyright"), "--pythonpath", &python]].concat())
}
