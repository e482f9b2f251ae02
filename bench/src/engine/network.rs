//! Requests about the whole bus: NMT commands, scanning for nodes, LSS.

use std::sync::{Arc, Mutex};

use lexican_runtime::cia301;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{AccessError, Link, LinkError, Pump};
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::wire::lss::{LssRequest, LssState};
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_runtime::wire::sdo::ClientRequest;
use lexican_runtime::{Duration, NodeId};
use lexican_toolbox::bus::sdo_channel::request_frame;
use lexican_toolbox::decode::lss::response_text;
use lexican_toolbox::lss::{Selected, Session, Target, Times, Trouble};

use super::hub::{Port, Ports};
use super::jobs::Job;
use super::lock::lock;
use super::worker::Worker;
use crate::model::Model;
use crate::request::{Answer, Nmt, Refused};

/// The pause between two requests, for other nodes' frames.
const PAUSE: Duration = Duration::from_millis(5);

/// How long a device may take to respond.
const ANSWER: Duration = Duration::from_millis(500);

/// How long a device may take for one step of a fastscan.
const STEP: Duration = Duration::from_millis(50);

/// Sends an NMT command to a node or to all.
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

/// Reads 1000h of every node-ID. The model notices which nodes respond.
pub(super) fn scan(ports: &Ports, mut link: Port, model: &Arc<Mutex<Model>>, job: &Job) -> Result<Answer, Refused> {
    let mut pump = Pump::new();
    let lost = |error| lost(ports, error);
    let request = ClientRequest::InitiateUpload { address: Address::new(cia301::DEVICE_TYPE, 0) };
    let known: Vec<_> = lock(model).nodes().collect();
    for (node, place) in NodeId::all().zip(1..).filter(|(node, _)| !known.contains(node)) {
        job.progress(f64::from(place) / 127.0, format!("asks node {node}"));
        link.send(&request_frame(node, request)).map_err(lost)?;
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

/// The refusal because the link is gone: either the bus is, or the client.
fn lost(ports: &Ports, error: LinkError) -> Refused {
    match error {
        LinkError::Closed if !ports.is_over() => Refused::interrupted(),
        error => Refused::new(error),
    }
}

/// Gives the node-ID of the worker, which no node may have yet, to a device without node-ID, and has it stored (CiA
/// 305).
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
    let times = Times { response: ANSWER, step: STEP };
    let who =
        Session::run(worker.link()?, times, |session| configure(session, node, job)).map_err(|error| match error {
            Ended::Refused(refused) => refused,
            Ended::Trouble(Trouble::Link(error)) => lost(ports, error),
            Ended::Trouble(error @ Trouble::NoUnconfigured) => Refused::new(error)
                .with_remedy("has it lost its node-ID, and has it power? A device without LSS has switches for it"),
            Ended::Trouble(error) => Refused::new(error),
        });
    // Even if the client's link is gone: otherwise, the next configuration would reach this device, too.
    if who.is_err() {
        let _ = ports.link().send(&LssRequest::SwitchGlobal(LssState::Waiting).frame());
    }
    let who = who?;
    job.end(true, format!("{who} is node {node}"));
    Ok(Answer::Done)
}

/// Why a device was not configured.
enum Ended {
    Refused(Refused),
    Trouble(Trouble),
}

impl From<Trouble> for Ended {
    fn from(trouble: Trouble) -> Self {
        Ended::Trouble(trouble)
    }
}

/// Finds the device and gives it the node-ID; returns its identity as text.
fn configure(session: &mut Session<Port>, node: NodeId, job: &Job) -> Result<String, Ended> {
    job.progress(0.1, "looks for a device by fastscan".to_owned());
    let Selected { identity, .. } = session.select(Target::Unconfigured)?;
    let who = format!("vendor {:X}h, product {:X}h, serial {:X}h", identity.vendor, identity.product, identity.serial);
    job.progress(0.7, format!("{who} gets node-ID {node}"));
    let mut done = session.configure_node(Some(node))?;
    if done.is_ok() {
        done = session.store()?;
    }
    done.map(|()| who.clone()).map_err(|refusal| {
        let why = response_text(refusal);
        Ended::Refused(Refused::new(format_args!("{who} does not take the node-ID, or does not store it: {why}")))
    })
}
