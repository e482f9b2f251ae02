//! `lexican replace`: replaces a failed device of a machine.

use std::fmt::Write as _;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use lexican_machine::{Machine, Node};
use lexican_runtime::host::Pace;
use lexican_runtime::{Duration, NodeId};
use lexican_toolbox::drive::describe;
use lexican_toolbox::lss::Times;
use lexican_toolbox::node::identity::words;
use lexican_toolbox::parameters::archive::{Archive, ArchivedNode};
use lexican_toolbox::replace::{ReplaceError, Replacement, Replacing, Step, Watched, replace};
use lexican_toolbox::text::duration::milliseconds;
use lexican_toolbox::text::time_of_day;
use lexican_toolbox::values::report::ValueReport;
use serde_json::json;

use crate::bus::{BusArgs, node_id};
use crate::machine::{found, sound_on_bus};
use crate::output::{Failure, ForceArgs, Outcome, note, print_result, warn, write_whole};
use crate::parameters::Watch;
use crate::parameters::archive::{is_archive, overlays, read, stamp, title};
use crate::send::time::now;

/// Let a new device take the place of a node of the machine
///
/// Finds it: at its node-ID, without one, or the only one of its vendor and product at another one; the last two get the node-ID by LSS,
/// and store it. Checks that it is of the vendor and product of the backup, and says what else is another than before. Restores its
/// parameters from the backup, lets it store them, and resets it. Boots it as machine.toml says, falls silent, and waits for it to notice that
/// its manager is gone. Resets it again, and compares all that can be read with the backup. Writes a report.
///
/// Nothing moves. If it ends early (Ctrl-C, a lost bus, a power cut), the same command goes on: what has been done is seen of the device.
/// Exit code 1 if the device cannot take the place, or is not protected; 2 if it ends early.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    bus: BusArgs,

    /// How long to wait for a response to LSS
    #[arg(long, value_name = "TIME", default_value = "500ms", value_parser = milliseconds)]
    timeout: Duration,

    /// The report; by default a text file named after machine, node and date. One that is there is replaced by --force, which takes a
    /// device of another vendor or product, too
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,

    #[command(flatten)]
    force: ForceArgs,

    /// Print one JSON object per line
    #[arg(long)]
    json: bool,

    /// The node: its name in machine.toml, or its node-ID
    #[arg(value_name = "NODE", value_parser = node_id)]
    node: NodeId,

    /// The backup of the machine; by default the newest one beside machine.toml
    #[arg(value_name = "FILE")]
    backup: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Examples:
    lexican replace feeder
    lexican replace feeder labeller-12.tar -o feeder.txt";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let path = found(None)?;
    let machine = sound_on_bus(&path)?;
    let node = machine.nodes.iter().find(|node| node.id == Some(args.node)).ok_or_else(|| {
        Failure::new(format_args!("{} has no node {}", path.display(), args.node)).help("name one of its nodes")
    })?;
    let name = node.name.as_str();
    let (file, archive) = match &args.backup {
        Some(file) => (file.clone(), read(file)?),
        None => newest(&path, name)?,
    };
    let archived = archive.node(name).ok_or_else(|| {
        Failure::new(format_args!("{} has no {name}", file.display())).help("`lexican backup` saves the whole machine")
    })?;
    // The machine may have moved the node to another node-ID since the backup.
    let archived = ArchivedNode { node: args.node, ..archived.clone() };
    let sheet = node.device().ok_or_else(|| {
        Failure::new(format_args!("{name} has no data sheet")).help("sheet = \"FILE.eds\" in the file of the machine")
    })?;
    let output =
        args.output.clone().unwrap_or_else(|| format!("{}_{name}_{}.txt", title(&machine, &path), stamp()).into());
    args.force.guard(&output, [file.as_path()])?;
    let mut link = args.bus.open(Pace::Virtual)?.settled()?.link;
    let others = machine.nodes.iter().filter_map(|node| node.id).chain(machine.bus.manager);
    let of = Replacement {
        archived: &archived,
        sheet,
        overlays: &overlays(node),
        identity: node.identity.exact(),
        others: others.filter(|other| *other != args.node).collect(),
        assignment: machine.assignment(node, args.node),
        watched: watched(&machine, node),
        times: Times { response: args.timeout, ..Times::default() },
        force: args.force.is_given(),
    };
    let watch = Watch::new()?;
    let (mut steps, mut unprinted) = (Vec::new(), None);
    let result = replace(&mut link, &of, &mut |what| match what {
        Replacing::At(progress) => watch.see(progress),
        Replacing::Done(step) => {
            let object = json!({ "event": "step", "name": name, "text": step.to_string() });
            let printed = watch.bar.suspend(|| print_result(args.json, object, format_args!("{name}: {step}")));
            unprinted = unprinted.take().or(printed.err());
            steps.push(step.clone());
            if watch.is_interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        }
    });
    drop(watch);
    let verdict = verdict(name, &steps, &result);
    let mut report = report(&machine, &of, &file, &archive);
    steps.iter().for_each(|step| _ = writeln!(report, "- {step}"));
    let _ = writeln!(report, "\n{verdict}");
    write_whole(&output, report.as_bytes())?;
    if let Some(failure) = unprinted {
        return Err(failure);
    }
    let object =
        json!({ "event": "summary", "name": name, "replaced": result.is_ok(), "text": verdict, "report": output });
    let error = match result {
        Ok(()) => {
            print_result(args.json, object, format_args!("{verdict}; see {}", output.display()))?;
            let is_drive = node.sheet.as_ref().is_some_and(|sheet| describe(&sheet.input).is_ok());
            let is_untested = steps.iter().any(|step| matches!(step, Step::Untested(_)));
            return Ok(if is_drive && is_untested { Outcome::Found } else { Outcome::Clean });
        }
        Err(error) => error,
    };
    if let ReplaceError::Differs(comparison, domains) = &error {
        for difference in &comparison.differences {
            let text = |side: &Option<ValueReport>| side.as_ref().map_or("none", ValueReport::text).to_owned();
            let title = difference.a.as_ref().or(difference.b.as_ref()).map(ValueReport::title).unwrap_or_default();
            warn(format_args!("{name}: {title}: {}, and not {}", text(&difference.b), text(&difference.a)));
        }
        for address in comparison.unknown.iter().chain(domains) {
            warn(format_args!("{name}: {address}: it cannot be read, or is another"));
        }
    }
    if args.json {
        print_result(true, object, "")?;
    }
    if let ReplaceError::Ended(_) | ReplaceError::Lss(_) = error {
        return Err(Failure::new(verdict).help(error.remedy()));
    }
    warn(verdict);
    note(format_args!("{}; then the same command goes on", error.remedy()));
    Ok(Outcome::Found)
}

