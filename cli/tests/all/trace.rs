//! `lexican conform --trace`: sends the frames of a manual to a device.

use crate::common::{Run, folder, lexican_in};
use serde_json::Value;

const TRACE: &str = "\
chapter,cob_id,data,meaning,condition
read,607,40 00 10 00,the device type,
read,587,43 00 10 00 xx xx xx xx,,
write,607,2B 17 10 00 64 00,heartbeat every 100 ms,
write,587,60 17 10 00 00 00 00 00,,
write,707,7F,,until 1s
write,707,7F,,until 1s; not before 50ms
";

/// Tests a device made of the sensor's data sheet with these frames.
fn trace(name: &str, text: &str, args: &[&str]) -> Run {
    let folder = folder(name);
    std::fs::write(folder.join("sensor.eds"), include_str!("../sensor.eds")).unwrap();
    std::fs::write(folder.join("t.csv"), text).unwrap();
    lexican_in(&folder, &[&["conform", "--bus", "sim:sensor.eds?node=7", "--trace", "t.csv"], args].concat())
}

#[test]
fn a_device_that_answers_as_printed_passes_and_another_fails_at_the_step() {
    let run = trace("trace-passes", TRACE, &[]);
    run.on_stdout(0, "2 chapters: 2 passed, 0 failed, 0 left out");
    run.on_stdout(0, "line 3: < 587#43001000xxxxxxxx");
    let other = TRACE.replace("587,60 17", "587,60 18");
    let run = trace("trace-fails", &other, &[]);
    run.on_stdout(1, "write: failed: line 5: 587#6018100000000000 was expected, 587#6017100000000000 came");
    run.on_stdout(1, "read: passed");
    let run = trace("trace-json", &other, &["--json"]);
    let lines: Vec<Value> = run.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!((&lines[1]["steps"][1]["line"], &lines[2]["failed"]), (&5.into(), &1.into()), "{run}");
}

#[test]
fn a_frame_that_comes_too_early_or_never_fails() {
    let run = trace("trace-early", &TRACE.replace("not before 50ms", "not before 900ms"), &[]);
    run.on_stdout(1, "not before 900 ms");
    let run = trace("trace-never", &TRACE.replace("707,7F,,until 1s\n", "707,05,,until 1s\n"), &[]);
    run.on_stdout(1, "line 6: 707#05 was expected, 707#7F came");
}

/// As for cases: frames in words, and what has become worse.
#[test]
fn a_report_has_the_chapters_and_is_compared_with_an_earlier_one() {
    let folder = folder("trace-report");
    std::fs::write(folder.join("sensor.eds"), include_str!("../sensor.eds")).unwrap();
    std::fs::write(folder.join("t.csv"), TRACE).unwrap();
    let ask = ["conform", "--bus", "sim:sensor.eds?node=7", "--trace", "t.csv"];
    let run = |args: &[&str]| lexican_in(&folder, &[&ask[..], args].concat());
    run(&["--report", "r.json", "--report", "r.html"]).on_stdout(0, "2 passed");
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let report: Value = serde_json::from_str(&read("r.json")).unwrap();
    assert_eq!((&report["overall"], &report["passed"]), (&"passed".into(), &2.into()), "{report}");
    let case = &report["cases"][1];
    assert_eq!((&case["title"], &case["verdict"]), (&"write".into(), &"passed".into()), "{case}");
    let frames = case["frames"].as_array().unwrap();
    assert!(frames.iter().any(|frame| frame["words"] == "heartbeat: PRE-OPERATIONAL"), "{case}");
    assert!(
        report["facts"].as_array().unwrap().contains(&serde_json::json!(["plan", "t.csv, 2 chapters"])),
        "{report}"
    );
    assert!(read("r.html").contains("write"));
    let other = TRACE.replace("587,60 17", "587,60 18");
    std::fs::write(folder.join("t.csv"), other).unwrap();
    let worse = run(&["--against", "r.json"]);
    worse.on_stdout(1, "worse");
    worse.on_stdout(1, "trace/2");
}

/// Each condition with a trace that passes, and a change that makes it fail.
#[test]
fn each_condition_can_pass_and_fail() {
    let read = "cob_id,direction,data,condition\n607,send,40 14 10 00,\n587,expect,43 14 10 00 87 00 00 00,\n";
    let heartbeat = "cob_id,direction,data,condition\n607,send,2B 17 10 00 C8 00,\n587,expect,60 17 10 00 00 00 00 00,\n707,expect,7F,until 1s\n";
    for (name, text, from, to, why) in [
        // 5 % of 135 is 6.
        ("about", read.replace("87 00 00 00,", "85 00 00 00,about"), "85 00", "80 00", "587#4314100087000000 came"),
        // All but the value must be as printed.
        (
            "about-other",
            read.replace("87 00 00 00,", "85 00 00 00,about"),
            "43 14",
            "43 15",
            "587#4314100087000000 came",
        ),
        (
            "about-bytes",
            read.replace("87 00 00 00,", "85 00 00 00,about 4-4"),
            "00 00 00,",
            "00 01 00,",
            "587#4314100087000000 came",
        ),
        ("direction", read.to_owned(), "587,expect", "587,from device", ""),
        ("direction-sent", read.to_owned(), "587,expect", "587,send", "which needs `--allow outputs`"),
        ("not-before", format!("{heartbeat}707,expect,7F,not before 150ms\n"), "150ms", "450ms", "not before 450 ms"),
        (
            "any-time",
            heartbeat.replace("until 1s", "any time"),
            "707,expect,7F",
            "707,expect,05",
            "707#05 was expected, 707#7F came",
        ),
    ] {
        trace(&format!("trace-{name}"), &text, &[]).on_stdout(0, "1 passed");
        let other = text.replacen(from, to, 1);
        assert_ne!(other, text, "{name}");
        let run = trace(&format!("trace-{name}-not"), &other, &[]);
        run.on_stdout(if why.is_empty() { 0 } else { 1 }, why);
    }
}

