//! What is built by npm: the page of the bench (`bench/page/dist`, of `bench/page/src`) after its tests, and the extension for VS Code.

use std::path::Path;
use std::process::Command;

use crate::command;

/// Makes the page anew; with `check`, compares it with the one that is there, if this machine has npm.
pub(crate) fn run(root: &Path, check: bool) -> Result<(), String> {
    let folder = root.join("bench/page");
    if check && !command::is_there("npm") {
        println!("skipped: whether the bench's page is what its sources make: there is no npm");
        return Ok(());
    }
    let make = if check { "check" } else { "build" };
    run_npm(&folder, &[&["ci", "--no-audit", "--no-fund"], &["test"], &["run", make]])
}

fn run_npm(folder: &Path, lines: &[&[&str]]) -> Result<(), String> {
    lines.iter().try_for_each(|arguments| {
        let npm = command::show(
            &format!("npm {}", arguments.join(" ")),
            Command::new("npm").current_dir(folder).args(*arguments),
        );
        npm.map_err(|error| format!("{error}: it takes nodejs and npm"))
    })
}

/// Makes the package of the extension for VS Code: `editors/vscode/lexican.vsix`.
pub(crate) fn extension(root: &Path) -> Result<(), String> {
    let install = ["install", "--omit=dev", "--no-audit", "--no-fund", "--no-package-lock"];
    let pack = ["exec", "--yes", "--", "@vscode/vsce@4.1.0", "package", "--skip-license", "--out", "lexican.vsix"];
    run_npm(&root.join("editors/vscode"), &[&install, &pack])
}

/// Plays with the bench in a browser, and keeps its pictures in `bench/docs`.
pub(crate) fn pictures(root: &Path) -> Result<(), String> {
    let folder = root.join("bench/docs");
    std::fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let play = ["test", "--workspace", "--test", "bench", "page::", "--", "--nocapture"];
    command::run_cargo(root, &play, &[("LEXICAN_PICTURES", &folder.to_string_lossy())])
}
