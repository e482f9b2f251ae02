//! Reads and writes entries of a node.

use lexican_eds::model::Value;
use lexican_eds::types::Class;
use lexican_eds::{Input, Source};
use lexican_runtime::host::AccessError;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::SdoError;
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::node::stored;
use lexican_toolbox::values::lookup::{resolve, resolve_all};
use lexican_toolbox::values::report::ValueReport;
use lexican_toolbox::values::wire::{encode, written};

use super::hub::Port;
use super::jobs::Job;
use super::lock::lock;
use super::worker::Worker;
use crate::model::value;
use crate::number;
use crate::request::{Answer, Refused};
use crate::sheet::Sheet;
use crate::view;

/// Reads entries given by name or address.
pub(super) fn read(worker: &Worker, texts: &[String]) -> Result<Answer, Refused> {
    let device = lock(&worker.model).sheet(worker.node).map(|sheet| sheet.device);
    let mut addresses = Vec::new();
    for text in texts {
        // `1018` means all its entries, `1018:00` only the first.
        addresses.extend(resolve_all(device, text).map_err(|error| Refused::new(&error).with_remedy(error.advice()))?);
    }
    let mut network = worker.network()?;
    let mut values = Vec::new();
    for address in addresses {
        if worker.is_interrupted() {
            return Err(Refused::interrupted());
        }
        values.push(read_one(worker, &mut network, address)?);
    }
    Ok(Answer::Values(values))
}

fn read_one(worker: &Worker, network: &mut Network<Port>, address: Address) -> Result<view::Value, Refused> {
    let result = network.read_bytes(worker.node, address);
    let model = lock(&worker.model);
    let at = model.seconds();
    match result {
        Ok(data) => Ok(value(at, &ValueReport::of_bytes(model.values(worker.node), address, &data))),
        Err(AccessError::Sdo { error: SdoError::Aborted { code, .. }, .. }) => Ok(view::Value {
            address: address.to_string(),
            text: code.to_string(),
            number: None,
            raw: String::new(),
            at,
            is_error: true,
        }),
        Err(error) => Err(Refused::new(error).with_remedy(model.no_answer(worker.node))),
    }
}

/// Reads the data sheet that the node stores, and uses it for the node.
pub(super) fn fetch_sheet(worker: &Worker, job: &Job) -> Result<Answer, Refused> {
    let node = worker.node;
    let mut network = worker.network()?;
    let silent = |error: AccessError| Refused::new(error).with_remedy(lock(&worker.model).no_answer(node));
    match stored::form(&mut network, node).map_err(silent)? {
        Some(stored::TEXT) => {}
        Some(form) => {
            let why =
                format_args!("the data sheet of node {node} is in form {form} of the vendor (1022h), and no text");
            return Err(Refused::new(why).with_remedy("`lexican eds fetch` writes it as it is, for the vendor's tools"));
        }
        None => return Err(Refused::new(format_args!("node {node} has no data sheet in it: there is no 1022h"))),
    }
    let text = network.read_bytes(node, stored::SHEET).map_err(silent)?;
    let name = format!("1021h of node {node}");
    let sheet = DataSheet::new(Input::new(Source::from_bytes(&name, &text)));
    let sheet = sheet.map_err(|error| Refused { remedy: error.remedy(), ..Refused::new(&error) })?;
    job.end(true, format!("{} objects", sheet.device.objects.len()));
    lock(&worker.model).introduce(node, Sheet::new(&name, sheet));
    Ok(Answer::Done)
}

/// Writes an entry, if the data sheet allows it.
pub(super) fn write(worker: &Worker, text: &str, new: &str, is_forced: bool) -> Result<Answer, Refused> {
    let node = worker.node;
    let sheet = lock(&worker.model).sheet(node).ok_or_else(|| {
        Refused::new(format_args!("the data types of node {node} are unknown")).with_remedy("give it a data sheet")
    })?;
    let address =
        resolve(Some(sheet.device), text).map_err(|error| Refused::new(&error).with_remedy(error.advice()))?;
    let entry = sheet.device.entry(address.index(), address.sub());
    let entry = entry.ok_or_else(|| Refused::new(format_args!("the data sheet has no {address}")))?;
    let mut network = worker.network()?;
    // Limits and units may depend on other entries: read them, and the model takes them from the bus.
    let conditions = {
        let model = lock(&worker.model);
        let values = model.values(node).filter(|_| !is_forced);
        let unseen = |address: &Address| values.is_some_and(|values| values.seen(*address).is_none());
        let conditions = values.map(|values| values.conditions(entry)).unwrap_or_default();
        conditions.into_iter().filter(unseen).collect::<Vec<_>>()
    };
    for condition in conditions {
        let _ = network.read_bytes(node, condition);
    }
    let data = {
        let model = lock(&worker.model);
        let values = model.values(node).ok_or_else(|| Refused::new("the node is gone"))?;
        let title = ValueReport::without_value(Some(values), address).title();
        let titled = |refused: Refused| Refused { why: format!("{title}: {}", refused.why), ..refused };
        let value: Value = match entry.data_type.class() {
            Class::Text | Class::Bytes | Class::Other => values.parse(entry, new).map_err(Refused::new),
            _ => number::read(new, |text| values.parse(entry, text), |value| values.describe(entry, value)),
        }
        .map_err(titled)?;
        if !is_forced {
            let refused = |error| Refused::new(format_args!("{title}: {error}")).with_remedy("nothing was sent");
            values.check_write(entry, &value, node).map_err(refused)?;
        }
        encode(entry.data_type, &value)
            .ok_or_else(|| Refused::new(format_args!("{title}: the value is no {}", entry.data_type)))?
    };
    match network.write_bytes(node, address, &written(Some(sheet.device), data)) {
        Ok(()) => read_one(worker, &mut network, address).map(|value| Answer::Values(vec![value])),
        Err(AccessError::Sdo { error: SdoError::Aborted { code, .. }, .. }) => {
            Err(Refused::new(format_args!("{address} {}: the device aborts: {code}", entry.name)))
        }
        Err(error) => Err(Refused::new(error).with_remedy(lock(&worker.model).no_answer(node))),
    }
}
