//! The output of the LSS commands.

use lexican_runtime::NodeId;
use lexican_runtime::wire::lss::{Identity, LssResponse};
use serde_json::{Map, Value as Json, json};

use crate::output::{Failure, Outcome, fields, print_result, warn};
use lexican_toolbox::decode::lss::{response_json, response_text};
use lexican_toolbox::lss::Selected;
use lexican_toolbox::node::identity::{self, recognise};

/// The name of the device in a line of output.
pub(super) fn title(selected: Option<Selected>) -> String {
    selected.map_or_else(|| "all devices".to_owned(), |selected| describe(selected.identity))
}

/// `siko/ag03-1, vendor 195h, product 0h, revision 10000h, serial 2Ah`.
pub(super) fn describe(identity: Identity) -> String {
    let Identity { vendor, product, revision, serial } = identity;
    let device = recognise(vendor, Some(product)).map(|known| known.id.to_owned());
    let numbers = identity::words([vendor, product, revision, serial].map(Some));
    device.into_iter().chain(numbers).collect::<Vec<_>>().join(", ")
}

pub(super) fn identity_json(identity: Identity) -> Map<String, Json> {
    let Identity { vendor, product, revision, serial } = identity;
    let device = recognise(vendor, Some(product)).map(|known| known.id);
    fields(json!({
        "vendor": vendor, "product": product, "revision": revision, "serial": serial, "device": device,
    }))
}

/// The JSON fields of a device; empty if all are selected.
pub(super) fn selected_json(selected: Option<Selected>) -> Map<String, Json> {
    let Some(Selected { identity, node }) = selected else { return Map::new() };
    let mut fields = identity_json(identity);
    fields.insert("node".to_owned(), json!(node.map(NodeId::get)));
    fields
}

pub(super) fn print(as_json: bool, mut device: Map<String, Json>, more: Json, text: &str) -> Result<(), Failure> {
    device.extend(fields(more));
    print_result(as_json, device, text)
}

/// Prints the refusal of a device: a JSON object, or a warning.
pub(super) fn print_refusal(
    as_json: bool,
    selected: Option<Selected>,
    refusal: LssResponse,
) -> Result<Outcome, Failure> {
    let text = response_text(refusal);
    if as_json {
        let mut more = response_json(refusal);
        more["refusal"] = json!(text);
        print(true, selected_json(selected), more, "")?;
    } else {
        warn(format_args!("{}: {text}", title(selected)));
    }
    Ok(Outcome::Found)
}
