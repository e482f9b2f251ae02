//! Compares the README of an example with its program. `cargo xtask bless` updates the README.

use std::path::Path;

/// Runs the commands in the README, whose number is `commands_shown`, and compares output and pictures byte by byte.
/// `run` gets the arguments of the program and returns its output.
pub(crate) fn check(package: &str, commands_shown: usize, run: impl Fn(&[&str]) -> String) {
    let bless = std::env::var_os("LEXICAN_BLESS").is_some();
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut readme = std::fs::read_to_string(here.join("README.md")).expect("there is a README");
    let begin = format!("$ cargo run -p {package} -- ");
    let commands: Vec<String> =
        readme.lines().filter_map(|line| line.strip_prefix(&begin)).map(str::to_owned).collect();
    assert_eq!(commands.len(), commands_shown, "{commands:?}");
    let mut stale = Vec::new();
    for command in commands {
        let folder = format!("examples/{package}/");
        let mut args: Vec<String> = command.split_whitespace().map(|arg| arg.replace(&folder, "")).collect();
        let picture = args.iter().position(|arg| arg == "--plot").map(|at| {
            let golden = here.join(&args[at + 1]);
            let drawn = Path::new(env!("CARGO_TARGET_TMPDIR")).join(golden.file_name().expect("it is a file"));
            args[at + 1] = drawn.to_str().expect("UTF-8").to_owned();
            (drawn, golden)
        });
        let stdout = run(&args.iter().map(String::as_str).collect::<Vec<_>>());
        let begin = readme.find(&command).expect("it was found there") + command.len() + 1;
        let end = begin + readme[begin..].find("```").expect("the block ends");
        let is_stale = readme[begin..end] != stdout;
        let drawn = picture.map(|(drawn, golden)| (std::fs::read_to_string(drawn).expect("it was drawn"), golden));
        if bless {
            readme.replace_range(begin..end, &stdout);
            drawn.iter().for_each(|(text, golden)| std::fs::write(golden, text).expect("the folder is writable"));
        } else if is_stale || drawn.is_some_and(|(text, golden)| std::fs::read_to_string(golden).ok() != Some(text)) {
            stale.push(command);
        }
    }
    if bless {
        std::fs::write(here.join("README.md"), readme).expect("the folder is writable");
    }
    assert!(stale.is_empty(), "{stale:?}: `cargo xtask bless` takes over what they do now");
}
