//! The demo: the manual's worked examples from the command line.

use crate::common::{files, folder, lexican, lexican_in};

/// The frames of the manual's tables 25 and 26, typed off the page.
const TABLES: [&str; 27] = [
    "000#0105",
    "205#0601",
    "205#0701",
    "205#0F01",
    "405#1F0088130000",
    "205#0F01",
    "405#1F0078ECFFFF",
    "205#1F01",
    "205#1F00",
    "205#0F01",
    "205#0701",
    "205#0601",
    "205#0001",
    "000#8005",
    "000#0105",
    "205#0601",
    "205#0701",
    "205#0F01",
    "505#0F0044000000",
    "505#0F001E000000",
    "205#0F01",
    "505#0F00B8FFFFFF",
    "205#0F01",
    "205#0701",
    "205#0601",
    "205#0001",
    "000#8005",
];

#[test]
fn the_demo_passes_its_checks_and_logs_every_row_of_both_tables_in_order() {
    let folder = folder("demo");
    let run = lexican_in(&folder, &["demo"]);
    assert_eq!(run.code, Some(0), "{}\n{}", run.stdout, run.stderr);
    assert!(!run.stdout.contains("FAILED"), "{run}");
    assert_eq!(files(&folder), ["demo.log", "demo.svg"]);

    let log = std::fs::read_to_string(folder.join("demo.log")).unwrap();
    let sent: Vec<_> = log
        .lines()
        .filter_map(|line| line.split(' ').nth(2))
        .filter(|frame| matches!(&frame[..3], "000" | "205" | "405" | "505"))
        .collect();
    assert_eq!(sent, TABLES);

    let picture = std::fs::read_to_string(folder.join("demo.svg")).unwrap();
    assert!(picture.starts_with("<svg ") && picture.trim_end().ends_with("</svg>"));
    for text in ["position [increments]", "velocity [rev/min]", "time on the bus [s]", "RPDO3: travel to -5000"] {
        assert!(picture.contains(text), "{text}");
    }
}

#[test]
fn every_frame_of_the_log_is_printed_with_its_time_and_in_words() {
    let folder = folder("demo-print");
    let run = lexican_in(&folder, &["demo"]);
    let log = std::fs::read_to_string(folder.join("demo.log")).unwrap();
    // The line of a frame begins with its time, which has six decimals.
    let is_frame = |line: &&str| line.split_whitespace().next().is_some_and(|word| word.parse::<f64>().is_ok());
    assert_eq!(run.stdout.lines().filter(is_frame).count(), log.lines().count());
    for words in [
        "Controlword = enable operation + new setpoint, Target Position = -5000 increments",
        "Velocity Actual Value = +68 rev/min",
        "write 6060:00 Modes of Operation = profile velocity (2)",
        "Statusword = OPERATION ENABLED",
    ] {
        assert!(run.stdout.contains(words), "{words}");
    }
}

#[test]
fn two_runs_are_the_same_to_the_byte() {
    let [one, two] = ["demo-one", "demo-two"].map(folder);
    let printed = [&one, &two].map(|folder| lexican_in(folder, &["demo"]).stdout);
    assert_eq!(printed[0], printed[1]);
    for name in ["demo.log", "demo.svg"] {
        assert!(std::fs::read(one.join(name)).unwrap() == std::fs::read(two.join(name)).unwrap(), "{name}");
    }
}

#[test]
fn a_folder_that_cannot_be_written_is_a_clear_error() {
    let folder = folder("demo-out");
    std::fs::write(folder.join("file"), "in the way").unwrap();
    let out = folder.join("file");
    let run = lexican(&["demo", "--folder", out.to_str().unwrap()]);
    run.on_stderr(2, "cannot create");
    assert_eq!(files(&folder), ["file"]);
}
