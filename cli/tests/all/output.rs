//! Output to a closed pipe, colours, and endless inputs.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::common::{folder, lexican, lexican_in};

const DRIVE: &str = "sim:siko/ag03-1?node=5";

/// Two data sheets that differ, one of them with a mistake.
fn sheets(name: &str) -> PathBuf {
    let folder = folder(name);
    let sensor = include_str!("../sensor.eds");
    std::fs::write(folder.join("good.eds"), sensor).unwrap();
    std::fs::write(folder.join("bad.eds"), sensor.replacen("AccessType=ro", "AccessType=zz", 1)).unwrap();
    folder
}

/// Runs the command with a closed stdout, and returns its exit code.
fn unread(folder: &Path, args: &[&str]) -> Option<i32> {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let mut command = Command::new(env!("CARGO_BIN_EXE_lexican"));
    let command = command.args(args).current_dir(folder).stdin(Stdio::null()).stdout(writer).stderr(Stdio::null());
    command.status().unwrap().code()
}

#[test]
fn a_closed_pipe_keeps_the_exit_code() {
    let folder = sheets("closed-pipe");
    for (code, args) in [
        (1, &["eds", "lint", "--strict", "bad.eds"][..]),
        (1, &["eds", "lint", "--strict", "bad.eds", "--format", "short"]),
        (1, &["eds", "lint", "--strict", "bad.eds", "--json"]),
        (1, &["eds", "lint", "--strict", "bad.eds", "--format", "sarif"]),
        (2, &["eds", "lint", "missing.eds", "good.eds"]),
        (1, &["eds", "diff", "good.eds", "bad.eds"]),
        (0, &["eds", "dump", "good.eds"]),
        (1, &["eds", "fmt", "--check", "bad.eds"]),
        (0, &["gen", "siko/ag03-1"]),
        (0, &["devices"]),
        (0, &["scan", "--bus", DRIVE]),
        (1, &["read", "--bus", DRIVE, "2FFF", "6064"]),
        (1, &["write", "--bus", DRIVE, "1018:01", "1"]),
        (1, &["nmt", "--bus", DRIVE, "start", "--node", "6", "--wait", "300ms"]),
        (1, &["nmt", "--bus", DRIVE, "start", "--node", "6", "--wait", "300ms", "--json"]),
        (1, &["lss", "find", "--bus", DRIVE]),
        (0, &["check", "--bus", DRIVE]),
        (0, &["monitor", "--bus", DRIVE, "--for", "1s"]),
    ] {
        let read = lexican_in(&folder, args);
        assert_eq!((read.code, unread(&folder, args)), (Some(code), Some(code)), "{args:?}: {}", read.stderr);
    }
}

#[test]
fn no_color_is_obeyed_by_every_command() {
    let folder = sheets("no-color");
    for args in [
        &["eds", "lint", "bad.eds"][..],
        &["scan", "--bus", DRIVE],
        &["read", "--bus", DRIVE, "2FFF"],
        &["monitor", "--bus", DRIVE, "--for", "1s"],
        &["--help"],
    ] {
        let output = |without: Option<&str>| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_lexican"));
            command.args(args).current_dir(&folder).stdin(Stdio::null()).env("CLICOLOR_FORCE", "1");
            if let Some(value) = without {
                command.env("NO_COLOR", value);
            }
            let output = command.output().unwrap();
            let is_coloured = |bytes: &[u8]| bytes.contains(&0x1B);
            is_coloured(&output.stdout) || is_coloured(&output.stderr)
        };
        assert_eq!((output(None), output(Some("1"))), (true, false), "{args:?}");
    }
}

/// Runs the command with at most this many KiB of memory, and returns how it ended.
#[cfg(target_os = "linux")]
fn with_memory(kib: u32, args: &str) -> (Option<i32>, String) {
    let command = format!("ulimit -v {kib}; exec {} {args}", env!("CARGO_BIN_EXE_lexican"));
    let output = Command::new("sh").args(["-c", &command]).stdin(Stdio::null()).output().unwrap();
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[cfg(target_os = "linux")]
#[test]
fn inputs_without_end_are_not_read_to_their_end() {
    const GIB: u32 = 1024 * 1024;
    for (args, code, words) in
        [("eds lint /dev/zero", 2, "not a regular file"), ("monitor --bus log:/dev/zero", 2, "this is no log")]
    {
        let (ended, said) = with_memory(2 * GIB, args);
        assert!(ended == Some(code) && said.contains(words), "{args}: {ended:?} {said}");
    }
}

#[test]
fn a_file_beyond_the_bound_is_refused_without_being_read_whole() {
    let folder = folder("beyond");
    // A sparse file, which takes no room on the disk.
    let file = std::fs::File::create(folder.join("huge.eds")).unwrap();
    file.set_len(1 << 40).unwrap();
    let run = lexican_in(&folder, &["eds", "lint", "huge.eds"]);
    run.on_stdout(2, "more than 67108864 bytes");
    assert_eq!(lexican(&["devices"]).code, Some(0));
}
