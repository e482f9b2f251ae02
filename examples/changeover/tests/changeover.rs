//! The program, as its user runs it. `cargo xtask bless` takes over the pictures in `docs/` and the reports in the README.

#[path = "../../golden.rs"]
mod golden;

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::Value as Json;

const RECIPE: &str = "recipes/bottle-0.5l.toml";

fn program() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_changeover"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).stdin(Stdio::null());
    command
}

/// Exit code, stdout and stderr.
fn run(args: &[&str]) -> (i32, String, String) {
    texts(program().args(args).output().expect("the program was built for this test"))
}

fn texts(output: Output) -> (i32, String, String) {
    let text = |bytes| String::from_utf8(bytes).expect("the program prints UTF-8");
    let (code, stdout, stderr) = (output.status.code(), text(output.stdout), text(output.stderr));
    assert!(!stderr.contains("panicked"), "{stderr}");
    (code.unwrap_or_else(|| panic!("it ends by itself: {stderr}")), stdout, stderr)
}

/// The report, and the exit code with it.
fn report(args: &[&str]) -> (i32, Json) {
    let (code, stdout, stderr) = run(&[args, &["--format", "json"]].concat());
    (code, serde_json::from_str(&stdout).unwrap_or_else(|error| panic!("{error}: {stdout}{stderr}")))
}

fn drives(report: &Json) -> &[Json] {
    report["drives"].as_array().expect("a report has drives")
}

fn number(of: &Json, key: &str) -> f64 {
    of[key].as_f64().unwrap_or_else(|| panic!("{key} is a number: {of}"))
}

/// Files with a recipe of one drive and its machine, in one of which something is different.
fn recipe(name: &str, from: &str, to: &str) -> [PathBuf; 2] {
    const MACHINE: &str = r#"[node.rail]
id = 1
sheet = "siko/ag03-1"
settings = { "spindle pitch" = "4 mm", "607D:01" = "raw:-500", "607D:02" = "raw:12000" }

[node.gate]
id = 2
sheet = "siko/ag02"
"#;
    let sound = format!(
        "name = \"Test\"\nmachine = \"{name}.machine.toml\"\n\n[[drive]]\nnode = \"rail\"\nposition.mm = 42.5\n"
    );
    let files = [("toml", sound.as_str()), ("machine.toml", MACHINE)].map(|(extension, text)| {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name).with_extension(extension);
        std::fs::write(&path, text.replacen(from, to, 1)).expect("the folder for tests is writable");
        path
    });
    assert!([&sound, MACHINE].iter().any(|text| text.contains(from)), "{name}");
    files
}

#[test]
fn every_drive_reaches_its_position_and_all_start_with_sync() {
    let (code, report) = report(&[RECIPE]);
    assert_eq!(code, 0, "{report}");
    assert_eq!((report["done"].as_bool(), &report["stop"]), (Some(true), &Json::Null));
    assert_eq!(drives(&report).len(), 12);
    for drive in drives(&report) {
        assert_eq!((drive["outcome"].as_str(), drive["start"].as_str()), (Some("reached"), Some("SYNC")), "{drive}");
        // Increments of the drive: 1/100 mm, or 360°/1600.
        let increment = match drive["unit"].as_str() {
            Some("mm") => 0.01,
            Some("°") => 0.225,
            _ => 1.0,
        };
        assert!((number(drive, "reached") - number(drive, "to")).abs() <= 1.01 * increment, "{drive}");
        assert!(number(drive, "time_s") > 0.0, "{drive}");
    }
}

/// What a drive is connected by shows in nothing but its time.
#[test]
fn drives_behind_other_interfaces_change_over_with_those_on_the_bus() {
    let ((code, mixed), (_, on_bus)) = (report(&[RECIPE, "--doors"]), report(&[RECIPE]));
    assert_eq!(code, 0, "{mixed}");
    for (drive, other) in drives(&mixed).iter().zip(drives(&on_bus)) {
        for key in ["name", "outcome", "start", "to"] {
            assert_eq!(drive[key], other[key], "{drive}");
        }
        assert!((number(drive, "reached") - number(other, "reached")).abs() <= 0.02, "{drive}");
        let has_doors = drive["kind"].as_str().is_some_and(|kind| kind.starts_with("siko/"));
        let is_later = number(drive, "time_s") > number(other, "time_s") + 0.05;
        assert_eq!(is_later, has_doors, "{drive} {other}");
    }
}

