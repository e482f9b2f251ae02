//! The page "A drive in an hour", followed to the letter with a data sheet of our own.
#![cfg(unix)]

mod outside;

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, ChildStderr, Stdio};

const PAGE: &str = include_str!("../../drives/a-drive-in-an-hour.md");

/// `lexican simulate`, until it is dropped.
struct Simulation {
    process: Child,
    /// Kept open: the command ends when it cannot print.
    printed: BufReader<ChildStderr>,
}

impl Simulation {
    /// The simulation of a data sheet as node 5, and its bus.
    fn start(folder: &str) -> (Simulation, String) {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the tests lie in the workspace");
        let manifest = root.join("cli/Cargo.toml");
        let manifest = manifest.to_str().expect("the checkout has a name in UTF-8");
        let build = ["build", "--quiet", "--bin", "lexican", "--manifest-path", manifest];
        outside::succeeds(folder, &build);
        let mut command = std::process::Command::new(outside::target_folder().join("debug/lexican"));
        command.current_dir(folder).args(["simulate", "eds/servo.eds", "--node", "5"]);
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut process = command.spawn().expect("the command can be started");
        let printed = BufReader::new(process.stderr.take().expect("it is piped"));
        let mut simulation = Simulation { process, printed };
        let bus = simulation.printed.by_ref().lines().map_while(Result::ok).find_map(|line| {
            let word = line.split_whitespace().find(|word| word.starts_with("slcan:"))?;
            Some(word.to_owned())
        });
        (simulation, bus.expect("it prints its bus"))
    }
}

impl Drop for Simulation {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

#[test]
fn the_page_moves_a_drive() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("readme/axis");
    let _ = std::fs::remove_dir_all(&folder);
    outside::write(&folder, "eds/servo.eds", include_str!("../downstream/servo/eds/servo.eds"));
    let files = outside::files_of(PAGE, "axis");
    // A file that comes again is of a later step.
    let mut seen = BTreeSet::new();
    let first = files.iter().take_while(|(path, _)| seen.insert(*path)).count();
    let (first, later) = files.split_at(first);
    assert_eq!(
        seen.into_iter().collect::<Vec<_>>(),
        ["Cargo.toml", "build.rs", "src/bin/any.rs", "src/lib.rs", "src/main.rs"]
    );
    let name = folder.to_str().expect("the target folder has a name in UTF-8");
    for (step, at) in [(first, "1000"), (later, "Position(1000)")] {
        for (path, text) in step {
            outside::write(&folder, path, text);
        }
        outside::succeeds(name, &["clippy", "--", "-D", "warnings"]);
        let moved =
            format!("Reached {{ position: 1000 }}, at {at}\nAttained {{ position: 0 }}\nReached {{ velocity: 100 }}\n");
        assert_eq!(outside::output(name, &["run", "--quiet", "--bin", "axis"]), moved);
        let (_simulation, bus) = Simulation::start(name);
        let any = ["run", "--quiet", "--bin", "any", "--", &bus, "eds/servo.eds"];
        assert_eq!(outside::output(name, &any), "Reached { position: 1000 }\n");
        assert_eq!(outside::output(name, &["run", "--quiet", "--bin", "axis", "--", &bus]), moved);
    }
}

#[test]
fn no_block_of_the_page_is_left_unchecked() {
    outside::has_no_other_blocks(PAGE, &outside::files_of(PAGE, "axis"));
}
