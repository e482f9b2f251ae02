//! The bench over a live bus: what its faces ask for is carried out on threads, and the model hears all of it.

mod access;
mod hub;
mod jobs;
mod network;
mod order;
mod parameters;
mod pdo;
mod recording;
mod station;

use std::collections::{BTreeMap, BTreeSet};
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};

use lexican_driver::Description;
use lexican_runtime::host::{AccessError, Link};
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::{Duration, Frame, Instant, NodeId, cia301};
use lexican_toolbox::cob_ids::CobIds;
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::filter::Filter;
use lexican_toolbox::log::Format;
use lexican_toolbox::object::resolve;
use lexican_toolbox::sampler::Signal;
use tokio::sync::oneshot;

use crate::command::{Answer, Command, Order, Other, Refused, TraceFilter};
use crate::model::{BusInfo, DEVICE_NAME, Model, Which, watched};
use crate::sheet::Sheet;
use crate::view::{self, View};
use hub::{Port, Ports};
use jobs::Job;
use parameters::node_id;
use pdo::Wanted;
use recording::{Recording, micros};
use station::{NOBODY, Station};

/// How often new nodes are looked for, and simulated devices are asked.
const LOOK: Duration = Duration::from_millis(100);

/// How often state, position and velocity of a drive are read.
const DRIVE: Duration = Duration::from_millis(250);

/// How often it is found out why a drive would not move, while somebody has the hands.
const OBSTACLES: Duration = Duration::from_secs(2);

/// The fastest that an entry is read again and again.
const FASTEST_MS: u32 = 10;

/// The fastest that a log is played.
const MOST_SPEED: f64 = 1000.0;

/// The most rows that a request gets.
const MOST_ROWS: u32 = 1000;

/// What can be done to simulated devices.
pub trait Simulation: Send {
    /// The devices, and what can be done to each.
    fn devices(&self) -> Vec<view::Simulated>;

    /// Sets an input of a device: `blocked = true`.
    ///
    /// # Errors
    ///
    /// Why it cannot be set.
    fn input(&mut self, node: NodeId, text: &str) -> Result<(), String>;

    /// Switches a device on or off.
    ///
    /// # Errors
    ///
    /// Why it cannot be switched.
    fn set_power(&mut self, node: NodeId, is_on: bool) -> Result<(), String>;
}

/// What a bench begins with.
pub struct Setup {
    /// The bus.
    pub bus: BusInfo,
    /// Nodes that are known before they are heard: their names and data sheets.
    pub nodes: Vec<(NodeId, Option<String>, Option<Sheet>)>,
    /// The simulated devices, if they are.
    pub simulation: Option<Box<dyn Simulation>>,
}

impl Setup {
    /// A bus of which nothing is known yet.
    #[must_use]
    pub fn new(bus: BusInfo) -> Self {
        Setup { bus, nodes: Vec::new(), simulation: None }
    }

    fn model(self, now: Instant) -> (Arc<Mutex<Model>>, Option<Box<dyn Simulation>>) {
        let mut model = Model::new(now, self.bus);
        for (node, name, sheet) in self.nodes {
            if let Some(sheet) = sheet {
                model.introduce(node, sheet);
            }
            if let Some(name) = name {
                model.name(node, name);
            }
        }
        (Arc::new(Mutex::new(model)), self.simulation)
    }
}

/// A bench; clones are the same one.
#[derive(Clone)]
pub struct Bench(Arc<Shared>);

struct Shared {
    model: Arc<Mutex<Model>>,
    ports: Ports,
    stations: Mutex<BTreeMap<NodeId, Arc<Station>>>,
    faces: Mutex<Faces>,
    simulation: Mutex<Option<Box<dyn Simulation>>>,
    recording: Option<Arc<Recording>>,
    /// Links for what faces have started that is about no single node.
    links: Mutex<BTreeMap<u32, Vec<u64>>>,
}

#[derive(Default)]
struct Faces {
    last: u32,
    open: BTreeSet<u32>,
    holder: Option<u32>,
}

/// The answer to a command, when it is there.
pub struct Reply(oneshot::Receiver<Result<Answer, Refused>>);

