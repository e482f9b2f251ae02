//! `lexican eds lint`: checks data sheets.

use std::io::Write;
use std::path::PathBuf;
use std::sync::mpsc::sync_channel;

use anstream::adapter::strip_str;
use indicatif::ProgressBar;
use lexican_eds::fix::{Fixed, fix};
use lexican_eds::report::sarif;
use lexican_eds::{Diagnostic, Input, Severity};
use serde_json::{Value, json};

use super::file;
use crate::output::{self, Failure, Outcome, plural, progress};
use lexican_toolbox::data_sheet::{DataSheet, DataSheetError, find, with_overlays};

/// Check data sheets: prints each finding with its place, the line, and a remedy
///
/// Files are read leniently; guesses are reported. Exit code 0 without findings at or above --fail-on, 1 with
/// findings, 2 if a file cannot be read or is no data sheet.
///
/// With --fix, what has one right answer is mended in the files first: counts, the numbering of lists, keys and sections
/// that come twice with the same content, odd spellings. All other lines stay byte for byte, and so does a finding that
/// several things could mend.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// EDS, DCF or XDD files, or devices that lexican knows (see `lexican devices`)
    #[arg(required = true, value_name = "FILE|DEVICE")]
    files: Vec<String>,

    /// Corrections and meanings, applied to every file; may be given several times
    #[arg(long, value_name = "FILE")]
    overlay: Vec<PathBuf>,

    /// How to print the findings
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,

    /// Print one JSON document with all files and findings
    #[arg(long, conflicts_with = "format")]
    json: bool,

    /// The level of findings with exit code 1
    #[arg(long, value_enum, default_value_t = Level::Error)]
    fail_on: Level,

    /// Treat warnings as errors
    #[arg(long)]
    strict: bool,

    /// Mend what has one right answer, in the files
    #[arg(long)]
    fix: bool,

    /// Print what --fix would change, and leave the files as they are; exit code 1 if there is anything
    #[arg(long, requires = "fix")]
    dry_run: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican eds lint drive.eds --fail-on warning
    lexican eds lint drive.eds --fix --dry-run
    lexican eds lint *.eds --format sarif > findings.sarif";

#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    /// The lines of the file with the findings below them
    Text,
    /// One line per finding: file, line, column, severity, code, message
    Short,
    #[value(skip)]
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

impl Args {
    const fn format(&self) -> Format {
        if self.json { Format::Json } else { self.format }
    }
}

/// The result for one file. It keeps only text, since there may be thousands of files.
#[derive(Default)]
struct Checked {
    /// In the requested format; empty if the file cannot be read.
    text: String,
    /// In SARIF, if that is the format.
    sarif: Option<Value>,
    /// The numbers of errors, warnings and notes.
    counts: [usize; 3],
    /// The number of findings that were fixed, or would be.
    fixed: usize,
    /// The number of findings that could be fixed.
    fixable: usize,
    /// Why the file is no data sheet.
    failure: Option<Failure>,
}

const SEVERITIES: [Severity; 3] = [Severity::Error, Severity::Warning, Severity::Note];

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    if args.dry_run && args.format() == Format::Sarif {
        return Err(Failure::new("a SARIF log has findings, not changes").help("use --json, or do without --dry-run"));
    }
    let colours = output::colours();
    let mut printer = Printer { format: args.format(), stdout: output::raw_stdout(), any: false };
    let mut log = sarif([]);
    let mut summary = Summary::default();
    let mut failures = Vec::new();
    in_parallel(
        &args.files,
        |name| check(args, name, colours),
        |checked| {
            summary.add(&checked);
            failures.extend(checked.failure);
            checked.sarif.into_iter().for_each(|of_file| append(&mut log, of_file));
            printer.print(&checked.text)
        },
    )?;
    if let Some(rules) = log["runs"][0]["tool"]["driver"]["rules"].as_array_mut() {
        rules.sort_by_key(|rule| rule["id"].to_string());
    }
    printer.finish(&log)?;
    for failure in &failures {
        failure.report();
    }
    summary.print(args.dry_run);

    let fail_on = match args.fail_on {
        Level::Error => 1,
        Level::Warning => 2,
        Level::Note => 3,
    };
    Ok(if !failures.is_empty() {
        Outcome::Unreadable
    } else if args.dry_run && summary.fixed > 0 || summary.counts.iter().take(fail_on).any(|&count| count > 0) {
        Outcome::Found
    } else {
        Outcome::Clean
    })
}

