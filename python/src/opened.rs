//! An open network, and how it is closed: no drive is left moving without a word.

use std::path::Path;
use std::sync::{Arc, Mutex, Weak};

use lexican_machine::{BoxedLink, Heard, Machine as File, MachineError, blocking, tokio as shell};
use lexican_runtime::Duration;
use lexican_runtime::host::tokio::{Network, Runner};
use lexican_runtime::host::url::Scheme;
use lexican_runtime::host::{BusUrl, Pace, schemes};
use lexican_simulation::plant::{SCHEME, is_machine};
use pyo3::prelude::*;

use crate::callbacks::{Callback, LEFT};
use crate::drive::Slot;
use crate::error::{Closed, LinkFailed, Raise, wrong};
use crate::simulation::Simulation;
use crate::wait::{Run, Unlocked, lock};

/// The scheme of simulated devices, as in the command.
pub(crate) const SIM: Scheme = Scheme { what: "a simulated device", ..SCHEME };

/// The name of a machine without a file in errors.
const NAMELESS: &str = "this network";

/// How long simulated devices boot.
const BOOTING: Duration = Duration::from_millis(100);

/// All open networks, to be closed at the end of the interpreter.
static OPEN: Mutex<Vec<Weak<Shared>>> = Mutex::new(Vec::new());

/// What all objects of a network share.
pub(crate) struct Shared {
    opened: Mutex<Option<Opened>>,
    /// The drives that the program may hold.
    pub(crate) drives: Mutex<Vec<Weak<Slot>>>,
    pub(crate) callbacks: Mutex<Vec<Callback>>,
}

/// An open network.
pub(crate) struct Opened {
    /// The network of the first bus.
    pub(crate) network: Network,
    pub(crate) runner: Run,
    /// `None` until a node is named.
    pub(crate) machine: Option<shell::Machine>,
    simulations: Vec<Simulation>,
    /// The PDOs received on each bus.
    pub(crate) heard: Vec<Heard>,
    /// Its nodes in the words of a machine's file, if it has no file.
    words: Option<String>,
}

impl Opened {
    /// Names a node; only without a file.
    pub(crate) fn name(&mut self, node: &str, id: u8, sheet: &str, overlays: &[String]) -> PyResult<()> {
        let words = self.words.as_mut().ok_or_else(|| wrong("the machine's file names its nodes"))?;
        let all = words.clone() + &File::node_words(node, id, sheet, overlays);
        let file = File::of_words(NAMELESS, &all).map_err(Raise::raise)?;
        self.machine = Some(shell::Machine::beside(self.network.clone(), file).map_err(Raise::raise)?);
        *words = all;
        Ok(())
    }

    /// The simulation with this device.
    pub(crate) fn simulation(&self, node: &str) -> PyResult<&Simulation> {
        let simulation = self.simulations.iter().find(|simulation| simulation.has(node));
        simulation.ok_or_else(|| wrong(format_args!("there is no simulated device {node:?}")))
    }
}

/// Parses the URL of a bus, which may be simulated.
pub(crate) fn bus_url(url: &str) -> PyResult<BusUrl> {
    let known: Vec<_> = schemes::SCHEMES.iter().copied().chain([&SIM]).collect();
    BusUrl::among(&known, url).map_err(|error| LinkFailed::new_err(error.to_string()))
}

impl Shared {
    /// Opens the bus of a URL.
    pub(crate) fn of_url(url: &str, pace: Pace) -> PyResult<Arc<Self>> {
        Shared::link_of(&bus_url(url)?, pace)?.map_or_else(Ok, Shared::of_link)
    }

    /// Opens a link without a network; if it is simulated, also returns the simulation.
    pub(crate) fn lone_link(url: &BusUrl, pace: Pace) -> PyResult<(BoxedLink, Option<Arc<Self>>)> {
        Ok(match Shared::link_of(url, pace)? {
            Ok(link) => (link, None),
            Err(simulation) => (simulation.another_link()?, Some(simulation)),
        })
    }

    /// Opens the link of a URL, or the simulation.
    fn link_of(url: &BusUrl, pace: Pace) -> PyResult<Result<BoxedLink, Arc<Self>>> {
        let failed = |error: String| LinkFailed::new_err(error);
        if url.scheme().name != SIM.name {
            return url.open().map(Ok).map_err(|error| failed(format!("cannot open {url}: {error}")));
        }
        let node = url.get("node").map_or(Ok(1), str::parse).map_err(|error| failed(format!("{url}: {error}")))?;
        Shared::simulated(url.place(), node, url.pace().unwrap_or(pace)).map(Err)
    }

    /// A network over a link.
    pub(crate) fn of_link(link: BoxedLink) -> PyResult<Arc<Self>> {
        let (link, heard) = Heard::over(link);
        let (runner, network) = Runner::spawn(link).map_err(MachineError::from).map_err(Raise::raise)?;
        let runner = Arc::new(Unlocked::new(runner));
        let (machine, simulations, heard, words) = (None, Vec::new(), vec![heard], Some(String::new()));
        Ok(Shared::new(Opened { network, runner, machine, simulations, heard, words }))
    }

    /// Opens the machine of a file on its buses.
    pub(crate) fn of_machine(path: &Path) -> PyResult<Arc<Self>> {
        let file = File::of_path(path).map_err(Raise::raise)?;
        Shared::over(file.links().map_err(Raise::raise)?, file, Vec::new(), None)
    }

