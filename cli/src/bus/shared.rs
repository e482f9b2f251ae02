//! Buses that the commands of a sequence share: each is opened once and stays open.

use std::sync::{Arc, Mutex, PoisonError};

use lexican_runtime::host::{BusUrl, Incoming, Link, LinkError};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};
use lexican_toolbox::data_sheet::DataSheet;

use super::kind::{Bus, Simulation};
use crate::output::Failure;

/// The open buses; `None` unless a sequence runs.
static OPEN: Mutex<Option<Vec<Open>>> = Mutex::new(None);

struct Open {
    url: BusUrl,
    link: Shared,
    nodes: Vec<(NodeId, DataSheet)>,
    simulation: Option<Simulation>,
}

/// Shares all buses opened from now on.
pub(crate) fn share() {
    *OPEN.lock().unwrap_or_else(PoisonError::into_inner) = Some(Vec::new());
}

/// Makes a bus the one of this URL, for all further commands.
pub(crate) fn lend(url: &BusUrl, bus: Bus) -> Result<(), Failure> {
    share();
    open(url, || Ok(bus)).map(drop)
}

/// Opens a bus, or returns it if it is open already.
pub(super) fn open(url: &BusUrl, open: impl FnOnce() -> Result<Bus, Failure>) -> Result<Bus, Failure> {
    let mut all = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(all) = all.as_mut() else { return open() };
    let at = match all.iter().position(|bus| bus.url == *url) {
        Some(at) => at,
        None => {
            let Bus { link, nodes, simulation } = open()?;
            let link = Shared(Arc::new(Mutex::new(link)));
            all.push(Open { url: url.clone(), link, nodes, simulation });
            all.len() - 1
        }
    };
    let Open { link, nodes, simulation, .. } = &all[at];
    let mut link = link.clone();
    // As after opening: without a filter, and without old frames.
    link.listen_to(&[])?;
    while link.receive(link.now())?.is_some() {}
    Ok(Bus { link: Box::new(link), nodes: nodes.clone(), simulation: simulation.clone() })
}

/// A link that one command uses after another.
#[derive(Clone)]
struct Shared(Arc<Mutex<Box<dyn Link + Send>>>);

impl Shared {
    /// Ignores the poison of a command that panicked; the link is still usable.
    fn with<T>(&self, action: impl FnOnce(&mut Box<dyn Link + Send>) -> T) -> T {
        action(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Link for Shared {
    fn now(&self) -> Instant {
        self.with(|link| link.now())
    }
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.with(|link| link.send(frame))
    }
    fn try_send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.with(|link| link.try_send(frame))
    }
    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        self.with(|link| link.receive(until))
    }
    fn is_real_time(&self) -> bool {
        self.with(|link| link.is_real_time())
    }
    fn latency(&self) -> Duration {
        self.with(|link| link.latency())
    }
    fn listen_to(&mut self, ids: &[CobId]) -> Result<(), LinkError> {
        self.with(|link| link.listen_to(ids))
    }
}
