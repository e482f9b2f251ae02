//! `lexican conform`: a device that passes, one that fails, and cases that are not allowed.

use crate::common::{Run, folder, lexican, lexican_in};
use serde_json::Value;

const SHEET: &str = include_str!("../sensor.eds");

/// Tests a device made of the sensor's data sheet against the same data sheet with some text replaced.
fn conform(name: &str, wrong: Option<(&str, &str)>, args: &[&str]) -> (std::path::PathBuf, Run) {
    let folder = folder(name);
    let (right, other) = wrong.unwrap_or_default();
    assert!(SHEET.contains(right));
    std::fs::write(folder.join("sensor.eds"), SHEET).unwrap();
    std::fs::write(folder.join("tested.eds"), SHEET.replacen(right, other, 1)).unwrap();
    let device = ["conform", "--bus", "sim:sensor.eds?node=7", "--device", "tested.eds"];
    let run = lexican_in(&folder, &[&device[..], args].concat());
    (folder, run)
}

#[test]
fn a_device_like_its_data_sheet_passes() {
    let (_, run) = conform("conform-passes", None, &["--only", "2,4,10", "--allow", "all"]);
    run.on_stdout(0, " passed");
    let last = run.stdout.lines().last().unwrap();
    assert!(last.starts_with("43 cases: ") && !last.contains("failed"), "{run}");
}

#[test]
fn a_failure_has_its_clause_its_frames_in_words_and_all_reports() {
    let wrong = ("DefaultValue=5\n", "DefaultValue=6\n");
    let reports = ["--only", "4.2", "--report", "r.json", "--report", "r.xml", "--report", "r.html"];
    let (_, run) = conform("conform-fails-json", Some(wrong), &["--only", "4.2", "--json"]);
    let lines: Vec<Value> = run.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let [case, sum] = &lines[..] else { panic!("{run}") };
    assert_eq!((&case["event"], &case["verdict"]), (&"case".into(), &"failed".into()), "{case}");
    assert_eq!((&sum["event"], &sum["failed"], run.code), (&"summary".into(), &1.into(), Some(1)), "{sum}");
    let (folder, run) = conform("conform-fails", Some(wrong), &reports);
    run.on_stdout(1, "failed 306-1/6.5.2/2 values are the defaults: 2001:00 is 5, by default 6");
    run.on_stdout(1, "2001:00 Averaged Samples = 5");
    run.on_stdout(1, "1 case: 1 failed");
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let json: Value = serde_json::from_str(&read("r.json")).unwrap();
    assert_eq!((&json["failed"], &json["cases"][0]["verdict"]), (&1.into(), &"failed".into()), "{json}");
    assert!(json["cases"][0]["frames"].as_array().unwrap().len() > 20);
    let xml = read("r.xml");
    assert!(xml.contains("<testcase classname=\"306-1/6.5.2\" name=\"2: values are the defaults\""), "{xml}");
    assert!(xml.contains("<failure message=\"2001:00 is 5, by default 6\">"), "{xml}");
    let html = read("r.html");
    assert!(html.contains("by default 6") && !html.contains("{{"), "{html}");
}

/// Whichever cases are run, because a mistake in the data sheet may be why one fails.
#[test]
fn the_warnings_of_a_data_sheet_are_said_before_the_test() {
    let wrong = ("DefaultValue=5\n", "DefaultValue=300\n");
    let (folder, run) = conform("conform-warnings", Some(wrong), &["--only", "2.1"]);
    run.on_stdout(0, "the data sheet has 1 warning: lexican eds lint tested.eds");
    let said = run.stdout.lines().find_map(|line| line.split_once(": lexican ")).unwrap().1;
    lexican_in(&folder, &said.split(' ').collect::<Vec<_>>()).on_stdout(0, "warning[");
    let (_, run) = conform("conform-no-warnings", None, &["--only", "2.1"]);
    assert!(!run.stdout.contains("warning"), "{run}");
}