impl Reply {
    /// Blocks until the answer is there.
    ///
    /// # Errors
    ///
    /// Why the command was not carried out.
    pub fn wait(self) -> Result<Answer, Refused> {
        self.0.blocking_recv().unwrap_or_else(|_| Err(gone()))
    }

    /// The answer, if it is there.
    pub fn take(&mut self) -> Option<Result<Answer, Refused>> {
        match self.0.try_recv() {
            Ok(result) => Some(result),
            Err(oneshot::error::TryRecvError::Empty) => None,
            Err(oneshot::error::TryRecvError::Closed) => Some(Err(gone())),
        }
    }
}

impl Future for Reply {
    type Output = Result<Answer, Refused>;

    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        Pin::new(&mut self.0).poll(context).map(|answer| answer.unwrap_or_else(|_| Err(gone())))
    }
}

/// A page or a terminal. When it is closed or dropped, what it has started is stopped.
pub struct Face {
    bench: Bench,
    number: u32,
}

impl Bench {
    /// A bench of a link in real time.
    ///
    /// # Errors
    ///
    /// The machine gives no thread for it.
    pub fn live(link: Box<dyn Link + Send>, setup: Setup) -> std::io::Result<Self> {
        let (model, simulation) = setup.model(link.now());
        let ports = hub::begin(link, Arc::clone(&model))?;
        let bench = Bench::new(model, ports, simulation, None);
        let keeper = bench.clone();
        std::thread::Builder::new().name("nodes".to_owned()).spawn(move || keeper.keep())?;
        Ok(bench)
    }

    /// A bench of a recorded log, which is shown to its end at first. It takes no frames.
    ///
    /// # Errors
    ///
    /// The machine gives no thread for it.
    pub fn replay(frames: Vec<(Instant, Frame)>, mut setup: Setup) -> std::io::Result<Self> {
        setup.bus.is_writable = false;
        let now = frames.first().map_or(Instant::ZERO, |(at, _)| *at);
        let (model, simulation) = setup.model(now);
        let ports = hub::nowhere(now);
        let recording = recording::begin(frames, ports.clone(), Arc::clone(&model))?;
        Ok(Bench::new(model, ports, simulation, Some(recording)))
    }

    fn new(
        model: Arc<Mutex<Model>>,
        ports: Ports,
        simulation: Option<Box<dyn Simulation>>,
        recording: Option<Arc<Recording>>,
    ) -> Self {
        let (stations, faces, simulation) = (Mutex::default(), Mutex::default(), Mutex::new(simulation));
        Bench(Arc::new(Shared { model, ports, stations, faces, simulation, recording, links: Mutex::default() }))
    }

    /// A new face.
    #[must_use]
    pub fn open_face(&self) -> Face {
        let mut faces = lock(&self.0.faces);
        faces.last += 1;
        let number = faces.last;
        faces.open.insert(number);
        self.show_hands(&faces);
        Face { bench: self.clone(), number }
    }

    /// What faces show.
    #[must_use]
    pub fn view(&self) -> View {
        lock(&self.0.model).view()
    }

    /// Stops what moves, and ends the bench.
    pub fn end(&self) {
        let replies: Vec<_> = self.stop_all();
        for reply in replies {
            let _ = reply.wait();
        }
        self.0.ports.end();
    }

