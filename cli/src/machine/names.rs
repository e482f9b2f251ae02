//! The names of a machine's nodes on the command line: what stands in its file need not be typed again.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Arg, Command};
use lexican_machine::{Machine, Node};
use lexican_runtime::NodeId;

use super::file::of_here;
use crate::bus::BUS;
use crate::node_place::{Words, command};

/// The arguments with node-IDs instead of names of nodes, and with the bus and the data sheets of the machine where they are not
/// given. Without a machine they stay as they are.
pub(crate) fn resolved(args: Vec<OsString>, cli: &Command) -> Vec<OsString> {
    resolved_by(args, cli, found)
}

/// A machine, and where it is.
pub(crate) type Found = Option<(PathBuf, Machine)>;

/// The same by a machine that is found in another way: by the file that is named, if one is.
pub(crate) fn resolved_by(
    mut args: Vec<OsString>,
    cli: &Command,
    found: impl Fn(Option<PathBuf>) -> Found,
) -> Vec<OsString> {
    let (command, begin) = command(&args, cli);
    let option = |long: &str| command.get_arguments().find(|arg| arg.get_long() == Some(long));
    let takes = |long: &str| option(long).is_some();
    // The bus of a simulation is where its devices go.
    let Some(bus) = option("bus").filter(|_| command.get_name() != "simulate") else { return args };
    let place = Words { args: &args, command }.node_word(begin);
    let is_given = |args: &[OsString], long: &str| {
        let begins = format!("{long}=");
        args.iter().any(|word| word == long || word.to_str().is_some_and(|word| word.starts_with(&begins)))
    };
    let needs_bus = !is_given(&args, "--bus") && std::env::var_os(BUS).is_none();
    let has_name =
        place.is_some_and(|(at, _)| args[at].to_str().is_some_and(|word| word.starts_with(char::is_alphabetic)));
    let wants_simulation =
        args.windows(2).any(|pair| pair == ["--bus", "sim"]) || args.iter().any(|word| word == "--bus=sim");
    let lacks_bus = needs_bus && bus.is_required_set();
    if !(lacks_bus || has_name || wants_simulation) {
        return args;
    }
    let Some((path, machine)) = found(Words { args: &args, command }.machine(begin)) else { return args };
    let mut named: Vec<&Node> = Vec::new();
    if let Some((at, prefix)) = place {
        let word = args[at].to_str().unwrap_or_default()[prefix..].to_owned();
        let nodes: Option<Vec<_>> =
            word.split(',').map(|name| machine.node(name).filter(|node| node.id.is_some())).collect();
        if let Some(nodes) = nodes {
            let ids: Vec<_> = nodes.iter().filter_map(|node| Some(node.id?.to_string())).collect();
            args[at] = (args[at].to_str().unwrap_or_default()[..prefix].to_owned() + &ids.join(",")).into();
            named = nodes;
        }
    }
    let simulation = || format!("sim:{}", path.display());
    if let Some(at) = args.iter().position(|word| word == "--bus=sim") {
        args[at] = format!("--bus={}", simulation()).into();
    } else if let Some(at) = args.windows(2).position(|pair| pair == ["--bus", "sim"]) {
        args[at + 1] = simulation().into();
    }
    let mut more: Vec<OsString> = Vec::new();
    if needs_bus
        && (bus.is_required_set() || !named.is_empty())
        && let Some(url) = &machine.bus.url
    {
        more.extend(["--bus".into(), url.value.clone().into()]);
    }
    if takes("device") && !is_given(&args, "--device") {
        // A command for a whole bus knows all of its nodes.
        let all = if place.is_none() { machine.nodes.iter().collect() } else { named };
        // What a command says of a single node has no node-ID in front.
        let of_one =
            |long| option(long).and_then(Arg::get_value_names).is_some_and(|names| !names[0].contains("NODE="));
        let several = all.len() > 1;
        let said = |id: NodeId, long, what: &str| match of_one(long) && !several {
            true => [format!("--{long}"), what.to_owned()],
            false => [format!("--{long}"), format!("{id}={what}")],
        };
        for node in all {
            if let (Some(id), Some(sheet)) = (node.id, &node.sheet_name) {
                more.extend(said(id, "device", sheet).map(OsString::from));
                if !is_given(&args, "--overlay") && takes("overlay") {
                    let overlays = node.overlays.iter().map(|path| path.display().to_string());
                    more.extend(overlays.flat_map(|path| said(id, "overlay", &path)).map(OsString::from));
                }
            }
        }
    }
    let end = args.iter().position(|word| word == "--").unwrap_or(args.len());
    args.splice(end..end, more);
    args
}

/// The machine that is named, or that of this folder. What is wrong with its file is said by `machine check`.
fn found(named: Option<PathBuf>) -> Found {
    let path = named.or_else(of_here)?;
    let machine = Machine::open(&path).ok()?;
    Some((path, machine))
}
