//! Backup, restore and comparison of a node's parameters.

use std::ops::ControlFlow;

use lexican_eds::{Input, Source};
use lexican_runtime::NodeId;
use lexican_runtime::host::AccessError;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::SdoError;
use lexican_toolbox::node::remote::RemoteNode;
use lexican_toolbox::parameters::backup::backup;
use lexican_toolbox::parameters::compare::{Difference, Side, compare};
use lexican_toolbox::parameters::restore::{Options, Outcome, check_identity, configured, restore};
use lexican_toolbox::parameters::{Ended, Progress};
use lexican_toolbox::values::report::ValueReport;

use super::hub::Port;
use super::jobs::Job;
use super::lock::lock;
use super::worker::Worker;
use crate::request::{Answer, Refused};
use crate::sheet::Sheet;
use crate::view;

/// Reads all parameters of a node as a DCF.
pub(super) fn keep(worker: &Worker, job: &Job) -> Result<Answer, Refused> {
    let sheet = sheet_of(worker)?;
    let mut network = worker.network()?;
    let mut node = RemoteNode::new(&mut network, worker.node);
    let kept = backup(&mut node, sheet.device, false, &mut |progress| report(worker, job, sheet, progress))
        .map_err(|error| ended(worker, error))?;
    let name = format!("node-{}.dcf", worker.node);
    let (refused, others) = (kept.left_out.len(), kept.no_parameters.len());
    job.end(
        true,
        format!("{} parameters in {name}, {refused} not read; {others} entries are no parameters", kept.kept),
    );
    Ok(Answer::File { name, bytes: kept.dcf().into_bytes() })
}

/// Writes parameters that differ from a DCF.
pub(super) fn put_back(worker: &Worker, job: &Job, dcf: &str) -> Result<Answer, Refused> {
    let sheet = sheet_of(worker)?;
    let (device, _) = lexican_eds::load(&Input::new(Source::new("backup.dcf", dcf)));
    let settings = configured(&device, worker.node);
    if settings.is_empty() {
        return Err(Refused::new("the file has no parameter values").with_remedy("it has to be a DCF, as a backup is"));
    }
    let mut network = worker.network()?;
    let mut node = RemoteNode::new(&mut network, worker.node);
    check_identity(&mut node, &device).map_err(|error| ended(worker, error))?.map_err(Refused::new)?;
    let mut outcome = Outcome::default();
    let result = restore(
        &mut node,
        sheet.device,
        &settings,
        Options::default(),
        &mut |progress| report(worker, job, sheet, progress),
        &mut outcome,
    );
    let said = format!("{} written, {} had their value", outcome.written.len(), outcome.equal);
    result.map_err(|error| {
        Refused::new(format_args!("{}: {said} until then", ended(worker, error).why))
            .with_remedy("restore again: it goes on where it ended")
    })?;
    see_anew(worker, &mut network);
    if outcome.refused.is_empty() {
        job.end(true, format!("{said}; the node is PRE-OPERATIONAL"));
        return Ok(Answer::Done);
    }
    let title = |address: &Address| {
        let model = lock(&worker.model);
        ValueReport::without_value(model.values(worker.node), *address).title()
    };
    let refused = outcome.refused.iter().map(|(address, why)| format!("{}: {why}", title(address)));
    Err(Refused::new(format_args!("{said}; not taken: {}", refused.collect::<Vec<_>>().join("; "))))
}

/// Reads all values seen before again, because they may depend on the parameters written. The model takes them from the
/// bus.
fn see_anew(worker: &Worker, network: &mut Network<Port>) {
    let seen = lock(&worker.model).seen(worker.node);
    for address in seen {
        if worker.is_interrupted() {
            return;
        }
        match network.read_bytes(worker.node, address) {
            // A write-only entry has not been seen with a value.
            Ok(_) | Err(AccessError::Sdo { error: SdoError::Aborted { .. }, .. }) => {}
            Err(_) => return,
        }
    }
}

/// The values in a node's data sheet.
pub(super) fn side_of_sheet(worker: &Worker) -> Result<Side, Refused> {
    Ok(Side::of_sheet(sheet_of(worker)?.device.clone(), worker.node))
}

/// The values in a DCF.
pub(super) fn side_of_dcf(worker: &Worker, dcf: &str) -> Side {
    let device = lexican_eds::device(&Input::new(Source::new("other.dcf", dcf)));
    Side::of_sheet(device, worker.node)
}

/// Compares two sides.
pub(super) fn differences(here: &Side, there: &Side, job: &Job) -> Result<Answer, Refused> {
    let found = compare(here, there);
    let (differ, unknown, others) = (found.differences.len(), found.unknown.len(), found.left_out.len());
    let unknown = if unknown == 0 { String::new() } else { format!(", {unknown} known of one side only") };
    let compared = found.compared;
    job.end(
        true,
        format!("{compared} parameters compared, {differ} differ{unknown}; {others} entries are no parameters"),
    );
    Ok(Answer::Differences(found.differences.iter().map(difference).collect()))
}

fn difference(found: &Difference) -> view::Difference {
    let words = |report: &Option<ValueReport>| report.as_ref().map_or("-", ValueReport::text).to_owned();
    let report = found.a.as_ref().or(found.b.as_ref());
    view::Difference {
        address: found.address.to_string(),
        name: report.and_then(|report| report.name.as_deref()).unwrap_or_default().to_owned(),
        here: words(&found.a),
        there: words(&found.b),
    }
}

/// The values in the node.
pub(super) fn side(worker: &Worker, job: &Job) -> Result<Side, Refused> {
    let sheet = sheet_of(worker)?;
    let mut network = worker.network()?;
    let mut remote = RemoteNode::new(&mut network, worker.node);
    Side::of_node(&mut remote, sheet.device.clone(), &mut |progress| report(worker, job, sheet, progress))
        .map_err(|error| ended(worker, error))
}

fn report(worker: &Worker, job: &Job, sheet: Sheet, progress: Progress<'_>) -> ControlFlow<()> {
    match progress {
        Progress::Reading { address, at, of } | Progress::Writing { address, at, of } => {
            let entry = sheet.device.entry(address.index(), address.sub());
            let name = entry.map_or("", |entry| &entry.name);
            job.progress(at as f64 / of.max(1) as f64, format!("{address} {name}"));
        }
        Progress::Transferring { .. } | Progress::Written { .. } => {}
        Progress::Storing => job.progress(1.0, "it stores its parameters".to_owned()),
    }
    if worker.is_interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}

fn ended(worker: &Worker, ended: Ended) -> Refused {
    match ended {
        Ended::Stopped => Refused::interrupted(),
        Ended::Restarted => Refused::new(Ended::Restarted),
        Ended::Lost(error) => Refused::new(error).with_remedy(lock(&worker.model).no_answer(worker.node)),
    }
}

fn sheet_of(worker: &Worker) -> Result<Sheet, Refused> {
    let node = worker.node;
    let sheet = lock(&worker.model).sheet(node);
    sheet.ok_or_else(|| Refused::new(format_args!("which device is node {node}?")).with_remedy("give it a data sheet"))
}

pub(super) fn node_id(number: u8) -> Result<NodeId, Refused> {
    NodeId::new(number).ok_or_else(|| Refused::new(format_args!("{number} is not a node-ID: these are 1 to 127")))
}