fn check(args: &Args, name: &str, colours: bool) -> Checked {
    checked(args, name, colours).unwrap_or_else(|failure| Checked { failure: Some(failure), ..Checked::default() })
}

fn checked(args: &Args, name: &str, colours: bool) -> Result<Checked, Failure> {
    let input = if args.fix { file::open(name)? } else { find(name)? };
    if args.fix {
        file::must_be_ini(&input.eds)?;
    }
    let input = with_overlays(input, &args.overlay)?;
    let (input, device, mut diagnostics, fixed) = if args.fix {
        let Fixed { input: after, device, left, fixed } = fix(&input);
        if device.objects.is_empty() {
            return Err(no_object(input));
        }
        if args.dry_run {
            let diff = file::difference(&input.eds, &after.eds);
            let text = match args.format() {
                Format::Json => {
                    let diff = strip_str(&diff).to_string();
                    format!("{:#}", json!({ "file": input.eds.name(), "fixed": fixed, "diff": diff }))
                }
                _ if colours => diff,
                _ => strip_str(&diff).to_string(),
            };
            return Ok(Checked { text, fixed: fixed.values().sum(), ..Checked::default() });
        }
        if after.eds != input.eds {
            file::write(&after.eds)?;
        }
        (after, device, left, Some(fixed))
    } else {
        let (device, diagnostics) = lexican_eds::load(&input);
        (input, device, diagnostics, None)
    };
    if args.strict {
        let codes: Vec<_> =
            diagnostics.iter().filter(|it| it.severity == Severity::Warning).map(|it| it.code).collect();
        codes.into_iter().for_each(|code| diagnostics.deny(code));
    }
    let text = match args.format() {
        Format::Text if colours => diagnostics.render_styled(&input),
        Format::Text => diagnostics.render(&input),
        Format::Short => diagnostics.iter().map(|finding| short(finding, &input)).collect(),
        Format::Json => {
            let findings = diagnostics.to_json(&input);
            let mut of_file = json!({ "file": input.eds.name(), "findings": findings });
            if let Some(fixed) = &fixed {
                of_file["fixed"] = json!(fixed);
            }
            format!("{of_file:#}")
        }
        Format::Sarif => String::new(),
    };
    let sarif = (args.format() == Format::Sarif).then(|| diagnostics.to_sarif(&input));
    let failure = device.objects.is_empty().then(|| no_object(input.clone()));
    Ok(Checked {
        text,
        sarif,
        counts: SEVERITIES.map(|severity| diagnostics.count(severity)),
        fixed: fixed.iter().flat_map(|fixed| fixed.values()).sum(),
        fixable: diagnostics.iter().filter(|finding| finding.fix.is_some()).count(),
        failure,
    })
}

/// The failure for a text that is no data sheet. Its findings are printed separately.
fn no_object(input: Input) -> Failure {
    let error = DataSheetError::NoObject { sheet: DataSheet::parse(input).into() };
    Failure::new(&error).help_if(error.remedy())
}

/// One line that begins with the file name, even if the finding has no place.
fn short(finding: &Diagnostic, input: &Input) -> String {
    let line = finding.render_short(input);
    if finding.span().is_some() { line + "\n" } else { format!("{}: {line}\n", input.eds.name()) }
}

