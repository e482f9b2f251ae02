//! Carries out orders to drives.

use lexican_driver::sequence::{self, Recovery};
use lexican_driver::{Any, Description, Error, Missing, Mode, Protection, Supervision};
use lexican_runtime::profile::cia402::State;
use lexican_runtime::{Duration, NodeId};
use lexican_toolbox::drive::{
    Ending, Look, Order, RESCUE, SafeEnd, Scales, Times, Verb, carry_out, end_safely, explain_settings,
};

use super::hub::Port;
use super::lock::lock;
use super::worker::{NOBODY, Worker};
use crate::model::Model;
use crate::number;
use crate::request::{Answer, Refused};
use crate::sheet::{Sheet, lack};
use crate::view;

type Drive = lexican_driver::Drive<Port, Any>;

/// The time within which a drive notices that the bench is gone.
const PROTECTION: Duration = Duration::from_secs(1);

/// How long a motion may take.
const WITHIN: Duration = Duration::from_secs(600);

/// Carries out an order for a client; [`view::Drive`] shows its progress.
pub(super) fn carry(worker: &Worker, verb: Verb, value: Option<&str>) -> Result<Answer, Refused> {
    let node = worker.node;
    let (sheet, description) = {
        let mut model = lock(&worker.model);
        let is_to_stand = model.drive_if_known(node).is_some_and(|drive| drive.standstill.unconfirmed().is_some());
        if !verb.is_stop() && is_to_stand {
            return Err(Refused::new(format_args!("drive {node} is to stand, and has not confirmed that it does"))
                .with_remedy("give the order again when it has; until then the stop is sent again and again"));
        }
        description(&model, node)?
    };
    let mut scales = Scales::new(sheet.device, description);
    // A stop has no value, and waits for nothing.
    if !verb.is_stop() {
        let mut network = worker.network()?;
        let mut remote = lexican_toolbox::node::remote::RemoteNode::new(&mut network, node);
        for object in scales.objects() {
            let values = scales.values();
            let conditions = values.entry(object).map(|entry| values.conditions(entry)).unwrap_or_default();
            remote.read_conditions(conditions, values).map_err(Refused::new)?;
        }
    }
    let order = parse(verb, value, &scales)?;
    let drive = match Drive::connect_described_unprotected(worker.link()?, node, description) {
        Err(_) if verb.is_stop() => {
            let recovery = Recovery::within(RESCUE);
            let found = Drive::connect_described_and_recover(worker.ports.link(), node, description, &recovery);
            found.map(|(drive, _)| drive)
        }
        connected => connected,
    };
    let mut drive = match drive {
        Ok(drive) => drive,
        Err(error) => {
            let refused = Refused::new(&error).with_remedy(lock(&worker.model).no_answer(node));
            if verb.is_stop() {
                lock(&worker.model).drive(node).ending = Some(unstoppable(node, &error));
            }
            return Err(refused);
        }
    };
    worker.begin_order(drive.cancel_handle());
    let target = match order {
        Order::MoveTo(target) => Some(target),
        // The interrupted motion may be another manager's.
        Order::Resume => {
            let target = drive.run(async |drive| drive.get(description.objects.target_position).await);
            target.ok().and_then(|target| i32::try_from(target).ok())
        }
        _ => None,
    };
    let before = {
        let mut model = lock(&worker.model);
        let shown = model.drive(node);
        shown.order = Some(order.words(&scales, None, "until it is stopped"));
        (shown.ending, shown.look) = (None, None);
        std::mem::replace(&mut shown.target, target)
    };
    let result = run(worker, &mut drive, order);
    let end = end_safely(&mut drive, order, result);
    drop(drive.release());
    let is_refused = end.word == "refused";
    let ending = shown(node, end);
    if !verb.is_stop() {
        // The obstacles may have changed.
        worker.ask(NOBODY, move |worker| look(worker, description));
    }
    let is_success = ending.is_success;
    let refused = Refused { why: ending.text.clone(), remedy: ending.remedy.clone() };
    let mut model = lock(&worker.model);
    let shown = model.drive(node);
    (shown.order, shown.ending) = (None, Some(ending));
    if is_refused {
        shown.target = before;
    }
    if is_success { Ok(Answer::Done) } else { Err(refused) }
}