/// Of hundreds of findings, it prints ten lines, and the command for the others. The test runs this command as printed.
#[test]
fn a_data_sheet_with_errors_says_which_in_ten_lines() {
    let folder = folder("conform-unfit");
    let device = include_str!("../../../tests/conformance/device.eds");
    let wrong = device.replace("[1000]", "[1F99]").replace("DataType=0x0007", "DataType=0x9999");
    std::fs::write(folder.join("device.eds"), device).unwrap();
    std::fs::write(folder.join("wrong.eds"), wrong).unwrap();
    let args = ["conform", "--bus", "sim:device.eds?node=5", "--device", "wrong.eds", "--report", "r.json"];
    let run = lexican_in(&folder, &args);
    run.on_stderr(2, "wrong.eds: 1000h, the device type, cannot be read in it");
    run.on_stderr(2, "wrong.eds:65:10: warning[eds::unknown-data-type]");
    assert_eq!(run.stderr.lines().count(), 12, "{run}");
    let json: Value = serde_json::from_str(&std::fs::read_to_string(folder.join("r.json")).unwrap()).unwrap();
    let said = json["ended_early"].as_str().unwrap();
    let (_, command) = said.rsplit_once(": lexican ").unwrap();
    assert!(said.lines().count() == 12 && run.stderr.contains(command), "{said}");
    let lint = lexican_in(&folder, &command.split(' ').collect::<Vec<_>>());
    assert!(lint.stdout.matches("unknown-data-type").count() > 10, "{lint}");
}

/// The head of a report, in each format: who tested, when, with what and on what, and the place to sign.
#[test]
fn a_report_says_what_was_tested_by_whom_and_against_which_text() {
    let args = [
        "--only",
        "2.7,2.27",
        "--allow",
        "store",
        "--bit-rate",
        "500",
        "--tester",
        "A. Smith",
        "--remark",
        "2nd <try>",
    ];
    let files = ["--report", "r.json", "--report", "r.xml", "--report", "r.html"];
    let (folder, run) = conform("conform-head", None, &[&args[..], &files[..]].concat());
    assert_eq!(run.code, Some(0), "{run}");
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let json: Value = serde_json::from_str(&read("r.json")).unwrap();
    let fact = |name: &str| {
        let facts = json["facts"].as_array().unwrap();
        let found = facts.iter().find(|fact| fact[0] == name);
        found.unwrap_or_else(|| panic!("{name}: {facts:?}"))[1].as_str().unwrap().to_owned()
    };
    assert_eq!((&json["overall"], &json["tester"]), (&"passed".into(), &"A. Smith".into()));
    assert_eq!(fact("version"), format!("lexican {}", env!("CARGO_PKG_VERSION")));
    assert!(fact("date").starts_with("20") && fact("date").ends_with(" UTC"));
    assert_eq!((fact("bit rate"), fact("allowed")), ("500 kbit/s".to_owned(), "store".to_owned()));
    assert!(fact("bus").starts_with("sim:sensor.eds") && fact("duration").ends_with(" s"));
    assert!(fact("vendor-ID (1018h:01)").starts_with(|first: char| first.is_ascii_digit()));
    // In the format of `sha256sum`.
    let sum = std::process::Command::new("sha256sum").arg(folder.join("tested.eds")).output();
    let sum = String::from_utf8(sum.unwrap().stdout).unwrap();
    assert_eq!(sum.split(' ').next(), Some(&*fact("SHA-256 of tested.eds")));
    let case = &json["cases"][0];
    assert_eq!((&case["clause"], &case["id"]), (&"CiA 301, 7.2.4.3.17".into(), &"301/7.2.4.3.17/5".into()));
    assert!(case["requirement"].as_str().unwrap().starts_with("A server aborts a request"), "{case}");
    assert!(case["expected"][0].as_str().unwrap().contains("(CCT 2.7)"), "{case}");
    let xml = read("r.xml");
    assert!(xml.contains("<property name=\"verdict\" value=\"passed\"/>"), "{xml}");
    assert!(xml.contains("<property name=\"remark\" value=\"2nd &lt;try&gt;\"/>"), "{xml}");
    let html = read("r.html");
    assert!(
        html.contains("A. Smith") && !html.contains("<try>") && !html.contains("http:") && !html.contains("https:"),
        "{html}"
    );
}

