//! `lexican read` and `lexican write`: paths, whole objects, several nodes, files, and values that the data sheet
//! forbids.

use std::path::PathBuf;
use std::process::{Command, Stdio};

use crate::common::{folder, lexican, lexican_in};

const DRIVE: &str = "sim:siko/ag03-1?node=5";
const SHEET: &str = include_str!("../sensor.eds");

/// The objects in which a device stores its own data sheet.
const OWN_DATA_SHEET: &str = "[1021]\nParameterName=Store EDS\nObjectType=0x2\nDataType=0x000F\nAccessType=ro\n\n\
    [1022]\nParameterName=Store format\nObjectType=0x7\nDataType=0x0005\nAccessType=ro\nDefaultValue=0\n\n";

#[test]
fn a_device_hands_out_its_data_sheet() {
    let folder = folder("eds-fetch");
    let listed = SHEET.replace("SupportedObjects=6\n", "SupportedObjects=8\n7=0x1021\n8=0x1022\n");
    let sheet = listed.replacen("[1018]", &(OWN_DATA_SHEET.to_owned() + "[1018]"), 1);
    std::fs::write(folder.join("sensor.eds"), &sheet).unwrap();
    let bus = "sim:sensor.eds?node=7";
    lexican_in(&folder, &["scan", "--bus", bus]).on_stdout(0, "`lexican eds fetch 7` reads it");
    let fetch = ["eds", "fetch", "7", "--bus", bus, "-o", "got.eds"];
    lexican_in(&folder, &fetch).on_stderr(0, "got.eds: Sensor, ");
    assert_eq!(std::fs::read_to_string(folder.join("got.eds")).unwrap(), sheet);
    lexican_in(&folder, &fetch).on_stderr(2, "--force");
    // A vendor-specific format, and then a device without a data sheet.
    std::fs::write(folder.join("sensor.eds"), sheet.replace("DefaultValue=0\n\n", "DefaultValue=128\n\n")).unwrap();
    lexican_in(&folder, &[&fetch[..], &["--force"]].concat()).on_stderr(1, "form 128 of the vendor");
    let none = ["eds", "fetch", "5", "--bus", "sim:siko/ag03-1?node=5", "-o", "none.eds"];
    lexican_in(&folder, &none).on_stderr(2, "node 5 has no data sheet in it");
}

/// A folder with the data sheet of a sensor that has a DOMAIN in place of its label.
fn with_domain(name: &str) -> PathBuf {
    let folder = folder(name);
    let label =
        "ParameterName=Label\nObjectType=0x7\nDataType=0x0009\nAccessType=rw\nPDOMapping=0\nDefaultValue=sensor";
    assert!(SHEET.contains(label));
    let domain = "ParameterName=Program\nObjectType=0x2\nDataType=0x000F\nAccessType=rw\nPDOMapping=0";
    std::fs::write(folder.join("sensor.eds"), SHEET.replace(label, domain)).unwrap();
    folder
}

#[test]
fn objects_are_named_by_path_and_read_as_a_whole() {
    let read = |object: &str| lexican(&["read", "--bus", DRIVE, object]);
    for path in ["2410/5", "2410/v-pos", "Motor Parameter Set/5", "Motor Parameter Set/v-Pos", "2410:05"] {
        read(path).on_stdout(0, "2410:05 Motor Parameter Set, v-Pos = ");
    }
    for whole in ["1018", "Identity Object"] {
        let run = read(whole);
        run.on_stdout(0, "1018:00 Identity Object");
        assert_eq!(run.stdout.lines().count(), 5, "{run}");
    }
    assert_eq!(read("1018:00").stdout.lines().count(), 1);
    // Of a mapping, only the entries in use.
    let mapping = lexican(&["read", "--bus", DRIVE, "--json", "1600"]);
    assert!(mapping.code == Some(0) && mapping.stdout.lines().count() == 2, "{mapping}");
    // The error history is still empty.
    assert_eq!(read("1003").stdout.lines().count(), 1);
    lexican(&["write", "--bus", DRIVE, "2410/5", "7"]).on_stdout(0, "2410:05 Motor Parameter Set, v-Pos = 7");
}

