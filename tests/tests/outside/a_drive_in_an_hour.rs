//! The page "A drive in an hour", followed to the letter with a data sheet of this repository.
#![cfg(unix)]

use crate::outside;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, Command, Stdio};

const PAGE: &str = include_str!("../../../drives/a-drive-in-an-hour.md");

/// A reader who follows a page.
pub(crate) struct User {
    folder: PathBuf,
    simulation: Option<Simulation>,
}

/// A running `lexican simulate`, ended when this is dropped.
struct Simulation {
    process: Child,
    /// Kept open, because the command ends when it cannot print.
    _printed: BufReader<ChildStderr>,
    bus: String,
}

impl User {
    /// A user with the command, and a folder with these files.
    pub(crate) fn begins(folder: &str, files: &[(&str, &str)]) -> Self {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("readme").join(folder);
        let _ = std::fs::remove_dir_all(&folder);
        for (path, text) in files {
            outside::write(&folder, path, text);
        }
        let user = User { folder, simulation: None };
        // In place of `cargo install`.
        let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cli/Cargo.toml");
        let manifest = manifest.to_str().expect("the checkout has a name in UTF-8");
        outside::succeeds(user.folder(), &["build", "--quiet", "--bin", "lexican", "--manifest-path", manifest]);
        user
    }

    /// Writes the files of a page and types its commands. Returns the output of the last ones, and how many outputs
    /// were compared. The part about Python comes last; that package's tests run it.
    pub(crate) fn follows(&mut self, page: &'static str, folder: &str) -> (String, usize) {
        let (mut printed, mut compared) = (String::new(), 0);
        for (language, text) in outside::blocks(page).take_while(|(language, _)| *language != "python") {
            match (language, outside::file(text, folder)) {
                (_, Some(path)) => outside::write(&self.folder, path, text),
                ("sh", None) => printed = text.lines().map(|command| self.types(command)).collect(),
                ("text", None) => {
                    assert_eq!(printed.trim_end(), text);
                    compared += 1;
                }
                _ => panic!("a block that the test does not follow: {text}"),
            }
        }
        (printed, compared)
    }

    fn folder(&self) -> &str {
        self.folder.to_str().expect("the target folder has a name in UTF-8")
    }

    /// Types a command, and returns its output. Leaves out only the commands for a real bus.
    fn types(&mut self, command: &str) -> String {
        let bus = self.simulation.as_ref().map_or("", |simulation| &simulation.bus);
        let words: Vec<&str> = command.split_whitespace().map_while(|word| (word != "#").then_some(word)).collect();
        let words: Vec<&str> =
            words.into_iter().map(|word| if word.starts_with("slcan:") { bus } else { word }).collect();
        match words[..] {
            ["cargo", .., "can0"] => String::new(),
            ["cargo", "run", ref rest @ ..] => {
                outside::succeeds(self.folder(), &["clippy", "--", "-D", "warnings"]);
                outside::output(self.folder(), &[&["run", "--quiet"], rest].concat())
            }
            ["lexican", "simulate", ..] => {
                self.simulation = Some(Simulation::start(self.lexican(&words[1..])));
                String::new()
            }
            ["lexican", ref rest @ ..] => {
                let output = self.lexican(rest).output().expect("the command can be started");
                assert!(output.status.success(), "{command}: {}", String::from_utf8_lossy(&output.stderr));
                String::from_utf8(output.stdout).expect("it prints UTF-8")
            }
            _ => panic!("a command that the test does not follow: {command}"),
        }
    }

    fn lexican(&self, words: &[&str]) -> Command {
        let mut command = Command::new(outside::target_folder().join("debug/lexican"));
        command.current_dir(&self.folder).args(words);
        command
    }
}

impl Simulation {
    fn start(mut command: Command) -> Simulation {
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut process = command.spawn().expect("the command can be started");
        let mut printed = BufReader::new(process.stderr.take().expect("it is piped"));
        let bus = printed.by_ref().lines().map_while(Result::ok).find_map(|line| {
            let word = line.split_whitespace().find(|word| word.starts_with("slcan:"))?;
            Some(word.to_owned())
        });
        Simulation { process, _printed: printed, bus: bus.expect("it prints its bus") }
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
    let mut user = User::begins("axis", &[("eds/servo.eds", include_str!("../../downstream/servo/eds/servo.eds"))]);
    let (printed, compared) = user.follows(PAGE, "axis");
    assert_eq!(compared, 3, "what the page says of the output is compared");
    assert_eq!(printed, "reached, at 1000; Position(1000)\nhomed, at 0\nruns at 100\n", "after the last step");

    // For example with the name of the file instead of the dictionary's.
    outside::write(&user.folder, "src/lib.rs", "pub mod od {\n    lexican_runtime::include_od!(\"Servo\");\n}\n");
    let output = outside::cargo(user.folder()).args(["check", "--lib"]).output().expect("cargo can be started");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("there is no dictionary `Servo`; the build script has generated `servo`"), "{said}");
}
