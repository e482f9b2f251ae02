//! The interface for build scripts: files are written whole or not at all, and errors are complete.

use std::fs;
use std::path::{Path, PathBuf};

use lexican_codegen::{Config, Error};

const SHEET: &str = "\
[FileInfo]
FileName=drive.eds

[DeviceInfo]
VendorName=Example Works
BaudRate_1000=1

[MandatoryObjects]
SupportedObjects=1
1=0x1000

[1000]
ParameterName=Device type
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=402
PDOMapping=0
";

/// An empty folder of a test's own.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn write(folder: &Path, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, content).unwrap();
    path
}

/// The names of all files.
fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Generating fails, writes nothing, and says all of `words`.
#[track_caller]
fn check_refused(out: &Path, config: Config, words: &[&str]) {
    let error = config.out_dir(out).generate().unwrap_err();
    let said = format!("{error:?}");
    for words in words {
        assert!(said.contains(words), "{words:?} is not in: {said}");
    }
    assert!(!error.to_string().contains('\n'), "{error}");
    assert!(!files(out).iter().any(|name| name.contains(".rs")), "{:?}", files(out));
}

#[test]
fn the_file_is_named_after_the_data_sheet() {
    let out = folder("named");
    let sheet = write(&out, "Drive-2 (new).EDS", SHEET);
    Config::new().eds(&sheet).out_dir(&out).generate().unwrap();
    Config::new().eds(&sheet).module("other").out_dir(&out).generate().unwrap();
    let report = ["drive_2_new.findings.txt", "other.findings.txt"];
    assert_eq!(files(&out), ["Drive-2 (new).EDS", report[0], "drive_2_new.rs", report[1], "other.rs"]);
    let report = fs::read_to_string(out.join(report[0])).unwrap();
    assert!(report.contains("warning[cia301::missing-object]") && report.contains("[MandatoryObjects]"), "{report}");
}

#[test]
fn a_driver_of_what_is_no_drive_is_refused() {
    let out = folder("driver");
    let sheet = write(&out, "drive.eds", SHEET);
    check_refused(&out, Config::new().eds(&sheet).driver(true), &["drive.eds: 5 errors", "drive::no-object", "6040h"]);
    Config::new().eds(&sheet).driver(false).out_dir(&out).generate().unwrap();
}

#[test]
fn a_device_of_the_library_is_named_after_its_folder() {
    let out = folder("library");
    for shipped in lexican_eds::library::all() {
        Config::new().device(shipped.id).storage(true).names(true).out_dir(&out).generate().unwrap();
        let file = shipped.id.replace(['/', '-'], "_") + ".rs";
        assert!(fs::read_to_string(out.join(file)).unwrap().contains("pub const DEVICE_TYPE"));
    }
}

#[test]
fn a_file_is_not_written_again_when_nothing_changed() {
    let out = folder("unchanged");
    let sheet = write(&out, "drive.eds", SHEET);
    let generate = |sheet: &Path| {
        Config::new().eds(sheet).out_dir(&out).generate().unwrap();
        fs::metadata(out.join("drive.rs")).unwrap().modified().unwrap()
    };
    let first = generate(&sheet);
    assert_eq!(generate(&sheet), first);
    let old = fs::read_to_string(out.join("drive.rs")).unwrap();
    write(&out, "drive.eds", SHEET.replace("Device type", "Type of the device"));
    generate(&sheet);
    assert_ne!(fs::read_to_string(out.join("drive.rs")).unwrap(), old);
    assert_eq!(files(&out), ["drive.eds", "drive.findings.txt", "drive.rs"]);
}

#[test]
fn what_is_no_data_sheet_is_refused() {
    let out = folder("refused");
    let config = |content: &[u8]| Config::new().eds(write(&out, "drive.eds", content));
    check_refused(&out, config(b""), &["drive.eds", "is empty"]);
    check_refused(&out, config(b" \r\n\n"), &["drive.eds", "is empty"]);
    check_refused(&out, config(&[0x7F, b'E', b'L', b'F', 2, 1, 0, 0]), &["drive.eds", "is a binary file"]);
    check_refused(&out, Config::new().eds(out.join("missing.eds")), &["cannot read", "missing.eds"]);
    check_refused(&out, Config::new().eds(&out), &["cannot read"]);
    check_refused(&out, config(b"just some words\nand more\n"), &["drive.eds", "no object"]);
}

#[test]
fn errors_of_the_data_sheet_are_shown_with_their_lines() {
    let out = folder("errors");
    let sheet = write(&out, "drive.eds", SHEET);
    let overlay = write(&out, "drive.toml", "[overlay]\nformat = 1\n[object.\"2000\"]\nquantity = \"Speed\"\n");
    let config = Config::new().eds(&sheet).overlay(&overlay);
    check_refused(&out, config, &["nothing was generated", "drive.toml:3", "[object.\"2000\"]", "error["]);
    // A finding that does not matter by itself may be made to.
    let config = Config::new().eds(&sheet).deny("cia301::missing-object");
    check_refused(&out, config, &["1001", "error[cia301::missing-object]"]);
    Config::new().eds(&sheet).allow("cia301::missing-object").out_dir(&out).generate().unwrap();
}

#[test]
fn nothing_is_written_when_one_of_several_is_refused() {
    let out = folder("several");
    let good = write(&out, "good.eds", SHEET);
    let bad = write(&out, "bad.eds", "");
    check_refused(&out, Config::new().eds(&good).eds(bad), &["bad.eds"]);
    check_refused(&out, Config::new().eds(&good).eds(write(&out, "GOOD.dcf", SHEET)), &["`good.rs`", ".module("]);
}

#[test]
fn a_wrong_configuration_says_what_to_call() {
    let out = folder("configuration");
    let sheet = write(&out, "drive.eds", SHEET);
    check_refused(&out, Config::new(), &[".eds("]);
    check_refused(&out, Config::new().overlay("x.toml").eds(&sheet), &["x.toml", "before the data sheet"]);
    check_refused(&out, Config::new().module("valve").eds(&sheet), &["`valve`", "before the data sheet"]);
    let mistyped = Config::new().eds(&sheet).deny("cia301::mising-object");
    check_refused(&out, mistyped, &["no finding `cia301::mising-object`", "did you mean `cia301::missing-object`"]);
    check_refused(&out, Config::new().eds(&sheet).allow("no such thing"), &["no finding `no such thing`"]);
    check_refused(&out, Config::new().eds(&sheet).runtime_path("not a path"), &["`not a path`"]);
    check_refused(&out, Config::new().eds(&sheet).overlay(out.join("no.toml")), &["cannot read", "no.toml"]);
}

#[test]
fn an_unknown_device_is_answered_with_names_like_it() {
    let out = folder("unknown");
    let known = lexican_eds::library::all().first().expect("the library has devices").id;
    let almost = known[..known.len() - 1].to_owned();
    check_refused(&out, Config::new().device(&almost), &[&almost, "did you mean", known]);
    let error = Config::new().device("something/entirely different").out_dir(&out).generate().unwrap_err();
    assert!(matches!(&error, Error::UnknownDevice { near, .. } if near.is_empty()), "{error:?}");
}

#[test]
fn a_folder_that_cannot_be_written_to_is_an_error() {
    let out = folder("unwritable");
    let sheet = write(&out, "drive.eds", SHEET);
    let error = Config::new().eds(sheet).out_dir(out.join("no/such/folder")).generate().unwrap_err();
    assert!(format!("{error:?}").contains("cannot write"), "{error:?}");
}
