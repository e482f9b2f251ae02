//! Tests the common style of all commands: the same name means the same in each of them.

use std::collections::BTreeMap;

use clap::{Arg, ArgAction, Command, CommandFactory};

use crate::Cli;

/// All commands that do something, with their full names.
fn commands() -> Vec<(String, Command)> {
    fn collect(above: &str, command: &Command, all: &mut Vec<(String, Command)>) {
        let name = format!("{above} {}", command.get_name()).trim().to_owned();
        if !command.has_subcommands() {
            all.push((name.clone(), command.clone()));
        }
        command.get_subcommands().for_each(|below| collect(&name, below, all));
    }
    let mut all = Vec::new();
    collect("", &Cli::command(), &mut all);
    all
}

/// The kind of an argument: the name of its value, or that it is a flag.
fn kind(arg: &Arg) -> String {
    match arg.get_action() {
        ArgAction::SetTrue => "flag".to_owned(),
        _ => arg.get_value_names().unwrap_or_default().iter().map(ToString::to_string).collect(),
    }
}

/// The kind regardless of how many it is for: `NODES` becomes `NODE`, and `NODE=FILE`, which is said of one node, becomes
/// `FILE`.
fn of_any_number(kind: &str) -> String {
    match kind {
        "NODES" | "NODE[=DEVICE]" => "NODE".to_owned(),
        "NODE=DEVICE" => "FILE|DEVICE".to_owned(),
        "NODE=FILE" => "FILE".to_owned(),
        "COB-IDS" => "COB-ID".to_owned(),
        kind => kind.to_owned(),
    }
}

#[test]
fn an_option_takes_the_same_in_every_command() {
    let mut options: BTreeMap<String, BTreeMap<String, Vec<String>>> = BTreeMap::new();
    for (name, command) in commands() {
        for arg in command.get_arguments() {
            let Some(long) = arg.get_long() else { continue };
            let kinds = options.entry(long.to_owned()).or_default();
            kinds.entry(of_any_number(&kind(arg))).or_default().push(name.clone());
        }
    }
    let clashes: Vec<_> = options.iter().filter(|(_, kinds)| kinds.len() > 1).collect();
    assert!(clashes.is_empty(), "options that take different things: {clashes:#?}");
    assert!(options.len() > 80, "the options are found");
}

#[test]
fn a_command_takes_its_node_first_or_by_an_option_but_not_both_ways() {
    for (name, command) in commands() {
        let is_node = |arg: &&Arg| of_any_number(&kind(arg)) == "NODE";
        let option = command.get_arguments().filter(is_node).any(|arg| arg.get_long() == Some("node"));
        let place = command.get_positionals().position(|arg| is_node(&arg));
        assert!(!(option && place.is_some()), "{name} takes its node in two ways");
        assert!(place.is_none_or(|place| place == 0), "{name} takes its node behind something else");
    }
}

/// A duration has its unit, in defaults as well; and the file that a command produces is its `--output`.
#[test]
fn values_are_named_in_one_way() {
    for (name, command) in commands() {
        for arg in command.get_arguments() {
            let kind = kind(arg);
            let long = arg.get_long().unwrap_or_default();
            assert!(!["MS", "SECONDS", "ID", "IDS"].contains(&&*kind), "{name} --{long} {kind}");
            let defaults = arg.get_default_values().iter().filter_map(|value| value.to_str());
            for default in defaults.filter(|_| kind == "TIME") {
                assert!(default.ends_with(char::is_alphabetic), "{name} --{long}: {default} has no unit");
            }
            assert!(arg.get_short() != Some('o') || long == "output", "{name} -o is --{long}");
        }
    }
}
