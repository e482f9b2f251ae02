//! `lexican completions` and `lexican man`.

use std::process::{Command, Stdio};

use crate::common::{files, folder, lexican, lexican_in};

/// The candidates that bash gets for the last of these words.
fn candidates(words: &[&str]) -> Vec<String> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lexican"));
    let command = command.args(["--", "lexican"]).args(words).stdin(Stdio::null()).env_remove("LEXICAN_BUS");
    let command = command.env("LEXICAN_COMPLETE", "bash").env("_CLAP_COMPLETE_INDEX", words.len().to_string());
    let output = command.output().unwrap();
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap().lines().map(str::to_owned).collect()
}

#[test]
fn commands_devices_and_objects_are_completed() {
    assert_eq!(candidates(&["resto"]), ["restore"]);
    assert_eq!(candidates(&["read", "--device", "siko/ag03"]), ["siko/ag03-1"]);
    let of_drive = |text: &str| candidates(&["read", "--device", "siko/ag03-1", text]);
    assert_eq!(of_drive("position-a"), ["Position-Actual-Value"]);
    assert_eq!(of_drive("6064"), ["6064"]);
    assert_eq!(of_drive("2410/05"), ["2410/05"]);
    let set = of_drive("Motor-Parameter-Set/v");
    assert!(set.contains(&"Motor-Parameter-Set/v-Pos".to_owned()), "{set:?}");
    assert_eq!(candidates(&["write", "--bus", "sim:siko/ag03-1", "Spindle"]), ["Spindle-Pitch"]);
    assert!(candidates(&["read", "--device", "no/such", "Position"]).is_empty());
    // A completed name denotes the object.
    for name in ["Position-Actual-Value", "Motor-Parameter-Set/v-Pos", "2410/05"] {
        assert_eq!(lexican(&["read", "--bus", "sim:siko/ag03-1", name]).code, Some(0), "{name}");
    }
}

#[test]
fn every_shell_has_a_script() {
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        lexican(&["completions", shell]).on_stdout(0, "LEXICAN_COMPLETE");
    }
    lexican(&["completions", "sh"]).on_stderr(2, "bash, elvish, fish, powershell, zsh");
}

#[test]
fn every_command_has_a_man_page() {
    let folder = folder("man");
    assert_eq!(lexican_in(&folder, &["man", "man1"]).code, Some(0));
    let pages = files(&folder.join("man1"));
    for page in ["lexican.1", "lexican-read.1", "lexican-eds-lint.1", "lexican-restore.1"] {
        assert!(pages.iter().any(|name| name == page), "{page}: {pages:?}");
    }
    let read = std::fs::read_to_string(folder.join("man1/lexican-read.1")).unwrap();
    assert!(
        read.contains(".TH") && read.contains("Read objects of nodes by SDO") && read.contains("overlay"),
        "{read}"
    );
    std::fs::write(folder.join("file"), "").unwrap();
    lexican_in(&folder, &["man", "file"]).on_stderr(2, "cannot write file");
}
