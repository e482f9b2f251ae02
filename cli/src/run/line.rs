//! The lines of a sequence, understood before any of them runs.

use std::ffi::OsString;

use lexican_eds::Source;
use lexican_machine::Machine;
use lexican_toolbox::drive::describe;

use super::wait::Wait;
use crate::bus::BusArgs;
use crate::node_place::command;
use crate::output::{Failure, Outcome};

/// What does not end by itself, or opens buses of its own.
const REFUSED: [&str; 6] = ["run", "bench", "demo", "simulate", "chaos", "completions"];

/// What the whole command does with its arguments.
#[derive(Clone, Copy)]
pub(crate) struct Shell {
    pub(crate) command: fn() -> clap::Command,
    /// Names of nodes replaced by what the machine says of them.
    pub(crate) resolved: fn(Vec<OsString>, &clap::Command) -> Vec<OsString>,
    /// Whether it understands them; if not, why.
    pub(crate) check: fn(Vec<OsString>) -> Result<(), String>,
    pub(crate) run: fn(Vec<OsString>) -> Result<Outcome, Failure>,
}

pub(super) struct Lines {
    pub(super) steps: Vec<Line>,
    /// What stops the drives, each with its name.
    pub(super) stops: Vec<(String, Step)>,
}

pub(super) struct Line {
    /// From 1.
    pub(super) number: usize,
    pub(super) text: String,
    pub(super) step: Step,
}

pub(super) enum Step {
    Wait(Wait),
    /// The arguments of a command, which have been understood.
    Command(Vec<OsString>),
}

impl Lines {
    /// Reads a sequence; all of its mistakes are in the failure.
    pub(super) fn read(
        source: &Source,
        shell: Shell,
        bus: &BusArgs,
        as_json: bool,
        machine: Option<&Machine>,
    ) -> Result<Self, Failure> {
        let (mut steps, mut wrong) = (Vec::new(), String::new());
        let mut drives: Vec<String> = Vec::new();
        for (number, text) in (1..).zip(source.text().lines()) {
            let text = text.trim();
            let words = match shlex::split(text) {
                Some(words) if words.is_empty() => continue,
                Some(words) => words,
                None => vec![String::new()],
            };
            if let [first, who, ..] = words.as_slice()
                && first == "drive"
                && !drives.contains(who)
            {
                drives.push(who.clone());
            }
            match Step::of(&words, shell, bus, as_json, machine) {
                Ok(step) => steps.push(Line { number, text: text.to_owned(), step }),
                Err(why) => wrong += &format!("{}:{number}: {}\n", source.name(), why.trim_end()),
            }
        }
        if !wrong.is_empty() {
            return Err(Failure::new("the sequence cannot run: nothing was done").after(wrong + "\n"));
        }
        let of_machine = machine.iter().flat_map(|machine| &machine.nodes).filter(|node| {
            node.id.is_some() && node.sheet.as_ref().is_some_and(|sheet| describe(&sheet.input).is_ok())
        });
        let id = |who: &str| machine.and_then(|machine| machine.node(who)?.id).map(|id| id.to_string());
        for node in of_machine {
            if !drives.iter().any(|who| *who == node.name.value || id(&node.name) == Some(who.clone())) {
                drives.push(node.name.value.clone());
            }
        }
        let stop = |who: String| {
            let words = ["drive", &who, "stop"].map(str::to_owned);
            let step = Step::of(&words, shell, bus, as_json, machine).map_err(Failure::new)?;
            Ok::<_, Failure>((who, step))
        };
        Ok(Lines { steps, stops: drives.into_iter().map(stop).collect::<Result<_, _>>()? })
    }
}

impl Step {
    fn of(
        words: &[String],
        shell: Shell,
        bus: &BusArgs,
        as_json: bool,
        machine: Option<&Machine>,
    ) -> Result<Self, String> {
        match words.first().map(String::as_str) {
            Some("") => return Err("a quotation does not end".to_owned()),
            Some("wait") => return Wait::parse(&words[1..], machine).map(Step::Wait),
            Some(word) if REFUSED.contains(&word) => return Err(format!("`{word}` has no place in a sequence")),
            _ => {}
        }
        let cli = (shell.command)();
        let mut args: Vec<OsString> = ["lexican".to_owned()].iter().chain(words).map(OsString::from).collect();
        let takes = |long: &str| command(&args, &cli).0.get_arguments().any(|arg| arg.get_long() == Some(long));
        let is_given = |long: &str| words.iter().any(|word| word.split('=').next() == Some(long));
        let mut more: Vec<OsString> = Vec::new();
        if takes("bus") && !is_given("--bus") {
            more.extend(["--bus".into(), bus.url().to_string().into()]);
        }
        if as_json && takes("json") && !is_given("--json") {
            more.push("--json".into());
        }
        args.extend(more);
        let args = (shell.resolved)(args, &cli);
        (shell.check)(args.clone()).map(|()| Step::Command(args))
    }
}