#[test]
fn a_report_is_compared_with_an_earlier_one() {
    let (folder, run) = conform("conform-against", None, &["--only", "2.7,4.2", "--report", "right.json"]);
    assert_eq!(run.code, Some(0), "{run}");
    let sheet = SHEET.replacen("DefaultValue=5\n", "DefaultValue=6\n", 1);
    std::fs::write(folder.join("wrong.eds"), sheet).unwrap();
    let test = |device: &str, args: &[&str]| {
        let base = ["conform", "--bus", "sim:sensor.eds?node=7", "--device", device, "--only"];
        lexican_in(&folder, &[&base[..], args].concat())
    };
    let run = test("wrong.eds", &["2.8,4.2", "--against", "right.json", "--report", "wrong.json"]);
    run.on_stdout(1, "worse: 306-1/6.5.2/2 values are the defaults: failed, was passed");
    run.on_stdout(1, "new: 301/7.2.4.3.17/6 ");
    run.on_stdout(1, "gone: 301/7.2.4.3.17/5: was passed");
    run.on_stdout(1, "against right.json: 1 worse, 0 better, 1 new, 1 gone");
    let run = test("tested.eds", &["2.8,4.2", "--against", "wrong.json"]);
    run.on_stdout(0, "better: 306-1/6.5.2/2 values are the defaults: passed, was failed");
    // A case that is no longer tested counts as worse, although nothing fails.
    test("tested.eds", &["4.6", "--report", "all.json", "--allow", "all"]).on_stdout(0, "1 passed");
    test("tested.eds", &["4.6", "--against", "all.json"]).on_stdout(1, "not allowed, was passed");
    test("tested.eds", &["2.7", "--against", "tested.eds"]).on_stderr(2, "is no report of a test");
    test("tested.eds", &["2.7", "--against", "none.json"]).on_stderr(2, "cannot read none.json");
}

#[test]
fn a_plan_says_what_has_to_be_allowed_and_tests_nothing() {
    let (_, run) = conform("conform-plan", None, &["--plan", "--allow", "manufacturer"]);
    run.on_stdout(0, " cases for");
    run.on_stdout(0, "manufacturer   allowed: writes objects of the manufacturer");
    let (_, run) = conform("conform-not-allowed", None, &["--only", "4.6"]);
    run.on_stdout(0, "1 case: 1 not allowed");
}

/// Unusual defaults and limits that editors write and devices have. None of them is a fault of the device.
#[test]
fn an_unusual_data_sheet_is_no_failure() {
    let mut sheet = include_str!("../../../tests/conformance/device.eds").to_owned();
    for (entry, value) in [
        // The default of the history is its number of fields.
        ("1003sub0", "DefaultValue=0xFE"),
        // SYNC is produced from the start, with a period of 20 ms or more.
        ("1005", "DefaultValue=0x40000080"),
        ("1006", "DefaultValue=20000\nLowLimit=20000\nHighLimit=100000"),
        // The heartbeat replaces guarding.
        ("1017", "DefaultValue=500"),
        // Limits of numbers that consist of several fields.
        ("1016sub1", "DefaultValue=0\nLowLimit=0\nHighLimit=0x7FFFFF"),
        ("1600sub1", "DefaultValue=0x60400010\nLowLimit=0\nHighLimit=0xFFFFFFFF"),
        // The value that 1011h:01 reads as, not the signature that it takes.
        ("1011sub1", "DefaultValue=1\nLowLimit=0\nHighLimit=1"),
        // Not an identifier, but not switched off either.
        ("1201sub1", "DefaultValue=0"),
    ] {
        let (head, section) = sheet.split_once(&format!("[{entry}]\n")).unwrap();
        let (section, rest) = section.split_once("\n\n").unwrap();
        let kept: Vec<_> = section.lines().filter(|line| !line.starts_with("DefaultValue")).collect();
        sheet = format!("{head}[{entry}]\n{}\n{value}\n\n{rest}", kept.join("\n"));
    }
    let folder = folder("conform-unusual");
    std::fs::write(folder.join("unusual.eds"), sheet).unwrap();
    // No drive has such a status word.
    let allow = "outputs,manufacturer,store,restore,node-id";
    let run = lexican_in(&folder, &["conform", "--bus", "sim:unusual.eds?node=5", "--allow", allow, "--skip", "1.0"]);
    run.on_stdout(0, " passed");
    assert!(!run.stdout.contains("NOT PUT BACK"), "{run}");
}

