//! Existing files are replaced only with `--force`, and files that are being read never.
#![cfg(unix)]

use crate::common::{files, folder, lexican_in};

const LOG: &str = "(1000000000.000000) can0 185#0102\n(1000000000.100000) can0 705#05\n";
const DRIVE: &str = "sim:siko/ag03-1?node=5";

#[test]
fn no_command_replaces_a_file_unless_it_is_told_to() {
    let folder = folder("files-guarded");
    std::fs::write(folder.join("in.log"), LOG).unwrap();
    let plot = ["plot", "--bus", DRIVE, "--for", "300ms", "6064"];
    // The name of the file, the option before it, and the command.
    let commands: [(&str, &[&str], &[&str]); 10] = [
        ("kept.dcf", &["-o"], &["backup", "--bus", DRIVE]),
        ("bus.log", &["-o"], &["record", "--bus", "log:in.log", "--to", "candump"]),
        ("bus.asc", &[], &["convert", "in.log", "--to", "asc"]),
        ("drive.rs", &["-o"], &["gen", "siko/ag03-1"]),
        ("drive.dbc", &["-o"], &["eds", "to-dbc", "siko/ag03-1", "--node", "5"]),
        ("drive.lua", &["-o"], &["eds", "to-wireshark", "siko/ag03-1", "--node", "5"]),
        ("name.bin", &["-o"], &["read", "--bus", DRIVE, "1008:00"]),
        ("curve.svg", &["--svg"], &plot),
        ("curve.csv", &["--csv"], &plot),
        ("new.eds", &[], &["eds", "new", "--vendor", "405", "--product", "7"]),
    ];
    for (name, option, args) in commands {
        let run = |more: &[&str], name| lexican_in(&folder, &[args, more, option, &[name]].concat());
        let path = folder.join(name);
        let first = run(&[], name);
        assert!(first.code == Some(0) && path.exists(), "{first}");
        std::fs::write(&path, "what somebody has kept").unwrap();
        let again = run(&[], name);
        again.on_stderr(2, &format!("cannot write {name}: it is there already"));
        assert!(again.stderr.contains("--force replaces it"), "{again}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "what somebody has kept");
        let forced = run(&["--force"], name);
        assert!(forced.code == Some(0) && std::fs::read(&path).unwrap() != b"what somebody has kept", "{forced}");
        // For `eds new`, the name gets an extension.
        if args[0] != "eds" || args[1] != "new" {
            (0..2).for_each(|_| assert_eq!(run(&[], "/dev/null").code, Some(0), "{name}"));
        }
    }
    let left = files(&folder);
    assert!(left.iter().all(|name| !name.ends_with("new")), "{left:?}");
}

#[test]
fn what_is_read_is_never_written() {
    let folder = folder("files-read");
    std::fs::write(folder.join("bus.log"), LOG).unwrap();
    std::fs::hard_link(folder.join("bus.log"), folder.join("other.log")).unwrap();
    let drive = lexican_eds::library::find("siko/ag03-1").unwrap().input();
    std::fs::write(folder.join("drive.eds"), drive.eds.text()).unwrap();
    let before = std::fs::read(folder.join("drive.eds")).unwrap();
    let commands: [&[&str]; 8] = [
        &["record", "--bus", "log:bus.log", "-o", "bus.log"],
        &["record", "--bus", "log:bus.log", "-o", "other.log"],
        &["convert", "bus.log", "bus.log"],
        &["convert", "bus.log", "other.log"],
        &["gen", "drive.eds", "-o", "./drive.eds"],
        &["eds", "to-dbc", "drive.eds", "--node", "5", "-o", "drive.eds"],
        &["backup", "--bus", DRIVE, "--device", "drive.eds", "-o", "drive.eds"],
        &["plot", "--bus", "log:bus.log", "--node", "5", "--device", "siko/ag03-1", "tpdo1", "--csv", "bus.log"],
    ];
    for args in commands {
        let run = lexican_in(&folder, &[args, &["--force"]].concat());
        run.on_stderr(2, "it is read at the same time");
        assert_eq!(std::fs::read_to_string(folder.join("bus.log")).unwrap(), LOG);
        assert_eq!(std::fs::read(folder.join("drive.eds")).unwrap(), before);
    }
}

#[test]
fn a_conversion_is_whole_or_not_there() {
    let folder = folder("files-whole");
    std::fs::write(folder.join("cut.log"), LOG.repeat(20_000) + "(1000000000.000000) can0 18X#\n").unwrap();
    let convert = ["convert", "cut.log", "out.log"];
    lexican_in(&folder, &convert).on_stderr(2, "cut.log");
    assert_eq!(files(&folder), ["cut.log"]);
    std::fs::write(folder.join("out.log"), LOG).unwrap();
    lexican_in(&folder, &[&convert[..], &["--force"]].concat()).on_stderr(2, "cut.log");
    assert_eq!(std::fs::read_to_string(folder.join("out.log")).unwrap(), LOG);
    assert_eq!(files(&folder), ["cut.log", "out.log"]);
}
