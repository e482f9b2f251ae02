//! The bench over a bus: its nodes and clients.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex};

use lexican_driver::Description;
use lexican_runtime::host::{AccessError, Link};
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::{Duration, Frame, Instant, NodeId, cia301};
use lexican_toolbox::node::stored;
use lexican_toolbox::trace::sampler::Signal;

use super::hub::{self, Port, Ports};
use super::lock::lock;
use super::recording::{self, Recording};
use super::reply::Gathered;
use super::wanted::Wanted;
use super::worker::{NOBODY, Worker};
use super::{order, pdo};
use crate::model::{Braking, BusInfo, DEVICE_NAME, DRIVE, Model, watched};
use crate::request::{Answer, Refused, Request};
use crate::sheet::Sheet;
use crate::view::{self, View};

/// The interval of looking for new nodes and asking simulated devices.
const LOOK: Duration = Duration::from_millis(100);

/// The interval of checking what prevents a drive from moving, while a client has control.
const OBSTACLES: Duration = Duration::from_secs(2);

/// How long the end of the bench waits for drives: as long as an attempt to stop one may take.
const ENDING: Duration = Duration::from_secs(7);

/// Control of simulated devices.
pub trait Simulation: Send {
    /// The devices, with the inputs of each.
    fn devices(&self) -> Vec<view::Simulated>;

    /// Sets an input of a device: `blocked = true`.
    fn input(&mut self, node: NodeId, text: &str) -> Result<(), String>;

    /// Switches a device on or off.
    fn set_power(&mut self, node: NodeId, is_on: bool) -> Result<(), String>;
}

/// Translates between requests and lines of the command, and runs these.
pub trait Player: Send + Sync {
    /// The line that does the same as a request, if there is one.
    fn line(&self, request: &Request) -> Option<String>;

    /// Reads a sequence, to be run over this link, without running any line. If `text` is `None`, it is one of the
    /// machine's.
    fn read(&self, name: &str, text: Option<String>, link: Box<dyn Link + Send>) -> Result<Vec<Line>, Refused>;
}

/// A line of a sequence, ready to run.
pub struct Line {
    /// `3: drive feeder move-to 50 mm`.
    pub text: String,
    /// The nodes that it talks to; `None` for all.
    pub nodes: Option<Vec<NodeId>>,
    /// Runs it; returns its output and its result.
    pub run: Box<dyn FnOnce() -> (String, Result<(), Refused>) + Send>,
}

/// The initial state of a bench.
pub struct Setup {
    /// The bus.
    pub bus: BusInfo,
    /// Nodes that are known from the beginning, with name and data sheet.
    pub nodes: Vec<(NodeId, Option<String>, Option<Sheet>)>,
    /// Control of the devices, if they are simulated.
    pub simulation: Option<Box<dyn Simulation>>,
    /// What the file of the machine keeps for the bench.
    pub kept: view::Kept,
    /// Plays sequences, if that is possible.
    pub player: Option<Box<dyn Player>>,
}

impl Setup {
    /// A bus without known nodes.
    #[must_use]
    pub fn new(bus: BusInfo) -> Self {
        Setup { bus, nodes: Vec::new(), simulation: None, kept: view::Kept::default(), player: None }
    }

    fn model(&mut self, now: Instant) -> Arc<Mutex<Model>> {
        let mut model = Model::new(now, self.bus.clone());
        model.kept = std::mem::take(&mut self.kept);
        for (node, name, sheet) in self.nodes.drain(..) {
            if let Some(sheet) = sheet {
                model.introduce(node, sheet);
            }
            if let Some(name) = name {
                model.name(node, name);
            }
        }
        Arc::new(Mutex::new(model))
    }
}

/// A bench. Clones refer to the same bench.
#[derive(Clone)]
pub struct Bench(pub(super) Arc<Shared>);

