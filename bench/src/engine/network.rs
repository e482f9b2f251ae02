//! What is about the whole bus: network management, looking for nodes, LSS.

use std::sync::{Arc, Mutex};

use lexican_runtime::cia301::{self, connection};
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{AccessError, Link, LinkError, Pump};
use lexican_runtime::object::Address;
use lexican_runtime::service::lss_manager::{Busy, Event, LssManager};
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::wire::lss::{LssRequest, LssState};
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_runtime::wire::sdo::ClientRequest;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

use super::hub::{Port, Ports};
use super::jobs::Job;
use super::lock::lock;
use super::worker::Worker;
use crate::model::Model;
use crate::request::{Answer, Nmt, Refused};

/// Between two requests, so that other nodes get through.
const PAUSE: Duration = Duration::from_millis(5);

/// How long a device may take to answer.
const ANSWER: Duration = Duration::from_millis(500);

/// How long a device may take for a step of a fastscan.
const STEP: Duration = Duration::from_millis(50);

/// How long a device may take to store its configuration.
const STORING: Duration = Duration::from_secs(3);

/// Sends a command to a node, or to all.
pub(super) fn command(ports: &Ports, node: Option<NodeId>, command: Nmt) -> Result<Answer, Refused> {
    let command = match command {
        Nmt::Start => NmtCommand::Start,
        Nmt::Stop => NmtCommand::Stop,
        Nmt::PreOperational => NmtCommand::EnterPreOperational,
        Nmt::ResetNode => NmtCommand::ResetNode,
        Nmt::ResetCommunication => NmtCommand::ResetCommunication,
    };
    Network::new(ports.link()).command(command, node).map_err(Refused::new)?;
    Ok(Answer::Done)
}

/// Asks every node-ID for its device type. The model hears who answers.
pub(super) fn scan(ports: &Ports, mut link: Port, model: &Arc<Mutex<Model>>, job: &Job) -> Result<Answer, Refused> {
    let mut pump = Pump::new();
    let lost = |error| lost(ports, error);
    let request = ClientRequest::InitiateUpload { address: Address::new(cia301::DEVICE_TYPE, 0) }.to_bytes();
    let known: Vec<_> = lock(model).nodes().collect();
    for (node, place) in NodeId::all().zip(1..).filter(|(node, _)| !known.contains(node)) {
        job.progress(f64::from(place) / 127.0, format!("asks node {node}"));
        link.send(&Frame::from_array(CobId::of_node(connection::SDO_REQUEST, node), request)).map_err(lost)?;
        listen(&mut link, &mut pump, PAUSE).map_err(lost)?;
    }
    let latency = link.latency();
    listen(&mut link, &mut pump, ANSWER + latency).map_err(lost)?;
    let nodes = lock(model).nodes().count();
    job.end(true, format!("{nodes} nodes, {} of them new", nodes - known.len()));
    Ok(Answer::Done)
}

fn listen(link: &mut impl Link, pump: &mut Pump, span: Duration) -> Result<(), LinkError> {
    let until = link.now() + span;
    while pump.receive_frame(link, until)?.is_some() {}
    Ok(())
}

/// Why a link is gone: the bus is, or the client that it was for.
fn lost(ports: &Ports, error: LinkError) -> Refused {
    match error {
        LinkError::Closed if !ports.is_over() => Refused::interrupted(),
        error => Refused::new(error),
    }
}

/// Gives a device without node-ID that of the worker, which no node may have, and lets it be stored (CiA 305).
pub(super) fn assign(worker: &Worker, job: &Job) -> Result<Answer, Refused> {
    let (node, ports) = (worker.node, &worker.ports);
    match worker.network()?.read_bytes(node, Address::new(cia301::DEVICE_TYPE, 0)) {
        Err(AccessError::Sdo { error: SdoError::TimedOut { .. }, .. }) => {}
        Err(AccessError::Link(error)) => return Err(lost(ports, error)),
        _ => {
            return Err(Refused::new(format_args!("a node has the node-ID {node}"))
                .with_remedy("choose another one, or take that node off the bus first"));
        }
    }
    let result = configure(ports, &mut worker.link()?, node, job);
    // However it has ended, no device waits for the rest: the next one would be configured with it.
    let waiting = deselect(&mut ports.link());
    let who = result?;
    waiting.map_err(|error| lost(ports, error))?;
    job.end(true, format!("{who} is node {node}"));
    Ok(Answer::Done)
}

/// No device waits for a configuration any more. None answers that.
fn deselect(link: &mut Port) -> Result<(), LinkError> {
    link.send(&LssRequest::SwitchGlobal(LssState::Waiting).frame())
}

/// Runs an operation of the LSS manager that ends with an event.
fn operate(
    link: &mut Port,
    patience: Duration,
    begin: impl FnOnce(&mut LssManager) -> Result<(), Busy>,
) -> Result<Event, LinkError> {
    let mut manager = LssManager::new().with_timeouts(patience, STEP);
    begin(&mut manager).expect("a new manager is idle");
    Pump::new().run(link, &mut manager, Instant::MAX)?.ok_or(LinkError::Closed)
}

/// Finds the device, and gives it the node-ID; returns its identity in words.
fn configure(ports: &Ports, link: &mut Port, node: NodeId, job: &Job) -> Result<String, Refused> {
    job.progress(0.1, "looks for a device by fastscan".to_owned());
    deselect(link).map_err(|error| lost(ports, error))?;
    let mut operate = |patience, begin: &dyn Fn(&mut LssManager) -> Result<(), Busy>| {
        operate(link, patience, begin).map_err(|error| lost(ports, error))
    };
    let identity = match operate(ANSWER, &LssManager::fastscan)? {
        Event::Found(identity) => identity,
        _ => {
            return Err(Refused::new("no device without node-ID answers")
                .with_remedy("has it lost its node-ID, and has it power? A device without LSS has switches for it"));
        }
    };
    let who = format!("vendor {:X}h, product {:X}h, serial {:X}h", identity.vendor, identity.product, identity.serial);
    job.progress(0.7, format!("{who} gets node-ID {node}"));
    let done = match operate(ANSWER, &|manager| manager.configure_node(Some(node)))? {
        Event::Done => operate(STORING, &LssManager::store)?,
        other => other,
    };
    match done {
        Event::Done => Ok(who),
        other => Err(Refused::new(format_args!("{who} does not take the node-ID, or does not store it: {other:?}"))),
    }
}