#[test]
fn a_drive_that_does_not_wait_for_sync_is_started_by_itself() {
    let gate = "42.5\n[[drive]]\nnode = \"gate\"\nposition.degrees = 90\nsync = false";
    let [path, _] = recipe("by_itself", "42.5", gate);
    let (code, report) = report(&[path.to_str().expect("UTF-8")]);
    assert_eq!(code, 0, "{report}");
    let summary = "2 of 2 drives are in position; SYNC starts 1 of them, the others start one after the other";
    assert_eq!(report["summary"], summary);
    let starts: Vec<_> = drives(&report).iter().map(|drive| (&drive["start"], &drive["outcome"])).collect();
    assert_eq!(
        format!("{starts:?}"),
        r#"[(String("SYNC"), String("reached")), (String("by itself"), String("reached"))]"#
    );
}

#[test]
fn a_drive_that_fails_stops_all_others() {
    for (fault, node, because) in [
        ("6@2", 6, "capper-height: fault: B (7121): drive shaft blocked"),
        ("8@2", 8, "infeed-screw-phase: fault: F439 (8611): Following error"),
    ] {
        let (code, report) = report(&[RECIPE, "--fault", fault]);
        assert_eq!(code, 1, "{report}");
        assert_eq!(report["stop"]["because"], because);
        assert_all_stopped(&report, node);
    }
}

/// All drives have stopped, since this one has failed.
fn assert_all_stopped(report: &Json, failed: u64) {
    let stop = &report["stop"];
    // Each at once, and all on one bus of 500 kbit/s; then they brake.
    assert!(number(stop, "ordered_within_s") < 0.05, "{stop}");
    assert!(number(stop, "stood_within_s") < 1.0, "{stop}");
    let none = Json::Array(Vec::new());
    for drive in drives(report) {
        let (way, gone) =
            (number(drive, "to") - number(drive, "from"), number(drive, "reached") - number(drive, "from"));
        match (drive["node"].as_u64(), drive["outcome"].as_str()) {
            (Some(node), outcome) if node == failed => assert_eq!(outcome, Some("fault")),
            // This one was there already.
            (Some(10), outcome) => assert_eq!(outcome, Some("reached")),
            (_, outcome) => {
                assert_eq!((outcome, &drive["why"]), (Some("stopped"), &none), "{drive}");
                assert!((0.01..0.99).contains(&(gone / way)), "it had begun, and was not there yet: {drive}");
            }
        }
    }
}

/// The signals, against a run that takes half a minute on the wall.
#[cfg(unix)]
#[test]
fn the_operator_stops_all_drives() {
    use nix::sys::signal::{Signal, kill};
    use std::io::{BufRead, BufReader, Read};

    for signal in [Signal::SIGINT, Signal::SIGTERM] {
        let mut command = program();
        command.args([RECIPE, "--pace", "real", "--format", "json"]).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("the program was built for this test");
        let mut stderr = BufReader::new(child.stderr.take().expect("it is piped"));
        let mut line = String::new();
        while !line.contains("discharge-gate-crank:") {
            line.clear();
            assert_ne!(stderr.read_line(&mut line).expect("UTF-8"), 0, "all drives set off");
        }
        kill(nix::unistd::Pid::from_raw(child.id().cast_signed()), signal).expect("it runs");
        let mut rest = String::new();
        stderr.read_to_string(&mut rest).expect("UTF-8");
        let (code, stdout, _) = texts(child.wait_with_output().expect("it ends"));
        let report: Json = serde_json::from_str(&stdout).unwrap_or_else(|error| panic!("{error}: {stdout}{rest}"));
        assert_eq!((code, &report["stop"]["because"]), (1, &Json::from("the operator has stopped it")), "{signal}");
        for drive in drives(&report) {
            assert_eq!(
                (&drive["outcome"], &drive["why"]),
                (&Json::from("stopped"), &Json::Array(Vec::new())),
                "{signal}: {drive}"
            );
        }
    }
}

