//! A client, a page or a terminal: its requests, and what ends with it.

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
use super::worker::Worker;
use super::{access, network, order, parameters, pdo};
use crate::model::Braking;
use crate::number;
use crate::request::{Answer, Other, Refused, Request, Verb};
use crate::sheet::Sheet;

/// The shortest interval of reading an entry.
const FASTEST_MS: u32 = 10;

/// The greatest speed of playing a log.
const MOST_SPEED: f64 = 1000.0;

/// The most rows in an answer.
const MOST_ROWS: u32 = 1000;

/// A client. When it is closed or dropped, everything that it has started is stopped.
pub struct Client {
    bench: Bench,
    number: u32,
}

impl Bench {
    /// A new client.
    #[must_use]
    pub fn open_client(&self) -> Client {
        let mut clients = lock(&self.0.clients);
        clients.last += 1;
        let number = clients.last;
        clients.open.insert(number);
        self.show_control(&clients);
        Client { bench: self.clone(), number }
    }
}

impl Client {
    /// Its number, from 1.
    #[must_use]
    pub const fn number(&self) -> u32 {
        self.number
    }

    /// Closes the client: stops what it has started, and releases control.
    pub fn close(&self) {
        let mut clients = lock(&self.bench.0.clients);
        if !clients.open.remove(&self.number) {
            return;
        }
        if clients.holder == Some(self.number) {
            clients.holder = None;
        }
        self.bench.show_control(&clients);
        drop(clients);
        self.bench.stop_started_by(self.number);
        self.bench.forget_wishes_of(self.number);
    }

    /// Begins a request, whose answer comes later. Requests about the same node are carried out one after the other.
    #[must_use]
    pub fn ask(&self, request: Request) -> Reply {
        let (sender, reply) = oneshot::channel();
        if needs_control(&request)
            && let Err(refused) = self.may_change()
        {
            let _ = sender.send(Err(refused));
            return Reply(reply);
        }
        self.begin(request, sender);
        Reply(reply)
    }

    fn may_change(&self) -> Result<(), Refused> {
        match lock(&self.bench.0.clients).holder {
            Some(holder) if holder == self.number => Ok(()),
            Some(other) => Err(held_by(other)),
            None => Err(Refused::new("nobody has control").with_remedy("take control first")),
        }
    }

    fn begin(&self, request: Request, sender: oneshot::Sender<Result<Answer, Refused>>) {
        let bench = &self.bench;
        let (line, recorder) = (bench.line(&request), bench.clone());
        let noted = move |was_stopped, result| {
            recorder.note(line, was_stopped, &result);
            result
        };
        let model = &bench.0.model;
        match request {
            Request::Read { node, addresses } => {
                self.with(node, sender, move |worker| access::read(worker, &addresses));
            }
            Request::Write { node, address, text, force } => {
                self.with(node, sender, move |worker| noted(false, access::write(worker, &address, &text, force)));
            }
            Request::FetchSheet { node } => self.job(node, "data sheet", sender, access::fetch_sheet),
            Request::Backup { node } => self.job(node, "backup", sender, parameters::keep),
            Request::Restore { node, dcf } => {
                self.job(node, "restore", sender, move |worker, job| parameters::put_back(worker, job, &dcf));
            }
            Request::Compare { node, with } => {
                let client = self.number;
                let (bench, job) = (bench.clone(), Arc::new(Job::begin(model, format!("comparison of node {node}"))));
                apart(sender, move || concluded(&job, |_| compare(&bench, client, node, with, &job)));
            }
            Request::Pdos { node } => self.with(node, sender, pdo::show),
            Request::MapPdo { node, pdo, objects, transmission, check } => {
                let wanted = Wanted { pdo, objects, transmission, is_check: check };
                self.with(node, sender, move |worker| pdo::map(worker, &wanted));
            }
            Request::Drive { node, order: order @ (Verb::Stop | Verb::QuickStop), .. } => {
                bench.end_play();
                let braking = if order == Verb::Stop { Braking::Programmed } else { Braking::Full };
                match node_id(node).and_then(|node| bench.drive(node)) {
                    Ok(worker) => worker.stop(braking, move |result| drop(sender.send(noted(false, result)))),
                    Err(refused) => drop(sender.send(Err(refused))),
                }
            }
            Request::Drive { node, order, value } => {
                self.with(node, sender, move |worker| {
                    let result = order::carry(worker, order, value.as_deref());
                    noted(worker.is_interrupted(), result)
                });
            }
            Request::StopAll => bench.stop_all(move |result| drop(sender.send(result))),
            Request::Seek { seconds } => match self.recording() {
                Ok(recording) => recording.seek(micros(seconds), Some(sender)),
                Err(refused) => drop(sender.send(Err(refused))),
            },
            Request::Scan => {
                if let Err(refused) = bench.check_writable() {
                    drop(sender.send(Err(refused)));
                    return;
                }
                // For nodes with a worker, through the worker.
                for worker in lock(&bench.0.workers).values() {
                    get_to_know(worker);
                }
                let (ports, model) = (bench.0.ports.clone(), Arc::clone(model));
                let (link, job) = (bench.link_of(self.number), Job::begin(&model, "scan".to_owned()));
                apart(sender, move || concluded(&job, |job| network::scan(&ports, link, &model, job)));
            }
            Request::PlaySequence { name, text } => {
                let (bench, client, job) = (bench.clone(), self.number, Job::begin(model, name.clone()));
                apart(sender, move || concluded(&job, |job| bench.play(client, &name, text, job)));
            }
            Request::Assign { node } => self.job(node, "assignment by LSS", sender, network::assign),
            other => {
                let _ = sender.send(noted(false, self.at_once(other)));
            }
        }
    }

