//! Commands that tasks run.

use std::path::Path;
use std::process::{Command, Output};

/// The cargo that has started the task.
pub(crate) fn cargo() -> Command {
    Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
}

/// Whether this machine has a program.
pub(crate) fn is_there(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok()
}

/// Runs a command on this machine, and shows it.
pub(crate) fn run(words: &[&str]) -> Result<(), String> {
    let (program, arguments) = words.split_first().ok_or("no command")?;
    show(&words.join(" "), Command::new(program).args(arguments))
}

/// Runs a command, after a line that shows it.
pub(crate) fn show(line: &str, command: &mut Command) -> Result<(), String> {
    println!("$ {line}");
    let status = command.status().map_err(|error| format!("{line}: {error}"))?;
    if status.success() { Ok(()) } else { Err(format!("{line}: {status}")) }
}

/// Runs a command, and returns what it says when it succeeds.
pub(crate) fn output(command: &mut Command) -> Result<Output, String> {
    let output = command.output().map_err(|error| format!("{command:?}: {error}"))?;
    if output.status.success() {
        return Ok(output);
    }
    Err(format!("{command:?}: {}\n{}", output.status, String::from_utf8_lossy(&output.stderr)))
}

/// Runs cargo in a folder, and shows it.
pub(crate) fn run_cargo(root: &Path, arguments: &[&str], environment: &[(&str, &str)]) -> Result<(), String> {
    let line = format!("cargo {}", arguments.join(" "));
    show(&line, cargo().args(arguments).envs(environment.iter().copied()).current_dir(root))
}
