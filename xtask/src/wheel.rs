//! The Python package `lexican`: `cargo xtask wheel` makes its wheel, `cargo xtask ci python` makes, tests and type-checks one in a fresh
//! environment.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::{command, workspace};

/// What makes wheels.
const MATURIN: &str = "maturin>=1.14,<2";

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The folder that it is put into
    #[arg(long, short, default_value = "target/wheels")]
    output: PathBuf,
    /// The Python that it is made by. A free-threaded one gets a wheel for itself alone: before Python 3.15, it loads no other
    #[arg(long, default_value = "python3")]
    python: String,
}

pub(crate) fn make(root: &Path, arguments: &Arguments) -> Result<(), String> {
    let venv = workspace::target_folder(root).join("python-wheels");
    let python = environment(&arguments.python, &venv)?;
    wheel(root, &python, "release", &root.join(&arguments.output)).map(|wheel| println!("{}", wheel.display()))
}

/// A fresh environment: its Python.
fn environment(python: &str, venv: &Path) -> Result<PathBuf, String> {
    command::run(&[python, "-m", "venv", "--clear", &venv.to_string_lossy()])?;
    Ok(venv.join("bin/python"))
}

/// Makes the wheel by the Python of an environment.
fn wheel(root: &Path, python: &Path, profile: &str, output: &Path) -> Result<PathBuf, String> {
    let (python, output) = (python.to_string_lossy(), output.to_string_lossy());
    command::run(&[&python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", MATURIN])?;
    let target = format!("CARGO_TARGET_DIR={}", workspace::target_folder(root).join("python").display());
    let manifest = root.join("python/Cargo.toml");
    let build = ["--profile", profile, "--locked", "--manifest-path", &manifest.to_string_lossy()];
    let for_python = ["--interpreter", &python, "--out", &output];
    command::run(&[&["env", &target, &python, "-m", "maturin", "build"], &build[..], &for_python].concat())?;
    let wheels = fs::read_dir(&*output).map_err(|error| error.to_string())?.flatten().map(|entry| entry.path());
    let made = wheels.filter(|path| path.extension().is_some_and(|ending| ending == "whl"));
    let newest = made.max_by_key(|path| fs::metadata(path).and_then(|it| it.modified()).ok());
    newest.ok_or_else(|| format!("maturin has put no wheel into {output}"))
}

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
    let python = environment("python3", &venv)?;
    // The package as users install it, except that it is not optimised.
    let made = format!("{}[test]", wheel(root, &python, "quick", &venv.join("wheels"))?.display());
    let program = |name: &str| words(&venv.join("bin").join(name));
    let python = words(&python);
    command::run(&[&python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", &made])?;
    // Not `python -m pytest`, which would import the sources and not what is installed; and no byte code beside them.
    let within = words(&root.join("python"));
    let here = ["env", "-C", &within, "PYTHONDONTWRITEBYTECODE=1"];
    command::run(&[&here[..], &[&program("pytest"), "-q"]].concat())?;
    command::run(&[&here[..], &[&program("mypy"), "--cache-dir", &format!("{target}/mypy")]].concat())?;
    command::run(&[&here[..], &[&program("pyright"), "--pythonpath", &python]].concat())
}
