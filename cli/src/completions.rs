//! `lexican completions` and `lexican man`: shell completions and man pages, made from the arguments of all commands.

use std::ffi::OsStr;
use std::io::Write;
use std::path::PathBuf;

use clap::Command;
use clap_complete::engine::{CompletionCandidate, PathCompleter, ValueCompleter};
use clap_complete::env::{CompleteEnv, Shells};
use lexican_eds::library;
use lexican_eds::model::{Device, Entry, Object};
use lexican_toolbox::values::{address, name};

use crate::bus::{BUS, SheetName};
use crate::output::{Failure, Outcome, raw_stdout};
use lexican_toolbox::data_sheet::find;

/// The environment variable in which a shell asks for completions.
const ASK: &str = "LEXICAN_COMPLETE";

/// Print completions for a shell
///
/// They complete commands, options, devices and object names; these come from the data sheet that is named by --device or by
/// the URL of the bus (also in LEXICAN_BUS). The shell asks the command itself for them, so they need not be made anew for a new version.
#[derive(clap::Args, Debug)]
#[command(after_help = COMPLETIONS_EXAMPLES)]
pub(crate) struct CompletionsArgs {
    /// The shell
    #[arg(value_parser = ["bash", "elvish", "fish", "powershell", "zsh"])]
    shell: String,
}

const COMPLETIONS_EXAMPLES: &str = "\
Examples:
    source <(lexican completions bash)                    (in ~/.bashrc)
    lexican completions zsh > ~/.zfunc/_lexican
    lexican completions fish > ~/.config/fish/completions/lexican.fish";

/// Write a man page for each command into a folder
///
/// The files are lexican.1, lexican-read.1, lexican-eds-lint.1 and so on.
#[derive(clap::Args, Debug)]
#[command(after_help = MAN_EXAMPLES)]
pub(crate) struct ManArgs {
    /// The folder to write them into
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

const MAN_EXAMPLES: &str = "\
Examples:
    lexican man ~/.local/share/man/man1";

/// If a shell asks for completions, prints them and ends the process.
pub(crate) fn answer(command: fn() -> Command) {
    CompleteEnv::with_factory(command).var(ASK).complete();
}

pub(crate) fn completions(args: &CompletionsArgs) -> Result<Outcome, Failure> {
    let shells = Shells::builtins();
    let shell = shells.completer(&args.shell).expect("the argument is one of these shells");
    let mut stdout = raw_stdout();
    shell.write_registration(ASK, NAME, NAME, NAME, &mut stdout)?;
    stdout.flush()?;
    Ok(Outcome::Clean)
}

pub(crate) fn man(args: &ManArgs, command: Command) -> Result<Outcome, Failure> {
    let failed = |error| Failure::file("write", &args.folder, &error);
    std::fs::create_dir_all(&args.folder).map_err(failed)?;
    clap_mangen::generate_to(command, &args.folder).map_err(failed)?;
    Ok(Outcome::Clean)
}

const NAME: &str = "lexican";

/// Completes devices of the library, and files.
pub(crate) fn devices(current: &OsStr) -> Vec<CompletionCandidate> {
    let begins = |id: &&str| id.starts_with(&*current.to_string_lossy());
    let known = library::all().iter().map(|shipped| shipped.id).filter(begins).map(CompletionCandidate::new);
    known.chain(PathCompleter::file().complete(current)).collect()
}

/// Completes objects of the device on the command line: by index if the word begins with a digit, else by name.
pub(crate) fn objects(current: &OsStr) -> Vec<CompletionCandidate> {
    let Some(device) = device_of(std::env::args(), std::env::var(BUS).ok()) else { return Vec::new() };
    let current = current.to_string_lossy().to_lowercase();
    let by_index = current.starts_with(|first: char| first.is_ascii_digit());
    let candidate = |object: &Object, entry: &Entry| {
        let is_single = object.entries.len() == 1;
        let index = format!("{:04X}", object.index);
        let (object, sub) = match by_index {
            true => (index, format!("{:02X}", entry.sub)),
            false => (one_word(&object.name), one_word(&entry.name)),
        };
        let text = if is_single { object } else { format!("{object}/{sub}") };
        let help = if by_index { name(&device, entry) } else { address(entry).to_string() };
        text.to_lowercase().starts_with(&current).then(|| CompletionCandidate::new(text).help(Some(help.into())))
    };
    let entries = device.objects.iter().flat_map(|object| object.entries.iter().map(move |entry| (object, entry)));
    entries.filter_map(|(object, entry)| candidate(object, entry)).collect()
}

/// A name as one word that needs no quotes: `Position-Actual-Value`. It means the same object.
fn one_word(name: &str) -> String {
    let words = name.split(|letter: char| !letter.is_alphanumeric()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("-")
}

/// The data sheet in `--device`, or else in the URL of the bus.
fn device_of(args: impl Iterator<Item = String>, bus: Option<String>) -> Option<Device> {
    let args: Vec<_> = args.collect();
    let value = |option: &str| {
        let next =
            args.iter().zip(args.iter().skip(1)).find(|(name, _)| *name == option).map(|(_, value)| value.clone());
        next.or_else(|| Some(args.iter().find_map(|arg| arg.strip_prefix(option)?.strip_prefix('='))?.to_owned()))
    };
    let of_bus = |url: String| {
        let (head, parameters) = url.split_once('?').unwrap_or((&url, ""));
        let named = parameters.split('&').find_map(|parameter| parameter.strip_prefix("device="));
        head.strip_prefix("sim:").or(named).map(str::to_owned)
    };
    let named = value("--device").and_then(|named| Some(named.parse::<SheetName>().ok()?.sheet));
    let name = named.or_else(|| of_bus(value("--bus").or(bus)?))?;
    // Silently: the shell expects nothing but candidates.
    Some(lexican_eds::device(&find(&name).ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_device_is_named_by_the_command_line_or_by_the_bus() {
        for (args, bus, known) in [
            ("read --device siko/ag03-1 ", None, true),
            ("read --device=siko/ag03-1 ", None, true),
            ("read --device 5=siko/ag03-1 ", None, true),
            ("read --bus sim:siko/ag03-1?node=5 ", None, true),
            ("read --bus serial:/dev/ttyUSB0?baud=9600&device=siko/ag02 ", None, true),
            ("read ", Some("sim:siko/ag02"), true),
            ("read --bus can0 ", Some("sim:siko/ag02"), false),
            ("read ", None, false),
            ("read --device none ", None, false),
        ] {
            let device = device_of(args.split(' ').map(str::to_owned), bus.map(str::to_owned));
            assert_eq!(device.is_some(), known, "{args}");
        }
    }
}
