//! `lexican backup`, `restore`, `compare` and `apply`: the parameters of devices.

pub(crate) mod apply;
pub(crate) mod backup;
pub(crate) mod compare;
pub(crate) mod restore;
#[cfg(test)]
mod simulated;
mod writing;

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::{DecimalBytes, ProgressBar};
use lexican_eds::model::Device;
use lexican_runtime::NodeId;
use lexican_runtime::object::Address;
use lexican_toolbox::parameters::{Ended, Progress};
use lexican_toolbox::remote::Refusal;
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::report::ValueReport;
use serde_json::json;

use crate::output::{Failure, ctrl_c, fields, print_result, progress, warn};

/// Shows the progress, and stops an operation at Ctrl-C.
struct Watch {
    bar: ProgressBar,
    interrupted: Arc<AtomicBool>,
}

impl Watch {
    fn new() -> Result<Self, Failure> {
        Ok(Watch { bar: progress("{msg} {wide_bar} {pos}/{len}", 1), interrupted: ctrl_c()? })
    }

    fn see(&self, progress: Progress<'_>) -> ControlFlow<()> {
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
