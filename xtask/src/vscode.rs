//! The package of the extension for VS Code, which npm makes of `editors/vscode`.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::{outside, workspace};

/// Makes `lexican.vsix` in the target folder, and leaves the checkout as it is.
pub(crate) fn run(root: &Path) -> Result<(), String> {
    let folder = outside::empty_folder(root, "vscode")?;
    let failed = |error| format!("{}: {error}", folder.display());
    fs::create_dir_all(&folder).map_err(failed)?;
    for file in workspace::entries(&root.join("editors/vscode"))? {
        fs::copy(&file, folder.join(file.file_name().unwrap_or_default())).map_err(failed)?;
    }
    fs::copy(root.join("LICENSE-MIT"), folder.join("LICENSE")).map_err(failed)?;
    let package = folder.with_file_name("lexican.vsix").to_string_lossy().into_owned();
    for words in [
        &["npm", "install", "--omit=dev", "--no-audit", "--no-fund", "--no-package-lock"][..],
        &["npx", "--yes", "@vscode/vsce@4.1.0", "package", "--out", &package],
    ] {
        println!("$ {}", words.join(" "));
        let status = Command::new(words[0]).args(&words[1..]).current_dir(&folder).status();
        let status = status.map_err(|error| format!("{}: {error}: install nodejs and npm", words[0]))?;
        if !status.success() {
            return Err(format!("{}: {status}", words.join(" ")));
        }
    }
    Ok(())
}
