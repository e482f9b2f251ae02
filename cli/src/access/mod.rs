//! `lexican read` and `lexican write`: objects of nodes over SDO, by name and unit.

mod read;
mod write;

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::{DecimalBytes, ProgressFinish};
use lexican_runtime::NodeId;
use lexican_runtime::host::Link;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::{Payload, SdoError};
use lexican_toolbox::node::followed::Followed;
use lexican_toolbox::node::remote::RemoteNode;
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::report::ValueReport;
use serde_json::{Map, Value as Json, json};

use crate::output::{Failure, print_result, spinner, warn};

pub(crate) use read::{LONGEST, ReadArgs, read, save};
pub(crate) use write::{WriteArgs, data_type, write};

/// Prints results in the wanted form.
#[derive(Clone, Copy)]
struct Printer {
    node: NodeId,
    json: bool,
    /// Whether texts must name the node.
    names_node: bool,
}

impl Printer {
    fn print(self, mut fields: Map<String, Json>, text: &str) -> Result<(), Failure> {
        fields.insert("node".to_owned(), json!(self.node.get()));
        print_result(self.json, fields, format_args!("{}{text}", self.prefix()))
    }

    /// Prints an abort: a JSON object, or a warning.
    fn refusal(self, report: &ValueReport, error: &SdoError) -> Result<(), Failure> {
        match error {
            SdoError::Aborted { code, .. } if self.json => return self.print(report.refusal(*code), ""),
            SdoError::Aborted { code, .. } => {
                warn(format_args!("{}{}: the device aborts: {code}", self.prefix(), report.title()));
            }
            error => warn(format_args!("{}{error}", self.prefix())),
        }
        Ok(())
    }

    fn prefix(self) -> String {
        if self.names_node { format!("node {}: ", self.node) } else { String::new() }
    }
}

/// Reads the entries on which unit and limits of an entry depend.
pub(crate) fn read_conditions<L: Link>(
    network: &mut Network<L>,
    node: NodeId,
    address: Address,
    values: &mut DeviceValues<'_>,
) -> Result<(), Failure> {
    let conditions = values.entry(address).map(|entry| values.conditions(entry)).unwrap_or_default();
    Ok(RemoteNode::new(network, node).read_conditions(conditions, values)?)
}

/// Wraps a transfer of `payload`, whose length is `len` if known: shows its progress, and aborts it at Ctrl-C.
fn follow<P: Payload>(
    what: &str,
    len: Option<usize>,
    payload: P,
    interrupted: &AtomicBool,
) -> Followed<P, impl FnMut(u32) -> ControlFlow<()>> {
    let of = len.map(|len| format!(" of {}", DecimalBytes(len as u64))).unwrap_or_default();
    let bar = spinner(what.to_owned()).with_finish(ProgressFinish::AndClear);
    Followed::new(payload, move |bytes| {
        bar.set_message(format!("{what}: {}{of}", DecimalBytes(bytes.into())));
        if interrupted.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })
}

/// Whether an error is an answer of the node.
fn is_answer(error: &SdoError) -> bool {
    !matches!(error, SdoError::TimedOut { .. })
}
