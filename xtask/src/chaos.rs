//! What `lexican chaos` finds in our own commands, the bench and examples: a few seeds of each.

use std::path::Path;
use std::process::{Command, Stdio};

use crate::outside::{empty_folder, write};
use crate::{command, workspace};

const RECIPE: &str =
    "name = \"Disturbed\"\nmachine = \"machine.toml\"\n\n[[drive]]\nnode = \"rail\"\nposition.increments = 3000\n";
/// A drive that is set otherwise than at power-on, so that restoring its parameters has to write.
const MACHINE: &str = "[node.rail]\nid = 5\nsheet = \"siko/ag03-1\"\nguarding = \"100 ms\"\n\n[node.rail.settings]\n\"Motor Parameter Set/v-Pos\" = 40\n2412 = \"2.5 mm\"\n\n[simulate.rail.settings]\n\"Motor Parameter Set/v-Pos\" = 35\n";

const AXES: &str = "[kind.axis]\nsheet = \"kollmorgen/akd\"\n\n[node.x]\nid = 1\nkind = \"axis\"\n\n[node.y]\nid = 2\nkind = \"axis\"\n";

/// A program, what it is run against, and which seeds.
struct Subject {
    name: &'static str,
    options: &'static [&'static str],
    /// `L` is the command.
    program: &'static [&'static str],
}

const SUBJECTS: &[Subject] = &[
    Subject {
        name: "drive, AG03/1",
        options: &["siko/ag03-1", "--node", "5", "--seed", "1", "--runs", "5"],
        program: &["L", "drive", "5", "move-to", "2000", "--enable"],
    },
    Subject {
        name: "drive, AKD",
        options: &["kollmorgen/akd", "--node", "5", "--seed", "20", "--runs", "5"],
        program: &["L", "drive", "5", "move-to", "20000", "--enable"],
    },
    Subject {
        name: "backup",
        options: &["siko/ag03-1", "--node", "5", "--seed", "3", "--runs", "5", "--writes", "kept.dcf"],
        program: &["L", "backup", "5", "-o", "kept.dcf", "--force"],
    },
    Subject {
        name: "restore",
        options: &["siko/ag03-1", "--node", "5", "--seed", "3", "--runs", "5"],
        program: &["L", "restore", "5", "changed.dcf"],
    },
    Subject {
        name: "apply",
        options: &["siko/ag03-1", "--node", "5", "--seed", "8", "--runs", "5"],
        program: &["L", "apply"],
    },
    Subject {
        name: "changeover",
        options: &["siko/ag03-1", "--node", "5", "--seed", "2", "--runs", "5"],
        program: &["changeover", "recipe.toml", "--bus", "{bus}"],
    },
    Subject {
        name: "circle",
        options: &["axes.toml", "--seed", "1", "--runs", "4"],
        program: &["circle", "--bus", "{bus}", "--period", "10"],
    },
    Subject {
        name: "bench",
        options: &["siko/ag03-1", "--node", "5", "--seed", "2", "--runs", "5", "--for", "3s"],
        program: &["L", "bench", "--no-open", "--bus", "{bus}", "--device", "5=siko/ag03-1"],
    },
];

/// Disturbs each of them, all at the same time: they mostly wait.
pub(crate) fn run(root: &Path) -> Result<(), String> {
    let programs = ["--bin", "lexican", "--bin", "changeover", "--bin", "circle"];
    command::run_cargo(root, &[&["build", "--workspace"], &programs[..]].concat(), &[])?;
    let folder = empty_folder(root, "chaos")?;
    let files = [("recipe.toml", RECIPE), ("machine.toml", MACHINE), ("axes.toml", AXES)];
    for (name, text) in files {
        write(&folder.join(name), text)?;
    }
    let lexican = |args: &[&str]| {
        let mut lexican = Command::new(workspace::program(root, "lexican"));
        lexican.args(args).current_dir(&folder).stdin(Stdio::null()).env_remove("LEXICAN_BUS");
        lexican
    };
    command::output(&mut lexican(&["backup", "--bus", "sim:machine.toml", "5", "-o", "changed.dcf"]))?;
    let disturb = |subject: &Subject| {
        let program = workspace::program(root, if subject.program[0] == "L" { "lexican" } else { subject.program[0] });
        let program = program.to_string_lossy();
        let args = [&["chaos"], subject.options, &["--", &program], &subject.program[1..]].concat();
        let output = lexican(&args).output().map_err(|error| format!("{}: {error}", subject.name))?;
        let text = [output.stdout, output.stderr].concat();
        println!("{}:\n{}", subject.name, String::from_utf8_lossy(&text));
        if output.status.success() { Ok(()) } else { Err(format!("{}: {}", subject.name, output.status)) }
    };
    std::thread::scope(|scope| {
        let running: Vec<_> = SUBJECTS.iter().map(|subject| scope.spawn(|| disturb(subject))).collect();
        let panicked = |_| Err("a thread has panicked".to_owned());
        let ended: Vec<_> = running.into_iter().map(|it| it.join().unwrap_or_else(panicked)).collect();
        ended.into_iter().collect()
    })
}