pub(super) struct Shared {
    pub(super) model: Arc<Mutex<Model>>,
    pub(super) ports: Ports,
    pub(super) workers: Mutex<BTreeMap<NodeId, Arc<Worker>>>,
    pub(super) clients: Mutex<Clients>,
    pub(super) simulation: Mutex<Option<Box<dyn Simulation>>>,
    pub(super) recording: Option<Arc<Recording>>,
    /// What clients want to be read repeatedly.
    pub(super) wanted: Mutex<Wanted>,
    /// The links of clients' requests that are not about a single node.
    pub(super) links: Mutex<BTreeMap<u32, Vec<u64>>>,
    pub(super) player: Option<Box<dyn Player>>,
    /// While recording: the lines so far, and when the last one ended.
    pub(super) recorded: Mutex<Option<(String, Option<Instant>)>>,
    /// The link of the sequence that is being played.
    pub(super) playing: Mutex<Option<u64>>,
}

#[derive(Default)]
pub(super) struct Clients {
    pub(super) last: u32,
    pub(super) open: BTreeSet<u32>,
    pub(super) holder: Option<u32>,
}

impl Clients {
    /// Refuses requests of a closed client: nothing would end them.
    fn check_open(&self, client: u32) -> Result<(), Refused> {
        self.open.contains(&client).then_some(()).ok_or_else(Refused::interrupted)
    }
}

impl Bench {
    /// A bench on a link in real time.
    pub fn live(link: Box<dyn Link + Send>, mut setup: Setup) -> std::io::Result<Self> {
        let model = setup.model(link.now());
        let ports = hub::begin(link, Arc::clone(&model))?;
        let bench = Bench::new(model, ports, setup, None);
        let keeper = bench.clone();
        std::thread::Builder::new().name("nodes".to_owned()).spawn(move || keeper.keep())?;
        Ok(bench)
    }

    /// A bench on a recorded log, shown up to its end at first. Nothing can be sent.
    pub fn replay(frames: Vec<(Instant, Frame)>, mut setup: Setup) -> std::io::Result<Self> {
        setup.bus.is_writable = false;
        let now = frames.first().map_or(Instant::ZERO, |(at, _)| *at);
        let model = setup.model(now);
        let ports = hub::nowhere(now);
        let recording = recording::begin(frames, ports.clone(), Arc::clone(&model))?;
        Ok(Bench::new(model, ports, setup, Some(recording)))
    }

    fn new(model: Arc<Mutex<Model>>, ports: Ports, setup: Setup, recording: Option<Arc<Recording>>) -> Self {
        let (simulation, player) = (Mutex::new(setup.simulation), setup.player);
        let (workers, clients, wanted, links, recorded, playing) = Default::default();
        let of_clients =
            Shared { model, ports, workers, clients, simulation, recording, wanted, links, player, recorded, playing };
        Bench(Arc::new(of_clients))
    }

    /// A snapshot for clients.
    #[must_use]
    pub fn view(&self) -> View {
        let mut model = lock(&self.0.model);
        if self.0.recording.is_none() {
            // Time passes even after the bus is lost.
            model.pass(self.0.ports.now());
        }
        model.view()
    }

    /// Stops all drives and ends the bench. Waits for them, but no longer than it takes to notice that a drive is gone.
    /// Returns one sentence for each drive that has not confirmed its standstill.
    pub fn end(&self) -> Vec<String> {
        if !self.0.ports.is_over() {
            self.stop_all(|_| {});
            let until = self.0.ports.now() + ENDING;
            while !self.unconfirmed().is_empty() && self.0.ports.now() < until && !self.0.ports.is_over() {
                #[expect(clippy::disallowed_methods, reason = "the bench runs in real time")]
                std::thread::sleep(Duration::from_millis(5).into());
            }
        }
        let unconfirmed = self.unconfirmed();
        self.0.ports.end();
        unconfirmed
    }

    /// One sentence for each drive that was to stop and has not confirmed its standstill.
    #[must_use]
    pub fn unconfirmed(&self) -> Vec<String> {
        lock(&self.0.model).unconfirmed()
    }