/// A simulated drive fails only where its manual deviates from the standard; the file beside the drive lists each case.
#[test]
fn drives_deviate_only_as_their_manuals_say() {
    for (drive, at, known) in
        [("siko/ag03-1", "siko-ag03-1", 17), ("siko/ag02", "siko-ag02", 16), ("kollmorgen/akd", "kollmorgen-akd", 18)]
    {
        let bus = format!("sim:{drive}?node=5");
        let file = format!("{}/../drives/{at}/conform.toml", env!("CARGO_MANIFEST_DIR"));
        let run = lexican(&[
            "conform",
            "--bus",
            &bus,
            "--allow",
            "all",
            "--only",
            "301,306-1,402",
            "--strict",
            "--known",
            &file,
        ]);
        run.on_stdout(0, &format!("{known} failed as known"));
        assert_eq!(run.stdout.matches("\n    known: ").count(), known, "{run}");
        assert!(!run.stdout.contains("has passed"), "{run}");
    }
}

#[test]
fn a_known_deviation_names_a_case_and_what_is_seen() {
    let folder = folder("conform-known");
    let args = ["conform", "--bus", "sim:siko/ag02", "--known", "known.toml", "--only", "2.7"];
    for (text, code, message) in [
        ("\"301/99/1\" = { seen = \"*\", why = \"no\" }", 2, "known.toml: no case has the id \"301/99/1\""),
        ("\"301/7.2.4.3.17/5\" = \"no\"", 2, "seen = "),
        (
            "\"301/7.2.4.3.17/5\" = { seen = \"* 0504 0000*\", why = \"no\" }",
            1,
            "note: it is known to fail otherwise: * 0504 0000*",
        ),
        ("\"301/7.2.4.3.17/5\" = { seen = \"* 0601 0000*\", why = \"yes\" }", 0, "known: yes"),
    ] {
        std::fs::write(folder.join("known.toml"), text).unwrap();
        let run = lexican_in(&folder, &args);
        assert!(run.code == Some(code) && run.to_string().contains(message), "{text}: {run}");
    }
}

#[test]
fn a_device_is_tested_by_lss_and_keeps_its_node_id() {
    let (_, run) = conform("conform-lss", None, &["--only", "305", "--allow", "all", "--bit-rate", "500"]);
    run.on_stdout(0, "21 cases: 21 passed\n");
    let (_, run) = conform("conform-no-lss", Some(("LSS_Supported=1", "LSS_Supported=0")), &["--only", "305"]);
    run.on_stdout(0, "21 cases: 21 do not apply\n");
}

#[test]
fn cases_are_listed_chosen_and_shuffled() {
    let list = lexican(&["conform", "--list"]);
    assert!(list.code == Some(0) && list.stdout.lines().count() > 127, "{list}");
    lexican(&["conform", "--list", "--only", "301/7.2.4.3.7", "--skip", "2.13"]).on_stdout(0, "2.17");
    let order = |seed: &str| lexican(&["conform", "--list", "--seed", seed]).stdout;
    assert!(order("1") == order("1") && order("1") != order("2"));
    lexican(&["conform", "--list", "--only", "301/9"]).on_stderr(2, "no case is called \"301/9\"");
    lexican(&["conform", "--list", "--only", "2.1", "--skip", "2"]).on_stderr(2, "no case is left");
    lexican(&["conform"]).on_stderr(2, "--bus <URL>");
    lexican(&["conform", "--bus", "sim:siko/ag03-1", "--allow", "all,fun"]).on_stderr(2, "motion, outputs");
}

#[test]
fn a_drive_is_moved_only_if_that_is_allowed_and_the_plan_says_how_far() {
    let drive = ["conform", "--bus", "sim:kollmorgen/akd", "--only", "402/8.1,402/607Ah"];
    let run = lexican(&[&drive[..], &["--plan", "--travel", "400", "--velocity", "250"]].concat());
    run.on_stdout(0, "motion         not allowed: gives a drive orders");
    run.on_stdout(0, "With --allow motion THE DRIVE MOVES in 28 cases");
    run.on_stdout(0, "travels of up to 400 from where it stands (6064h; --travel)");
    run.on_stdout(0, "at a velocity of 250 (6081h, 60FFh; --velocity)");
    let run = lexican(&drive);
    run.on_stdout(0, "28 cases: 28 not allowed");
    // Its bit 5 passes the previous target, and mode 8 is not in 6502h.
    let run = lexican(&[&drive[..], &["--allow", "motion"]].concat());
    run.on_stdout(1, "failed 402/607Ah/4 a set-point with bit 5 replaces the one under way");
    run.on_stdout(1, "28 cases: 23 passed, 1 failed, 4 do not apply");
}
