//! A machine for blocking programs. It runs the one of [`tokio`](super::tokio) inside, so that all drives share one
//! adapter.

use std::fmt;
use std::ops::{Deref, DerefMut};
use std::path::Path;

use lexican_driver::shared::{self, StopHandle};
use lexican_driver::{Any, Error};
use lexican_runtime::host::tokio::{Network, Runner};
use lexican_runtime::object::{Object, Readable, Value, Writable};
use lexican_runtime::{Duration, NodeId};
use lexican_toolbox::drive::{Ending, Order};
use lexican_toolbox::values::report::ValueReport;

use super::{BoxedLink, Event, MachineError, tokio};
use crate::model;

/// A machine on its buses. Clones refer to the same machine and may be used in other threads; it ends when all clones,
/// and all nodes and drives from it, are dropped.
#[derive(Clone)]
pub struct Machine {
    machine: tokio::Machine,
    runner: Runner,
    stop: StopHandle,
}

impl Machine {
    /// See [`tokio::Machine::open`].
    pub fn open(path: impl AsRef<Path>) -> Result<Self, MachineError> {
        let file = model::Machine::of_path(path.as_ref())?;
        Machine::over(file.links()?, file)
    }

    /// See [`tokio::Machine::over`].
    pub fn over(links: Vec<BoxedLink>, file: model::Machine) -> Result<Self, MachineError> {
        let mut runner: Option<Runner> = None;
        let machine = tokio::Machine::on(links, file, |link| {
            if let Some(runner) = &runner {
                return runner.block_on(async { Network::spawn(link) });
            }
            let (first, network) = Runner::spawn(link)?;
            runner = Some(first);
            Ok(network)
        })?;
        Ok(Machine { machine, runner: runner.expect("there is a bus"), stop: StopHandle::default() })
    }

    /// The machine as read from its file.
    #[must_use]
    pub fn file(&self) -> &model::Machine {
        self.machine.file()
    }

    /// The same machine for asynchronous code, and its runner.
    #[must_use]
    pub fn inner(&self) -> (&tokio::Machine, &Runner) {
        (&self.machine, &self.runner)
    }

    /// A handle that stops all drives from another thread: for `ctrlc::set_handler`, for example.
    #[must_use]
    pub fn stop_handle(&self) -> StopHandle {
        self.stop.clone()
    }

    /// See [`tokio::Machine::boot`].
    pub fn boot(&self) -> Result<(), MachineError> {
        self.runner.block_on(self.machine.boot())
    }

    /// See [`tokio::Machine::events`].
    #[must_use]
    pub fn events(&self) -> Events {
        Events { events: self.machine.events(), machine: self.clone() }
    }

    /// See [`tokio::Machine::node`].
    pub fn node(&self, name: &str) -> Result<Node, MachineError> {
        Ok(Node { node: self.machine.node(name)?, runner: self.runner.clone() })
    }

    /// See [`tokio::Machine::drive`].
    pub fn drive(&self, name: &str) -> Result<Drive, MachineError> {
        let drive = self.runner.block_on(self.machine.drive(name))?;
        Ok(Drive(shared::Drive::new(drive, self.runner.clone(), self.stop.clone())))
    }

    /// See [`tokio::move_together`]. The [stop handle](Machine::stop_handle) stops these drives, too.
    pub fn move_together(&self, orders: &mut [(&mut Drive, &str)]) -> Result<(), MachineError> {
        let mut inner: Vec<_> = orders.iter_mut().map(|(drive, position)| (drive.0.inner(), *position)).collect();
        self.runner.block_on(async {
            match self.stop.unless_stopped(tokio::move_together(&mut inner)).await {
                Some(ended) => ended,
                None => {
                    let node = inner.first().map_or(NodeId::literal(127), |(drive, _)| drive.node().id());
                    tokio::stop_all(inner.iter_mut().map(|(drive, _)| &mut **drive)).await?;
                    Err(Error::Cancelled { node, stopped: true }.into())
                }
            }
        })
    }