/// Calls `work` for every item on all processors, and `done` for the results in order.
fn in_parallel<T: Sync, R: Send>(
    items: &[T],
    work: impl Fn(&T) -> R + Sync,
    mut done: impl FnMut(R) -> std::io::Result<()>,
) -> std::io::Result<()> {
    // A few files need no progress bar.
    let progress = match items.len() {
        0..8 => ProgressBar::hidden(),
        many => progress("{bar:40.cyan/dim} {pos}/{len} data sheets", many as u64),
    };
    let workers = std::thread::available_parallelism().map_or(1, usize::from).min(items.len());
    let written = std::thread::scope(|scope| {
        let results: Vec<_> = (0..workers)
            .map(|first| {
                // Workers wait until their results are taken, so that few results are kept.
                let (sender, results) = sync_channel(2);
                let mut items = items.iter().skip(first).step_by(workers);
                let work = &work;
                // Sending fails after `done` has failed.
                scope.spawn(move || items.try_for_each(|item| sender.send(work(item)).ok()));
                results
            })
            .collect();
        for results in results.iter().cycle().take(items.len()) {
            let Ok(result) = results.recv() else { break };
            progress.inc(1);
            done(result)?;
        }
        Ok(())
    });
    progress.finish_and_clear();
    written
}

/// Adds the results and rules of a file to the single run of a SARIF log.
fn append(log: &mut Value, mut of_file: Value) {
    let lists: [fn(&mut Value) -> &mut Value; 2] =
        [|log| &mut log["runs"][0]["results"], |log| &mut log["runs"][0]["tool"]["driver"]["rules"]];
    for list in lists {
        let more = list(&mut of_file).take();
        let Some(all) = list(log).as_array_mut() else { continue };
        for element in more.as_array().into_iter().flatten() {
            // Elements with an id are rules; add each only once.
            if element["id"].is_null() || !all.iter().any(|other| other["id"] == element["id"]) {
                all.push(element.clone());
            }
        }
    }
}

/// Writes the texts of all files; in JSON, as elements of a list.
struct Printer<W> {
    format: Format,
    stdout: W,
    any: bool,
}

impl<W: Write> Printer<W> {
    fn print(&mut self, text: &str) -> std::io::Result<()> {
        if self.format != Format::Json {
            return self.stdout.write_all(text.as_bytes());
        }
        if text.is_empty() {
            return Ok(());
        }
        let before = if self.any { "," } else { HEAD };
        self.any = true;
        write!(self.stdout, "{before}\n    {}", text.replace('\n', "\n    "))
    }

    fn finish(mut self, log: &Value) -> std::io::Result<()> {
        match self.format {
            Format::Json if self.any => writeln!(self.stdout, "\n  ]\n}}")?,
            Format::Json => writeln!(self.stdout, "{HEAD}]\n}}")?,
            Format::Sarif => writeln!(self.stdout, "{log:#}")?,
            Format::Text | Format::Short => {}
        }
        self.stdout.flush()
    }
}

const HEAD: &str = "{\n  \"files\": [";

/// The last line; on stderr, to keep it out of a pipe.
#[derive(Default)]
struct Summary {
    files: usize,
    unreadable: usize,
    counts: [usize; 3],
    fixed: usize,
    fixable: usize,
}

impl Summary {
    fn add(&mut self, checked: &Checked) {
        self.files += 1;
        self.unreadable += usize::from(checked.failure.is_some());
        self.counts.iter_mut().zip(checked.counts).for_each(|(sum, count)| *sum += count);
        self.fixed += checked.fixed;
        self.fixable += checked.fixable;
    }

    fn print(&self, dry_run: bool) {
        let lost = if self.unreadable > 0 { format!(", {} not readable", self.unreadable) } else { String::new() };
        let sheets = plural(self.files, "data sheet");
        let mut stderr = anstream::stderr().lock();
        if dry_run {
            let _ = writeln!(stderr, "{sheets}: {} would be fixed{lost}", plural(self.fixed, "finding"));
            return;
        }
        let [errors, warnings, notes] = self.counts;
        let fixes = match (self.fixed, self.fixable) {
            (0, 0) => String::new(),
            (0, fixable) => format!("; --fix mends {fixable} of them"),
            (fixed, _) => format!("; {fixed} fixed"),
        };
        let counts = [(errors, "error"), (warnings, "warning"), (notes, "note")];
        let [errors, warnings, notes] = counts.map(|(count, what)| plural(count, what));
        let _ = writeln!(stderr, "{sheets}: {errors}, {warnings}, {notes}{fixes}{lost}");
    }
}