    /// Looks after nodes that are new.
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
                let Ok(station) = self.station(node) else { continue };
                if station.is_idle() && lock(&self.0.model).is_stranger(node) {
                    get_to_know(&station);
                }
                if let Some(description) = sheet.and_then(|sheet| sheet.drive) {
                    self.look_after(&mut drives, &station, description);
                }
            }
            #[expect(clippy::disallowed_methods, reason = "the bench runs in real time")]
            std::thread::sleep(LOOK.into());
        }
    }

    /// Follows a drive, and finds out why it would not move.
    fn look_after(
        &self,
        drives: &mut BTreeMap<NodeId, lexican_runtime::Instant>,
        station: &Arc<Station>,
        description: &'static Description,
    ) {
        let now = self.0.ports.now();
        let is_new = !drives.contains_key(&station.node);
        if is_new {
            for address in watched(description) {
                station.poll(address, DRIVE);
            }
        }
        let has_hands = lock(&self.0.faces).holder.is_some();
        let due = drives.entry(station.node).or_insert(now);
        if has_hands && *due <= now && station.is_idle() {
            *due = now + OBSTACLES;
            station.ask(NOBODY, move |station| order::look(station, description));
        }
    }

    fn station(&self, node: NodeId) -> Result<Arc<Station>, Refused> {
        self.check_writable()?;
        let mut stations = lock(&self.0.stations);
        if let Some(station) = stations.get(&node) {
            return Ok(Arc::clone(station));
        }
        let station = Station::begin(node, self.0.ports.clone(), Arc::clone(&self.0.model)).map_err(Refused::new)?;
        stations.insert(node, Arc::clone(&station));
        Ok(station)
    }

    /// Frames can be sent, or could be until the bus was lost.
    fn check_writable(&self) -> Result<(), Refused> {
        match (&self.0.recording, lock(&self.0.model).listens_only()) {
            (Some(_), _) => Err(Refused::new("a log takes no frames").with_remedy("open the bus itself")),
            (None, true) => Err(Refused::new("the bench only listens to this bus")),
            (None, false) => Ok(()),
        }
    }

    /// Reads an entry every so often; on a bus that takes no frames its value comes when others read it.
    fn poll(&self, node: NodeId, address: Address, every_ms: u32) {
        if let Ok(station) = self.station(node) {
            station.poll(address, millis(every_ms));
        }
    }

    fn unpoll(&self, node: NodeId, address: Address, every_ms: u32) {
        if let Ok(station) = self.station(node) {
            station.unpoll(address, millis(every_ms));
        }
    }

    /// Stops every drive, whatever else is under way.
    fn stop_all(&self) -> Vec<Reply> {
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
        let stop = |node| {
            let (sender, reply) = oneshot::channel();
            match self.station(node) {
                Ok(station) => station.stop(move |station| {
                    // An order that was cancelled has stopped its drive, but somebody else may move it.
                    let _ = sender.send(order::carry(station, Order::Stop, None));
                }),
                Err(refused) => drop(sender.send(Err(refused))),
            }
            Reply(reply)
        };
        drives.into_iter().map(stop).collect()
    }

    /// Stops what a face has started.
    fn stop_started_by(&self, face: u32) {
        for station in lock(&self.0.stations).values() {
            station.leave(face);
        }
        let links = lock(&self.0.links).remove(&face);
        links.into_iter().flatten().for_each(|link| self.0.ports.cut(link));
    }

    /// A link that is lost when a face is closed.
    fn link_of(&self, face: u32) -> Port {
        let link = self.0.ports.link();
        lock(&self.0.links).entry(face).or_default().push(link.number());
        link
    }

    fn show_hands(&self, faces: &Faces) {
        let hands = view::Hands { holder: faces.holder, faces: faces.open.len() as u32 };
        lock(&self.0.model).hands = hands;
    }
}

/// Asks a node who it is: the model hears what it answers.
fn get_to_know(station: &Station) {
    station.ask(NOBODY, |station| {
        let Ok(mut network) = station.network() else { return };
        let identity = (1..=4).map(|sub| Address::new(cia301::IDENTITY, sub));
        for address in identity.chain([Address::new(DEVICE_NAME, 0)]) {
            match network.read_bytes(station.node, address) {
                Ok(_) | Err(AccessError::Sdo { error: SdoError::Aborted { .. }, .. }) => {}
                // It is not there, and asked again when it boots.
                Err(_) => return,
            }
        }
    });
}

impl Face {
    /// Its number, from 1.
    #[must_use]
    pub const fn number(&self) -> u32 {
        self.number
    }

    /// Closes it: what it has started is stopped, and its hands are free.
    pub fn close(&self) {
        let mut faces = lock(&self.bench.0.faces);
        if !faces.open.remove(&self.number) {
            return;
        }
        if faces.holder == Some(self.number) {
            faces.holder = None;
        }
        self.bench.show_hands(&faces);
        drop(faces);
        self.bench.stop_started_by(self.number);
    }

