//! Our figures and those of our peers, side by side in one run.
//!
//! `cargo xtask bench` with sdo, eds, files, instructions or bus is how to call it. What is compared is said where each
//! contender is made, with what it does not do. No test asserts a time: the goals below the tables are read by people.

#[cfg(target_os = "linux")]
mod bus;
mod eds;
mod files;
mod instructions;
mod measure;
mod report;
mod sdo;

use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match *arguments {
        ["sdo"] => sdo::run(),
        ["eds"] => eds::run(None),
        ["eds", path] => eds::run(Some(path)),
        ["files", folder] => files::run(folder),
        ["instructions"] => instructions::run(),
        // What that calls, under valgrind.
        ["count", case, nodes, rounds] => instructions::child(case, nodes, rounds),
        #[cfg(target_os = "linux")]
        ["bus", link, python, table] => return bus::run(link, python, table),
        // What that calls, to have each side in a process of its own.
        #[cfg(target_os = "linux")]
        ["play", ref part @ ..] => return bus::play(part),
        // What the benchmark calls to measure the memory of one reader alone.
        ["peak", reader, path] => eds::peak::child(reader, path),
        _ => {
            eprintln!("usage: cargo xtask bench [sdo | eds [FILE] | files FOLDER | instructions | bus]");
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}
