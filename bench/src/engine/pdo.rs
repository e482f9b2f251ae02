//! Reads and changes the PDO configuration of a node.

use std::collections::BTreeMap;

use lexican_eds::model::Device;
use lexican_runtime::CobId;
use lexican_runtime::host::AccessError;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::object::{Address, Direction};
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::wire::pdo::TransmissionType;
use lexican_toolbox::pdo::{Change, Objection, PdoName, PdoState, Plan, transmission};
use lexican_toolbox::values::{address, name};

use super::hub::Port;
use super::lock::lock;
use super::worker::Worker;
use crate::model::Model;
use crate::request::{Answer, Refused};
use crate::view;

/// Reads the PDO configuration of a node, so that the model can decode its PDOs.
pub(super) fn learn(worker: &Worker) {
    let device = lock(&worker.model).sheet(worker.node).map(|sheet| sheet.device);
    let Ok(mut network) = worker.network() else { return };
    // Ignore errors: a node that does not respond is read again when it boots; until then, its data sheet is used.
    let _ = PdoState::read_all(device, reader(&mut network, worker));
}

/// Reads how the PDOs of a node are configured.
pub(super) fn show(worker: &Worker) -> Result<Answer, Refused> {
    let device = lock(&worker.model).sheet(worker.node).map(|sheet| sheet.device);
    let mut network = worker.network()?;
    let states = PdoState::read_all(device, reader(&mut network, worker)).map_err(Refused::new)?;
    let mut users = BTreeMap::<CobId, Vec<PdoName>>::new();
    for state in states.iter().filter(|state| state.cob_id.is_valid()) {
        users.entry(state.cob_id.id()).or_default().push(state.name);
    }
    let model = lock(&worker.model);
    let pdos = states.iter().map(|state| {
        let same = users.get(&state.cob_id.id()).filter(|users| users.len() > 1 && state.cob_id.is_valid());
        let conflict = same.map(|users| {
            let names: Vec<_> = users.iter().filter(|name| **name != state.name).map(PdoName::to_string).collect();
            format!("{} has the same COB-ID", names.join(", "))
        });
        let conflict =
            conflict.or_else(|| (state.bits() > 64).then(|| format!("{} bits are mapped, 64 fit", state.bits())));
        view(&model, worker, device, state, conflict)
    });
    Ok(Answer::Pdos(pdos.collect()))
}

fn view(
    model: &Model,
    worker: &Worker,
    device: Option<&Device>,
    state: &PdoState,
    conflict: Option<String>,
) -> view::Pdo {
    let mut first_bit = 0u8;
    let mut fields = Vec::new();
    for mapped in &state.mapping {
        let entry =
            device.and_then(|device| Some((device, device.entry(mapped.address.index(), mapped.address.sub())?)));
        let value = model.value(worker.node, mapped.address);
        fields.push(view::PdoField {
            address: mapped.address.to_string(),
            name: entry.map_or_else(|| "gap".to_owned(), |(device, entry)| name(device, entry)),
            first_bit,
            bits: mapped.bits,
            text: value.map(|value| value.text.clone()),
            at: value.map(|value| value.at),
        });
        first_bit = first_bit.saturating_add(mapped.bits);
    }
    view::Pdo {
        name: state.name.to_string(),
        id: state.cob_id.id().to_string(),
        is_on: state.cob_id.is_valid(),
        transmission: state.transmission.map_or_else(String::new, |it| transmission(state.name.direction, it)),
        event_timer_ms: state.event_timer_ms,
        inhibit_ms: state.inhibit_100us.map(|time| f64::from(time) / 10.0),
        fields,
        per_second: model.per_second(state.cob_id.id()),
        conflict,
        mappable: device.map(|device| mappable(device, state.name)).unwrap_or_default(),
    }
}

/// The entries that fit into the PDO alone.
fn mappable(device: &Device, pdo: PdoName) -> Vec<(String, String)> {
    let fits = |at: &Address| pdo.map(Some(device), &[at.to_string()]).is_ok();
    let entries = device.entries().map(|entry| (address(entry), entry)).filter(|(at, _)| fits(at));
    entries.map(|(at, entry)| (at.to_string(), name(device, entry))).collect()
}

/// The wanted change of a PDO.
pub(super) struct Wanted {
    pub(super) pdo: String,
    pub(super) objects: Vec<String>,
    pub(super) transmission: Option<String>,
    pub(super) is_check: bool,
}

