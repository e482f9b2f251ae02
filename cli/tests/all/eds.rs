//! `lexican eds`: output and exit codes.

use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::common::{files, folder, lexican, lexican_in};

const SHEET: &str = include_str!("../sensor.eds");

/// The data sheet with a default that is not a number.
fn guessed() -> String {
    assert!(SHEET.contains("DefaultValue=4\n"));
    SHEET.replace("DefaultValue=4\n", "DefaultValue=one\n")
}

#[test]
fn a_page_is_html_unless_its_name_or_an_option_says_markdown() {
    let folder = folder("eds-doc");
    std::fs::write(folder.join("x.eds"), guessed()).unwrap();
    let doc = |args: &[&str]| lexican_in(&folder, &[&["eds", "doc", "x.eds", "-o"], args].concat());
    let html = "<!DOCTYPE html>";
    for (args, begins) in [
        (&["x.md"][..], "# "),
        (&["x"], html),
        (&["y.md", "--format", "html"], html),
        (&["y.txt", "--format", "markdown"], "# "),
    ] {
        doc(args).on_stdout(0, "");
        assert!(std::fs::read_to_string(folder.join(args[0])).unwrap().starts_with(begins), "{args:?}");
    }
    // A page is made despite an error, and shows it.
    std::fs::write(folder.join("x.toml"), "[overlay]\nformat = 1\nnonsense = 2\n").unwrap();
    doc(&["z.md", "--overlay", "x.toml"]).on_stderr(1, "overlay::unknown-key");
    assert!(std::fs::read_to_string(folder.join("z.md")).unwrap().contains("x.toml:3 | overlay::unknown-key"));
    doc(&["x.eds", "--force"]).on_stderr(2, "x.eds");
}

#[test]
fn the_drive_has_138_entries() {
    let dump = |format: &[&str]| {
        let run = lexican(&[&["eds", "dump", "siko/ag03-1"], format].concat());
        assert_eq!(run.code, Some(0), "{run}");
        run.stdout
    };
    let csv = dump(&["--format", "csv"]);
    let lines: Vec<_> = csv.lines().collect();
    assert_eq!(
        lines[0],
        "index,subindex,name,object_type,data_type,access,pdo_mapping,default,low_limit,high_limit,configured,obj_flags"
    );
    assert_eq!(lines.len(), 139);
    let row = |start: &str| lines.iter().find(|line| line.starts_with(start)).copied();
    assert!(row("1400,01,").is_some_and(|row| row.contains("UNSIGNED32,rw") && row.contains("$NODEID+0x200")));
    assert!(row("1800,04,").is_none());
    assert!(row("607A,00,").is_some_and(|row| row.contains(",VAR,INTEGER32,")));
    let json = dump(&["--json"]);
    assert!(json.starts_with('{') && json.trim_end().ends_with('}'));
    assert!(dump(&["--format", "md"]).starts_with("| index |"));
    let devices = lexican(&["devices"]);
    assert!(devices.stdout.contains("siko/ag03-1") && devices.stdout.contains("138 entries"), "{}", devices.stdout);
    let lint = lexican(&["eds", "lint", "siko/ag03-1"]);
    assert_eq!(lint.code, Some(0), "{}{}", lint.stdout, lint.stderr);
}

#[test]
fn the_exit_code_of_lint_follows_the_level() {
    let folder = folder("lint");
    std::fs::write(folder.join("bad.toml"), "[overlay").unwrap();
    let guessed = guessed();
    for (text, args, code) in [
        (guessed.as_bytes(), &["--fail-on", "warning"][..], 1),
        (guessed.as_bytes(), &["--fail-on", "note"], 1),
        (guessed.as_bytes(), &["--strict"], 1),
        (SHEET.as_bytes(), &[], 0),
        (SHEET.as_bytes(), &["--overlay", "bad.toml"], 1),
        (SHEET.as_bytes(), &["--overlay", "missing.toml"], 2),
        (b"", &[], 2),
        (&[0x7F, b'E', b'L', b'F', 0, 0, 0xFF, 0xFE, 0], &[], 2),
    ] {
        std::fs::write(folder.join("x.eds"), text).unwrap();
        let run = lexican_in(&folder, &[&["eds", "lint", "x.eds"], args].concat());
        assert_eq!(run.code, Some(code), "{run}");
    }
}

