//! The bench's settings in the file: what it shows from the beginning.

use std::collections::BTreeMap;
use std::path::PathBuf;

use lexican_runtime::Duration;
use lexican_toolbox::text::node_id::node_ids;
use lexican_toolbox::trace::sampler::Signal;

use crate::at::At;
use crate::file::{self, Filter};
use crate::files::Files;
use crate::model::{Node, Shown};
use crate::nodes::place;
use crate::read::Out;
use crate::wire::{End, end};

/// The default interval of reading objects.
const EVERY: Duration = Duration::from_millis(200);

/// The signals to show; those that do not exist are reported.
pub(crate) fn shown(nodes: &[Node], bench: &file::Bench, out: &mut Out) -> Vec<Shown> {
    let every = bench.every.as_ref().map_or(EVERY, |it| it.value.0);
    let texts = bench.watch.iter().map(|it| (it, false)).chain(bench.plot.iter().map(|it| (it, true)));
    texts.filter_map(|(text, as_curve)| one(nodes, text, as_curve, every, out)).collect()
}

/// The files of sequences.
pub(crate) fn sequences(paths: &[At<PathBuf>], files: Files<'_>, out: &mut Out) -> Vec<PathBuf> {
    for path in paths {
        if let Err(error) = files.read(&path.value) {
            out.wrong("machine::bench", &path.span, error.to_string(), None);
        }
    }
    paths.iter().map(|path| files.path(&path.value)).collect()
}

/// The filters of the trace, with names of nodes replaced by node-IDs.
pub(crate) fn filters(
    nodes: &[Node],
    filters: BTreeMap<String, At<Filter>>,
    out: &mut Out,
) -> BTreeMap<String, Filter> {
    let mut lowered = |At { value: filter, span }: At<Filter>| {
        let words = filter.nodes.split(',').map(str::trim).filter(|word| !word.is_empty());
        let ids = words.filter_map(|word| match node_ids(word) {
            Ok(_) => Some(word.to_owned()),
            Err(_) => Some(nodes[place(nodes, word, &span, out)?].id?.to_string()),
        });
        Filter { nodes: ids.collect::<Vec<_>>().join(","), ..filter }
    };
    filters.into_iter().map(|(name, filter)| (name, lowered(filter))).collect()
}

fn one(nodes: &[Node], text: &At<String>, as_curve: bool, every: Duration, out: &mut Out) -> Option<Shown> {
    let End::Node(node, object) = end(nodes, &text.value, &text.span, out)? else {
        out.wrong("machine::bench", &text.span, "the manager has no objects", Some("NODE.OBJECT".to_owned()));
        return None;
    };
    let signal = Signal::parse(nodes[node].device(), object);
    let signal = signal
        .map_err(|error| out.wrong("machine::bench", &text.span, error.to_string(), Some(error.advice())))
        .ok()?;
    if let (Signal::Pdo { .. }, false) = (&signal, as_curve) {
        out.wrong("machine::bench", &text.span, "a PDO has curves, and is not watched", Some("plot".to_owned()));
        return None;
    }
    Some(Shown { node: nodes[node].id?, signal, as_curve, every })
}