/// `after` is the time between two frames. A frame that comes meanwhile does not count as an answer to a later one.
#[test]
fn a_wait_is_as_long_as_it_says() {
    let text = "cob_id,data,condition\n607,40 00 10 00,\n587,43 00 10 00 xx xx xx xx,\n607,40 01 10 00,after 2s\n587,4F 01 10 00 xx xx xx xx,\n";
    let run = trace("trace-wait", text, &["--json"]);
    let chapter: Value = serde_json::from_str(run.stdout.lines().next().unwrap()).unwrap();
    let at = |step: usize| chapter["steps"][step]["seconds"].as_f64().unwrap();
    assert!((2.0..2.1).contains(&(at(2) - at(1))), "{run}");
    let early = "cob_id,data,condition\n607,2B 17 10 00 C8 00,\n587,60 17 10 00 00 00 00 00,\n607,2B 17 10 00 00 00,after 50ms\n587,60 17 10 00 00 00 00 00,\n707,7F,\n";
    trace("trace-early-off", early, &[]).on_stdout(1, "line 6: 707#7F was expected, nothing with this identifier came");
    trace(
        "trace-heartbeat",
        &early.replace("after 50ms", "after 250ms").replace("\n707,7F,\n", "\n707,7F,any time\n"),
        &[],
    )
    .on_stdout(0, "1 passed");
}

#[test]
fn what_is_dangerous_is_left_out_unless_it_is_allowed() {
    let store = "cob_id,data\n607,23 10 10 01 73 61 76 65\n587,xx xx xx xx xx xx xx xx\n";
    trace("trace-store", store, &[]).on_stdout(1, "which needs `--allow store`");
    let restore = store.replace("10 10 01", "11 10 01");
    trace("trace-restore", &restore, &[]).on_stdout(1, "which needs `--allow restore`");
    trace("trace-others", "cob_id,data\n000,81 00\n", &["--allow", "all"]).on_stdout(1, "is of all nodes");
    trace("trace-allowed", store, &["--allow", "store"]).on_stdout(0, "1 passed");
}

#[test]
fn an_error_of_the_file_has_its_line_and_column() {
    for (from, to, expected) in [
        ("587,60", "58G,60", "t.csv:5: column cob_id: \"58G\" is no identifier"),
        ("607,2B", "607,2BX", "t.csv:4: column data: "),
        ("607,2B", "607,xx", "is sent, and what is sent has no x"),
        ("until 1s", "until 2h", "t.csv:6: column condition: "),
        ("until 1s", "until 1", "t.csv:6: column condition: "),
        ("until 1s", "about 3", "t.csv:6: column condition: "),
        ("707,7F", "707,R9", "t.csv:6: column data: "),
        ("cob_id", "id", "t.csv:1: there is no column cob_id"),
    ] {
        trace("trace-errors", &TRACE.replacen(from, to, 1), &[]).on_stderr(2, expected);
    }
}

/// The examples printed in the manuals are traces without change.
#[test]
fn drives_are_asked_by_the_frames_of_their_manuals() {
    let manual = |file: &str| format!("{}/../tests/manual/{file}", env!("CARGO_MANIFEST_DIR"));
    let ask = |drive: &str, file: &str, args: &[&str]| {
        let (bus, file) = (format!("sim:{drive}"), manual(file));
        lexican_in(&folder("trace-manuals"), &[&["conform", "--bus", &bus, "--trace", &file], args].concat())
    };
    let run = ask("kollmorgen/akd?node=3", "akd/frames.csv", &["--allow", "all"]);
    for chapter in ["7.2.1.3", "7.2.1.4", "7.2.1.5", "7.2.1.6"] {
        run.on_stdout(0, &format!("{chapter}: passed"));
    }
    // The others say why they are left out.
    run.on_stdout(0, "11 chapters: 4 passed, 0 failed, 7 left out");
    run.on_stdout(0, "7.2.1.8: does not apply: line 190: no frame brings about \"supply off\"");
    let run = ask("kollmorgen/akd?node=3", "akd/frames.csv", &[]);
    run.on_stdout(1, "7.2.1.3: not run: it gives a drive orders, which needs `--allow motion`");
    for (drive, chapter) in [("ag02", "10.2.8"), ("ag03-1", "7.2.8")] {
        let file = format!("{drive}/sdo_examples.csv");
        let run = ask(&format!("siko/{drive}?node=5"), &file, &["--allow", "all"]);
        // The manual reads a value that was set earlier.
        run.on_stdout(0, &format!("{chapter}.1: passed"));
        run.on_stdout(0, &format!("{chapter}.2: passed"));
        let run = ask(&format!("siko/{drive}?node=5"), &format!("{drive}/example_position.csv"), &["--allow", "all"]);
        run.on_stdout(1, "no frame brings about \"target position reached\"");
        // The same, with waits written as frames.
        let file = format!("../../conform/traces/siko-{drive}.csv");
        let run = ask(&format!("siko/{drive}?node=5"), &file, &["--allow", "all"]);
        run.on_stdout(0, "2 chapters: 2 passed, 0 failed, 0 left out");
    }
}
