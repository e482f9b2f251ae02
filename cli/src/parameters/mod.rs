//! `lexican backup`, `restore`, `compare` and `apply`: the parameters of devices.

pub(crate) mod apply;
pub(crate) mod backup;
pub(crate) mod compare;
pub(crate) mod restore;
#[cfg(test)]
mod simulated;

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::ProgressBar;
use lexican_eds::model::Device;
use lexican_runtime::NodeId;
use lexican_runtime::object::Address;
use lexican_toolbox::parameters::restore::{Options, Outcome as Restored, Settings};
use lexican_toolbox::parameters::{Ended, Progress};
use lexican_toolbox::remote::Refusal;
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::report::ValueReport;
use serde_json::json;

use crate::output::{Failure, Outcome, ctrl_c, fields, plural, print_result, progress, warn};

/// Shows the progress, and stops an operation at Ctrl-C.
struct Watch {
    bar: ProgressBar,
    interrupted: Arc<AtomicBool>,
}

impl Watch {
    fn new() -> Result<Self, Failure> {
        Ok(Watch { bar: progress("{msg} {wide_bar} {pos}/{len}", 1), interrupted: ctrl_c()? })
    }

    fn see(&self, progress: Progress) -> ControlFlow<()> {
        let (what, at, of) = match progress {
            Progress::Reading { address, at, of } => (format!("reading {address}"), at, of),
            Progress::Writing { address, at, of } => (format!("writing {address}"), at, of),
            Progress::Storing => ("storing".to_owned(), 1, 1),
        };
        self.bar.set_message(what);
        self.bar.set_length(of as u64);
        self.bar.set_position(at as u64);
        if self.interrupted.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

impl From<Ended> for Failure {
    fn from(ended: Ended) -> Self {
        match ended {
            Ended::Stopped => Failure::new(ended),
            Ended::Lost(error) => error.into(),
        }
    }
}

/// The data sheet of a node, without which its parameters are unknown.
fn known(node: NodeId, device: Option<&Device>) -> Result<&Device, Failure> {
    device.ok_or_else(|| {
        Failure::new(format_args!("the data sheet of node {node} is unknown"))
            .help("name it with --device FILE, or --device siko/ag03-1 for one that lexican knows")
    })
}

/// Prints an entry that a device does not read or take.
fn print_refused(
    as_json: bool,
    node: NodeId,
    values: &DeviceValues<'_>,
    address: Address,
    refusal: &Refusal,
) -> Result<(), Failure> {
    let report = ValueReport::without_value(Some(values), address);
    if as_json {
        let mut object = report.json();
        object.extend(fields(json!({ "event": "refused", "node": node.get(), "reason": refusal.to_string() })));
        return print_result(true, object, "");
    }
    warn(format_args!("node {node}: {}: {refusal}", report.title()));
    Ok(())
}

/// What was wanted, and how.
struct Wanted<'a> {
    node: NodeId,
    sheet: &'a Device,
    settings: &'a Settings,
    options: Options,
    json: bool,
}

impl Wanted<'_> {
    /// Prints what became of the settings.
    fn print(&self, restored: &Restored, ended: Result<(), Ended>) -> Result<Outcome, Failure> {
        let mut values = DeviceValues::new(self.sheet);
        for (address, data) in self.settings {
            if let Some(value) = ValueReport::of_bytes(Some(&values), *address, data).value {
                values.set(*address, &value);
            }
        }
        let (event, verb, changed): (_, _, Vec<Address>) = match self.options.dry_run {
            true => ("differs", "would be written", restored.differing.keys().copied().collect()),
            false => ("written", "written", restored.written.clone()),
        };
        for address in &changed {
            self.print_change(event, &values, *address, restored)?;
        }
        for (address, refusal) in &restored.refused {
            print_refused(self.json, self.node, &values, *address, refusal)?;
        }
        for address in &restored.switched_off {
            let node = self.node;
            warn(format_args!("node {node}: the PDO of {address} was switched off, and is not switched on again"));
        }
        let mut text = format!(
            "node {}: {} {verb}, {} had their value",
            self.node,
            plural(changed.len(), "parameter"),
            restored.equal
        );
        if !restored.refused.is_empty() {
            text += &format!(", {} refused", restored.refused.len());
        }
        if restored.stored {
            text += "; the device has stored them";
        }
        let object = json!({
            "event": "summary", "node": self.node.get(), event: changed.len(), "equal": restored.equal,
            "refused": restored.refused.len(), "stored": restored.stored, "complete": ended.is_ok(),
        });
        print_result(self.json, fields(object), text)?;
        match ended {
            Err(ended) => Err(Failure::from(ended)
                .help("the same command goes on from here: what the device has is not written again")),
            Ok(()) if restored.refused.is_empty() => Ok(Outcome::Clean),
            Ok(()) => Ok(Outcome::Found),
        }
    }

    fn print_change(
        &self,
        event: &str,
        values: &DeviceValues<'_>,
        address: Address,
        restored: &Restored,
    ) -> Result<(), Failure> {
        let Some(data) = self.settings.get(&address) else {
            return Ok(());
        };
        let report = ValueReport::of_bytes(Some(values), address, data);
        let before = restored.differing.get(&address).and_then(Option::as_ref);
        let before = before.map(|before| ValueReport::of_bytes(Some(values), address, before).text().to_owned());
        let mut object = report.json();
        object.extend(fields(json!({ "event": event, "node": self.node.get(), "before": before })));
        let before = before.map(|before| format!(", was {before}")).unwrap_or_default();
        print_result(self.json, object, format_args!("{}{before}", report.equation()))
    }
}