    /// Gives a command; its answer comes when it is carried out. Commands about one node follow one another.
    #[must_use]
    pub fn ask(&self, command: Command) -> Reply {
        let (sender, reply) = oneshot::channel();
        if needs_hands(&command)
            && let Err(refused) = self.may_change()
        {
            let _ = sender.send(Err(refused));
            return Reply(reply);
        }
        self.begin(command, sender);
        Reply(reply)
    }

    fn may_change(&self) -> Result<(), Refused> {
        match lock(&self.bench.0.faces).holder {
            Some(holder) if holder == self.number => Ok(()),
            Some(other) => Err(held_by(other)),
            None => Err(Refused::new("nobody has the hands").with_remedy("take the hands first")),
        }
    }

    fn begin(&self, command: Command, sender: oneshot::Sender<Result<Answer, Refused>>) {
        let bench = &self.bench;
        let model = &bench.0.model;
        match command {
            Command::Read { node, addresses } => {
                self.with(node, sender, move |station| access::read(station, &addresses));
            }
            Command::Write { node, address, text, force } => {
                self.with(node, sender, move |station| access::write(station, &address, &text, force));
            }
            Command::Backup { node } => self.job(node, "backup", sender, parameters::keep),
            Command::Restore { node, dcf } => {
                self.job(node, "restore", sender, move |station, job| parameters::put_back(station, job, &dcf));
            }
            Command::Compare { node, with } => {
                let face = self.number;
                let (bench, job) = (bench.clone(), Arc::new(Job::begin(model, format!("comparison of node {node}"))));
                apart(sender, move || concluded(&job, |_| compare(&bench, face, node, with, &job)));
            }
            Command::Pdos { node } => self.with(node, sender, pdo::show),
            Command::MapPdo { node, pdo, objects, transmission, check } => {
                let wanted = Wanted { pdo, objects, transmission, is_check: check };
                self.with(node, sender, move |station| pdo::map(station, &wanted));
            }
            Command::Drive { node, order: order @ (Order::Stop | Order::QuickStop), .. } => {
                match node_id(node).and_then(|node| bench.station(node)) {
                    Ok(station) => station.stop(move |station| {
                        let _ = sender.send(order::carry(station, order, None));
                    }),
                    Err(refused) => drop(sender.send(Err(refused))),
                }
            }
            Command::Drive { node, order, value } => {
                self.with(node, sender, move |station| order::carry(station, order, value.as_deref()));
            }
            Command::StopAll => {
                let replies = bench.stop_all();
                apart(sender, move || {
                    let failed: Vec<_> = replies.into_iter().filter_map(|reply| reply.wait().err()).collect();
                    match failed.first() {
                        None => Ok(Answer::Done),
                        Some(first) => Err(first.clone()),
                    }
                });
            }
            Command::Seek { seconds } => match self.recording() {
                Ok(recording) => recording.seek(micros(seconds), Some(sender)),
                Err(refused) => drop(sender.send(Err(refused))),
            },
            Command::Scan => {
                if let Err(refused) = bench.check_writable() {
                    drop(sender.send(Err(refused)));
                    return;
                }
                // A node that has a station is asked through it.
                for station in lock(&bench.0.stations).values() {
                    get_to_know(station);
                }
                let (ports, model) = (bench.0.ports.clone(), Arc::clone(model));
                let (link, job) = (bench.link_of(self.number), Job::begin(&model, "scan".to_owned()));
                apart(sender, move || concluded(&job, |job| network::scan(&ports, link, &model, job)));
            }
            Command::Assign { node } => {
                if let Err(refused) = bench.check_writable() {
                    drop(sender.send(Err(refused)));
                    return;
                }
                let ports = bench.0.ports.clone();
                let (link, job) = (bench.link_of(self.number), Job::begin(model, format!("node-ID {node} by LSS")));
                apart(sender, move || concluded(&job, |job| network::assign(&ports, link, node_id(node)?, job)));
            }
            other => {
                let _ = sender.send(self.at_once(other));
            }
        }
    }

