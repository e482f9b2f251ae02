//! Reads the PDO configuration of a node by SDO, and prints it.

use std::collections::BTreeMap;
use std::io::Write as _;

use lexican_eds::model::Device;
use lexican_runtime::NodeId;
use lexican_runtime::host::AccessError;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::SdoError;
use lexican_toolbox::pdo::{PdoState, in_words};
use lexican_toolbox::values::report::ValueReport;
use serde_json::{Value as Json, json};

use crate::bus::BoxedLink;
use crate::output::{Failure, stdout};

/// Reads entries of a node; `None` for an entry that it lacks or does not allow to read.
pub(super) fn reader(
    network: &mut Network<BoxedLink>,
    node: NodeId,
) -> impl FnMut(Address) -> Result<Option<Vec<u8>>, AccessError> + use<'_> {
    move |address| match network.read_bytes(node, address) {
        Ok(data) => Ok(Some(data)),
        Err(AccessError::Sdo { error: SdoError::Aborted { .. }, .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

/// Prints a PDO: a JSON object, or text with a picture of its bits.
pub(super) fn print(
    as_json: bool,
    node: NodeId,
    state: &PdoState,
    device: Option<&Device>,
    values: &BTreeMap<Address, ValueReport>,
) -> Result<(), Failure> {
    let mut stdout = stdout();
    if as_json {
        let mut fields = state.json(device, values);
        fields.insert("node".to_owned(), json!(node.get()));
        writeln!(stdout, "{}", Json::Object(fields))?;
    } else {
        writeln!(stdout, "{}", in_words(state, device, values))?;
    }
    stdout.flush()?;
    Ok(())
}
