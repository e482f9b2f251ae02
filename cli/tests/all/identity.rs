//! A data sheet that is named for a node must match the identity of its device (1018h).

use std::path::PathBuf;

use crate::common::{files, folder, lexican_in};

/// A folder with a machine of a drive, a sensor of another vendor, and a drive of the same vendor.
fn machine(name: &str) -> PathBuf {
    let folder = folder(name);
    let sensor = include_str!("../sensor.eds").replace("VendorNumber=0\n", "VendorNumber=0x16F\n");
    let (before, vendor) = sensor.split_once("[1018sub1]").unwrap();
    let sensor = before.to_owned() + "[1018sub1]" + &vendor.replacen("DefaultValue=0\n", "DefaultValue=0x16F\n", 1);
    std::fs::write(folder.join("sensor.eds"), sensor).unwrap();
    std::fs::write(folder.join("nameless.eds"), include_str!("../sensor.eds")).unwrap();
    let node = |(id, sheet)| format!("[node.a{id}]\nid = {id}\nsheet = '{sheet}'\n");
    let machine = [(5, "siko/ag03-1"), (6, "siko/ag02"), (7, "sensor.eds")].map(node).concat();
    std::fs::write(folder.join("machine.toml"), machine).unwrap();
    folder
}

const BUS: [&str; 2] = ["--bus", "sim:machine.toml"];
const OTHER: &str =
    "node 7 is not the device of siko/ag03-1: it is another device: its vendor is 16Fh, by the data sheet 195h";

#[test]
fn a_node_is_not_backed_up_by_the_data_sheet_of_another_device() {
    let folder = machine("identity-backup");
    let backup = |args: &[&str]| lexican_in(&folder, &[&["backup"], &BUS[..], args].concat());
    let run = backup(&["5,6,7", "--device", "siko/ag03-1", "-o", "{node}.dcf"]);
    run.on_stderr(2, OTHER);
    assert!(run.stderr.contains("node 6 is not the device of siko/ag03-1: it is another device: its product"), "{run}");
    assert!(run.stderr.contains("--device 7=FILE") && !run.stderr.contains("the device aborts"), "{run}");
    let of_one: Vec<_> = files(&folder).into_iter().filter(|name| name.ends_with(".dcf")).collect();
    assert_eq!(of_one, ["5.dcf"]);
    // Each node gets its own data sheet.
    let own = ["5,7", "--device", "5=siko/ag03-1", "--device", "7=sensor.eds", "-o", "own-{node}.dcf"];
    let run = backup(&own);
    assert_eq!((run.code, run.stdout.lines().count()), (Some(0), 2), "{run}");
    // A data sheet without vendor-ID matches any device.
    assert_eq!(backup(&["7", "--device", "nameless.eds", "-o", "nameless.dcf"]).code, Some(0));
    backup(&["7", "--device", "5=siko/ag03-1", "-o", "a.dcf"]).on_stderr(2, "node 5 has a data sheet, but is none of");
    let twice = ["5", "--device", "siko/ag03-1", "--device", "sensor.eds", "-o", "a.dcf"];
    backup(&twice).on_stderr(2, "--device 5=FILE");
}

#[test]
fn every_command_looks_at_the_identity() {
    let folder = machine("identity-commands");
    let sheet = ["--device", "siko/ag03-1"];
    let set = "[node.sensor]\nid = 7\nsheet = \"siko/ag03-1\"\nsettings = { 1017 = \"100 ms\" }\n";
    std::fs::write(folder.join("set.toml"), set).unwrap();
    let commands: [&[&str]; 7] = [
        &["read", "--node", "7", "1017"],
        &["write", "--node", "7", "1017", "100"],
        &["pdo", "show", "7"],
        &["watch", "--node", "7", "1017", "--for", "100ms"],
        &["compare", "node:7", "siko/ag03-1"],
        &["apply", "7", "--machine", "set.toml"],
        &["compare", "node:7", "sensor.eds"],
    ];
    for args in commands {
        let run = lexican_in(&folder, &[args, &BUS[..], &sheet].concat());
        run.on_stderr(2, OTHER);
        assert!(run.stdout.is_empty(), "{run}");
    }
    // A vendor may have one data sheet for several products.
    let read = lexican_in(&folder, &["read", "--bus", BUS[1], "--device", "siko/ag03-1", "--node", "6", "6041"]);
    read.on_stderr(0, "node 6 may not be the device of siko/ag03-1");
    let none = lexican_in(&folder, &["read", "--bus", BUS[1], "--device", "7=none", "--node", "7", "1017"]);
    assert_eq!(none.code, Some(0), "{none}");
    // `check` reports the mismatch.
    let check = lexican_in(&folder, &["check", "--bus", BUS[1], "--device", "siko/ag03-1", "7"]);
    check.on_stdout(1, "another vendor: 16Fh, by the data sheet 195h");
}
