//! The parameters of a machine in one file: `lexican backup` without nodes, and `compare` with such files.

use std::path::{Path, PathBuf};

use lexican_eds::Source;
use lexican_machine::Machine;
use lexican_runtime::host::Link;
use lexican_runtime::host::blocking::Network;
use lexican_toolbox::node::remote::RemoteNode;
use lexican_toolbox::parameters::archive::{Archive, ENDING, LONGEST};
use lexican_toolbox::parameters::compare::Difference;
use lexican_toolbox::text::files::read_up_to;
use lexican_toolbox::text::time_of_day;
use serde_json::json;

use super::{Watch, known};
use crate::bus::{BoxedLink, NetworkArgs};
use crate::machine::{found, sound_on_bus};
use crate::output::{Failure, ForceArgs, Outcome, note, plural, print_result, warn};
use crate::send::time::now;

/// The argument of `compare` for the machine of this folder.
pub(super) const MACHINE: &str = "machine";

/// Whether a file is the backup of a machine, by its extension.
pub(crate) fn is_archive(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(ENDING))
}

/// Reads the backup of a machine.
pub(crate) fn read(path: &Path) -> Result<Archive, Failure> {
    let wrong = |error| Failure::new(format_args!("{}: {error}", path.display())).help("`lexican backup` makes one");
    Archive::read(&read_up_to(path, LONGEST)?).map_err(wrong)
}

/// Reads all nodes of a machine; nodes that do not answer are listed as unread.
pub(super) fn take<L: Link>(network: &mut Network<L>, machine: &Machine, watch: &Watch) -> Result<Archive, Failure> {
    let made = now().unwrap_or_default();
    let mut archive = Archive { machine: machine.name.clone(), made, ..Archive::default() };
    for node in &machine.nodes {
        let name = &node.name.value;
        let found = node.id.ok_or_else(|| "it gets its node-ID by LSS".to_owned());
        let known = |id| known(id, node.device()).map_err(|failure| failure.to_string());
        match found.and_then(|id| Ok((id, known(id)?))) {
            Ok((id, sheet)) => {
                archive.take(&mut RemoteNode::new(network, id), name, sheet, &mut |progress| watch.see(progress))?;
            }
            Err(why) => drop(archive.unread.insert(name.clone(), why)),
        }
    }
    Ok(archive)
}

/// Saves the parameters of all nodes of this folder's machine.
pub(super) fn backup(
    network: &NetworkArgs,
    output: Option<&PathBuf>,
    force: ForceArgs,
    as_json: bool,
) -> Result<Outcome, Failure> {
    let path = found(None)?;
    let machine = sound_on_bus(&path)?;
    let output = output.cloned().unwrap_or_else(|| default_name(&machine, &path));
    force.guard(&output, [path.as_path()])?;
    let mut network = network.connect_known(machine.nodes.iter().filter_map(|node| node.id))?;
    let watch = Watch::new()?;
    let archive = take(&mut network, &machine, &watch)?;
    drop(watch);
    if archive.nodes.is_empty() {
        let why = archive.unread.into_values().next().unwrap_or_default();
        return Err(Failure::new(format_args!("no node of {} can be read: {why}", path.display())));
    }
    let bytes = archive.to_bytes().map_err(|error| Failure::file("write", &output, &error))?;
    force.write(&output, &bytes)?;
    let mut outcome = Outcome::Clean;
    for node in &archive.nodes {
        for (address, why) in &node.refused {
            outcome = Outcome::Found;
            warn(format_args!("{}: {address}: {why}", node.name));
        }
        let kept = node.settings().len();
        let object = json!({
            "event": "node", "name": node.name, "node": node.node.get(), "kept": kept, "refused": node.refused,
            "domains": node.domains.len(), "left_out": node.left_out,
        });
        let missing = match node.refused.len() {
            0 => String::new(),
            count => format!(", {count} are missing"),
        };
        let text = format!("{} (node {}): {}{missing}", node.name, node.node, plural(kept, "parameter"));
        print_result(as_json, object, text)?;
    }
    for (name, why) in &archive.unread {
        outcome = outcome.max(match machine.node(name).is_some_and(|node| node.optional) {
            true => Outcome::Found,
            false => Outcome::Unreadable,
        });
        warn(format_args!("{name} is missing: {why}"));
    }
    let (file, count) = (output.display().to_string(), archive.nodes.len());
    let object = json!({ "event": "summary", "file": file, "nodes": count, "unread": archive.unread });
    print_result(as_json, object, format_args!("{} in {file}", plural(count, "node")))?;
    Ok(outcome)
}