    /// Looks after new nodes.
    fn keep(&self) {
        let mut drives = BTreeMap::new();
        while !self.0.ports.is_over() {
            let (nodes, is_writable) = {
                let mut model = lock(&self.0.model);
                if let Some(simulation) = &*lock(&self.0.simulation) {
                    model.devices = simulation.devices();
                }
                let nodes: Vec<_> = model.nodes().map(|node| (node, model.sheet(node))).collect();
                (nodes, model.is_writable())
            };
            for (node, sheet) in nodes.into_iter().filter(|_| is_writable) {
                let Ok(worker) = self.worker(node) else { continue };
                worker.hurry();
                if worker.is_idle() && lock(&self.0.model).is_stranger(self.0.ports.now(), node) {
                    get_to_know(&worker);
                }
                if worker.is_idle() && lock(&self.0.model).lacks_pdos(self.0.ports.now(), node) {
                    worker.ask(NOBODY, pdo::learn);
                }
                if let Some(description) = sheet.and_then(|sheet| sheet.drive) {
                    self.look_after(&mut drives, &worker, description);
                }
            }
            #[expect(clippy::disallowed_methods, reason = "the bench runs in real time")]
            std::thread::sleep(LOOK.into());
        }
    }

    /// Follows a drive, and checks what prevents it from moving.
    fn look_after(
        &self,
        drives: &mut BTreeMap<NodeId, lexican_runtime::Instant>,
        worker: &Arc<Worker>,
        description: &'static Description,
    ) {
        let now = self.0.ports.now();
        let is_new = !drives.contains_key(&worker.node);
        if is_new {
            for address in watched(description) {
                worker.poll(address, DRIVE);
            }
        }
        let has_control = lock(&self.0.clients).holder.is_some();
        if !has_control {
            // Values that were seen recently need not be read.
            let mut model = lock(&self.0.model);
            let drive = model.drive(worker.node);
            (drive.obstacles, drive.lacks) = (None, Vec::new());
            drop(model);
            drives.insert(worker.node, now);
        }
        let due = drives.entry(worker.node).or_insert(now);
        if has_control && *due <= now && worker.is_idle() {
            *due = now + OBSTACLES;
            worker.ask(NOBODY, move |worker| order::look(worker, description));
        }
    }

    pub(super) fn worker(&self, node: NodeId) -> Result<Arc<Worker>, Refused> {
        self.check_writable()?;
        let mut workers = lock(&self.0.workers);
        if let Some(worker) = workers.get(&node) {
            return Ok(Arc::clone(worker));
        }
        let worker =
            Worker::begin(node, self.0.ports.clone(), Arc::clone(&self.0.model), order::carry).map_err(Refused::new)?;
        workers.insert(node, Arc::clone(&worker));
        Ok(worker)
    }

    pub(super) fn drive(&self, node: NodeId) -> Result<Arc<Worker>, Refused> {
        order::description(&lock(&self.0.model), node)?;
        self.worker(node)
    }

    /// Refuses on a log, and on a bus that the bench only listens to; not if the bus was lost.
    pub(super) fn check_writable(&self) -> Result<(), Refused> {
        match (&self.0.recording, lock(&self.0.model).listens_only()) {
            (Some(_), _) => Err(Refused::new("a log takes no frames").with_remedy("open the bus itself")),
            (None, true) => Err(Refused::new("the bench only listens to this bus")),
            (None, false) => Ok(()),
        }
    }

    /// Reads an entry at intervals. If nothing can be sent, its value comes when others read it.
    pub(super) fn poll(&self, node: NodeId, address: Address, every_ms: u32) {
        if let Ok(worker) = self.worker(node) {
            worker.poll(address, millis(every_ms));
        }
    }

    pub(super) fn unpoll(&self, node: NodeId, address: Address, every_ms: u32) {
        if let Ok(worker) = self.worker(node) {
            worker.unpoll(address, millis(every_ms));
        }
    }

    /// Watches an entry for a client.
    pub(super) fn watch(&self, client: u32, node: NodeId, address: Address, every_ms: u32) -> Result<(), Refused> {
        let before = {
            let clients = lock(&self.0.clients);
            clients.check_open(client)?;
            lock(&self.0.wanted).watch(client, (node, address))?;
            lock(&self.0.model).watch(node, address, every_ms)
        };
        self.poll(node, address, every_ms);
        if let Some(before) = before {
            self.unpoll(node, address, before);
        }
        Ok(())
    }

    /// Ends watching an entry, for all clients.
    pub(super) fn unwatch(&self, node: NodeId, address: Address) {
        lock(&self.0.wanted).watches.remove(&(node, address));
        let before = lock(&self.0.model).unwatch(node, address);
        if let Some(every_ms) = before {
            self.unpoll(node, address, every_ms);
        }
    }

