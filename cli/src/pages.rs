//! Tests that every command in pages and in hints of the sources is valid.

use std::ffi::OsString;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use clap::{Command, CommandFactory};

use lexican_machine::{At, Machine};

use crate::machine::names;
use crate::{Cli, node_place};

/// All pages and sources, except the changelog, whose commands may be outdated.
fn pages(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the folder is there").map(|entry| entry.expect("it can be read")) {
        let (path, name) = (entry.path(), entry.file_name());
        let name = name.to_string_lossy();
        if path.is_dir() && !name.starts_with('.') && !["target", "node_modules"].contains(&&*name) {
            pages(&path, found);
        } else if (name.ends_with(".md") && name != "CHANGELOG.md") || (name.ends_with(".rs") && name != "pages.rs") {
            found.push(path);
        }
    }
}

/// A command in a page: a whole line of a code block, or a span between backquotes.
enum Said {
    Line(String),
    Span(String),
}

fn said(page: &str, is_source: bool) -> Vec<(usize, Said)> {
    let mut all = Vec::new();
    let mut block = None;
    for (at, line) in page.lines().enumerate() {
        let line_number = at + 1;
        if let Some(language) = line.trim_start().strip_prefix("```").filter(|_| !is_source) {
            block = if block.is_none() { Some(language) } else { None };
            continue;
        }
        match block {
            Some("text" | "rust" | "rust,ignore" | "python" | "toml" | "json" | "ini") => {}
            Some(_) => {
                let line = line.trim_start().trim_start_matches("$ ");
                for (begin, _) in line.match_indices("lexican ") {
                    let before = &line[..begin];
                    let is_word = before.is_empty() || before.ends_with(['(', ' ']) && !before.contains('#');
                    if is_word && !before.ends_with("-p ") && !before.ends_with("package ") {
                        all.push((line_number, Said::Line(line[begin..].to_owned())));
                    }
                }
            }
            None => {
                let spans = line.split('`').skip(1).step_by(2).filter(|span| span.starts_with("lexican "));
                // This is the first line of a simulated device's storage file, not a command.
                let spans = spans.filter(|span| !span.starts_with("lexican parameters"));
                all.extend(spans.map(|span| (line_number, Said::Span(span.to_owned()))));
            }
        }
    }
    all
}

/// The words of a line as in a shell, up to a comment, a pipe or the next command.
fn words(line: &str) -> Vec<OsString> {
    let ends = |word: &String| word.starts_with(['|', ';', '&', '>', '<', '(', ')']);
    let words = shlex::Shlex::new(line).take_while(|word| !ends(word));
    words.map(|word| word.trim_end_matches(')').into()).collect()
}

/// The machine of the demo.
const DEMO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/machines/line.toml");

/// What is wrong with a whole command line; `bus` is the value of `LEXICAN_BUS` in the page.
fn misread(line: &str, bus: Option<&str>) -> Option<String> {
    let words = words(line);
    if words.iter().any(|word| word == "..." || word == "\\") {
        return unknown(line);
    }
    let parse = |extra: Option<&str>| {
        let words = words.iter().cloned().chain(extra.iter().flat_map(|bus| ["--bus", bus]).map(OsString::from));
        // Pages use the node names of the demo, as if its machine had a bus.
        let demo = |_| {
            let mut machine = Machine::open(DEMO.as_ref()).ok()?;
            machine.bus.url = Some(At { value: "can0".to_owned(), span: 0..0 });
            Some((DEMO.into(), machine.into()))
        };
        let args = names::resolved_by(words.collect(), &Cli::command(), demo);
        let args = node_place::settled(args, &Cli::command());
        Cli::command().try_get_matches_from(args)
    };
    let error = parse(None).or_else(|error| parse(Some(bus.ok_or(error)?))).err()?;
    use clap::error::ErrorKind::{DisplayHelp, DisplayVersion};
    let text = error.to_string();
    (!matches!(error.kind(), DisplayHelp | DisplayVersion)).then(|| text.lines().next().unwrap_or_default().to_owned())
}

/// What is wrong with the mention of a command: an unknown subcommand or option.
fn unknown(mention: &str) -> Option<String> {
    let cli = Cli::command();
    let mut command: &Command = &cli;
    let mut words = words(mention).into_iter().skip(1).peekable();
    while let Some(below) = words.peek().and_then(|word| command.find_subcommand(word)) {
        (command, _) = (below, words.next());
    }
    if command.has_subcommands()
        && let Some(word) =
            words.peek().filter(|word| word.to_string_lossy().starts_with(|c: char| c.is_ascii_lowercase()))
    {
        return Some(format!("no subcommand {}", word.display()));
    }
    let has = |option: &str| {
        let mut arguments = command.get_arguments();
        ["help", "version"].contains(&option)
            || arguments.any(|arg| arg.get_long() == Some(option) || option == "node" && node_place::is_node(arg))
    };
    words.filter_map(|word| word.to_str().and_then(|word| word.strip_prefix("--")).map(str::to_owned)).find_map(
        |option| {
            let name = option.split('=').next().unwrap_or_default().trim_end_matches([',', '.', ';']);
            (!name.is_empty() && !has(name)).then(|| format!("no option --{name}"))
        },
    )
}

#[test]
fn every_command_in_every_page_is_understood() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace is above");
    let mut found = Vec::new();
    pages(root, &mut found);
    let (mut count, mut wrong) = (0, String::new());
    for page in found {
        let text = fs::read_to_string(&page).expect("it is a page");
        let bus = text.contains("LEXICAN_BUS").then_some("can0");
        for (line, said) in said(&text, page.extension().is_some_and(|extension| extension == "rs")) {
            count += 1;
            let (text, fault) = match said {
                Said::Line(text) => (text.clone(), misread(&text, bus)),
                Said::Span(text) => (text.clone(), unknown(&text)),
            };
            if let Some(fault) = fault {
                let page = page.strip_prefix(root).unwrap_or(&page).display();
                writeln!(wrong, "{page}:{line}: {text}\n    {fault}").expect("a string takes all");
            }
        }
    }
    assert!(wrong.is_empty(), "commands in pages that do not exist:\n{wrong}");
    assert!(count > 150, "the commands are found: {count}");
}

#[test]
fn a_wrong_command_is_noticed() {
    assert!(misread("lexican heartbeat --node 5 --bus can0", None).is_some());
    assert!(misread("lexican read --node 5 --bus can0", None).is_some());
    assert_eq!(misread("lexican scan > report.txt  # nodes", Some("can0")), None);
    assert!(unknown("lexican eds nothing").is_some());
    assert!(unknown("lexican drive --speed").is_some());
    assert_eq!(unknown("lexican drive 5 move-to"), None);
}