#[test]
fn several_nodes_are_read_one_after_the_other() {
    let run = lexican(&["read", "--bus", DRIVE, "--node", "0x5", "6060"]);
    run.on_stdout(0, "6060:00 Modes of Operation = profile position (1)\n");
    let run = lexican(&["read", "--bus", DRIVE, "--node", "4-6", "--timeout", "50ms", "6060"]);
    run.on_stdout(2, "node 5: 6060:00 Modes of Operation = profile position (1)\n");
    assert!(run.stderr.contains("node 4: ") && run.stderr.contains("node 6: "), "{run}");
    lexican(&["nmt", "--bus", DRIVE, "--node", "0x5", "start", "--wait", "2s"]).on_stdout(0, "node 5: OPERATIONAL\n");
    let run = lexican(&["nmt", "--bus", DRIVE, "--node", "5-6", "start", "--wait", "2s"]);
    run.on_stdout(1, "node 5: OPERATIONAL\n");
    assert!(run.stderr.contains("nothing was heard of node 6"), "{run}");
    let run = lexican(&["nmt", "--bus", DRIVE, "--node", "3,5", "stop"]);
    assert_eq!(run.stdout, "node 3: enter STOPPED\nnode 5: enter STOPPED\n");
    lexican(&["read", "--bus", DRIVE, "--node", "9-5", "6060"]).on_stderr(2, "is no range");
}

#[test]
fn the_bus_may_stand_in_the_environment() {
    let run = |bus: &str, args: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_lexican"));
        command.args(args).env("LEXICAN_BUS", bus).stdin(Stdio::null()).output().unwrap()
    };
    let output = run(DRIVE, &["read", "6060"]);
    assert!(output.status.success() && output.stdout.starts_with(b"6060:00 Modes of Operation"), "{output:?}");
    let output = run("carrier:pigeon", &["read", "--bus", DRIVE, "6060"]);
    assert!(output.status.success(), "--bus comes first: {output:?}");
    assert_eq!(run("carrier:pigeon", &["scan"]).status.code(), Some(2));
    lexican(&["read", "--help"]).on_stdout(0, "LEXICAN_BUS");
}

#[test]
fn a_domain_goes_into_a_file_and_comes_from_one() {
    let folder = with_domain("access-domain");
    let image: Vec<u8> = (0..2000_u32).map(|at| (at * 7) as u8).collect();
    std::fs::write(folder.join("image.bin"), &image).unwrap();
    const BUS: &str = "sim:sensor.eds?node=7";
    let run = lexican_in(&folder, &["write", "--bus", BUS, "2002", "@image.bin", "--json"]);
    run.on_stdout(0, "\"address\":\"2002:00\"");
    lexican_in(&folder, &["write", "--bus", BUS, "2002", "01 02 03"]).on_stdout(0, "2002:00 Program = 01 02 03");
    lexican_in(&folder, &["write", "--bus", BUS, "2002", "@missing.bin"]).on_stderr(2, "cannot read missing.bin");
    let run = lexican_in(&folder, &["read", "--bus", BUS, "1018:04", "-o", "serial.bin"]);
    assert_eq!((run.code, run.stdout.as_str()), (Some(0), ""), "{run}");
    assert_eq!(std::fs::read(folder.join("serial.bin")).unwrap(), [42, 0, 0, 0]);
    assert_eq!(lexican_in(&folder, &["read", "--bus", BUS, "1018:04", "-o", "-"]).stdout.as_bytes(), [42, 0, 0, 0]);
    lexican_in(&folder, &["read", "--bus", BUS, "1018", "-o", "x"]).on_stderr(2, "one file takes one entry");
    lexican_in(&folder, &["read", "--bus", BUS, "--node", "7,8", "1018:04", "-o", "x"]).on_stderr(2, "of one node");
    lexican_in(&folder, &["read", "--bus", BUS, "2003", "-o", "x"]).on_stderr(1, "the device aborts");
}

#[test]
fn what_the_data_sheet_forbids_is_not_sent() {
    let folder = folder("access-refused");
    std::fs::write(folder.join("sensor.eds"), SHEET).unwrap();
    // The device of this data sheet accepts all of them.
    let wide = SHEET.replace("LowLimit=1\nHighLimit=100\n", "").replace("AccessType=ro", "AccessType=rw");
    std::fs::write(folder.join("wide.eds"), wide).unwrap();
    let write = |object: &str, value: &str, more: &[&str]| {
        let args = ["write", "--bus", "sim:wide.eds?node=7", "--device", "sensor.eds", object, value];
        lexican_in(&folder, &[&args[..], more].concat())
    };
    for (object, value, reason) in [
        ("2000", "5", "2000:00 Measured Value: the data sheet says ro: the object cannot be written"),
        ("2001", "0", "2001:00 Averaged Samples: 0 is too low: the data sheet allows 1 to 100 (0064h)"),
        ("2001", "101", "101 (0065h) is too high"),
    ] {
        let run = write(object, value, &[]);
        run.on_stderr(1, reason);
        assert!(run.stderr.contains("--force") && run.stdout.is_empty(), "{run}");
        write(object, value, &["--json"]).on_stdout(1, "\"refused\":\"");
        write(object, value, &["--force"]).on_stdout(0, &format!("{object}:00 "));
    }
    // Not a value of the type at all.
    write("2001", "65536", &["--force"]).on_stderr(2, "65536 is no UNSIGNED16");
}