    /// Plots signals for a client.
    pub(super) fn plot(&self, client: u32, node: NodeId, signals: &[Signal], every_ms: u32) -> Result<(), Refused> {
        let new = {
            let clients = lock(&self.0.clients);
            clients.check_open(client)?;
            let curves: Vec<_> = signals.iter().map(|signal| (node, *signal)).collect();
            lock(&self.0.wanted).draw(client, &curves)?;
            lock(&self.0.model).plot(node, signals.iter().copied(), every_ms)
        };
        for signal in new {
            if let Signal::Object(address) = signal {
                self.poll(node, address, every_ms);
            }
        }
        Ok(())
    }

    /// Removes the curves of a node, or all, for all clients.
    pub(super) fn clear_plot(&self, node: Option<NodeId>) {
        lock(&self.0.wanted).curves.retain(|(known, _), _| node.is_some_and(|node| node != *known));
        let cleared = lock(&self.0.model).clear_plot(node);
        for (node, address, every_ms) in cleared {
            self.unpoll(node, address, every_ms);
        }
    }

    /// Ends watches and curves that only this client wanted.
    pub(super) fn forget_wishes_of(&self, client: u32) {
        let (watches, curves) = lock(&self.0.wanted).leave(client);
        for (node, address) in watches {
            self.unwatch(node, address);
        }
        for (node, signal) in curves {
            let every_ms = lock(&self.0.model).unplot(node, signal);
            if let (Signal::Object(address), Some(every_ms)) = (signal, every_ms) {
                self.unpoll(node, address, every_ms);
            }
        }
    }

    /// Stops every drive, whatever else is being done. `done` is called when all stand still, or with the first
    /// failure.
    pub(super) fn stop_all(&self, done: impl FnOnce(Result<Answer, Refused>) + Send + 'static) {
        self.end_play();
        let drives: Vec<_> = {
            let mut model = lock(&self.0.model);
            let is_drive = |node: &NodeId| model.sheet(*node).is_some_and(|sheet| sheet.drive.is_some());
            let drives: Vec<_> = model.nodes().filter(is_drive).collect();
            if let Some(why) = model.lost().map(str::to_owned) {
                for node in &drives {
                    model.drive(*node).ending = Some(order::unstoppable(*node, &why));
                }
            }
            drives
        };
        let gathered = Gathered::new(drives.len(), done);
        for node in drives {
            let gathered = Arc::clone(&gathered);
            match self.worker(node) {
                Ok(worker) => worker.stop(Braking::Programmed, move |result| gathered.take(result)),
                Err(refused) => gathered.take(Err(refused)),
            }
        }
    }

    pub(super) fn stop_started_by(&self, client: u32) {
        for worker in lock(&self.0.workers).values() {
            worker.leave(client);
        }
        let links = lock(&self.0.links).remove(&client);
        for link in links.into_iter().flatten() {
            lock(&self.0.playing).take_if(|played| *played == link);
            self.0.ports.cut(link);
        }
    }

    /// A link that is cut when the client is closed.
    pub(super) fn link_of(&self, client: u32) -> Port {
        let link = self.0.ports.link();
        lock(&self.0.links).entry(client).or_default().push(link.number());
        link
    }

    pub(super) fn show_control(&self, clients: &Clients) {
        let control = view::Control { holder: clients.holder, clients: clients.open.len() as u32 };
        lock(&self.0.model).control = control;
    }
}

/// Reads the identity of a node; the model takes it from the bus.
pub(super) fn get_to_know(worker: &Worker) {
    worker.ask(NOBODY, |worker| {
        let Ok(mut network) = worker.network() else { return };
        let identity = (1..=4).map(|sub| Address::new(cia301::IDENTITY, sub));
        for address in identity.chain([Address::new(DEVICE_NAME, 0), stored::FORM]) {
            if address == stored::FORM && lock(&worker.model).sheet(worker.node).is_some() {
                return;
            }
            match network.read_bytes(worker.node, address) {
                Ok(_) | Err(AccessError::Sdo { error: SdoError::Aborted { .. }, .. }) => {}
                // The node is not there; it is asked again when it boots.
                Err(_) => return,
            }
        }
    });
}

fn millis(every_ms: u32) -> Duration {
    Duration::from_millis(every_ms.into())
}