/// `labeller-12_2026-11-28_060012.tar` in this folder.
fn default_name(machine: &Machine, path: &Path) -> PathBuf {
    format!("{}_{}.{ENDING}", title(machine, path), stamp()).into()
}

/// The machine in file names: its name, or else that of its folder.
pub(crate) fn title(machine: &Machine, path: &Path) -> String {
    let folder = || Some(path.canonicalize().ok()?.parent()?.file_name()?.to_string_lossy().into_owned());
    let name = machine.name.clone().or_else(folder).unwrap_or_else(|| "machine".to_owned());
    name.replace(|c: char| !c.is_alphanumeric(), "-")
}

/// The current time, for file names.
pub(crate) fn stamp() -> String {
    let text = time_of_day::text(now().unwrap_or_default());
    text.split('.').next().unwrap_or_default().replace(' ', "_").replace(':', "")
}

/// Compares machines: the one of this folder, or backups.
pub(super) fn compare_machines(
    [a, b]: [&str; 2],
    as_json: bool,
    connect: impl Fn(&Machine) -> Result<Network<BoxedLink>, Failure>,
    print: impl Fn(&str, &Difference) -> Result<(), Failure>,
) -> Result<Outcome, Failure> {
    let (name_a, name_b) = (a, b);
    let is_live = [a, b].contains(&MACHINE);
    // Without the machine, the values of two backups have no units.
    let machine = if is_live {
        Some(sound_on_bus(&found(None)?)?)
    } else {
        found(None).ok().and_then(|path| sound_on_bus(&path).ok())
    };
    let watch = Watch::new()?;
    let side = |name: &str| {
        if is_archive(name.as_ref()) {
            return read(name.as_ref());
        }
        if name != MACHINE {
            return Err(Failure::new(format_args!("the backup of a machine cannot be compared with {name}")).help(
                "with `machine`, or with another backup; of a single node it has the DCF, `tar -xf` takes it out",
            ));
        }
        let machine = machine.as_ref().expect("it is there if a side is the machine");
        take(&mut connect(machine)?, machine, &watch)
    };
    let (a, b) = (side(a)?, side(b)?);
    drop(watch);
    let (mut compared, mut count) = (0, 0);
    let names = a.nodes.iter().map(|node| &node.name).chain(a.unread.keys());
    let others = b.nodes.iter().map(|node| &node.name).chain(b.unread.keys());
    let mut names: Vec<_> = names.chain(others).collect();
    names.sort();
    names.dedup();
    for name in names {
        let mut differs = |what: String| {
            count += 1;
            let object = json!({ "event": "difference", "name": name, "text": what });
            print_result(as_json, object, format_args!("{name}: {what}"))
        };
        match (a.node(name), b.node(name)) {
            (Some(one), Some(other)) => {
                let node = machine.as_ref().and_then(|machine| machine.node(name));
                let overlays = node.map_or_else(Vec::new, overlays);
                for version in one.other_versions(&other.identity, &other.versions) {
                    differs(version)?;
                }
                if let ([.., Some(one)], [.., Some(other)]) = (one.identity, other.identity)
                    && one != other
                {
                    note(format_args!("{name} is another device: its serial number is {other:X}h, and not {one:X}h"));
                }
                let (comparison, domains) = one.compare(other, &overlays);
                compared += comparison.compared + one.domains.len();
                for address in domains {
                    differs(format!("{address}: another content"))?;
                }
                count += comparison.differences.len();
                comparison.differences.iter().try_for_each(|difference| print(name, difference))?;
            }
            (_, None) => differs(format!("not in {}: {}", name_b, why(&b, name)))?,
            (None, _) => differs(format!("not in {}: {}", name_a, why(&a, name)))?,
        }
    }
    let verdict = if count == 0 { "the same".to_owned() } else { format!("{count} differ") };
    let object = json!({ "event": "summary", "compared": compared, "differ": count });
    print_result(as_json, object, format_args!("{} compared, {verdict}", plural(compared, "parameter")))?;
    Ok(if count == 0 { Outcome::Clean } else { Outcome::Found })
}

/// Why a node is missing in a backup.
fn why<'a>(archive: &'a Archive, name: &str) -> &'a str {
    archive.unread.get(name).map_or("there was no such node", String::as_str)
}

/// The overlays of a node, which give units and meanings to its DCF.
pub(crate) fn overlays(node: &lexican_machine::Node) -> Vec<Source> {
    node.sheet.as_ref().map(|sheet| sheet.input.overlays.clone()).unwrap_or_default()
}
