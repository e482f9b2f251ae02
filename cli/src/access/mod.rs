//! Objects of a node over SDO: `lexican read`, `lexican write`.

pub(crate) mod read;
pub(crate) mod write;

use lexican_runtime::NodeId;
use lexican_runtime::host::Link;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::SdoError;
use serde_json::{Map, Value as Json, json};

use crate::output::{Failure, tell, warn};
use crate::values::Known;
use crate::values::told::Told;
use crate::values::wire::{fitting, parse};

/// Reads the settings of the node that decide what a value means.
fn learn_conditions<L: Link>(network: &mut Network<L>, node: NodeId, address: Address, known: &mut Known<'_>) {
    let Some(entry) = known.entry(address) else { return };
    for condition in known.conditions(entry) {
        // Where the node does not tell, its data sheet does.
        let (Ok(data), Some(setting)) = (network.read_bytes(node, condition), known.entry(condition)) else {
            continue;
        };
        if let Some(value) = parse(setting.data_type, fitting(setting.data_type, &data)) {
            known.learn(condition.index(), condition.sub(), &value);
        }
    }
}

/// Whether a node answered, if not what was hoped for.
fn refused(error: &SdoError) -> bool {
    !matches!(error, SdoError::TimedOut { .. })
}

/// Tells an entry of a node.
fn print(as_json: bool, node: NodeId, mut fields: Map<String, Json>, text: &str) -> Result<(), Failure> {
    fields.insert("node".to_owned(), json!(node.get()));
    tell(as_json, fields, text)
}

/// That a node refused: an object for programs, a warning for people.
fn print_refusal(as_json: bool, node: NodeId, told: &Told, error: &SdoError) -> Result<(), Failure> {
    match error {
        SdoError::Aborted { code, .. } if as_json => print(true, node, told.refusal(*code), ""),
        SdoError::Aborted { code, .. } => {
            warn(format_args!("{}: the device aborts: {code}", told.title()));
            Ok(())
        }
        error => {
            warn(error);
            Ok(())
        }
    }
}