/// Checks a change of a PDO, and makes it unless only the check is wanted.
pub(super) fn map(worker: &Worker, wanted: &Wanted) -> Result<Answer, Refused> {
    let node = worker.node;
    let device = lock(&worker.model).sheet(node).map(|sheet| sheet.device);
    let pdo: PdoName = wanted.pdo.parse().map_err(Refused::new)?;
    let mut network = worker.network()?;
    let before = PdoState::read(pdo, reader(&mut network, worker)).map_err(Refused::new)?;
    let before = before.ok_or_else(|| Refused::new(format_args!("node {node} has no {pdo}")))?;
    let plan = match plan(worker, device, before, wanted) {
        Ok(plan) => plan,
        Err(objections) => {
            let objections: Vec<_> = objections.iter().map(ToString::to_string).collect();
            return if wanted.is_check {
                Ok(Answer::Objections(objections))
            } else {
                Err(Refused::new(objections.join("; ")).with_remedy("nothing was written"))
            };
        }
    };
    if wanted.is_check {
        return Ok(Answer::Objections(Vec::new()));
    }
    if !plan.changes_nothing()
        && let Err(error) = network.configure(node, &plan.apply())
    {
        let undone = network.configure(node, &plan.undo());
        let now =
            if undone.is_ok() { format!("{pdo} was put back as it was") } else { format!("{pdo} may be half changed") };
        let refused = Refused::new(format_args!("{error}; {now}"));
        return Err(match error {
            AccessError::Sdo { error: SdoError::Aborted { .. }, .. } => {
                refused.with_remedy("many devices demand PRE-OPERATIONAL for it")
            }
            _ => refused,
        });
    }
    let after = PdoState::read(pdo, reader(&mut network, worker)).map_err(Refused::new)?;
    let after = after.ok_or_else(|| Refused::new(format_args!("{pdo} of node {node} has vanished")))?;
    match after.differences(&plan.after).join("; ") {
        differences if differences.is_empty() => {
            let model = lock(&worker.model);
            Ok(Answer::Pdos(vec![view(&model, worker, device, &after, None)]))
        }
        differences => Err(Refused::new(format_args!("{pdo} was written, but {differences}"))),
    }
}

fn plan(
    worker: &Worker,
    device: Option<&Device>,
    before: PdoState,
    wanted: &Wanted,
) -> Result<Plan, Vec<ObjectionText>> {
    let text =
        |objections: Vec<Objection>| objections.iter().map(|it| ObjectionText(it.to_string())).collect::<Vec<_>>();
    let mapping = before.name.map(device, &wanted.objects).map_err(text)?;
    let (transmission, event_timer_ms) = match wanted.transmission.as_deref() {
        None => (None, None),
        Some(words) => timing(before.name.direction, words).map_err(|why| vec![ObjectionText(why)])?,
    };
    let change = Change {
        on: Some(true),
        cob_id: None,
        transmission,
        inhibit_100us: None,
        event_timer_ms,
        mapping: Some(mapping),
    };
    Plan::new(device, worker.node, before, &change).map_err(text)
}

/// The objections to a change, as text.
struct ObjectionText(String);

impl std::fmt::Display for ObjectionText {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

/// Parses `event`, `sync`, `sync:4`, `every:10ms` to a transmission type and an event timer in ms.
fn timing(direction: Direction, words: &str) -> Result<(Option<TransmissionType>, Option<u16>), String> {
    let wrong = || format!("{words:?} is none of event, sync, sync:N and every:10ms");
    let (kind, number) = words.split_once(':').map_or((words, None), |(kind, number)| (kind, Some(number)));
    match (kind, number) {
        ("event", None) => Ok((Some(TransmissionType::EventProfile), None)),
        ("sync", None) => Ok((Some(TransmissionType::from_code(1)), None)),
        ("sync", Some(number)) => match number.parse() {
            Ok(number @ 0..=240) => Ok((Some(TransmissionType::from_code(number)), None)),
            _ => Err(format!("{number:?} is no number of SYNCs: these are 0 to 240")),
        },
        ("every", Some(number)) => {
            let ms = number.trim_end_matches("ms").trim().parse().map_err(|_| wrong())?;
            let is_sent = direction == Direction::Transmit;
            Ok((is_sent.then_some(TransmissionType::EventProfile), Some(ms)))
        }
        _ => Err(wrong()),
    }
}

/// Reads entries; `None` for an entry that the node lacks or does not allow to read.
fn reader<'a>(
    network: &'a mut Network<Port>,
    worker: &'a Worker,
) -> impl FnMut(Address) -> Result<Option<Vec<u8>>, AccessError> + 'a {
    move |address| match network.read_bytes(worker.node, address) {
        Ok(data) => Ok(Some(data)),
        Err(AccessError::Sdo { error: SdoError::Aborted { .. }, .. }) => Ok(None),
        Err(error) => Err(error),
    }
}