    /// Lets time pass, during which nodes are watched and booted.
    pub fn pass(&self, span: Duration) -> Result<(), MachineError> {
        let network = self.machine.network();
        self.runner.block_on(async { Ok(network.sleep_until(network.now().await? + span).await.map(|_| ())?) })
    }
}

impl fmt::Debug for Machine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.machine.fmt(f)
    }
}

/// The events of a machine's nodes, from [`Machine::events`].
pub struct Events {
    events: tokio::Events,
    machine: Machine,
}

impl Events {
    /// Waits for the next event, at most `within` by the time of the bus; `None` if there was none.
    pub fn next(&mut self, within: Duration) -> Result<Option<Event>, MachineError> {
        let network = self.machine.machine.network();
        self.machine.runner.block_on(async {
            let until = network.now().await? + within;
            ::tokio::select! {
                biased;
                event = self.events.next() => Ok(event),
                over = network.sleep_until(until) => Ok(over.map(|_| None)?),
            }
        })
    }
}

/// A node of a machine, from [`Machine::node`].
#[derive(Clone, Debug)]
pub struct Node {
    node: tokio::Node,
    runner: Runner,
}

impl Node {
    /// Its node-ID.
    #[must_use]
    pub fn id(&self) -> NodeId {
        self.node.id()
    }

    /// See [`tokio::Node::read`].
    pub fn read<T: Value, A: Readable, M, D>(&self, object: Object<T, A, M, D>) -> Result<T, MachineError> {
        self.runner.block_on(self.node.read(object))
    }

    /// See [`tokio::Node::write`].
    pub fn write<T: Value, A: Writable, M, D>(&self, object: Object<T, A, M, D>, value: T) -> Result<(), MachineError> {
        self.runner.block_on(self.node.write(object, value))
    }

    /// See [`tokio::Node::get`].
    pub fn get(&self, object: &str) -> Result<ValueReport, MachineError> {
        self.runner.block_on(self.node.get(object))
    }

    /// See [`tokio::Node::set`].
    pub fn set(&self, object: &str, value: &str) -> Result<(), MachineError> {
        self.runner.block_on(self.node.set(object, value))
    }
}

/// A drive of a machine. It dereferences to [the driver's](shared::Drive), whose methods take positions in counts of
/// the drive; the methods here take them with units.
///
/// Dropping a drive that may be moving sends it a stop, and reports that on standard error.
#[derive(Debug)]
pub struct Drive(shared::Drive<Any, tokio::Drive>);

impl Drive {
    /// See [`tokio::Drive::counts`].
    pub fn counts(&mut self, position: &str) -> Result<i32, MachineError> {
        self.0.call(async |drive| drive.counts(position).await)
    }

    /// See [`tokio::Drive::move_to`].
    pub fn move_to(&mut self, position: &str) -> Result<Ending, MachineError> {
        self.0.call(async |drive| drive.move_to(position).await)
    }

    /// See [`tokio::Drive::start_moving_to`]; [`finish`](shared::Drive::finish) waits for the end.
    pub fn start_moving_to(&mut self, position: &str) -> Result<(), MachineError> {
        self.0.call(async |drive| drive.start_moving_to(position).await)
    }

    /// See [`tokio::Drive::run_at`].
    pub fn run_at(&mut self, velocity: &str, lasting: Duration) -> Result<Ending, MachineError> {
        self.0.call(async |drive| drive.run_at(velocity, lasting).await)
    }

    /// See [`tokio::Drive::carry_out`].
    pub fn carry_out(&mut self, order: Order, lasting: Option<Duration>) -> Result<Ending, MachineError> {
        self.0.call(async |drive| drive.carry_out(order, lasting).await)
    }
}

impl Deref for Drive {
    type Target = shared::Drive<Any, tokio::Drive>;

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl DerefMut for Drive {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.0
    }
}