    /// Simulates the devices in a machine's file, or one device.
    pub(crate) fn simulated(name: &str, node: u8, pace: Pace) -> PyResult<Arc<Self>> {
        let (file, words) = if is_machine(name) {
            (File::of_path(Path::new(name)).map_err(Raise::raise)?, None)
        } else {
            let words = File::node_words(&format!("node{node}"), node, name, &[]);
            (File::of_words(NAMELESS, &words).map_err(Raise::raise)?, Some(words))
        };
        let (links, simulations) = Simulation::of(&file, pace)?;
        Shared::over(links, file, simulations, words)
    }

    fn over(
        links: Vec<BoxedLink>,
        file: File,
        simulations: Vec<Simulation>,
        words: Option<String>,
    ) -> PyResult<Arc<Self>> {
        let (links, heard) = links.into_iter().map(Heard::over).unzip();
        let machine = blocking::Machine::over(links, file).map_err(Raise::raise)?;
        if !simulations.is_empty() {
            machine.pass(BOOTING).map_err(Raise::raise)?;
        }
        let (machine, runner) = machine.inner();
        let runner = Arc::new(Unlocked::new(runner.clone()));
        let (network, machine) = (machine.network().clone(), Some(machine.clone()));
        Ok(Shared::new(Opened { network, runner, machine, simulations, heard, words }))
    }

    fn new(opened: Opened) -> Arc<Self> {
        let (opened, drives, callbacks) = (Mutex::new(Some(opened)), Mutex::default(), Mutex::default());
        let shared = Arc::new(Shared { opened, drives, callbacks });
        note(&OPEN, &shared);
        shared
    }

    /// Lends the open network; an error if it is closed.
    pub(crate) fn with<T>(&self, use_it: impl FnOnce(&mut Opened) -> PyResult<T>) -> PyResult<T> {
        let mut opened = lock(&self.opened);
        use_it(opened.as_mut().ok_or_else(|| Closed::new_err("the network was closed"))?)
    }

    /// The network of the first bus, and its runner.
    pub(crate) fn network(&self) -> PyResult<(Network, Run)> {
        self.with(|opened| Ok((opened.network.clone(), Arc::clone(&opened.runner))))
    }

    /// The machine, and its runner.
    pub(crate) fn machine(&self) -> PyResult<(shell::Machine, Run)> {
        self.with(|opened| {
            let machine = opened.machine.clone().ok_or_else(|| wrong("no node has a name: add_node(5, \"x.eds\")"))?;
            Ok((machine, Arc::clone(&opened.runner)))
        })
    }

    /// Another link to a simulated bus.
    pub(crate) fn another_link(&self) -> PyResult<BoxedLink> {
        let link = self.with(|opened| Ok(opened.simulations.first().map(|simulation| simulation.bus.link())))?;
        Ok(Box::new(link.ok_or_else(|| wrong("only a simulated bus has room for another link"))?))
    }

    /// Gives a simulated device a command, and returns its answer.
    pub(crate) fn carry_out(&self, node: &str, line: &str) -> PyResult<String> {
        self.with(|opened| opened.simulation(node)?.carry_out(node, line))
    }

    /// Stops all drives that may be moving, waits for their standstill, and closes the network. Returns the first error
    /// of a drive or callback.
    pub(crate) fn close(&self, py: Python<'_>) -> PyResult<()> {
        let drives = std::mem::take(&mut *lock(&self.drives));
        py.detach(|| {
            let ended: Vec<_> = drives.iter().filter_map(Weak::upgrade).map(|drive| drive.end()).collect();
            let callbacks = std::mem::take(&mut *lock(&self.callbacks));
            let called: Vec<_> = callbacks.into_iter().map(Callback::end).collect();
            // Release this lock first: a call that wants it may hold the interpreter's, which the thread waits for.
            let opened = lock(&self.opened).take();
            drop(opened);
            ended.into_iter().chain(called).collect()
        })
    }
}

/// Adds a weak reference to a list, and removes those whose objects are gone.
pub(crate) fn note<T>(all: &Mutex<Vec<Weak<T>>>, it: &Arc<T>) {
    let mut all = lock(all);
    all.retain(|other| other.strong_count() > 0);
    all.push(Arc::downgrade(it));
}

/// In a forked process, forgets all networks: they belong to the parent, and their threads do not exist here.
#[pyfunction]
pub(crate) fn forget_all() {
    for shared in OPEN.try_lock().iter().flat_map(|open| open.iter()).filter_map(Weak::upgrade) {
        for slot in lock(&shared.drives).drain(..).filter_map(|slot| slot.upgrade()) {
            std::mem::forget(slot.drive.try_lock().map(|mut drive| drive.take()));
            std::mem::forget(slot);
        }
        std::mem::forget((lock(&shared.opened).take(), std::mem::take(&mut *lock(&shared.callbacks))));
    }
    std::mem::forget(LEFT.try_lock().map(|mut left| std::mem::take(&mut *left)));
}

/// Closes all open networks at the end of the interpreter.
#[pyfunction]
pub(crate) fn close_all(py: Python<'_>) -> PyResult<()> {
    let open = std::mem::take(&mut *lock(&OPEN));
    let closed: Vec<_> = open.iter().filter_map(Weak::upgrade).map(|shared| shared.close(py)).collect();
    let left = std::mem::take(&mut *lock(&LEFT));
    py.detach(|| left.into_iter().for_each(|thread| drop(thread.join())));
    closed.into_iter().collect()
}