    /// What waits for nothing.
    fn at_once(&self, command: Command) -> Result<Answer, Refused> {
        let (bench, number) = (&self.bench, self.number);
        let mut faces = lock(&bench.0.faces);
        match command {
            Command::TakeHands { force } => {
                let before = faces.holder.filter(|holder| *holder != number);
                if let Some(other) = before {
                    if !force {
                        return Err(held_by(other));
                    }
                    bench.stop_started_by(other);
                }
                faces.holder = Some(number);
                bench.show_hands(&faces);
                return Ok(Answer::Done);
            }
            Command::ReleaseHands => {
                faces.holder = faces.holder.filter(|holder| *holder != number);
                bench.show_hands(&faces);
                return Ok(Answer::Done);
            }
            _ => drop(faces),
        }
        match command {
            Command::Nmt { node, command } => {
                bench.check_writable()?;
                network::command(&bench.0.ports, node.map(node_id).transpose()?, command)
            }
            Command::SetSheet { node, sheet } => {
                let node = node_id(node)?;
                let read = DataSheet::load(&sheet, &[]);
                let read = read.map_err(|error| match error.remedy() {
                    Some(remedy) => Refused::new(&error).with_remedy(remedy),
                    None => Refused::new(&error),
                })?;
                lock(&bench.0.model).introduce(node, Sheet::new(&sheet, read));
                if let Some(recording) = &bench.0.recording {
                    recording.show_anew();
                }
                Ok(Answer::Done)
            }
            Command::Objects { node } => {
                let objects = lock(&bench.0.model).objects(node_id(node)?);
                objects.map(Answer::Objects).ok_or_else(|| {
                    Refused::new(format_args!("which device is node {node}?")).with_remedy("give it a data sheet")
                })
            }
            Command::Watch { node, address, every_ms } => {
                let (node, address) = self.entry(node, &address)?;
                let every_ms = every_ms.max(FASTEST_MS);
                let before = lock(&bench.0.model).watch(node, address, every_ms);
                bench.poll(node, address, every_ms);
                if let Some(before) = before {
                    bench.unpoll(node, address, before);
                }
                Ok(Answer::Done)
            }
            Command::Unwatch { node, address } => {
                let (node, address) = self.entry(node, &address)?;
                let before = lock(&bench.0.model).unwatch(node, address);
                if let Some(every_ms) = before {
                    bench.unpoll(node, address, every_ms);
                }
                Ok(Answer::Done)
            }
            Command::Plot { node, signals, every_ms } => {
                let node = node_id(node)?;
                let device = lock(&bench.0.model).sheet(node).map(|sheet| sheet.device);
                let parse = |text: &String| Signal::parse(device, text);
                let signals: Vec<_> = signals.iter().map(parse).collect::<Result<_, _>>().map_err(Refused::new)?;
                let every_ms = every_ms.max(FASTEST_MS);
                let new = lock(&bench.0.model).plot(node, signals, every_ms);
                for signal in new {
                    if let Signal::Object(address) = signal {
                        bench.poll(node, address, every_ms);
                    }
                }
                Ok(Answer::Done)
            }
            Command::ClearPlot { node } => {
                let node = node.map(node_id).transpose()?;
                let cleared = lock(&bench.0.model).clear_plot(node);
                for (node, address, every_ms) in cleared {
                    bench.unpoll(node, address, every_ms);
                }
                Ok(Answer::Done)
            }
            Command::Curves { since } => Ok(Answer::Curves(lock(&bench.0.model).curves(since))),
            Command::ExportPlot { format } => {
                let bytes = lock(&bench.0.model).plot_file(&format).map_err(Refused::new)?;
                Ok(Answer::File { name: format!("plot.{format}"), bytes })
            }
            Command::Seen { node, addresses } => {
                let node = node_id(node)?;
                let model = lock(&bench.0.model);
                let device = model.sheet(node).map(|sheet| sheet.device);
                let seen = addresses.iter().map(|text| resolve(device, text).map_err(Refused::new));
                let seen =
                    seen.map(|address| Ok(model.value(node, address?).cloned())).collect::<Result<Vec<_>, _>>()?;
                Ok(Answer::Values(seen.into_iter().flatten().collect()))
            }
            Command::Trace { filter, from, at, count } => {
                let which = which(&filter)?;
                let rows = lock(&bench.0.model).rows(&which, at, from, count.min(MOST_ROWS) as usize);
                Ok(Answer::Frames(rows))
            }
            Command::Export { format, filter } => {
                let known: Format = format.parse().map_err(Refused::new)?;
                let bytes = lock(&bench.0.model).log_file(&which(&filter)?, known).map_err(Refused::new)?;
                Ok(Answer::File { name: format!("bus.{}", extension(&format)), bytes })
            }
            Command::Input { node, text } => {
                let node = node_id(node)?;
                self.simulation(|simulation| simulation.input(node, &text))
            }
            Command::Power { node, on } => {
                let node = node_id(node)?;
                self.simulation(|simulation| simulation.set_power(node, on))
            }
            Command::Play { speed } if !(0.0..=MOST_SPEED).contains(&speed) => {
                Err(Refused::new(format_args!("a log is played at 0 to {MOST_SPEED} times its speed, not at {speed}")))
            }
            Command::Play { speed } => {
                self.recording()?.play(speed);
                Ok(Answer::Done)
            }
            _ => Err(Refused::new("this command is none of these")),
        }
    }

