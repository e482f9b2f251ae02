//! `cargo xtask vcan -- COMMAND`: runs a command with vcan0 and vcan1 up, even on machines without CAN.
//!
//! Where the kernel has vcan, the command just runs. Elsewhere it runs in user-mode Linux, a second kernel that is an
//! ordinary program. It is taken from packages of the distribution, without installing them.

mod uml;

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

use clap::Args;

const INTERFACES: [&str; 2] = ["vcan0", "vcan1"];

#[derive(Args)]
pub(crate) struct Arguments {
    /// Seconds until the command is ended
    #[arg(long, default_value_t = 600)]
    time_limit: u32,
    /// A folder that the command may write to for good; without CAN in this kernel, everything
    /// written elsewhere is gone afterwards
    #[arg(long, value_name = "DIR")]
    writable: Vec<PathBuf>,
    /// The program and its arguments
    #[arg(last = true, required = true)]
    command: Vec<String>,
}

/// Runs the command. The exit status is that of the command, 124 if its time was out, or 125 if it could not be
/// started.
pub(crate) fn main(root: &Path, arguments: &Arguments) -> ExitCode {
    match run(root, arguments) {
        Ok(status) => ExitCode::from(status),
        Err(message) => {
            eprintln!("vcan: {message}");
            ExitCode::from(125)
        }
    }
}

/// Runs `command` in the current folder, for other tasks.
pub(crate) fn run_command(root: &Path, command: &[&str], writable: &[&Path]) -> Result<(), String> {
    println!("$ cargo xtask vcan -- {}", command.join(" "));
    let arguments = Arguments {
        time_limit: 600,
        writable: writable.iter().map(|folder| folder.to_path_buf()).collect(),
        command: command.iter().map(|word| (*word).to_owned()).collect(),
    };
    match run(root, &arguments)? {
        0 => Ok(()),
        status => Err(format!("{}: exit status {status}", command.join(" "))),
    }
}

fn run(root: &Path, arguments: &Arguments) -> Result<u8, String> {
    if INTERFACES.iter().all(|interface| set_up(interface)) {
        let (program, rest) = arguments.command.split_first().ok_or("no command")?;
        let status = Command::new(program).args(rest).status().map_err(|error| format!("{program}: {error}"))?;
        return Ok(status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(125));
    }
    let kernel = uml::Kernel::in_cache(&crate::workspace::target_folder(root).join("vcan"))?;
    kernel.run(&arguments.command, arguments.time_limit, &arguments.writable)
}

/// Sets the interface up if it is not. Returns whether it is.
fn set_up(interface: &str) -> bool {
    let is_up = || {
        let flags = std::fs::read_to_string(format!("/sys/class/net/{interface}/flags")).unwrap_or_default();
        let flags = u32::from_str_radix(flags.trim().trim_start_matches("0x"), 16);
        flags.is_ok_and(|flags| flags & 1 != 0)
    };
    if is_up() {
        return true;
    }
    // Each line may fail, for lack of rights or of the module; only the result counts.
    for line in [
        "modprobe vcan".to_owned(),
        format!("ip link add dev {interface} type vcan"),
        format!("ip link set {interface} up"),
    ] {
        let mut words = line.split(' ');
        let program = words.next().unwrap_or_default();
        let _ = Command::new(program).args(words).stdout(Stdio::null()).stderr(Stdio::null()).status();
    }
    is_up()
}