#[test]
fn findings_name_file_line_and_column() {
    let folder = folder("lint-place");
    std::fs::write(folder.join("x.eds"), guessed()).unwrap();
    let line = 1 + SHEET.lines().position(|line| line == "DefaultValue=4").unwrap();
    let place = format!("x.eds:{line}:");
    for (format, text) in [
        (&["--format", "text"][..], &*place),
        (&["--format", "short"], &format!("\n{place}")),
        (&["--format", "sarif"], "\"version\": \"2.1.0\""),
        (&["--json"], "\"files\""),
    ] {
        let run = lexican_in(&folder, &[&["eds", "lint", "x.eds"], format].concat());
        assert!(format!("\n{}", run.stdout).contains(text), "{format:?}: {}", run.stdout);
    }
}

#[test]
fn what_has_one_right_answer_is_fixed_in_place_and_nothing_else() {
    let folder = folder("lint-fix");
    // In code page 1252, with a wrong count, flag and date, and a default that only people can correct.
    let wrong = guessed().replace('\n', "\r\n").replace("VendorName=Nobody", "; M\u{fc}ller\r\nVendorName = Nobody");
    let wrong =
        wrong.replace("SupportedObjects=3", "SupportedObjects=9").replace("LSS_Supported=1", "LSS_Supported= 2");
    let bytes = |text: &str| text.chars().map(|letter| letter as u8).collect::<Vec<_>>();
    std::fs::write(folder.join("x.eds"), bytes(&wrong)).unwrap();

    lexican_in(&folder, &["eds", "lint", "x.eds"]).on_stderr(0, "--fix mends 2 of them");
    let preview = lexican_in(&folder, &["eds", "lint", "x.eds", "--fix", "--dry-run"]);
    preview.on_stdout(1, "-LSS_Supported= 2\r\n+LSS_Supported= 1\r\n");
    assert!(preview.stdout.starts_with("--- x.eds\n+++ x.eds\n@@ "), "{preview}");
    preview.on_stderr(1, "1 data sheet: 2 findings would be fixed");
    assert_eq!(std::fs::read(folder.join("x.eds")).unwrap(), bytes(&wrong), "a preview writes nothing");
    let json = lexican_in(&folder, &["eds", "lint", "x.eds", "--fix", "--dry-run", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json.stdout).unwrap();
    assert_eq!(json["files"][0]["fixed"], serde_json::json!({ "eds::bad-flag": 1, "eds::list-count": 1 }));

    let run = lexican_in(&folder, &["eds", "lint", "x.eds", "--fix", "--fail-on", "warning"]);
    run.on_stderr(1, "; 2 fixed");
    run.on_stdout(1, "eds::bad-value");
    let mended = wrong.replace("SupportedObjects=9", "SupportedObjects=3").replace("_Supported= 2", "_Supported= 1");
    assert_eq!(std::fs::read(folder.join("x.eds")).unwrap(), bytes(&mended));
    let again = lexican_in(&folder, &["eds", "lint", "x.eds", "--fix", "--dry-run"]);
    assert_eq!((again.code, again.stdout.as_str()), (Some(0), ""), "{again}");

    lexican_in(&folder, &["eds", "lint", "siko/ag03-1", "--fix"]).on_stderr(2, "is not a file that could be written");
    lexican_in(&folder, &["eds", "lint", "x.eds", "--fix", "--dry-run", "--format", "sarif"]).on_stderr(2, "SARIF");
    // Not a data sheet, though one of its lines could be corrected.
    std::fs::write(folder.join("x.txt"), "[DeviceInfo]\nVendorName: x\n").unwrap();
    lexican_in(&folder, &["eds", "lint", "x.txt", "--fix"]).on_stderr(2, "describes no object");
    assert_eq!(std::fs::read(folder.join("x.txt")).unwrap(), b"[DeviceInfo]\nVendorName: x\n");
    // Half a character at the end could not be written back.
    std::fs::write(folder.join("half.eds"), b"[\0D\0]\0\n").unwrap();
    lexican_in(&folder, &["eds", "lint", "half.eds", "--fix"]).on_stderr(2, "half.eds is not whole");
}

#[test]
fn many_files_are_linted_in_one_call_in_their_order() {
    let folder = folder("lint-many");
    let names: Vec<_> = (0..200).map(|n| format!("{n:03}.eds")).collect();
    names.iter().for_each(|name| std::fs::write(folder.join(name), guessed()).unwrap());
    let mut args = vec!["eds", "lint", "--format", "short", "--strict"];
    args.extend(names.iter().map(String::as_str));
    let run = lexican_in(&folder, &args);
    assert_eq!(run.code, Some(1));
    let mut seen: Vec<_> = run.stdout.lines().filter_map(|line| line.split(':').next()).collect();
    seen.dedup();
    assert_eq!(seen, names);
    assert!(run.stderr.contains("200 data sheets: "), "{run}");
}

#[test]
fn unreadable_files_are_reported_and_nothing_is_written() {
    let folder = folder("unreadable");
    std::fs::write(folder.join("empty.eds"), "").unwrap();
    std::fs::write(folder.join("binary.eds"), [0, 159, 146, 150, 0, 1, 2, 3]).unwrap();
    std::fs::write(folder.join("text.eds"), "just some text\nand more of it\n").unwrap();
    let [info, first] = ["[DeviceInfo]", "[1000]"].map(|section| SHEET.find(section).unwrap());
    std::fs::write(folder.join("headless.eds"), &SHEET[info..first]).unwrap();
    let before = files(&folder);
    for (file, words) in [
        ("missing.eds", "cannot read missing.eds: no such file or directory"),
        ("empty.eds", "empty.eds"),
        ("binary.eds", "binary.eds"),
        ("text.eds", "text.eds:1:1"),
        ("headless.eds", "headless.eds"),
        ("siko/ag03-3", "did you mean siko/ag03-1 or siko/ag02?"),
        ("nobody/nothing", "lexican devices"),
        (".", "is a directory"),
    ] {
        for args in [&["eds", "dump", file][..], &["gen", file, "-o", "out.rs"]] {
            let run = lexican_in(&folder, args);
            assert!(matches!(run.code, Some(1 | 2)), "{args:?} ended with {:?}", run.code);
            assert!(run.stderr.contains(words), "{run}");
            assert_eq!(files(&folder), before, "{args:?}");
        }
    }
    let run = lexican_in(&folder, &["eds", "lint", "missing.eds"]);
    assert_eq!(run.code, Some(2));
}

#[test]
fn a_truncated_file_never_makes_the_command_panic() {
    let folder = folder("truncated");
    for end in (0..SHEET.len()).step_by(29) {
        std::fs::write(folder.join("x.eds"), &SHEET[..end]).unwrap();
        let run = lexican_in(&folder, &["eds", "dump", "x.eds"]);
        assert!(matches!(run.code, Some(0..=2)), "cut at {end}: {:?}", run.code);
        if end < SHEET.find("[DeviceInfo]").unwrap() {
            assert_eq!(run.code, Some(2), "cut at {end}");
        }
    }
}

#[test]
fn generated_code_is_whole_and_the_same_on_stdout() {
    let folder = folder("gen");
    let run = lexican_in(&folder, &["gen", "siko/ag03-1", "-o", "od.rs", "--storage", "--names"]);
    assert_eq!(run.code, Some(0), "{run}");
    assert_eq!(files(&folder), ["od.rs"]);
    let code = std::fs::read_to_string(folder.join("od.rs")).unwrap();
    assert_eq!(lexican(&["gen", "siko/ag03-1", "--storage", "--names"]).stdout, code);
    assert!(code.contains("0x6040"));
}

#[test]
fn a_driver_is_generated_of_a_drive_only() {
    let run = lexican(&["gen", "--driver", "kollmorgen/akd"]);
    assert_eq!(run.code, Some(0), "{run}");
    assert!(run.stdout.contains("pub mod driver {") && run.stdout.contains("vendor_ids: &[0x6A]"), "{run}");
    let sensor = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/sensor.eds");
    let run = lexican(&["gen", "--driver", &sensor.to_string_lossy()]);
    assert_eq!((run.code, run.stdout.as_str()), (Some(1), ""), "{run}");
    assert!(run.stderr.contains("error[drive::no-object]: there is no 6040h (control word)"), "{run}");
}

#[test]
fn a_reader_that_leaves_early_is_no_error() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_lexican"))
        .args(["eds", "dump", "siko/ag03-1"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Closes the pipe before anything is read.
    drop(child.stdout.take());
    let mut stderr = String::new();
    child.stderr.take().unwrap().read_to_string(&mut stderr).unwrap();
    assert_eq!((child.wait().unwrap().code(), stderr.as_str()), (Some(0), ""));
}

#[test]
fn two_data_sheets_are_compared_by_object() {
    let folder = folder("diff");
    std::fs::write(folder.join("a.eds"), SHEET).unwrap();
    std::fs::write(folder.join("b.eds"), SHEET.replace("Device Type", "Type of Device").replace('\n', "\r\n")).unwrap();
    let same = lexican_in(&folder, &["eds", "diff", "a.eds", "a.eds"]);
    assert_eq!((same.code, same.stdout.as_str()), (Some(0), ""));
    let run = lexican_in(&folder, &["eds", "diff", "a.eds", "b.eds"]);
    assert_eq!(run.code, Some(1), "{run}");
    assert_eq!(run.stdout.lines().count(), 1, "{run}");
    assert!(run.stdout.contains("1000") && run.stdout.contains("Type of Device"), "{run}");
    assert_eq!(lexican_in(&folder, &["eds", "diff", "a.eds", "missing.eds"]).code, Some(2));
}

#[test]
fn formatting_is_printed_checked_or_written_whole() {
    let folder = folder("fmt");
    let untidy = SHEET.replace("ParameterName=Device Type", "parametername = Ger\u{e4}tetyp");
    let bytes: Vec<u8> = untidy.chars().map(|letter| letter as u8).collect();
    std::fs::write(folder.join("x.eds"), &bytes).unwrap();
    let printed = lexican_in(&folder, &["eds", "fmt", "x.eds"]);
    assert!(printed.stdout.contains("ParameterName=Gerätetyp"), "{}", printed.stdout);
    let check = lexican_in(&folder, &["eds", "fmt", "--check", "x.eds"]);
    assert_eq!((check.code, check.stdout.as_str()), (Some(1), "x.eds\n"));
    assert_eq!(std::fs::read(folder.join("x.eds")).unwrap(), bytes);

    assert_eq!(lexican_in(&folder, &["eds", "fmt", "--write", "x.eds"]).code, Some(0));
    assert_eq!(files(&folder), ["x.eds"]);
    let written = std::fs::read(folder.join("x.eds")).unwrap();
    let name = b"=Ger\xE4tetyp";
    assert!(written.windows(name.len()).any(|bytes| bytes == name), "the file stays in code page 1252");
    assert_eq!(lexican_in(&folder, &["eds", "fmt", "--check", "x.eds"]).code, Some(0));

    let shipped = lexican_in(&folder, &["eds", "fmt", "--write", "x.eds", "siko/ag03-1"]);
    shipped.on_stderr(2, "siko/ag03-1 is not a file that could be written");

    std::fs::write(folder.join("empty.eds"), "").unwrap();
    assert_eq!(lexican_in(&folder, &["eds", "fmt", "--write", "empty.eds"]).code, Some(2));
    assert_eq!(std::fs::read(folder.join("empty.eds")).unwrap(), b"");
}

#[test]
fn fmt_keeps_the_encoding_of_a_file() {
    let folder = folder("fmt_encodings");
    let text = SHEET.replace("VendorName=Nobody", "vendorname = Störung");
    let utf_16 = |text: &str| text.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<u8>>();
    let code_page = |byte: u8| {
        let (before, after) = text.split_once('ö').unwrap();
        [before.as_bytes(), &[byte], after.as_bytes()].concat()
    };
    let with_mark = ["\u{FEFF}".as_bytes(), text.as_bytes()].concat();
    for (bytes, name) in [
        (text.as_bytes().to_vec(), "Störung".as_bytes().to_vec()),
        (with_mark, "Störung".as_bytes().to_vec()),
        (utf_16(&text), utf_16("Störung")),
        (code_page(0xF6), b"St\xF6rung".to_vec()),
        (code_page(0x94), b"St\x94rung".to_vec()),
    ] {
        std::fs::write(folder.join("x.eds"), &bytes).unwrap();
        let run = lexican_in(&folder, &["eds", "fmt", "--write", "x.eds"]);
        assert_eq!((run.code, run.stdout.trim()), (Some(0), "x.eds"), "{run}");
        let written = std::fs::read(folder.join("x.eds")).unwrap();
        assert!(written[..3] == bytes[..3], "the mark stays");
        assert!(written.windows(name.len()).any(|bytes| bytes == name), "{name:?}");
    }
}

#[test]
fn a_dump_says_what_is_configured_and_what_the_device_can() {
    let folder = folder("dump_dcf");
    let commissioned = "[DeviceComissioning]\nNodeID=5\nBaudrate=125\n\n[1000]";
    let text = SHEET
        .replace("[1000]", commissioned)
        .replace("BaudRate_500=1", "BaudRate_1000=1")
        .replace("ParameterName=Error Register\n", "ParameterName=Error Register\nObjFlags=1\nParameterValue=7\n");
    std::fs::write(folder.join("x.dcf"), text).unwrap();
    let dump = |format: &[&str]| lexican_in(&folder, &[&["eds", "dump", "x.dcf"], format].concat()).stdout;
    assert!(dump(&["--format", "csv"]).lines().any(|line| line.starts_with("1001,00,") && line.ends_with(",7,1")));
    let md = dump(&["--format", "md"]);
    for row in ["| NodeID | 5 |", "| Baudrate | 125 |", "| BaudRate | 250, 1000 |", "| LSS_Supported | 1 |"] {
        assert!(md.contains(row), "{row}:\n{md}");
    }
    let json: serde_json::Value = serde_json::from_str(&dump(&["--json"])).unwrap();
    assert_eq!((&json["commissioning"]["node_id"], &json["lss"]), (&5.into(), &true.into()));
    assert_eq!((&json["objects"][1]["flags"], &json["objects"][1]["entries"][0]["configured"]), (&1.into(), &7.into()));
}

#[test]
fn findings_of_many_files_are_one_document_in_the_order_of_the_files() {
    let folder = folder("lint_many");
    let names: Vec<String> = (0..12).map(|number| format!("{number}.eds")).collect();
    for (number, name) in names.iter().enumerate() {
        let text =
            if number % 3 == 0 { SHEET.replace("DefaultValue=0\n", "DefaultValue=x\n") } else { SHEET.to_owned() };
        std::fs::write(folder.join(name), text).unwrap();
    }
    let lint = |format: &[&str]| {
        let files: Vec<_> = names.iter().map(String::as_str).collect();
        let args = [&["eds", "lint"], format, &files].concat();
        let text = lexican_in(&folder, &args).stdout;
        serde_json::from_str::<serde_json::Value>(&text).unwrap()
    };
    let json = lint(&["--json"]);
    let files: Vec<_> = json["files"].as_array().into_iter().flatten().map(|file| file["file"].as_str()).collect();
    assert_eq!(files, names.iter().map(|name| Some(name.as_str())).collect::<Vec<_>>());
    let sarif = lint(&["--format", "sarif"]);
    assert_eq!(sarif["runs"].as_array().map(Vec::len), Some(1));
    let run = &sarif["runs"][0];
    let bad = |values: &serde_json::Value, key: &str| {
        values.as_array().into_iter().flatten().filter(|value| value[key] == "eds::bad-value").count()
    };
    // Four files with six such values each.
    assert_eq!((bad(&run["results"], "ruleId"), bad(&run["tool"]["driver"]["rules"], "id")), (24, 1));
}

/// A device in XML: every command accepts it, and says the same about it as about the EDS.
#[test]
fn a_data_sheet_in_xml_is_one_as_any_other() {
    let folder = folder("eds-xml");
    std::fs::write(folder.join("sensor.eds"), SHEET).unwrap();
    lexican_in(&folder, &["eds", "convert", "sensor.eds", "-o", "sensor.xdd"]).on_stdout(0, "sensor.xdd: 13 objects");
    let same = lexican_in(&folder, &["eds", "diff", "sensor.eds", "sensor.xdd"]);
    assert_eq!((same.code, same.stdout.as_str()), (Some(0), ""), "{same}");
    for args in [&["eds", "dump"][..], &["gen"]] {
        let of = |file: &str| lexican_in(&folder, &[args, &[file]].concat()).stdout;
        assert!(of("sensor.eds").len() > 500);
        assert_eq!(of("sensor.xdd").replace("sensor.xdd", "sensor.eds"), of("sensor.eds"), "{args:?}");
    }
    let bus = "sim:sensor.xdd?node=7";
    lexican_in(&folder, &["check", "--bus", bus, "--device", "sensor.xdd"]).on_stdout(0, "as the data sheet says");
    let machine = "[bus]\nurl = \"sim:sensor.xdd?node=7\"\n[node.feeder]\nid = 7\nsheet = \"sensor.xdd\"\n";
    std::fs::write(folder.join("machine.toml"), machine).unwrap();
    lexican_in(&folder, &["machine", "check"]).on_stdout(0, "1 node");
    lexican_in(&folder, &["read", "feeder", "1018:04"]).on_stdout(0, "= 42");
    lexican_in(&folder, &["eds", "fmt", "--check", "sensor.xdd"]).on_stdout(0, "");
    lexican_in(&folder, &["eds", "set", "sensor.xdd", "1017", "DefaultValue=1"]).on_stdout(0, "+          <");
    lexican_in(&folder, &["read", "feeder", "1017"]).on_stdout(0, "= 1");
    lexican_in(&folder, &["eds", "set", "sensor.xdd", "DeviceInfo", "RevisionNumber=9"]).on_stderr(2, "eds convert");
    for args in [&["lint", "--fix", "sensor.xdd"][..], &["remove", "sensor.xdd", "1017"]] {
        lexican_in(&folder, &[&["eds"], args].concat()).on_stderr(2, "in which this command changes nothing");
    }
}

#[test]
fn what_is_lost_in_another_format_is_named() {
    let folder = folder("eds-convert");
    let run = lexican_in(&folder, &["eds", "convert", "siko/ag03-1", "-o", "ag03.eds", "--json"]);
    run.on_stdout(0, "the unit of 100C:00");
    assert!(run.stderr.contains("warning: ag03.eds lacks the unit of 100C:00"), "{run}");
    lexican_in(&folder, &["eds", "convert", "siko/ag03-1", "-o", "ag03.eds"]).on_stderr(2, "--force replaces it");
    lexican_in(&folder, &["eds", "convert", "siko/ag03-1", "-o", "ag03.txt"]).on_stderr(2, "end it with .eds");
    std::fs::write(folder.join("x.xdd"), "<html/>").unwrap();
    lexican_in(&folder, &["eds", "convert", "x.xdd", "-o", "x.eds"]).on_stderr(2, "no data sheet");
}
