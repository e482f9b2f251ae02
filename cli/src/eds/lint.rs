//! `lexican eds lint`: what is wrong in data sheets.

use std::io::Write;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use indicatif::ProgressBar;
use lexican_eds::report::sarif;
use lexican_eds::{Diagnostic, Diagnostics, Input, Severity};

use crate::device::{input, no_object, with_overlays};
use crate::output::{self, Failure, Outcome, progress};

/// Check data sheets: every finding with its place, the line it is about, and how to mend it
///
/// Files are read as leniently as can be; what was guessed is reported. Exit code 0: nothing found at or
/// above --fail-on; 1: something found; 2: a file cannot be read or is no data sheet at all.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// EDS or DCF files, or devices that lexican knows (see `lexican devices`)
    #[arg(required = true, value_name = "FILE|DEVICE")]
    files: Vec<String>,

    /// Corrections and meanings, applied to every file; may be given several times
    #[arg(long, value_name = "FILE")]
    overlay: Vec<PathBuf>,

    /// How to print the findings
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,

    /// Which findings make the command fail
    #[arg(long, value_enum, default_value_t = Level::Error)]
    fail_on: Level,

    /// Take every warning for an error
    #[arg(long)]
    strict: bool,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    /// The lines of the file with the findings written below them
    Text,
    /// One line per finding: file, line, column, severity, code, message
    Short,
    /// One JSON document with all files and findings
    Json,
    /// SARIF 2.1.0, as code review tools read it
    Sarif,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum Level {
    /// Errors: nothing correct can be made of the line
    Error,
    /// Warnings and errors
    Warning,
    /// Any finding
    Note,
}

/// What became of one file.
#[derive(Default)]
struct Checked {
    /// The findings; `None` when there is no file to find anything in.
    findings: Option<(Input, Diagnostics)>,
    /// Why the file is no data sheet.
    failure: Option<Failure>,
    /// The findings as text, made where the file was checked so that it is done in parallel.
    text: String,
}

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let colours = output::colours();
    let checked = in_parallel(&args.files, |name| check(args, name, colours));

    print(args.format, &checked)?;
    for failure in checked.iter().filter_map(|it| it.failure.as_ref()) {
        failure.report();
    }
    summarise(&checked);

    let worst = checked.iter().filter_map(|it| it.findings.as_ref()?.1.worst()).max();
    let fail_on = match args.fail_on {
        Level::Error => Severity::Error,
        Level::Warning => Severity::Warning,
        Level::Note => Severity::Note,
    };
    Ok(if checked.iter().any(|it| it.failure.is_some()) {
        Outcome::Unreadable
    } else if worst >= Some(fail_on) {
        Outcome::Found
    } else {
        Outcome::Clean
    })
}

fn check(args: &Args, name: &str, colours: bool) -> Checked {
    let input = match input(name).and_then(|input| with_overlays(input, &args.overlay)) {
        Ok(input) => input,
        Err(failure) => return Checked { failure: Some(failure), ..Checked::default() },
    };
    let (device, mut diagnostics) = lexican_eds::load(&input);
    if args.strict {
        let codes: Vec<_> =
            diagnostics.iter().filter(|it| it.severity == Severity::Warning).map(|it| it.code).collect();
        codes.into_iter().for_each(|code| diagnostics.deny(code));
    }
    let text = match args.format {
        Format::Text if colours => diagnostics.render_styled(&input),
        Format::Text => diagnostics.render(&input),
        Format::Short => diagnostics.iter().map(|finding| short(finding, &input)).collect(),
        Format::Json | Format::Sarif => String::new(),
    };
    let failure = device.objects.is_empty().then(|| no_object(&input));
    Checked { findings: Some((input, diagnostics)), failure, text }
}

/// One line that begins with the name of the file, also when the finding has no place in it.
fn short(finding: &Diagnostic, input: &Input) -> String {
    let line = finding.render_short(input);
    if finding.span().is_some() { line + "\n" } else { format!("{}: {line}\n", input.eds.name()) }
}

/// Calls `work` for every item on all processors; the results are in the order of the items.
fn in_parallel<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    // Where there is little to do, nobody would want to see a bar.
    let progress = match items.len() {
        0..8 => ProgressBar::hidden(),
        many => progress("{bar:40.cyan/dim} {pos}/{len} data sheets", many as u64),
    };
    let next = AtomicUsize::new(0);
    let results = Mutex::new(Vec::with_capacity(items.len()));
    let worker = || {
        while let Some((number, item)) = {
            let number = next.fetch_add(1, Ordering::Relaxed);
            items.get(number).map(|item| (number, item))
        } {
            let result = work(item);
            results.lock().expect("no worker panics").push((number, result));
            progress.inc(1);
        }
    };
    let workers = std::thread::available_parallelism().map_or(1, usize::from).min(items.len());
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(worker);
        }
    });
    progress.finish_and_clear();
    let mut results = results.into_inner().expect("no worker panics");
    results.sort_by_key(|(number, _)| *number);
    results.into_iter().map(|(_, result)| result).collect()
}

fn print(format: Format, checked: &[Checked]) -> Result<(), Failure> {
    let mut stdout = output::raw_stdout();
    let all = || checked.iter().filter_map(|it| it.findings.as_ref());
    match format {
        Format::Text | Format::Short => checked.iter().try_for_each(|it| stdout.write_all(it.text.as_bytes()))?,
        Format::Json => {
            let files: Vec<_> = all()
                .map(|(input, findings)| {
                    serde_json::json!({ "file": input.eds.name(), "findings": findings.to_json(input) })
                })
                .collect();
            writeln!(stdout, "{:#}", serde_json::json!({ "files": files }))?;
        }
        Format::Sarif => writeln!(stdout, "{:#}", sarif(all().map(|(input, findings)| (input, findings))))?,
    }
    stdout.flush()?;
    Ok(())
}

/// One line on stderr, so that it neither disturbs a pipe nor is missed.
fn summarise(checked: &[Checked]) {
    let count = |severity| -> usize {
        checked.iter().filter_map(|it| it.findings.as_ref()).map(|(_, findings)| findings.count(severity)).sum()
    };
    let plural = |number: usize, what: &str| format!("{number} {what}{}", if number == 1 { "" } else { "s" });
    let unreadable = checked.iter().filter(|it| it.failure.is_some()).count();
    let lost = if unreadable > 0 { format!(", {unreadable} not readable") } else { String::new() };
    let _ = writeln!(
        anstream::stderr().lock(),
        "{}: {}, {}, {}{lost}",
        plural(checked.len(), "data sheet"),
        plural(count(Severity::Error), "error"),
        plural(count(Severity::Warning), "warning"),
        plural(count(Severity::Note), "note"),
    );
}