    fn recording(&self) -> Result<&Recording, Refused> {
        let refused = || Refused::new("this is a live bus").with_remedy("a log is opened by --bus log:FILE");
        self.bench.0.recording.as_deref().ok_or_else(refused)
    }

    fn simulation(&self, set: impl FnOnce(&mut dyn Simulation) -> Result<(), String>) -> Result<Answer, Refused> {
        match &mut *lock(&self.bench.0.simulation) {
            Some(simulation) => set(&mut **simulation).map(|()| Answer::Done).map_err(Refused::new),
            None => Err(Refused::new("the devices of this bus are real")),
        }
    }

    fn entry(&self, node: u8, text: &str) -> Result<(NodeId, Address), Refused> {
        let node = node_id(node)?;
        let device = lock(&self.bench.0.model).sheet(node).map(|sheet| sheet.device);
        Ok((node, resolve(device, text).map_err(Refused::new)?))
    }

    /// Carries something out when what was asked of the node before is done.
    fn with(
        &self,
        node: u8,
        sender: oneshot::Sender<Result<Answer, Refused>>,
        task: impl FnOnce(&Station) -> Result<Answer, Refused> + Send + 'static,
    ) {
        match node_id(node).and_then(|node| self.bench.station(node)) {
            Ok(station) => station.ask(self.number, move |station| {
                let result = task(station);
                // What was cut off from the bus has not failed by itself.
                let was_cut = result.is_err() && station.is_interrupted();
                let _ = sender.send(if was_cut { Err(Refused::interrupted()) } else { result });
            }),
            Err(refused) => drop(sender.send(Err(refused))),
        }
    }

    /// The same, shown as a job.
    fn job(
        &self,
        node: u8,
        name: &str,
        sender: oneshot::Sender<Result<Answer, Refused>>,
        task: impl FnOnce(&Station, &Job) -> Result<Answer, Refused> + Send + 'static,
    ) {
        let job = Job::begin(&self.bench.0.model, format!("{name} of node {node}"));
        self.with(node, sender, move |station| concluded(&job, |job| task(station, job)));
    }
}

impl Drop for Face {
    fn drop(&mut self) {
        self.close();
    }
}

/// Whether a command changes something on the bus.
fn needs_hands(command: &Command) -> bool {
    match command {
        Command::Nmt { .. }
        | Command::Assign { .. }
        | Command::Write { .. }
        | Command::Restore { .. }
        | Command::Input { .. }
        | Command::Power { .. } => true,
        Command::MapPdo { check, .. } => !check,
        // Everybody may stop.
        Command::Drive { order, .. } => !matches!(order, Order::Stop | Order::QuickStop),
        _ => false,
    }
}

