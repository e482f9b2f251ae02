//! Typed machines: mistakes in the file fail the build.

use std::path::PathBuf;
use std::{env, fs};

use lexican_machine::{Config, generate};

/// A folder with a machine in it.
fn folder(name: &str, machine: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("generate").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("machine.toml"), machine).unwrap();
    folder
}

const AXIS: &str = "sheet = \"kollmorgen/akd\"\nheartbeat = \"100 ms\"\n";
const BUS: &str = "[bus]\nmanager = 127\nheartbeat = \"200 ms\"\n";

/// Checks the build error for a machine with two axes; nothing is generated then.
#[track_caller]
fn fails(name: &str, further: &str, words: &[&str]) {
    let folder = folder(name, &format!("{BUS}[node.feeder]\nid = 5\n{AXIS}[node.cutter]\nid = 6\n{AXIS}{further}"));
    let error = generate(folder.join("machine.toml"), Config::new().out_dir(&folder)).unwrap_err();
    let said = format!("{error:?}");
    words.iter().for_each(|words| assert!(said.contains(words), "{words}: {said}"));
    assert!(!folder.join("machine.rs").exists());
}

#[test]
fn a_wire_that_does_not_fit_fails_the_build() {
    let words = ["1 error", "feeder sends 32 bits (6064:00), cutter takes 16 (6040:00)", "machine.toml:13:1"];
    fails("wire", "[wire]\n\"feeder.position actual value\" = \"cutter.controlword\"\n", &words);
}

#[test]
fn a_name_that_is_not_there_fails_the_build() {
    let words = ["there is no node \"fedder\"", "did you mean `feeder`", "\"fedder.statusword\" = \"manager\""];
    fails("name", "[wire]\n\"fedder.statusword\" = \"manager\"\n", &words);
}

#[test]
fn a_setting_of_a_read_only_object_fails_the_build() {
    let words =
        ["machine.toml:12:21", "the data sheet says ro: the object cannot be written", "settings = { 6041 = 1 }"];
    fails("read_only", "settings = { 6041 = 1 }\n", &words);
}

#[test]
fn the_code_depends_on_the_file_alone() {
    let machine = format!(
        "{BUS}[node.feeder]\nid = 5\n{AXIS}[node.\"type\"]\nid = 6\noptional = true\n[node.sheets]\nid = 7\noptional = true\n\
         [node.late]\nid = \"none\"\n"
    );
    let code = |name| {
        let folder = folder(name, &machine);
        generate(folder.join("machine.toml"), Config::new().out_dir(&folder)).unwrap();
        fs::read_to_string(folder.join("machine.rs")).unwrap()
    };
    let one = code("one");
    assert_eq!(one, code("other"));
    // Keywords, names already in use, and a node without a node-ID.
    assert!(one.contains("fn type_(&mut self)") && one.contains("fn sheets_x(&mut self)") && !one.contains("of_late"));
}
