//! `lexican check`: devices and data sheets that differ in one place.

#[cfg(unix)]
use crate::common::{Run, folder, lexican_in};
#[cfg(unix)]
use crate::simulation::Simulation;
use serde_json::{Value, json};

const SHEET: &str = include_str!("../sensor.eds");

/// Checks a device made of the sensor's data sheet against the same data sheet with some text replaced.
fn check(name: &str, wrong: &[(&str, &str)], args: &[&str]) -> Run {
    let folder = folder(name);
    let sheet = wrong.iter().fold(SHEET.to_owned(), |sheet, (right, wrong)| {
        assert!(sheet.contains(right), "{right}");
        sheet.replacen(right, wrong, 1)
    });
    std::fs::write(folder.join("sensor.eds"), SHEET).unwrap();
    std::fs::write(folder.join("wrong.eds"), sheet).unwrap();
    let device = ["check", "--bus", "sim:sensor.eds?node=7", "--device", "wrong.eds"];
    lexican_in(&folder, &[&device[..], args].concat())
}

#[track_caller]
fn finds(name: &str, wrong: &[(&str, &str)], args: &[&str], words: &str) {
    let run = check(name, wrong, args);
    run.on_stdout(1, words);
    assert!(run.stdout.contains("not as the data sheet says"), "{run}");
}

const MEASURED: &str = "ParameterName=Measured Value\nObjectType=0x7\nDataType=0x0003\nAccessType=ro";

#[test]
fn a_device_like_its_data_sheet_has_no_findings() {
    for (name, args) in [("check-same", &[][..]), ("check-same-write", &["--write", "--domains"])] {
        let run = check(name, &[], args);
        assert_eq!(run.code, Some(0), "{run}");
        assert_eq!(run.stdout, "node 7: 22 entries, as the data sheet says\n");
    }
}

#[test]
fn differences_are_printed() {
    let limit = [("LowLimit=1\n", "LowLimit=6\n"), ("DefaultValue=5\n", "DefaultValue=6\n")];
    finds("check-limit", &limit, &[], "limit      2001:00 Averaged Samples: 5 is not within 6 to 100\n");
    let vendor = "[1018sub1]\nParameterName=Vendor-ID\nObjectType=0x7\nDataType=0x0007\nAccessType=ro\nPDOMapping=0\n";
    let sheet = (&*format!("{vendor}DefaultValue=0\n"), vendor);
    finds(
        "check-identity",
        &[("VendorNumber=0", "VendorNumber=0x195"), sheet],
        &[],
        "identity   1018:01 Identity, Vendor-ID: another vendor: 0h, by the data sheet 195h\n",
    );
    let more = "[2003]\n";
    let object = "[2004]\nParameterName=More\nObjectType=0x7\nDataType=0x0005\nAccessType=ro\nPDOMapping=0\n\n[2003]\n";
    let list = ("SupportedObjects=4\n", "SupportedObjects=5\n5=0x2004\n");
    finds("check-missing", &[(more, object), list], &[], "missing    2004:00 More: the device has no such entry");
}

#[test]
fn writing_is_tried_only_on_request() {
    let wrong = [(MEASURED, &*MEASURED.replace("AccessType=ro", "AccessType=rw"))];
    let run = check("check-no-write", &wrong, &[]);
    assert_eq!(run.code, Some(0), "{run}");
    finds("check-write", &wrong, &["--write"], "access     2000:00 Measured Value: the data sheet says rw, but");
}

#[test]
fn variable_values_are_no_difference() {
    let wrong = [("DefaultValue=5\n", "DefaultValue=6\n")];
    let run = check("check-defaults", &wrong, &[]);
    run.on_stdout(0, "default    2001:00 Averaged Samples: it is 5, by the data sheet 6");
    assert!(run.stdout.contains("22 entries, as the data sheet says; 1 not at the default"), "{run}");
}

#[test]
fn findings_are_fields_for_programs() {
    let wrong = [("LowLimit=1\n", "LowLimit=6\n"), ("DefaultValue=5\n", "DefaultValue=6\n")];
    let run = check("check-json", &wrong, &["--json"]);
    let lines: Vec<Value> = run.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), 3);
    assert_eq!((&lines[1]["kind"], &lines[1]["difference"]), (&json!("default"), &json!(false)));
    for (key, value) in [
        ("event", json!("finding")),
        ("kind", json!("limit")),
        ("difference", json!(true)),
        ("address", json!("2001:00")),
        ("value", json!(5)),
        ("node", json!(7)),
    ] {
        assert_eq!(lines[0][key], value, "{key}");
    }
    assert_eq!(
        (&lines[2]["event"], &lines[2]["entries"], &lines[2]["differ"]),
        (&json!("summary"), &json!(22), &json!(1))
    );
}

#[test]
fn a_missing_node_is_reported_as_silent() {
    let folder = folder("check-silent");
    std::fs::write(folder.join("sensor.eds"), SHEET).unwrap();
    let args = ["check", "--bus", "sim:sensor.eds?node=7", "8", "--device", "sensor.eds"];
    let run = lexican_in(&folder, &args);
    run.on_stderr(2, "no answer");
    run.on_stderr(2, "lexican scan");
    lexican_in(&folder, &["check", "--bus", "sim:sensor.eds?node=7", "--device", "none"]).on_stderr(2, "--device FILE");
}

#[test]
fn a_contradiction_of_the_data_sheet_is_no_difference() {
    let wrong = [("LowLimit=1\n", "LowLimit=6\n"), ("VendorNumber=0", "VendorNumber=0x195")];
    let run = check("check-sheet", &wrong, &[]);
    assert_eq!(run.code, Some(0), "{run}");
    let lines = [
        "sheet      1018:01 Identity, Vendor-ID: another vendor: 0h, by the data sheet 195h; the data sheet itself has this value",
        "sheet      2001:00 Averaged Samples: 5 is not within 6 to 100; the data sheet itself has this value",
        "node 7: 22 entries, as the data sheet says; 2 by which the data sheet contradicts itself",
    ];
    assert_eq!(run.stdout.lines().collect::<Vec<_>>(), lines);
}

/// CiA 301, 7.5.2.36: off, clear the mapping, mapping, count, on. Devices refuse any other order.
#[test]
#[cfg(unix)]
fn a_pdo_is_written_back_in_the_order_in_which_it_can_be_changed() {
    let folder = folder("check-pdo-order");
    std::fs::write(folder.join("sensor.eds"), SHEET).unwrap();
    let mut sensor = Simulation::begin(&folder, &["sensor.eds", "--node", "7"]);
    let sheet = folder.join("sensor.eds").display().to_string();
    sensor.run("check", &["7", "--device", &sheet, "--write"]).on_stdout(0, "as the data sheet says");
    let mut next = || loop {
        let written = sensor.until("written");
        let address = written["address"].as_str().unwrap().to_owned();
        if ["1800:01", "1A00:00", "1A00:01"].contains(&&*address) {
            break (address, written["value"].as_u64().unwrap());
        }
    };
    let (first, cob_id) = next();
    assert!(first == "1800:01" && cob_id & 0x8000_0000 != 0, "{first} {cob_id:X}");
    let [cleared, mapped, counted, on] = [(); 4].map(|()| next());
    assert_eq!((cleared, &*mapped.0), (("1A00:00".to_owned(), 0), "1A00:01"));
    assert_eq!((&*counted.0, counted.1 > 0, on), ("1A00:00", true, ("1800:01".to_owned(), cob_id & 0x7FFF_FFFF)));
}
