//! `lexican chaos`: programs that leave nothing behind pass; others are found, each by its seed.
#![cfg(unix)]

use std::path::Path;

use crate::common::{Run, folder, lexican, lexican_in};

const LEXICAN: &str = env!("CARGO_BIN_EXE_lexican");

/// Disturbs the commands of a shell once, by this seed; `L` stands for lexican.
fn shell(folder: &Path, seed: u64, options: &[&str], script: &str) -> Run {
    let script = script.replace("L ", &format!("{LEXICAN} "));
    let seed = seed.to_string();
    let args = [&["chaos", "siko/ag03-1", "--node", "5", "--seed", &seed, "--runs", "1"], options].concat();
    lexican_in(folder, &[&args[..], &["--", "sh", "-c", &script]].concat())
}

#[test]
fn an_order_of_ours_leaves_nothing_moving_and_the_report_says_so() {
    let folder = folder("chaos-drive");
    let chaos = ["chaos", "siko/ag03-1", "--node", "5", "--seed", "3", "--runs", "3"];
    let reports = ["--report", "r.html", "--report", "r.json", "--report", "r.xml"];
    let run = lexican_in(
        &folder,
        &[&chaos[..], &reports, &["--", LEXICAN, "drive", "5", "move-to", "2000", "--enable"]].concat(),
    );
    assert_eq!(run.code, Some(0), "{run}");
    for line in [
        "passed chaos/undisturbed undisturbed",
        "passed chaos/3 SIGSTOP for 2.366 s at SDO request 9",
        "passed chaos/4 SIGTERM 351 ms after an axis has set off",
        "passed chaos/5 SIGKILL 839 ms after an axis has set off",
        "4 cases: 4 passed",
    ] {
        run.on_stdout(0, line);
    }
    let read = |name| std::fs::read_to_string(folder.join(name)).unwrap();
    assert!(read("r.html").contains("SIGKILL 839 ms") && read("r.xml").contains("tests=\"4\" failures=\"0\""));
    let json: serde_json::Value = serde_json::from_str(&read("r.json")).unwrap();
    assert_eq!(json["cases"][3]["id"], "chaos/5");
    assert!(json["cases"][3]["frames"].as_array().unwrap().len() > 100, "the frames are there, in words");
    lexican_in(&folder, &[&chaos[..], &reports, &["--", "true"]].concat()).on_stderr(2, "--force replaces it");
}

#[test]
fn a_drive_that_goes_on_without_its_program_is_found_again_by_the_seed() {
    let folder = folder("chaos-moves");
    // The script ignores the answers, and nothing protects the drive.
    let script = "L nmt start 5 >&2; \
        for w in '6060 1' '6040 6' '6040 7' '6040 15' '607A 4000' '6040 31'; do L write --node 5 $w >&2; done; sleep 3";
    let found = "failed chaos/5 SIGKILL 839 ms after an axis has set off: node 5 goes on: it does not stand 1.3 s after SIGKILL";
    shell(&folder, 5, &[], script).on_stdout(1, found);
    shell(&folder, 5, &["--dead-man", "6s"], script).on_stdout(0, "passed chaos/5 SIGKILL 839 ms");
}

#[test]
fn a_program_that_does_not_end_is_killed_and_advised() {
    let script = "trap '' TERM INT; for i in 1 2 3 4; do L read --node 5 6041 >&2; done; sleep 7";
    let run = shell(&folder("chaos-deaf"), 8, &[], script);
    run.on_stdout(0, "advised chaos/8 SIGTERM at frame 5 of the program: it goes on for 5 s after SIGTERM");
}

#[test]
fn a_success_that_is_none_is_found() {
    // Neither the exit code nor the output says that the remaining values were not written.
    let script = "for i in $(seq 20); do L write --node 5 607A ${i}00 >&2 || break; done; echo done";
    let run = shell(&folder("chaos-claims"), 6, &[], script);
    run.on_stdout(1, "failed chaos/6 bus cut at frame 38 of the program: it claims success by exit code 0: ");
    run.on_stdout(1, "not as after an undisturbed run: 607A:00");
}

#[test]
fn a_file_that_is_half_written_is_found() {
    let folder = folder("chaos-files");
    std::fs::write(folder.join("kept.txt"), "as before\n").unwrap();
    let half = "for i in $(seq 20); do L read --node 5 607A; done > kept.txt";
    let run = shell(&folder, 5, &["--writes", "kept.txt"], half);
    run.on_stdout(1, "failed chaos/5 SIGKILL at SDO request 39: kept.txt is half written: ");
    assert_eq!(std::fs::read_to_string(folder.join("kept.txt")).unwrap(), "as before\n", "it is put back");
    let whole = half.replace("kept.txt", "new.txt") + " && mv new.txt kept.txt";
    shell(&folder, 5, &["--writes", "kept.txt"], &whole).on_stdout(0, "passed chaos/5 SIGKILL at SDO request 39");
}

#[test]
fn what_cannot_be_disturbed_is_said() {
    let folder = folder("chaos-errors");
    let run = shell(&folder, 1, &[], "echo it has no recipe >&2; exit 3");
    run.on_stderr(2, "undisturbed, the program ends with exit code 3");
    assert!(run.stderr.contains("it has no recipe"), "{run}");
    for (args, words) in [
        (&["chaos", "siko/ag03-1", "--", "no-such-program"][..], "cannot run no-such-program"),
        (&["chaos", "siko/ag03-1", "--bus", "sim:siko/ag03-1", "--", "true"], "no bus that two programs share"),
        (&["chaos", "siko/ag03-1"], "required arguments"),
        (&["chaos", "siko/ag03-1", "--report", "r.pdf", "--", "true"], ".html, .json or .xml"),
        (&["chaos", "no/such", "--", "true"], "no/such"),
    ] {
        lexican(args).on_stderr(2, words);
    }
}