    /// Answers requests that need not wait.
    fn at_once(&self, request: Request) -> Result<Answer, Refused> {
        let (bench, number) = (&self.bench, self.number);
        match request {
            Request::TakeControl { force } => {
                let mut clients = lock(&bench.0.clients);
                let before = clients.holder.filter(|holder| *holder != number);
                if let Some(other) = before {
                    if !force {
                        return Err(held_by(other));
                    }
                    bench.stop_started_by(other);
                }
                clients.holder = Some(number);
                bench.show_control(&clients);
                Ok(Answer::Done)
            }
            Request::ReleaseControl => {
                let mut clients = lock(&bench.0.clients);
                clients.holder = clients.holder.filter(|holder| *holder != number);
                bench.show_control(&clients);
                Ok(Answer::Done)
            }
            Request::Nmt { node, command } => {
                bench.check_writable()?;
                network::command(&bench.0.ports, node.map(node_id).transpose()?, command)
            }
            Request::Record { on } => bench.record(on),
            Request::SetSheet { node, sheet } => {
                let node = node_id(node)?;
                let read = DataSheet::load(&sheet, &[]);
                let read = read.map_err(|error| Refused { remedy: error.remedy(), ..Refused::new(&error) })?;
                lock(&bench.0.model).introduce(node, Sheet::new(&sheet, read));
                if let Some(recording) = &bench.0.recording {
                    recording.show_anew();
                }
                Ok(Answer::Done)
            }
            Request::Objects { node } => {
                let objects = lock(&bench.0.model).objects(node_id(node)?);
                objects.map(Answer::Objects).ok_or_else(|| {
                    Refused::new(format_args!("which device is node {node}?")).with_remedy("give it a data sheet")
                })
            }
            Request::Watch { node, address, every_ms } => {
                let (node, address) = self.entry(node, &address)?;
                bench.watch(number, node, address, every_ms.max(FASTEST_MS)).map(|()| Answer::Done)
            }
            Request::Unwatch { node, address } => {
                let (node, address) = self.entry(node, &address)?;
                bench.unwatch(node, address);
                Ok(Answer::Done)
            }
            Request::Plot { node, signals, every_ms } => {
                let node = node_id(node)?;
                let device = lock(&bench.0.model).sheet(node).map(|sheet| sheet.device);
                let parse = |text: &String| Signal::parse(device, text);
                let signals: Vec<_> = signals.iter().map(parse).collect::<Result<_, _>>().map_err(Refused::new)?;
                bench.plot(number, node, &signals, every_ms.max(FASTEST_MS)).map(|()| Answer::Done)
            }
            Request::ClearPlot { node } => {
                let node = node.map(node_id).transpose()?;
                bench.clear_plot(node);
                Ok(Answer::Done)
            }
            Request::Curves { since } => Ok(Answer::Curves(lock(&bench.0.model).curves(since))),
            Request::ExportPlot { format } => {
                let file = lock(&bench.0.model).plot_file(&format);
                let bytes = file().map_err(Refused::new)?;
                Ok(Answer::File { name: format!("plot.{format}"), bytes })
            }
            Request::Seen { node, addresses } => {
                let node = node_id(node)?;
                let model = lock(&bench.0.model);
                let device = model.sheet(node).map(|sheet| sheet.device);
                let seen = addresses.iter().map(|text| resolve(device, text).map_err(Refused::new));
                let seen =
                    seen.map(|address| Ok(model.value(node, address?).cloned())).collect::<Result<Vec<_>, _>>()?;
                Ok(Answer::Values(seen.into_iter().flatten().collect()))
            }
            Request::Trace { filter: wanted, from, at, count } => {
                let which = which(&wanted)?;
                let rows = filter::rows(&bench.0.model, &which, at, from, count.min(MOST_ROWS) as usize);
                Ok(Answer::Frames(rows))
            }
            Request::Export { format, filter: wanted } => {
                let known: Format = format.parse().map_err(Refused::new)?;
                let bytes = filter::log_file(&bench.0.model, &which(&wanted)?, known).map_err(Refused::new)?;
                Ok(Answer::File { name: format!("bus.{}", extension(&format)), bytes })
            }
            Request::Input { node, text } => {
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
            Request::Acknowledge => {
                lock(&bench.0.model).acknowledge();
                Ok(Answer::Done)
            }
            Request::Number { text } => number::parse(&text).map(Answer::Number),
            Request::Power { node, on } => {
                let node = node_id(node)?;
                self.simulation(|simulation| simulation.set_power(node, on).map_err(Refused::new))
            }
            Request::Play { speed } if !(0.0..=MOST_SPEED).contains(&speed) => {
                Err(Refused::new(format_args!("a log is played at 0 to {MOST_SPEED} times its speed, not at {speed}")))
            }
            Request::Play { speed } => {
                self.recording()?.play(speed);
                Ok(Answer::Done)
            }
            _ => Err(Refused::new("this request is none of these")),
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

    /// Carries out `task` after all earlier requests to the node.
    fn with(
        &self,
        node: u8,
        sender: oneshot::Sender<Result<Answer, Refused>>,
        task: impl FnOnce(&Worker) -> Result<Answer, Refused> + Send + 'static,
    ) {
        match node_id(node).and_then(|node| self.bench.worker(node)) {
            Ok(worker) => worker.ask(self.number, move |worker| {
                let result = task(worker);
                // A failure of a task that was cut off from the bus was caused by that.
                let was_cut = result.is_err() && worker.is_interrupted();
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
        task: impl FnOnce(&Worker, &Job) -> Result<Answer, Refused> + Send + 'static,
    ) {
        let job = Job::begin(&self.bench.0.model, format!("{name} of node {node}"));
        self.with(node, sender, move |worker| concluded(&job, |job| task(worker, job)));
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        self.close();
    }
}

/// Whether a request changes something on the bus.
fn needs_control(request: &Request) -> bool {
    match request {
        Request::Nmt { .. }
        | Request::Assign { .. }
        | Request::Write { .. }
        | Request::Restore { .. }
        | Request::PlaySequence { .. }
        | Request::Input { .. }
        | Request::Power { .. } => true,
        Request::MapPdo { check, .. } => !check,
        // Every client may stop a drive.
        Request::Drive { order, .. } => !order.is_stop(),
        _ => false,
    }
}

fn concluded(job: &Job, task: impl FnOnce(&Job) -> Result<Answer, Refused>) -> Result<Answer, Refused> {
    let result = task(job);
    job.conclude(&result);
    result
}

/// Compares a node with something else. Two nodes are read in parallel.
fn compare(bench: &Bench, client: u32, node: u8, with: Other, job: &Arc<Job>) -> Result<Answer, Refused> {
    let worker = bench.worker(node_id(node)?)?;
    let read = |worker: &Worker| {
        let (sender, side) = oneshot::channel();
        let job = Arc::clone(job);
        worker.ask(client, move |worker| drop(sender.send(parameters::side(worker, &job))));
        side
    };
    let here = read(&worker);
    let wait = |side: oneshot::Receiver<_>| side.blocking_recv().unwrap_or_else(|_| Err(Refused::interrupted()));
    let (here, there) = match with {
        Other::Defaults => (wait(here)?, parameters::side_of_sheet(&worker)?),
        Other::Dcf(text) => (wait(here)?, parameters::side_of_dcf(&worker, &text)),
        Other::Node(other) => {
            let there = read(&*bench.worker(node_id(other)?)?);
            (wait(here)?, wait(there)?)
        }
    };
    parameters::differences(&here, &there, job)
}

/// Carries out `task` in a new thread.
fn apart(
    sender: oneshot::Sender<Result<Answer, Refused>>,
    task: impl FnOnce() -> Result<Answer, Refused> + Send + 'static,
) {
    // If no thread can be created, the sender is dropped, and the client gets an error.
    let _ = std::thread::Builder::new().spawn(move || drop(sender.send(task())));
}

/// The refusal because another client has control.
fn held_by(client: u32) -> Refused {
    Refused::new(format_args!("client {client} has control"))
        .with_remedy("ask there for them, or take them: what it started is stopped then")
}
