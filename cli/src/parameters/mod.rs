//! `lexican backup`, `restore`, `compare` and `apply`: the parameters of devices.

pub(crate) mod apply;
pub(crate) mod archive;
pub(crate) mod backup;
pub(crate) mod compare;
pub(crate) mod restore;
mod writing;

use std::collections::BTreeMap;
use std::io::Write;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::{DecimalBytes, ProgressBar};
use lexican_eds::model::Device;
use lexican_runtime::NodeId;
use lexican_runtime::object::Address;
use lexican_toolbox::node::remote::Refusal;
use lexican_toolbox::parameters::{Ended, LeftOut, LeftOuts, Progress};
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::report::ValueReport;
use serde_json::{Value as Json, json};

use crate::output::{self, Failure, ctrl_c, fields, note, print_result, progress, warn};

/// Shows the progress, and stops an operation at Ctrl-C.
pub(crate) struct Watch {
    pub(crate) bar: ProgressBar,
    interrupted: Arc<AtomicBool>,
}

impl Watch {
    pub(crate) fn new() -> Result<Self, Failure> {
        Ok(Watch { bar: progress("{msg} {wide_bar} {pos}/{len}", 1), interrupted: ctrl_c()? })
    }

    pub(crate) fn see(&self, progress: Progress<'_>) -> ControlFlow<()> {
        let step = match progress {
            Progress::Reading { address, at, of } => Some((format!("reading {address}"), at, of)),
            Progress::Writing { address, at, of } => Some((format!("writing {address}"), at, of)),
            Progress::Storing => Some(("storing".to_owned(), 1, 1)),
            Progress::Transferring { address, bytes } => {
                self.bar.set_message(format!("{address}: {}", DecimalBytes(bytes.into())));
                None
            }
            Progress::Written { .. } => None,
        };
        if let Some((what, at, of)) = step {
            self.bar.set_message(what);
            self.bar.set_length(of as u64);
            self.bar.set_position(at as u64);
        }
        if self.is_interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    pub(crate) fn is_interrupted(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
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
            Ended::Stopped | Ended::Restarted => Failure::new(ended),
            Ended::Lost(error) => error.into(),
        }
    }
}

/// The data sheet of a node; without one, its parameters are unknown.
fn known(node: NodeId, device: Option<&Device>) -> Result<&Device, Failure> {
    device.ok_or_else(|| {
        Failure::new(format_args!("the data sheet of node {node} is unknown"))
            .help("name it with --device FILE, or --device siko/ag03-1 for one that lexican knows")
    })
}

/// The option about entries that are no parameters.
#[derive(clap::Args, Clone, Copy, Debug)]
struct LeftOutArgs {
    /// List what is left out, and why
    #[arg(long)]
    left_out: bool,
}

impl LeftOutArgs {
    /// Lists the entries left out, or counts them by reason on stderr. In JSON they are in the summary ([`by_reason`]).
    fn print(self, as_json: bool, device: &Device, left_out: &LeftOuts) -> Result<(), Failure> {
        let values = DeviceValues::new(device);
        if as_json || left_out.is_empty() {
            return Ok(());
        }
        if self.left_out {
            let mut stdout = output::stdout();
            for (address, reason) in left_out {
                let title = ValueReport::without_value(Some(&values), *address).title();
                writeln!(stdout, "left out: {title}: {}", reason.words(1))?;
            }
            return Ok(());
        }
        let mut counts: BTreeMap<LeftOut, usize> = BTreeMap::new();
        left_out.values().for_each(|reason| *counts.entry(*reason).or_default() += 1);
        let counts = counts.into_iter().map(|(reason, count)| format!("{count} {}", reason.words(count)));
        note(format_args!("left out: {}; --left-out lists them", counts.collect::<Vec<_>>().join(", ")));
        Ok(())
    }
}

/// The addresses of the entries left out, by reason.
fn by_reason(left_out: &LeftOuts) -> Json {
    let mut reasons: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for (address, reason) in left_out {
        reasons.entry(reason.name()).or_default().push(address.to_string());
    }
    json!(reasons)
}

/// Prints an entry that a device refuses to read or write.
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
