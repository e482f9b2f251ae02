//! The backup of a machine in one file.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::common::{folder, lexican_in};

const MACHINE: &str = "\
[machine]
name = \"press 7\"

[node.feeder]
id = 5
sheet = \"siko/ag03-1\"

[node.cutter]
id = 6
sheet = \"siko/ag02\"
";

/// The output of `tar`.
fn tar(folder: &Path, args: &[&str]) -> String {
    let output = Command::new("tar").args(args).current_dir(folder).output().expect("there is tar");
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn a_machine_is_saved_in_one_file_that_other_tools_read() {
    let folder = folder("archive");
    fs::write(folder.join("machine.toml"), MACHINE).unwrap();
    let run = |args: &[&str]| lexican_in(&folder, args);
    run(&["backup", "--bus", "sim", "-o", "a.tar"]).on_stdout(0, "cutter (node 6): ");
    assert_eq!(tar(&folder, &["-tf", "a.tar"]), "backup.json\ncutter.dcf\nfeeder.dcf\n");
    let manifest: serde_json::Value = serde_json::from_str(&tar(&folder, &["-xOf", "a.tar", "backup.json"])).unwrap();
    assert_eq!((&manifest["machine"], &manifest["nodes"][0]["identity"][0]), (&"press 7".into(), &0x195.into()));
    assert_eq!(manifest["nodes"][0]["left_out"]["6040:00"], "command");
    // Its file for a node is the same as the backup of that node alone.
    tar(&folder, &["-xf", "a.tar", "feeder.dcf"]);
    run(&["backup", "feeder", "--bus", "sim", "-o", "alone.dcf"]).on_stdout(0, "parameters in alone.dcf");
    assert_eq!(
        fs::read_to_string(folder.join("feeder.dcf")).unwrap(),
        fs::read_to_string(folder.join("alone.dcf")).unwrap()
    );
    run(&["compare", "--bus", "sim", "a.tar", "machine"]).on_stdout(0, ", the same\n");

    let other = MACHINE.to_owned() + "[simulate.cutter]\nsettings = { 2412 = \"2.5 mm\" }\n";
    fs::write(folder.join("machine.toml"), other).unwrap();
    run(&["backup", "--bus", "sim", "-o", "b.tar"]).on_stdout(0, "2 nodes in b.tar");
    run(&["backup", "--bus", "sim", "-o", "b.tar"]).on_stderr(2, "--force replaces it");
    let differs = run(&["compare", "a.tar", "b.tar"]);
    differs.on_stdout(1, "cutter: 2412:00 ");
    assert!(differs.stdout.ends_with("1 differ\n"), "{differs}");
    run(&["compare", "a.tar", "b.tar", "--json"]).on_stdout(1, "\"name\":\"cutter\"");
    run(&["compare", "a.tar", "siko/ag02"]).on_stderr(2, "`tar -xf` takes it out");

    // By default, the file is named by its date.
    run(&["backup", "--bus", "sim"]).on_stdout(0, "2 nodes in press-7_20");
}

#[test]
fn what_is_missing_in_a_backup_is_said() {
    let folder = folder("archive-missing");
    let run = |args: &[&str]| lexican_in(&folder, args);
    let off = MACHINE.to_owned() + "[simulate.cutter]\npower = \"off\"\n";
    fs::write(folder.join("machine.toml"), &off).unwrap();
    let backup = ["backup", "--bus", "sim", "-o", "a.tar", "--timeout", "50ms"];
    run(&backup).on_stderr(2, "cutter is missing: node 6");
    run(&["compare", "--bus", "sim", "a.tar", "machine", "--timeout", "50ms"])
        .on_stdout(1, "cutter: not in machine: node 6");
    let optional = off.replace("id = 6", "id = 6\noptional = true");
    fs::write(folder.join("machine.toml"), optional).unwrap();
    run(&[&backup[..], &["--force"]].concat()).on_stdout(1, "1 node in a.tar");
    fs::write(
        folder.join("machine.toml"),
        off.replace("[node.feeder]", "[simulate.feeder]\npower = \"off\"\n[node.feeder]"),
    )
    .unwrap();
    run(&["backup", "--bus", "sim", "-o", "b.tar", "--timeout", "50ms"]).on_stderr(2, "can be read: node ");
}

#[test]
fn a_damaged_backup_is_refused() {
    let folder = folder("archive-damaged");
    fs::write(folder.join("machine.toml"), MACHINE).unwrap();
    let run = |args: &[&str]| lexican_in(&folder, args);
    run(&["backup", "--bus", "sim", "-o", "a.tar"]).on_stdout(0, "2 nodes");
    let whole = fs::read(folder.join("a.tar")).unwrap();
    let place = whole.windows(15).position(|bytes| bytes == b"ParameterValue=").unwrap();
    let mut changed = whole.clone();
    changed[place] = b'p';
    for (bytes, words) in [
        (&changed[..], "its cutter.dcf is not what was saved"),
        (&whole[..whole.len() / 2], "it is no backup of a machine"),
        (b"", "it has no backup.json"),
    ] {
        fs::write(folder.join("b.tar"), bytes).unwrap();
        run(&["compare", "a.tar", "b.tar"]).on_stderr(2, words);
    }
}
