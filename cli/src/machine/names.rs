//! Replaces names of a machine's nodes on the command line, and adds what its file already says.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::Arc;

use clap::{Arg, Command};
use lexican_machine::{Machine, Node};
use lexican_runtime::NodeId;

use super::file::{choose_bus, name_of_sheet, of_here, read, take_named, valued};
use crate::bus::BUS;
use crate::node_place::{Words, command};

/// Replaces names of nodes by node-IDs, and adds the bus and the data sheets of the machine unless they are given.
/// Without a machine, the arguments stay as they are.
pub(crate) fn resolved(mut args: Vec<OsString>, cli: &Command) -> Vec<OsString> {
    take_named(&mut args);
    resolved_by(args, cli, found)
}

/// The prefix of a node in an argument of `compare`.
const SIDE: &str = "node:";

/// A machine with its path.
pub(crate) type Found = Option<(PathBuf, Arc<Machine>)>;

/// The same with another way of finding the machine, by its file if one is named.
pub(crate) fn resolved_by(
    mut args: Vec<OsString>,
    cli: &Command,
    found: impl Fn(Option<PathBuf>) -> Found,
) -> Vec<OsString> {
    let (command, begin) = command(&args, cli);
    let option = |long: &str| command.get_arguments().find(|arg| arg.get_long() == Some(long));
    let takes = |long: &str| option(long).is_some();
    // In `simulate`, the bus is where the devices go, and the demo has its own.
    let has_own_bus = command.get_name() == "simulate" || args.iter().any(|word| word == "--demo");
    let Some(bus) = option("bus").filter(|_| !has_own_bus) else { return args };
    let place = Words { args: &args, command }.node_word(begin);
    let is_given = |args: &[OsString], long: &str| valued(args, long).is_some();
    let needs_bus = !is_given(&args, "--bus") && std::env::var_os(BUS).is_none();
    let words = place.map(|(at, prefix)| args[at].to_str().unwrap_or_default()[prefix..].to_owned());
    let has_name = words.as_deref().is_some_and(|word| word.starts_with(char::is_alphabetic));
    let bus_word =
        valued(&args, "--bus").map(|(at, prefix)| (at, prefix, args[at].to_string_lossy()[prefix..].to_owned()));
    let bus_name = bus_word.as_ref().map(|(.., name)| name.as_str()).filter(|name| !name.contains(':'));
    let lacks_bus = needs_bus && bus.is_required_set();
    let is_side = |word: &OsString| word.to_str().is_some_and(|word| word.starts_with(SIDE));
    if !(lacks_bus || has_name || bus_name.is_some() || args.iter().any(is_side)) {
        return args;
    }
    let Some((path, all)) = found(Words { args: &args, command }.machine(begin)) else { return args };
    // The bus that is named, or that of the node.
    let on_named = |name| all.on(Some(name)).ok();
    let of_simulation = bus_name.and_then(|name| name.strip_prefix("sim")).map(|rest| rest.strip_prefix('#'));
    let first = words.as_deref().and_then(|words| words.split(',').next());
    let machine = match (of_simulation, bus_name) {
        (Some(Some(bus)), _) => on_named(bus),
        (None, Some(name)) => on_named(name),
        _ => None,
    };
    let machine = machine
        .or_else(|| all.buses().find(|machine| first.is_some_and(|first| machine.node(first).is_some())))
        .or(Some(&*all).filter(|all| all.others.is_empty()));
    let named_bus = machine.and_then(|machine| machine.bus.name.as_ref());
    let of_bus = named_bus.map_or_else(String::new, |name| format!("#{}", choose_bus(&name.value)));
    if let Some((at, prefix, _)) = &bus_word {
        let url = machine.and_then(|machine| machine.bus.url.as_ref()).filter(|_| !of_bus.is_empty());
        let url = match of_simulation {
            Some(_) => Some(format!("sim:{}{of_bus}", path.display())),
            None => url.filter(|_| bus_name.and_then(on_named).is_some()).map(|url| url.value.clone()),
        };
        if let Some(url) = url {
            args[*at] = format!("{}{url}", &args[*at].to_string_lossy()[..*prefix]).into();
        }
    }
    let Some(machine) = machine else { return args };
    for word in args.iter_mut().filter(|word| is_side(word)) {
        let id = word.to_str().and_then(|word| machine.node(&word[SIDE.len()..])?.id);
        *word = id.map_or_else(|| word.clone(), |id| format!("{SIDE}{id}").into());
    }
    let mut named: Vec<&Node> = Vec::new();
    if let (Some((at, prefix)), Some(word)) = (place, &words) {
        let nodes: Option<Vec<_>> =
            word.split(',').map(|name| machine.node(name).filter(|node| node.id.is_some())).collect();
        if let Some(nodes) = nodes {
            let ids: Vec<_> = nodes.iter().filter_map(|node| Some(node.id?.to_string())).collect();
            args[at] = (args[at].to_str().unwrap_or_default()[..prefix].to_owned() + &ids.join(",")).into();
            named = nodes;
        }
    }
    let mut more: Vec<OsString> = Vec::new();
    if needs_bus
        && (bus.is_required_set() || !named.is_empty() || args.iter().any(is_side))
        && let Some(url) = &machine.bus.url
    {
        more.extend(["--bus".into(), url.value.clone().into()]);
    }
    if let (Some(rate), true) = (machine.bus.bit_rate, takes("bit-rate") && !is_given(&args, "--bit-rate")) {
        more.extend(["--bit-rate".into(), (rate / 1000).to_string().into()]);
    }
    if takes("device") && !is_given(&args, "--device") {
        // A command about a whole bus gets all its nodes.
        let all = if place.is_none() { machine.nodes.iter().collect() } else { named };
        // An argument about a single node has no node-ID in front.
        let of_one =
            |long| option(long).and_then(Arg::get_value_names).is_some_and(|names| !names[0].contains("NODE="));
        let several = all.len() > 1;
        let said = |id: NodeId, long, what: &str| match of_one(long) && !several {
            true => [format!("--{long}"), what.to_owned()],
            false => [format!("--{long}"), format!("{id}={what}")],
        };
        for node in all {
            if let (Some(id), Some(_)) = (node.id, &node.sheet) {
                more.extend(said(id, "device", &name_of_sheet(&path, &node.name)).map(OsString::from));
            }
        }
    }
    let end = args.iter().position(|word| word == "--").unwrap_or(args.len());
    args.splice(end..end, more);
    args
}

/// The machine that is named, or that of this folder. `machine check` reports what is wrong with its file.
fn found(named: Option<PathBuf>) -> Found {
    let path = named.or_else(of_here)?;
    let machine = read(&path).ok()?;
    Some((Machine::file_and_bus(&path).0.to_owned(), machine))
}
