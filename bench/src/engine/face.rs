//! A face: what it asks for, and what ends with it.

use std::sync::Arc;

use lexican_runtime::NodeId;
use lexican_runtime::object::Address;
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::log::Format;
use lexican_toolbox::trace::sampler::Signal;
use lexican_toolbox::values::lookup::resolve;
use tokio::sync::oneshot;

use super::bench::{Bench, Simulation, get_to_know};
use super::filter::{self, extension, which};
use super::jobs::Job;
use super::lock::lock;
use super::parameters::node_id;
use super::pdo::Wanted;
use super::recording::{Recording, micros};
use super::reply::Reply;
use super::station::Station;
use super::{access, network, order, parameters, pdo};
use crate::command::{Answer, Command, Other, Refused, Verb};
use crate::model::Braking;
use crate::number;
use crate::sheet::Sheet;

/// The fastest that an entry is read again and again.
const FASTEST_MS: u32 = 10;

/// The fastest that a log is played.
const MOST_SPEED: f64 = 1000.0;

/// The most rows that a request gets.
const MOST_ROWS: u32 = 1000;

/// A page or a terminal. When it is closed or dropped, what it has started is stopped.
pub struct Face {
    bench: Bench,
    number: u32,
}

impl Bench {
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
        self.bench.forget_wishes_of(self.number);
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
            Command::Drive { node, order: order @ (Verb::Stop | Verb::QuickStop), .. } => {
                let braking = if order == Verb::Stop { Braking::Programmed } else { Braking::Full };
                match node_id(node).and_then(|node| bench.drive(node)) {
                    Ok(station) => station.stop(braking, move |result| drop(sender.send(result))),
                    Err(refused) => drop(sender.send(Err(refused))),
                }
            }
            Command::Drive { node, order, value } => {
                self.with(node, sender, move |station| order::carry(station, order, value.as_deref()));
            }
            Command::StopAll => bench.stop_all(move |result| drop(sender.send(result))),
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
            Command::Assign { node } => self.job(node, "assignment by LSS", sender, network::assign),
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
                bench.watch(number, node, address, every_ms.max(FASTEST_MS)).map(|()| Answer::Done)
            }
            Command::Unwatch { node, address } => {
                let (node, address) = self.entry(node, &address)?;
                bench.unwatch(node, address);
                Ok(Answer::Done)
            }
            Command::Plot { node, signals, every_ms } => {
                let node = node_id(node)?;
                let device = lock(&bench.0.model).sheet(node).map(|sheet| sheet.device);
                let parse = |text: &String| Signal::parse(device, text);
                let signals: Vec<_> = signals.iter().map(parse).collect::<Result<_, _>>().map_err(Refused::new)?;
                bench.plot(number, node, &signals, every_ms.max(FASTEST_MS)).map(|()| Answer::Done)
            }
            Command::ClearPlot { node } => {
                let node = node.map(node_id).transpose()?;
                bench.clear_plot(node);
                Ok(Answer::Done)
            }
            Command::Curves { since } => Ok(Answer::Curves(lock(&bench.0.model).curves(since))),
            Command::ExportPlot { format } => {
                let file = lock(&bench.0.model).plot_file(&format);
                let bytes = file().map_err(Refused::new)?;
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
            Command::Trace { filter: wanted, from, at, count } => {
                let which = which(&wanted)?;
                let rows = filter::rows(&bench.0.model, &which, at, from, count.min(MOST_ROWS) as usize);
                Ok(Answer::Frames(rows))
            }
            Command::Export { format, filter: wanted } => {
                let known: Format = format.parse().map_err(Refused::new)?;
                let bytes = filter::log_file(&bench.0.model, &which(&wanted)?, known).map_err(Refused::new)?;
                Ok(Answer::File { name: format!("bus.{}", extension(&format)), bytes })
            }
            Command::Input { node, text } => {
                let node = node_id(node)?;
                self.simulation(|simulation| {
                    let (name, typed) = text.split_once('=').unwrap_or(("", &text));
                    let devices = simulation.devices();
                    let mut inputs = devices.iter().filter(|it| it.node == node.get()).flat_map(|it| &it.inputs);
                    let shown = inputs.find(|input| input.name == name.trim()).and_then(|input| input.value.clone());
                    number::check(typed, shown.as_deref())?;
                    simulation.input(node, &text).map_err(Refused::new)
                })
            }
            Command::Acknowledge => {
                lock(&bench.0.model).acknowledge();
                Ok(Answer::Done)
            }
            Command::Number { text } => number::parse(&text).map(Answer::Number),
            Command::Power { node, on } => {
                let node = node_id(node)?;
                self.simulation(|simulation| simulation.set_power(node, on).map_err(Refused::new))
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

    fn simulation(&self, set: impl FnOnce(&mut dyn Simulation) -> Result<(), Refused>) -> Result<Answer, Refused> {
        match &mut *lock(&self.bench.0.simulation) {
            Some(simulation) => set(&mut **simulation).map(|()| Answer::Done),
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
        Command::Drive { order, .. } => !order.is_stop(),
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

/// Does something on a thread of its own.
fn apart(
    sender: oneshot::Sender<Result<Answer, Refused>>,
    task: impl FnOnce() -> Result<Answer, Refused> + Send + 'static,
) {
    // Without a thread, the sender is dropped, and the face hears that.
    let _ = std::thread::Builder::new().spawn(move || drop(sender.send(task())));
}

/// Another face has the hands.
fn held_by(face: u32) -> Refused {
    Refused::new(format_args!("face {face} has the hands"))
        .with_remedy("ask there for them, or take them: what it started is stopped then")
}
