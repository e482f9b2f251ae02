//! Writes wanted values into a node, and prints the result.

use std::ops::ControlFlow;

use lexican_eds::model::Device;
use lexican_runtime::NodeId;
use lexican_runtime::host::Link;
use lexican_runtime::object::Address;
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_toolbox::node::remote::RemoteNode;
use lexican_toolbox::parameters::restore::{Options, Outcome as Restored, Settings, restore};
use lexican_toolbox::parameters::{Ended, LeftOuts, Progress};
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::report::ValueReport;
use serde_json::json;

use super::{Watch, by_reason, print_refused};
use crate::output::{Failure, Outcome, fields, plural, print_result, warn};

/// How parameters are written.
#[derive(clap::Args, Clone, Copy, Debug)]
pub(super) struct WriteArgs {
    /// Only print what differs
    #[arg(long, conflicts_with_all = ["store", "start"])]
    dry_run: bool,

    /// Let the device store its parameters at the end (1010h)
    #[arg(long)]
    store: bool,

    /// Start the node at the end
    #[arg(long)]
    start: bool,

    /// Print one JSON object per line
    #[arg(long)]
    pub(super) json: bool,
}

impl WriteArgs {
    const fn options(self) -> Options {
        Options { dry_run: self.dry_run, store: self.store }
    }

    /// Starts the node, if `--start` is given.
    fn start<L: Link>(self, node: &mut RemoteNode<'_, L>) -> Result<(), Failure> {
        if self.start {
            let id = node.id();
            node.network().command(NmtCommand::Start, Some(id))?;
        }
        Ok(())
    }
}

/// The wanted values, and how to write them.
pub(super) struct Wanted<'a> {
    node: NodeId,
    sheet: &'a Device,
    settings: &'a Settings,
    left_out: &'a LeftOuts,
    writing: WriteArgs,
    /// The wanted values, on which meanings of other entries depend.
    values: DeviceValues<'a>,
}

impl<'a> Wanted<'a> {
    pub(super) fn new(
        node: NodeId,
        sheet: &'a Device,
        settings: &'a Settings,
        left_out: &'a LeftOuts,
        writing: WriteArgs,
    ) -> Self {
        let mut values = DeviceValues::new(sheet);
        for (address, data) in settings {
            if let Some(value) = ValueReport::of_bytes(Some(&values), *address, data).value {
                values.set(*address, &value);
            }
        }
        Wanted { node, sheet, settings, left_out, writing, values }
    }

    /// Writes what differs; prints each entry when it is written, and the rest at the end.
    pub(super) fn restore<L: Link>(&self, node: &mut RemoteNode<'_, L>, watch: &Watch) -> Result<Outcome, Failure> {
        let (mut restored, mut unprinted) = (Restored::default(), None);
        let mut see = |progress: Progress<'_>| match progress {
            Progress::Written { address, before } => {
                let printed = watch.bar.suspend(|| self.print_change("written", address, before));
                unprinted = unprinted.take().or(printed.err());
                ControlFlow::Continue(())
            }
            progress => watch.see(progress),
        };
        let ended = restore(node, self.sheet, self.settings, self.writing.options(), &mut see, &mut restored);
        watch.bar.set_position(0);
        if ended.is_ok() {
            self.writing.start(node)?;
        }
        let outcome = watch.bar.suspend(|| self.print(&restored, ended));
        unprinted.map_or(outcome, Err)
    }

    fn print(&self, restored: &Restored, ended: Result<(), Ended>) -> Result<Outcome, Failure> {
        let (event, verb, changed) = match self.writing.options().dry_run {
            true => ("differs", "would be written", restored.differing.len()),
            false => ("written", "written", restored.written.len()),
        };
        for (address, before) in restored.differing.iter().filter(|_| self.writing.options().dry_run) {
            self.print_change(event, *address, before.as_deref())?;
        }
        for (address, refusal) in &restored.refused {
            print_refused(self.writing.json, self.node, &self.values, *address, refusal)?;
        }
        for address in &restored.switched_off {
            let node = self.node;
            warn(format_args!("node {node}: the PDO of {address} was switched off, and is not switched on again"));
        }
        let mut text =
            format!("node {}: {} {verb}, {} had their value", self.node, plural(changed, "parameter"), restored.equal);
        if !restored.refused.is_empty() {
            text += &format!(", {} refused", restored.refused.len());
        }
        if restored.stored {
            text += "; the device has stored them";
        }
        let object = json!({
            "event": "summary", "node": self.node.get(), event: changed, "equal": restored.equal,
            "refused": restored.refused.len(), "stored": restored.stored, "complete": ended.is_ok(),
            "left_out": by_reason(self.left_out),
        });
        print_result(self.writing.json, object, text)?;
        match ended {
            Err(ended) => Err(Failure::from(ended)
                .help("the same command goes on from here: what the device has is not written again")),
            Ok(()) if restored.refused.is_empty() => Ok(Outcome::Clean),
            Ok(()) => Ok(Outcome::Found),
        }
    }

    fn print_change(&self, event: &str, address: Address, before: Option<&[u8]>) -> Result<(), Failure> {
        let Some(data) = self.settings.get(&address) else {
            return Ok(());
        };
        let report = ValueReport::of_bytes(Some(&self.values), address, data);
        let text = |data| ValueReport::of_bytes(Some(&self.values), address, data).text().to_owned();
        let before = before.map(text);
        let mut object = report.json();
        object.extend(fields(json!({ "event": event, "node": self.node.get(), "before": before })));
        let before = before.map(|before| format!(", was {before}")).unwrap_or_default();
        print_result(self.writing.json, object, format_args!("{}{before}", report.equation()))
    }
}
