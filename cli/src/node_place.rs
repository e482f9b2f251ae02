//! Accepts a node both as `--node 5` and as the first word `5`, whichever of them a command has.

use std::ffi::{OsStr, OsString};

use clap::{Arg, Command};
use lexican_toolbox::text::node_id::node_ids;

/// Moves the node to where its command has it. Clap reports what cannot be understood.
pub(crate) fn settled(mut args: Vec<OsString>, cli: &Command) -> Vec<OsString> {
    let (command, begin) = command(&args, cli);
    let by_place = command.get_positionals().next().is_some_and(is_node);
    let by_option = command.get_arguments().any(|arg| arg.get_long() == Some("node"));
    let words = Words { args: &args, command };
    if by_place && !by_option {
        if let Some((at, len, node)) = words.option(begin) {
            args.drain(at..at + len);
            args.insert(begin, node);
        }
    } else if by_option
        && words.option(begin).is_none()
        && let Some(at) = words.node(begin)
    {
        args.insert(at, "--node".into());
    }
    args
}

/// The command in the arguments, and the position of its own arguments.
pub(crate) fn command<'c>(args: &[OsString], cli: &'c Command) -> (&'c Command, usize) {
    let (mut command, mut begin) = (cli, 1);
    while let Some(below) = args.get(begin).and_then(|name| command.find_subcommand(name)) {
        (command, begin) = (below, begin + 1);
    }
    (command, begin)
}

/// Whether an argument takes a node or several nodes.
pub(crate) fn is_node(arg: &Arg) -> bool {
    arg.get_value_names()
        .is_some_and(|names| names.iter().any(|name| ["NODE", "NODES", "NODE|none"].contains(&name.as_str())))
}

/// The words of a command line after the command, with the command.
pub(crate) struct Words<'a> {
    pub(crate) args: &'a [OsString],
    pub(crate) command: &'a Command,
}

impl Words<'_> {
    /// The position of `--node`, the number of its words, and its value.
    fn option(&self, begin: usize) -> Option<(usize, usize, OsString)> {
        let end = self.args.iter().position(|word| word == "--").unwrap_or(self.args.len());
        (begin..end).find_map(|at| match self.args[at].to_str()? {
            "--node" => Some((at, 2, self.args[..end].get(at + 1)?.clone())),
            word => Some((at, 1, word.strip_prefix("--node=")?.into())),
        })
    }

    /// The position of the word that may be the name of a node, and the length of what precedes the name in it.
    #[cfg(feature = "full")]
    pub(crate) fn node_word(&self, begin: usize) -> Option<(usize, usize)> {
        let takes_option = self.command.get_arguments().any(|arg| arg.get_long() == Some("node"));
        let takes_place = self.command.get_positionals().next().is_some_and(is_node);
        match self.option(begin) {
            Some((at, 2, _)) => Some((at + 1, 0)),
            Some((at, _, _)) => Some((at, "--node=".len())),
            None if takes_option || takes_place => self.place(begin).map(|at| (at, 0)),
            None => None,
        }
    }

    /// The file in `--machine`.
    #[cfg(feature = "full")]
    pub(crate) fn machine(&self, begin: usize) -> Option<std::path::PathBuf> {
        let first = self.command.get_positionals().next()?;
        let is_machine = first.get_value_names().is_some_and(|names| names.iter().any(|name| name == "MACHINE"));
        self.places(begin).first().filter(|_| is_machine).map(|at| (&self.args[*at]).into())
    }

    /// The position of a node without `--node`: the first word, or the one after a fixed choice, as in `nmt start`. It
    /// cannot be an object, because indices up to 007Fh are data types.
    fn node(&self, begin: usize) -> Option<usize> {
        let at = self.place(begin)?;
        let text = self.args[at].to_str()?;
        let decimal = text.starts_with(|c: char| c.is_ascii_digit() && c != '0');
        (decimal && node_ids(text).is_ok()).then_some(at)
    }

    /// The position of the first word that may be a node.
    fn place(&self, begin: usize) -> Option<usize> {
        let mut positionals = self.command.get_positionals();
        let chosen = positionals.next().is_some_and(|arg| !arg.get_possible_values().is_empty());
        self.places(begin).get(usize::from(chosen)).copied()
    }

    /// The positions of words that are neither options nor their values.
    fn places(&self, begin: usize) -> Vec<usize> {
        let mut places = Vec::new();
        let mut at = begin;
        while let Some(word) = self.args.get(at) {
            if word == "--" {
                break;
            }
            match self.option_of(word) {
                Some(takes_next) => at += usize::from(takes_next),
                None => places.push(at),
            }
            at += 1;
        }
        places
    }

    /// Whether the next word is the value of this option; `None` if this is no option.
    fn option_of(&self, word: &OsStr) -> Option<bool> {
        let word = word.to_str()?.strip_prefix('-').filter(|rest| !rest.is_empty())?;
        let known = |arg: &&Arg| match word.strip_prefix('-') {
            Some(long) => arg.get_long_and_visible_aliases().is_some_and(|names| names.contains(&long)),
            None => word.len() == 1 && arg.get_short() == word.chars().next(),
        };
        Some(self.command.get_arguments().find(known).is_some_and(|arg| arg.get_action().takes_values()))
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    fn settle(line: &str) -> String {
        let args = line.split(' ').map(OsString::from).collect();
        let settled = settled(args, &crate::Cli::command());
        settled.join(OsStr::new(" ")).into_string().expect("it is text")
    }

    #[test]
    fn a_node_is_taken_by_its_place_and_by_its_option() {
        for (typed, taken) in [
            ("lexican check --bus can0 --node 5 --device x.eds", "lexican check 5 --bus can0 --device x.eds"),
            ("lexican drive --node=5 move-to 3", "lexican drive 5 move-to 3"),
            ("lexican pdo show --bus can0 --node 5-7 tpdo1", "lexican pdo show 5-7 --bus can0 tpdo1"),
            ("lexican lss node-id --node 9 --bus can0", "lexican lss node-id 9 --bus can0"),
            ("lexican read 5 6041 --bus can0", "lexican read --node 5 6041 --bus can0"),
            ("lexican read --bus can0 5,6 6041", "lexican read --bus can0 --node 5,6 6041"),
            ("lexican write --bus can0 5 6060 3", "lexican write --bus can0 --node 5 6060 3"),
            ("lexican nmt start 5 --bus can0", "lexican nmt start --node 5 --bus can0"),
            ("lexican watch 5 statusword --bus can0", "lexican watch --node 5 statusword --bus can0"),
            ("lexican monitor 5 --bus can0", "lexican monitor --node 5 --bus can0"),
        ] {
            assert_eq!(settle(typed), taken);
        }
    }

    #[test]
    fn nothing_else_is_taken_for_a_node() {
        for line in [
            "lexican",
            "lexican read --bus can0 6041",
            "lexican read --bus can0 --node 5 6041",
            "lexican write --bus can0 6060 3",
            "lexican write --bus can0 --node 5 6060 3",
            "lexican nmt start --all --bus can0",
            "lexican watch --bus can0 --every 5 statusword",
            "lexican read -- 5",
            "lexican drive 5 move-to 7",
            "lexican boot --node 5=x.eds --bus can0",
            "lexican eds lint 5",
            "lexican check --node",
            "lexican scan --node 5",
        ] {
            assert_eq!(settle(line), line);
        }
    }
}
