//! Orders to a drive.

use lexican_driver::sequence::{self, Recovery};
use lexican_driver::{Any, Description, Error, Missing, Mode, Protection, Supervision};
use lexican_runtime::profile::cia402::State;
use lexican_runtime::{Duration, NodeId};
use lexican_toolbox::drive::{Ending, Look, Order, SafeEnd, Scales, Times, carry_out, end_safely};

use super::hub::Port;
use super::lock::lock;
use super::station::{NOBODY, Station};
use crate::command::{self, Answer, Refused};
use crate::model::Model;
use crate::number;
use crate::sheet::Sheet;
use crate::view;

type Drive = lexican_driver::Drive<Port, Any>;

/// How soon a drive is to notice that the bench is gone.
const PROTECTION: Duration = Duration::from_secs(1);

/// How long a travel may take.
const WITHIN: Duration = Duration::from_secs(600);

/// How long to try to stop a drive whose bus is lost.
const RESCUE: Duration = Duration::from_secs(5);

/// Carries an order out for a face; [`view::Drive`] shows what becomes of it.
pub(super) fn carry(station: &Station, order: command::Order, value: Option<&str>) -> Result<Answer, Refused> {
    let node = station.node;
    let (sheet, description) = {
        let mut model = lock(&station.model);
        let is_to_stand = model.drive_if_known(node).is_some_and(|drive| drive.standstill.unconfirmed().is_some());
        if !is_braking(order) && is_to_stand {
            return Err(Refused::new(format_args!("drive {node} is to stand, and has not confirmed that it does"))
                .with_remedy("give the order again when it has; until then the stop is sent again and again"));
        }
        description(&model, node)?
    };
    let mut scales = Scales::new(sheet.device, description);
    // A stop has no number, and waits for none.
    if !is_braking(order) {
        let mut network = station.network()?;
        let mut remote = lexican_toolbox::remote::RemoteNode::new(&mut network, node);
        for object in scales.objects() {
            let values = scales.values();
            let conditions = values.entry(object).map(|entry| values.conditions(entry)).unwrap_or_default();
            remote.read_conditions(conditions, values).map_err(Refused::new)?;
        }
    }
    let order = parse(order, value, &scales)?;
    let drive = match Drive::connect_described_unprotected(station.link()?, node, description) {
        Err(_) if is_stop(order) => {
            let recovery = Recovery::within(RESCUE);
            let found = Drive::connect_described_and_recover(station.ports.link(), node, description, &recovery);
            found.map(|(drive, _)| drive)
        }
        connected => connected,
    };
    let mut drive = match drive {
        Ok(drive) => drive,
        Err(error) => {
            let refused = Refused::new(&error).with_remedy(lock(&station.model).no_answer(node));
            if is_stop(order) {
                lock(&station.model).drive(node).ending = Some(unstoppable(node, &error));
            }
            return Err(refused);
        }
    };
    station.begin_order(drive.cancel_handle());
    let target = match order {
        Order::MoveTo(target) => Some(target),
        // Another manager may have ordered the travel.
        Order::Resume => {
            let target = drive.run(async |drive| drive.get(description.objects.target_position).await);
            target.ok().and_then(|target| i32::try_from(target).ok())
        }
        _ => None,
    };
    let before = {
        let mut model = lock(&station.model);
        let shown = model.drive(node);
        shown.order = Some(words(order, &scales));
        (shown.ending, shown.look) = (None, None);
        std::mem::replace(&mut shown.target, target)
    };
    let result = run(station, &mut drive, order);
    let end = end_safely(&mut drive, order, result);
    drop(drive.release());
    let is_refused = end.word == "refused";
    let ending = shown(node, end);
    if !is_stop(order) {
        // What stood in its way is another matter now.
        station.ask(NOBODY, move |station| look(station, description));
    }
    let is_success = ending.is_success;
    let refused = Refused { why: ending.text.clone(), remedy: ending.remedy.clone() };
    let mut model = lock(&station.model);
    let shown = model.drive(node);
    (shown.order, shown.ending) = (None, Some(ending));
    if is_refused {
        shown.target = before;
    }
    if is_success { Ok(Answer::Done) } else { Err(refused) }
}

/// The data sheet of a drive, and how to move it.
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

const fn is_braking(order: command::Order) -> bool {
    matches!(order, command::Order::Stop | command::Order::QuickStop)
}

