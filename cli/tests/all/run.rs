//! `lexican run`: a sequence of lines.

use std::fs;
use std::path::PathBuf;

use crate::common::{Run, folder, lexican_in};

const MACHINE: &str = "\
[bus]
manager = 127

[node.feeder]
id = 5
sheet = \"siko/ag03-1\"
guarding = \"100 ms\"
settings = { 1017 = \"0 ms\", 2412 = \"2.5 mm\" }

[node.cutter]
id = 6
sheet = \"kollmorgen/akd\"
";

/// A folder with a machine and a sequence.
fn with_sequence(name: &str, lines: &str) -> PathBuf {
    let folder = folder(name);
    fs::write(folder.join("machine.toml"), MACHINE).unwrap();
    fs::write(folder.join("a.seq"), lines).unwrap();
    folder
}

fn run(name: &str, lines: &str, more: &[&str]) -> Run {
    lexican_in(&with_sequence(name, lines), &[&["run", "a.seq", "--bus", "sim"], more].concat())
}

#[test]
fn lines_run_on_one_bus_with_their_times() {
    let lines = "# The first piece\nboot\n\ndrive feeder move-to 2.5 mm --enable  # a turn\nwait 500 ms\n\
                 wait feeder.6064 >= 2.4 mm within 1 s\nread feeder 6064\ndrive cutter move-to 2000 --enable\n";
    let done = run("run", lines, &[]);
    done.on_stdout(0, "2: boot\n");
    // Each line sees the effects of the previous ones.
    done.on_stdout(0, "6064:00 Position Actual Value = +2.50 mm\n");
    assert!(done.stdout.lines().last().unwrap().starts_with("6 lines in "), "{done}");
    assert_eq!(done.stdout.matches("it stands").count(), 2, "each drive is told to stop: {done}");
    let events: Vec<serde_json::Value> =
        run("run-json", lines, &["--json"]).stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let times: Vec<_> =
        events.iter().filter(|it| it["event"] == "line").map(|it| it["time"].as_f64().unwrap()).collect();
    assert!(times.len() == 6 && times.is_sorted() && times[3] - times[2] >= 0.5, "{times:?}");
    let last = events.last().unwrap();
    assert_eq!((&last["done"], &last["outcome"], &last["unstopped"]), (&6.into(), &0.into(), &serde_json::json!([])));
}

#[test]
fn all_mistakes_are_said_before_the_first_line_runs() {
    let lines = "boot\nbott\ndrive feeder move-too 50\ndrive feeder move-to\nwait cutter.nothing = 1 within 2 s\n\
                 wait knife.6064 = 1 within 2 s\nwait 5\nread \"x\nrun a.seq\n";
    let wrong = run("run-wrong", lines, &[]);
    for (line, words) in [
        (2, "'boot'"),
        (3, "'move-to'"),
        (4, "move-to"),
        (5, "names no object \"nothing\""),
        (6, "there is no node \"knife\""),
        (7, "write 5ms"),
        (8, "a quotation does not end"),
        (9, "`run` has no place"),
    ] {
        let found = wrong.stderr.split("a.seq:").any(|it| it.starts_with(&format!("{line}: ")) && it.contains(words));
        assert!(found, "{line}: {words}: {wrong}");
    }
    wrong.on_stderr(2, "nothing was done");
    assert_eq!(wrong.stdout, "");
}

#[test]
fn what_fails_ends_the_sequence_and_the_drives_stand() {
    let lines = "drive cutter enable\nwait feeder.2412 = 9 mm within 100 ms\nboot\n";
    let ended = run("run-ended", lines, &[]);
    ended.on_stdout(1, "node 6: it stands");
    ended.on_stdout(1, "a.seq:2 has ended it after ");
    assert!(ended.stderr.contains("not within 100 ms") && !ended.stdout.contains("has booted"), "{ended}");
    run("run-failed", "read feeder 6064\nread --node 9 6064\nboot\n", &[]).on_stdout(2, "a.seq:2 has ended it");
}

/// Ctrl-C while a drive runs without end, with one bus for all lines.
#[cfg(unix)]
#[test]
fn an_interrupted_sequence_leaves_no_drive_moving() {
    use crate::simulation::{Simulation, lines};
    use std::process::{Command, Stdio};
    let folder = with_sequence("run-interrupted", "drive cutter run 2000 --enable\nboot\n");
    let machine = Simulation::begin(&folder, &["machine.toml", "--bus", "pty:2"]);
    let mut run = Command::new(env!("CARGO_BIN_EXE_lexican"));
    let run = run.args(["run", "a.seq", "--json", "--bus", &machine.buses[0]]).current_dir(&folder);
    let mut run = run.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    let printed = lines(run.stdout.take().unwrap());
    let moves = |line: &str| line.contains("\"progress\"") && line.contains("\"velocity\":2000");
    assert!(printed.iter().any(|line| moves(&line)), "it never runs");
    assert!(Command::new("kill").args(["-INT", &run.id().to_string()]).status().unwrap().success());
    let rest: Vec<_> = printed.iter().collect();
    assert_eq!(run.wait().unwrap().code(), Some(2), "{rest:#?}");
    assert!(
        rest.iter().any(|line| line.contains("it stands")) && !rest.iter().any(|line| line.contains("booted")),
        "{rest:#?}"
    );
    machine.check("read", &["--node", "6", "606C", "--device", "kollmorgen/akd"], "= 0");
}