/// The data sheet of a drive, and its description.
pub(super) fn description(model: &Model, node: NodeId) -> Result<(Sheet, &'static Description), Refused> {
    let sheet = model.sheet(node);
    let found = sheet.and_then(|sheet| Some((sheet, sheet.drive?)));
    found.ok_or_else(|| match sheet.and_then(|sheet| sheet.lacks.first()) {
        Some(fact) => Refused {
            why: format!("drive {node} cannot be moved by its data sheet: {}", fact.text),
            remedy: fact.remedy.clone(),
        },
        None => Refused::new(format_args!("node {node} is no drive")),
    })
}

fn run(worker: &Worker, drive: &mut Drive, order: Order) -> Result<Ending, Error> {
    if order.moves() {
        match drive.protect(Supervision::within(PROTECTION)) {
            // The drive would continue if the bench were killed; the view warns of that beforehand.
            Err(why) if Protection::is_lacking(&why) => {}
            protected => protected.map(|_| ())?,
        }
    }
    let times = Times { within: WITHIN, lasting: None };
    let model = &worker.model;
    let mut look = |look: Look| lock(model).look(worker.node, look);
    // Watched entries are read by the order's SDO client meanwhile, because a node has only one conversation at a time.
    let mut wanted = |now| if order.verb().is_stop() { None } else { worker.due(now) };
    drive.run(async |drive| carry_out(&drive, order, times, &mut look, &mut wanted).await)
}

fn shown(node: NodeId, end: SafeEnd) -> view::Ending {
    let text = if end.may_be_moving { format!("DRIVE {node} {}", end.text) } else { end.text };
    // A cancelled order was cancelled by a client, which is no failure.
    let is_success = end.is_success || end.word == "cancelled";
    view::Ending { is_success, may_be_moving: end.may_be_moving, text, remedy: end.remedy }
}

/// The ending of an order whose drive could not be stopped.
pub(super) fn unstoppable(node: NodeId, why: &dyn std::fmt::Display) -> view::Ending {
    shown(node, lexican_toolbox::drive::unstoppable(why, Protection::None))
}

fn parse(verb: Verb, value: Option<&str>, scales: &Scales<'_>) -> Result<Order, Refused> {
    match value.map(str::trim).filter(|value| !value.is_empty()) {
        Some(text) => number::read(text, |text| verb.order(Some(text), scales), |order| order.value_text(scales)),
        None => verb.order(None, scales).map_err(Refused::new),
    }
}

/// Checks what would prevent a drive from moving now.
pub(super) fn look(worker: &Worker, description: &'static Description) {
    let Ok(link) = worker.link() else { return };
    let found = Drive::connect_described_unprotected(link, worker.node, description).and_then(|mut drive| {
        let obstacles = obstacles(&mut drive, description)?;
        Ok((obstacles, drive.run(async |drive| explain_settings(&drive).await)?))
    });
    let (obstacles, facts) = found.unwrap_or_else(|error| (vec![error.to_string()], Vec::new()));
    let mut model = lock(&worker.model);
    let drive = model.drive(worker.node);
    (drive.obstacles, drive.lacks) = (Some(obstacles), facts.iter().map(lack).collect());
}

fn obstacles(drive: &mut Drive, description: &'static Description) -> Result<Vec<String>, Error> {
    let checked = drive.run(async |drive| {
        if description.code_of(Mode::Positioning).is_some() {
            let target = drive.position().await?;
            sequence::refuse(&drive, sequence::Order::Travel { target }).await
        } else {
            sequence::refuse(&drive, sequence::Order::Run { velocity: 0 }).await
        }
    });
    match checked {
        Ok(()) => Ok(Vec::new()),
        Err(Error::Refused(refusal)) => {
            // Orders set the mode themselves.
            let is_obstacle = |missing: &&Missing| !matches!(missing, Missing::Mode(_) | Missing::UnknownMode(_));
            Ok(refusal.0.iter().filter(is_obstacle).map(|missing| sentence(*missing)).collect())
        }
        Err(error) => Err(error),
    }
}

fn sentence(missing: Missing) -> String {
    match missing {
        Missing::Enabled(State::SwitchOnDisabled) => "it is not enabled".to_owned(),
        other => lexican_driver::Refusal(vec![other]).to_string(),
    }
}