fn run(station: &Station, drive: &mut Drive, order: Order) -> Result<Ending, Error> {
    if order.moves() {
        match drive.protect(Supervision::within(PROTECTION)) {
            // It goes on with its order if the bench is killed: the view says so before.
            Err(why) if Protection::is_lacking(&why) => {}
            protected => protected.map(|_| ())?,
        }
    }
    let times = Times { within: WITHIN, lasting: None };
    let model = &station.model;
    let mut look = |look: Look| lock(model).look(station.node, look);
    // What is watched is read on, by the order's own client: a node has one conversation at a time.
    let mut wanted = |now| if is_stop(order) { None } else { station.due(now) };
    let ending = drive.run(async |drive| carry_out(&drive, order, times, &mut look, &mut wanted).await)?;
    if ending == Ending::Stalled {
        drive.stop()?;
    }
    Ok(ending)
}

fn shown(node: NodeId, end: SafeEnd) -> view::Ending {
    let text = if end.may_be_moving { format!("DRIVE {node} {}", end.text) } else { end.text };
    // What was interrupted has been by a face.
    let is_success = end.is_success || end.word == "cancelled";
    view::Ending { is_success, may_be_moving: end.may_be_moving, text, remedy: end.remedy }
}

const fn is_stop(order: Order) -> bool {
    matches!(order, Order::Stop | Order::QuickStop)
}

/// The ending of an order that left a drive to itself.
pub(super) fn unstoppable(node: NodeId, why: &dyn std::fmt::Display) -> view::Ending {
    shown(node, lexican_toolbox::drive::unstoppable(why, Protection::None))
}

fn parse(order: command::Order, value: Option<&str>, scales: &Scales<'_>) -> Result<Order, Refused> {
    let value = value.map(str::trim).filter(|value| !value.is_empty());
    let position = |text: &str| number::read(text, |text| scales.parse_position(text), |it| scales.target(*it));
    let velocity =
        |text: &str| number::read(text, |text| scales.parse_velocity(text), |it| scales.target_velocity(*it));
    let needed = |what: &str| value.ok_or_else(|| Refused::new(what));
    Ok(match order {
        command::Order::Enable => Order::Enable,
        command::Order::Disable => Order::Disable,
        command::Order::ResetFault => Order::ResetFault,
        command::Order::MoveTo => Order::MoveTo(position(needed("where to? It takes a position")?)?),
        command::Order::Step => Order::Step(value.map(position).transpose()?),
        command::Order::Run => Order::Run(velocity(needed("how fast? It takes a velocity")?)?),
        command::Order::Home => Order::Home(match value {
            None => None,
            Some(text) => Some(text.parse().map_err(|_| Refused::new(format_args!("{text:?} is no homing method")))?),
        }),
        command::Order::Stop => Order::Stop,
        command::Order::QuickStop => Order::QuickStop,
        command::Order::Resume => Order::Resume,
        command::Order::Drop => Order::Drop,
    })
}

fn words(order: Order, scales: &Scales<'_>) -> String {
    match order {
        Order::Enable => "is being enabled".to_owned(),
        Order::Disable => "is being stopped and disabled".to_owned(),
        Order::ResetFault => "its fault is being reset".to_owned(),
        Order::MoveTo(target) => format!("travels to {}", scales.target(target)),
        Order::Step(Some(width)) => format!("travels by {}", scales.target(width)),
        Order::Step(None) => "takes a step".to_owned(),
        Order::Run(velocity) => format!("runs at {} until it is stopped", scales.target_velocity(velocity)),
        Order::Home(Some(method)) => format!("homes by method {method}"),
        Order::Home(None) => "homes".to_owned(),
        Order::Stop => "is being stopped".to_owned(),
        Order::QuickStop => "is being stopped at once".to_owned(),
        Order::Resume => "goes on with its travel".to_owned(),
        Order::Drop => "drops the rest of its travel, and is being disabled".to_owned(),
        Order::Watch => "is being watched".to_owned(),
    }
}

/// Finds out why a drive would not move now.
pub(super) fn look(station: &Station, description: &'static Description) {
    let Ok(link) = station.link() else { return };
    let found = Drive::connect_described_unprotected(link, station.node, description)
        .and_then(|mut drive| obstacles(&mut drive, description));
    let obstacles = match found {
        Ok(obstacles) => obstacles,
        Err(error) => vec![error.to_string()],
    };
    lock(&station.model).drive(station.node).obstacles = Some(obstacles);
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
            // An order chooses its mode by itself.
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