#[test]
fn an_overlay_adds_units_to_any_data_sheet() {
    let folder = folder("access-overlay");
    std::fs::write(folder.join("sensor.eds"), SHEET).unwrap();
    let overlay = "[overlay]\nformat = 1\n[object.\"2001\"]\nquantity = \"Span\"\n[quantity.Span]\nunits = [{ symbol = \"ms\", method = \"ms\", scale = \"1/10\" }]\n";
    std::fs::write(folder.join("units.toml"), overlay).unwrap();
    const BUS: &str = "sim:sensor.eds?node=7";
    for device in [&[][..], &["--device", "sensor.eds"]] {
        let args = ["read", "--bus", BUS, "--overlay", "units.toml", "2001"];
        lexican_in(&folder, &[&args[..], device].concat()).on_stdout(0, "2001:00 Averaged Samples = 0.5 ms\n");
    }
    lexican_in(&folder, &["check", "--bus", BUS, "--overlay", "units.toml"]).on_stdout(0, "as the data sheet says");
    lexican_in(&folder, &["check", "--bus", BUS, "--overlay", "missing.toml"]).on_stderr(2, "missing.toml");
    let none = ["read", "--bus", BUS, "--device", "none", "--overlay", "units.toml", "2001"];
    lexican_in(&folder, &none).on_stderr(2, "an overlay adds to a data sheet");
    let log = "(0.000000) can0 587#4F01200005000000\n(0.100000) can0 607#2B01200005000000\n";
    std::fs::write(folder.join("bus.log"), log).unwrap();
    let monitor = ["monitor", "--bus", "log:bus.log", "--overlay", "7=units.toml"];
    lexican_in(&folder, &[&monitor[..], &["--device", "0x7=sensor.eds"]].concat()).on_stdout(0, "= 0.5 ms");
    lexican_in(&folder, &monitor).on_stderr(2, "that of node 7 is unknown");
    let boot = ["boot", "--bus", BUS, "--overlay", "7=units.toml", "--node"];
    lexican_in(&folder, &[&boot[..], &["7=sensor.eds"]].concat()).on_stdout(0, "node 7: has booted");
    lexican_in(&folder, &[&boot[..], &["7"]].concat()).on_stderr(2, "node-7 has no data sheet, which this is about");
}

#[test]
fn a_read_is_bounded_by_max_and_by_the_type() {
    let folder = folder("read-max");
    // The data sheet declares a number where the device has a text of a hundred bytes.
    let text = SHEET.replace("DefaultValue=sensor", &format!("DefaultValue={}", "x".repeat(100)));
    let label = "ParameterName=Label\nObjectType=0x7\nDataType=0x0009";
    let number =
        SHEET.replace(label, &label.replace("0x0009", "0x0007")).replace("DefaultValue=sensor", "DefaultValue=0");
    std::fs::write(folder.join("text.eds"), text).unwrap();
    std::fs::write(folder.join("number.eds"), number).unwrap();
    let bus = ["read", "--bus", "sim:text.eds?node=5", "Label"];
    lexican_in(&folder, &bus).on_stdout(0, "xxx");
    let bounded = |max, more: &[&str]| lexican_in(&folder, &[&bus[..], &["--max", max], more].concat());
    for more in [&[][..], &["-o", "label.bin"]] {
        let run = bounded("50", more);
        run.on_stderr(2, "2002:00: the device sends more than 50 bytes");
        run.on_stderr(2, "--max takes more, such as --max 800");
        assert!(!folder.join("label.bin").exists());
        assert_eq!(bounded("800", more).code, Some(0));
    }
    let run = lexican_in(&folder, &[&bus[..], &["--device", "number.eds"]].concat());
    run.on_stderr(2, "the device sends more than 64 bytes");
    run.on_stderr(2, "by its data type it has fewer");
}
