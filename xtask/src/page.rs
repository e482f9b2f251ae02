//! The page of the bench: its tests, and `bench/page/dist`, made of `bench/page/src`.

use std::io::ErrorKind;
use std::path::Path;
use std::process::Command;

/// Makes the page anew; with `check`, compares it with the one that is there, if this machine has npm.
pub(crate) fn run(root: &Path, check: bool) -> Result<(), String> {
    let folder = root.join("bench/page");
    let npm = || {
        let mut npm = Command::new("npm");
        npm.current_dir(&folder);
        npm
    };
    match npm().arg("--version").output() {
        Err(error) if check && error.kind() == ErrorKind::NotFound => {
            println!("skipped: whether the bench's page is what its sources make: there is no npm");
            return Ok(());
        }
        Err(error) => return Err(format!("npm: {error}: install nodejs and npm")),
        Ok(_) => {}
    }
    let make = if check { "check" } else { "build" };
    for arguments in [&["ci", "--no-audit", "--no-fund"][..], &["test"], &["run", make]] {
        let line = format!("npm {}", arguments.join(" "));
        println!("$ {line}");
        let status = npm().args(arguments).status().map_err(|error| format!("{line}: {error}"))?;
        if !status.success() {
            return Err(format!("{line}: {status}"));
        }
    }
    Ok(())
}

/// Plays with the bench in a browser, and keeps its pictures in `bench/docs`.
pub(crate) fn pictures(root: &Path) -> Result<(), String> {
    let folder = root.join("bench/docs");
    std::fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let play = ["test", "--workspace", "--test", "bench", "page::", "--", "--nocapture"];
    crate::command::run_cargo(root, &play, &[("LEXICAN_PICTURES", &folder.to_string_lossy())])
}