fn concluded(job: &Job, task: impl FnOnce(&Job) -> Result<Answer, Refused>) -> Result<Answer, Refused> {
    let result = task(job);
    job.conclude(&result);
    result
}

/// Compares a node with something else: each node is read by its own thread.
fn compare(bench: &Bench, face: u32, node: u8, with: Other, job: &Arc<Job>) -> Result<Answer, Refused> {
    let station = bench.station(node_id(node)?)?;
    let read = |station: &Station| {
        let (sender, side) = oneshot::channel();
        let job = Arc::clone(job);
        station.ask(face, move |station| drop(sender.send(parameters::side(station, &job))));
        side
    };
    let here = read(&station);
    let wait = |side: oneshot::Receiver<_>| side.blocking_recv().unwrap_or_else(|_| Err(Refused::interrupted()));
    let (here, there) = match with {
        Other::Defaults => (wait(here)?, parameters::side_of_sheet(&station)?),
        Other::Dcf(text) => (wait(here)?, parameters::side_of_dcf(&station, &text)),
        Other::Node(other) => {
            let there = read(&*bench.station(node_id(other)?)?);
            (wait(here)?, wait(there)?)
        }
    };
    parameters::differences(&here, &there, job)
}

fn millis(every_ms: u32) -> Duration {
    Duration::from_millis(every_ms.into())
}

/// Does something on a thread of its own.
fn apart(
    sender: oneshot::Sender<Result<Answer, Refused>>,
    task: impl FnOnce() -> Result<Answer, Refused> + Send + 'static,
) {
    // Without a thread, the sender is dropped, and the face hears that.
    let _ = std::thread::Builder::new().spawn(move || drop(sender.send(task())));
}

/// A filter in the words of `lexican monitor`.
fn which(filter: &TraceFilter) -> Result<Which, Refused> {
    if *filter == TraceFilter::default() {
        return Ok(Which::default());
    }
    fn list<T: std::str::FromStr<Err: std::fmt::Display>>(text: &str) -> Result<Vec<T>, Refused> {
        let words = text.split(',').map(str::trim).filter(|word| !word.is_empty());
        words.map(|word| word.parse().map_err(Refused::new)).collect()
    }
    let some = |text: &String| Some(text.trim().to_owned()).filter(|text| !text.is_empty());
    Ok(Which {
        key: format!("{filter:?}"),
        filter: Filter {
            nodes: nodes(&filter.nodes)?,
            services: list(&filter.services)?,
            without: list(&filter.without)?,
            objects: some(&filter.object).into_iter().collect(),
            ids: some(&filter.ids).map(|ids| ids.parse::<CobIds>().map_err(Refused::new)).transpose()?,
            texts: some(&filter.text).into_iter().collect(),
        },
        alarming: filter.alarming,
        transfers: filter.transfers,
    })
}

/// `5`, `3,5-9`.
fn nodes(text: &str) -> Result<Vec<NodeId>, Refused> {
    let number = |text: &str| {
        let digits = text.trim().strip_prefix("0x");
        let number = digits.map_or_else(|| text.trim().parse(), |digits| u8::from_str_radix(digits, 16));
        let wrong = || Refused::new(format_args!("{text:?} is no node-ID: these are 1 to 127"));
        number.ok().and_then(NodeId::new).ok_or_else(wrong)
    };
    let mut nodes = Vec::new();
    for part in text.split(',').filter(|part| !part.trim().is_empty()) {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let (first, last) = (number(first)?, number(last)?);
        nodes.extend(NodeId::all().filter(|node| (first..=last).contains(node)));
    }
    Ok(nodes)
}

/// The end of the name of a log.
fn extension(format: &str) -> &str {
    match format {
        "candump" => "log",
        trc if trc.starts_with("trc") => "trc",
        other => other,
    }
}

/// Another face has the hands.
fn held_by(face: u32) -> Refused {
    Refused::new(format_args!("face {face} has the hands"))
        .with_remedy("ask there for them, or take them: what it started is stopped then")
}

fn gone() -> Refused {
    Refused::new("a stop came first, or the bench has ended").with_remedy("ask again")
}

/// A thread that panics has done no harm to what it held.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