/// What differs from a sound recipe, in which line that is noticed, what is said, and what to do about it.
#[test]
fn a_recipe_that_does_not_fit_is_refused_before_anything_moves() {
    for (name, from, to, place, said, remedy) in [
        (
            "limit",
            "42.5",
            "142.5",
            (0, 6),
            "rail: 142.50 mm is beyond its limits, -5.00 mm to 120.00 mm",
            "between them",
        ),
        ("far", "42.5", "1e9", (0, 6), "rail: no position is so far away", "that the drive can count"),
        (
            "increments",
            "position.mm = 42.5",
            "position.increments = 10000000",
            (0, 6),
            "rail: 10000000 increments is beyond its limits",
            "between them",
        ),
        ("pitch", "\"spindle pitch\" = \"4 mm\", ", "", (0, 6), "rail: the drive has no spindle pitch", "in degrees"),
        ("kind", "ag03-1", "ag04", (1, 3), "no known device is called \"siko/ag04\"", "did you mean siko/ag0"),
        ("node", "\"rail\"", "\"rial\"", (0, 5), "rial is no node of the machine", "those of the machine's file"),
        ("id", "id = 1", "id = \"none\"", (0, 5), "rail has no node-ID or no data sheet", "in the machine's file"),
        ("key", "node =", "nodde =", (0, 5), "unknown field `nodde`", "README.md"),
        ("unit", "position.mm", "position.inch", (0, 6), "unknown variant `inch`", "README.md"),
        ("text", "= 42.5", "= ", (0, 6), "string values must be quoted", "README.md"),
        ("file", "file.machine", "nothing", (0, 2), "nothing.toml", "relative to the recipe"),
        (
            "twice",
            "42.5",
            "42.5\n[[drive]]\nnode = \"rail\"\nposition.mm = 1",
            (0, 8),
            "rail is in the recipe already",
            "remove one",
        ),
    ] {
        let paths = recipe(name, from, to);
        let (code, stdout, stderr) = run(&[paths[0].to_str().expect("UTF-8")]);
        assert_eq!((code, stdout.as_str()), (2, ""), "{name}: {stderr}");
        let place = format!("{}:{}:", paths[place.0].display(), place.1);
        for text in [said, &place, remedy] {
            assert!(stderr.contains(text), "{name}: no {text:?} in {stderr}");
        }
        assert!(!stderr.contains("rail: 0.00"), "{name}: nothing sets off");
    }
}

#[test]
fn what_cannot_begin_is_said_with_exit_code_2() {
    for (args, said) in [
        (&["nowhere.toml"][..], "cannot read nowhere.toml"),
        (&[RECIPE, "--bus", "slcan:/dev/nothing"], "there is no serial port /dev/nothing"),
        (&[RECIPE, "--bus", "slcan:/dev/nothing", "--fault", "6@2"], "cannot be used with"),
        (&[RECIPE, "--doors", "--fault", "6@2"], "cannot be used with"),
        (&[RECIPE, "--fault", "99@2"], "no drive at node 99"),
        (&[RECIPE, "--fault", "6"], "say which node, and when"),
    ] {
        let (code, stdout, stderr) = run(args);
        assert_eq!((code, stdout.as_str()), (2, ""), "{args:?}: {stderr}");
        assert!(stderr.contains(said), "{args:?}: {stderr}");
    }
}

#[test]
fn a_dry_run_moves_nothing() {
    let (code, report) = report(&[RECIPE, "--dry-run"]);
    assert_eq!(code, 0, "{report}");
    for drive in drives(&report) {
        assert_eq!((&drive["outcome"], &drive["reached"]), (&Json::from("planned"), &Json::Null), "{drive}");
    }
    assert_eq!((number(&drives(&report)[0], "low"), number(&drives(&report)[0], "high")), (-5.0, 120.0));
}

#[test]
fn the_golden_reports_and_pictures_are_those_of_the_program() {
    golden::check("changeover", 3, |args| run(args).1);
}

#[test]
fn the_picture_has_every_drive_and_the_stop() {
    let pictures = ["docs/changeover.svg", "docs/stopped.svg"];
    let texts = pictures.map(|path| {
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path))
            .expect("the README's commands draw it")
    });
    let (_, report) = report(&[RECIPE, "--dry-run"]);
    for (text, stops) in texts.iter().zip([0, 1]) {
        assert!(text.starts_with("<svg ") && text.trim_end().ends_with("</svg>"));
        for drive in drives(&report) {
            assert!(text.contains(drive["name"].as_str().expect("a name")), "{drive}");
        }
        for axis in ["position [mm]", "position [°]", "position [increments]", "time since the release [s]"] {
            assert!(text.contains(axis), "{axis}");
        }
        assert_eq!(text.matches("all are stopped").count(), stops);
    }
}
