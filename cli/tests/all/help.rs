//! The help of every command, and the advice for mistyped ones.

use crate::common::lexican;

/// The names of the subcommands that a help text lists.
fn listed(help: &str) -> Vec<String> {
    let lines = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let lines = lines.take_while(|line| line.starts_with("  "));
    // Further lines of a description have a larger indent.
    let names = lines.filter(|line| !line.starts_with("   ")).filter_map(|line| line.split_whitespace().next());
    names.filter(|name| *name != "help").map(str::to_owned).collect()
}

/// Checks the help of a command and of its subcommands; returns their number.
fn check(command: &[&str]) -> usize {
    let run = lexican(&[command, &["--help"]].concat());
    let name = command.join(" ");
    assert_eq!(run.code, Some(0), "{name}: {}", run.stderr);
    let first = run.stdout.lines().next().unwrap_or_default();
    assert!(first.len() > 20 && !first.starts_with("Usage"), "{name} begins with {first:?}");
    assert!(run.stdout.contains(&format!("Usage: lexican {name}").trim_end().to_owned()), "{name}: {}", run.stdout);
    // Every option has a description, in its own line or in the next one.
    let lines: Vec<_> = run.stdout.lines().collect();
    for (at, line) in lines.iter().enumerate().filter(|(_, line)| line.trim_start().starts_with("--")) {
        let explained = line.trim().contains("  ") || lines.get(at + 1).is_some_and(|next| !next.trim().is_empty());
        assert!(explained, "{name}: {line:?}");
    }
    let below = listed(&run.stdout);
    1 + below.iter().map(|below| check(&[command, &[below.as_str()]].concat())).sum::<usize>()
}

#[test]
fn every_command_explains_itself() {
    assert!(check(&[]) > 20, "the commands are found in the help");
}

#[test]
fn without_arguments_every_command_says_what_it_needs() {
    let help = lexican(&[]);
    help.on_stderr(2, "Commands:");
    assert!(help.stderr.contains("lexican simulate siko/ag03-1"), "how to begin: {}", help.stderr);
    for command in ["scan", "read", "write", "nmt", "monitor", "check", "gen", "simulate"] {
        let run = lexican(&[command]);
        run.on_stderr(2, "required arguments");
        assert!(run.stderr.contains(&format!("Usage: lexican {command}")), "{command}: {}", run.stderr);
    }
    lexican(&["bench"]).on_stderr(2, "lexican bench --demo              (a simulated plant)");
    let devices = lexican(&["devices"]);
    assert!(devices.code == Some(0) && devices.stdout.contains("siko/ag03-1"));
}

#[test]
fn a_misspelt_command_or_option_finds_its_name() {
    for (args, words) in [
        (&["moniter"][..], "'monitor'"),
        (&["scan", "--buss", "can0"], "'--bus'"),
        (&["nmt", "--bus", "can0", "reset", "--all"], "reset-node"),
    ] {
        lexican(args).on_stderr(2, words);
    }
}
