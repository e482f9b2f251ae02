//! The lines of a sequence, all of which are checked before the first one runs.

use std::ffi::OsString;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::AtomicBool;

use lexican_eds::Source;
use lexican_runtime::NodeId;
use lexican_toolbox::drive::describe;
use lexican_toolbox::text::node_id::node_ids;

use super::wait::Wait;
use crate::bus::BusArgs;
use crate::machine::OnBus;
use crate::node_place::{Words, command};
use crate::output::{Failure, Outcome};

/// Commands that do not end by themselves, or that open buses of their own.
const REFUSED: [&str; 6] = ["run", "bench", "demo", "simulate", "chaos", "completions"];

/// What a sequence uses of the command.
#[derive(Clone, Copy)]
pub(crate) struct Shell {
    pub(crate) command: fn() -> clap::Command,
    /// Resolves the names of nodes.
    pub(crate) resolved: fn(Vec<OsString>, &clap::Command) -> Vec<OsString>,
    /// Checks arguments; returns the error text.
    pub(crate) check: fn(Vec<OsString>) -> Result<(), String>,
    pub(crate) run: fn(Vec<OsString>) -> Result<Outcome, Failure>,
}

/// What lines may refer to.
pub(crate) struct Context {
    pub(crate) shell: Shell,
    pub(crate) bus: BusArgs,
    pub(crate) as_json: bool,
    pub(crate) machine: Option<OnBus>,
}

pub(crate) struct Lines {
    pub(crate) steps: Vec<Line>,
    /// The orders that stop the drives, each with the name of its drive.
    pub(crate) stops: Vec<(String, Step)>,
}

pub(crate) struct Line {
    /// From 1.
    pub(crate) number: usize,
    pub(crate) text: String,
    pub(crate) step: Step,
}

pub(crate) enum Step {
    Wait(Wait),
    /// The arguments of a command, already checked.
    Command(Vec<OsString>),
}

impl Lines {
    /// Reads a sequence. The error text has all mistakes.
    pub(crate) fn read(source: &Source, context: &Context) -> Result<Self, String> {
        let machine = context.machine.as_deref();
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
            match Step::of(&words, context) {
                Ok(step) => steps.push(Line { number, text: text.to_owned(), step }),
                Err(why) => wrong += &format!("{}:{number}: {}\n", source.name(), why.trim_end()),
            }
        }
        if !wrong.is_empty() {
            return Err(wrong);
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
            Ok::<_, String>((who, Step::of(&words, context)?))
        };
        Ok(Lines { steps, stops: drives.into_iter().map(stop).collect::<Result<_, _>>()? })
    }
}

impl Step {
    fn of(words: &[String], Context { shell, bus, as_json, machine }: &Context) -> Result<Self, String> {
        match words.first().map(String::as_str) {
            Some("") => return Err("a quotation does not end".to_owned()),
            Some("wait") => return Wait::parse(&words[1..], machine.as_deref()).map(Step::Wait),
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
        if *as_json && takes("json") && !is_given("--json") {
            more.push("--json".into());
        }
        args.extend(more);
        let args = (shell.resolved)(args, &cli);
        (shell.check)(args.clone()).map(|()| Step::Command(args))
    }

    /// Runs the line. If the command panics, it has failed.
    pub(crate) fn carry_out(&self, context: &Context, interrupted: &AtomicBool) -> Result<Outcome, Failure> {
        let run = || match self {
            Step::Wait(wait) => wait.run(&context.bus, context.as_json, interrupted),
            Step::Command(words) => (context.shell.run)(words.clone()),
        };
        catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|_| Err(Failure::new("the command has crashed: see above")))
    }

    /// The nodes that the line talks to, if it names any.
    pub(crate) fn nodes(&self, shell: Shell) -> Option<Vec<NodeId>> {
        match self {
            Step::Wait(wait) => Some(wait.until.iter().map(|until| until.node).collect()),
            Step::Command(args) => {
                let cli = (shell.command)();
                let (command, begin) = command(args, &cli);
                let (at, prefix) = Words { args, command }.node_word(begin)?;
                node_ids(&args[at].to_str()?[prefix..]).ok()
            }
        }
    }
}
