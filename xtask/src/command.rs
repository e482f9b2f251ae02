//! Commands that tasks run.

use std::process::Command;

/// The cargo that has started the task.
pub(crate) fn cargo() -> Command {
    Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
}

/// Runs a command on this machine, and shows it.
pub(crate) fn run(words: &[&str]) -> Result<(), String> {
    let line = words.join(" ");
    println!("$ {line}");
    let (program, arguments) = words.split_first().ok_or("no command")?;
    let status = Command::new(program).args(arguments).status().map_err(|error| format!("{line}: {error}"))?;
    if status.success() { Ok(()) } else { Err(format!("{line}: {status}")) }
}