/// The result for the user: whether the device has taken the place, or in which state it is.
fn verdict(name: &str, steps: &[Step], result: &Result<(), ReplaceError>) -> String {
    let has_begun = steps.iter().any(|step| matches!(step, Step::Named { .. } | Step::Checked { .. }));
    match result {
        Ok(()) => format!("{name} has been replaced"),
        Err(error) if has_begun => format!("{name} HAS NOT BEEN REPLACED, and may be configured in part: {error}"),
        Err(error) => format!("{name} HAS NOT BEEN REPLACED: {error}"),
    }
}

/// The head of the report.
fn report(machine: &Machine, of: &Replacement<'_>, file: &Path, archive: &Archive) -> String {
    let time = |time| time_of_day::text(time).split('.').next().unwrap_or_default().to_owned();
    let ArchivedNode { name, node, identity, versions, .. } = of.archived;
    let title = machine.name.as_ref().map(|name| format!(" of {name}")).unwrap_or_default();
    let before: Vec<_> = words(*identity).chain(versions.iter().flatten().cloned()).collect();
    format!(
        "Replacement of {name} (node {node}){title}, {} UTC\n\nBackup: {}, {} UTC\nBefore: {}\n\n",
        time(now().unwrap_or_default()),
        file.display(),
        time(archive.made),
        before.join(", ")
    )
}

/// The newest backup with this node beside the file of a machine.
fn newest(path: &Path, name: &str) -> Result<(PathBuf, Archive), Failure> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let files = std::fs::read_dir(folder).map_err(|error| Failure::file("read", folder, &error))?;
    let files = files.filter_map(|file| Some(file.ok()?.path())).filter(|file| is_archive(file));
    let backups = files.filter_map(|file| Some((file.clone(), read(&file).ok()?)));
    let newest = backups
        .filter(|(_, archive)| archive.node(name).is_some())
        .max_by_key(|(_, archive)| time_of_day::to_unix(archive.made));
    newest.ok_or_else(|| {
        let what = format_args!("there is no backup of {name} beside {}", path.display()).to_string();
        Failure::new(what).help("name one; `lexican backup` makes it, as long as the device before can be read")
    })
}

/// How a node notices that its manager is gone.
fn watched(machine: &Machine, node: &Node) -> Option<Watched> {
    if let Some(within) = node.life_time() {
        return Some(Watched { heartbeat: None, within });
    }
    let (manager, within) = machine.watches_manager(node)?;
    Some(Watched { heartbeat: Some((manager, machine.bus.heartbeat.as_ref()?.value)), within })
}
