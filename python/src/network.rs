//! Networks, machines, and their nodes.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use lexican_machine::parameters::{backup_machine, backup_node, restore_machine, restore_node};
use lexican_machine::{What, tokio as shell};
use lexican_runtime::CobId;
use lexican_runtime::host::{Fate, Pace};
use lexican_runtime::manager::Remote;
use lexican_runtime::object::Address;
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_toolbox::data_sheet::DataSheet as Sheet;
use lexican_toolbox::parameters::archive::Archive;
use lexican_toolbox::parameters::restore::{Options, configured, domains as files};
use lexican_toolbox::text::time_of_day;
use lexican_toolbox::values::report::ValueReport;
use pyo3::exceptions::{PyAttributeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyBytes, PyDict, PyTuple};

use crate::backup::{Call, Restored, seen};
use crate::callbacks::Callback;
use crate::drive::{Drive, Slot};
use crate::error::{Raise, wrong};
use crate::frames::{Frames, PythonLink, frame, unix_time};
use crate::opened::{Shared, note};
use crate::pdo::Pdo;
use crate::sheet::{DataSheet, node_id};
use crate::simulation::pace;
use crate::value::{ObjectName, Value, by_name, words};
use crate::wait::{Run, ask, lock, seconds, wait, within};

/// A network: the bus of a URL as the command has it ("can0", "slcan:/dev/ttyACM0", "log:FILE",
/// "sim:siko/ag03-1?node=5"), or a bus of python-can.
///
/// Calls block while other Python threads run; `lexican.aio` has the same for asyncio.
///
/// Raises LinkFailed if the bus cannot be opened.
#[pyclass(module = "lexican", frozen, subclass, weakref)]
pub(crate) struct Network {
    pub(crate) shared: Arc<Shared>,
}

impl Network {
    fn find(&self, name: &str) -> PyResult<Node> {
        let (machine, _) = self.shared.machine()?;
        let id = machine.node(name).map_err(Raise::raise)?.id().get();
        Ok(Node { shared: Arc::clone(&self.shared), name: name.to_owned(), id })
    }
}

#[pymethods]
impl Network {
    #[new]
    fn new(bus: &Bound<'_, PyAny>) -> PyResult<Self> {
        let shared = match bus.extract::<String>() {
            Ok(url) => bus.py().detach(|| Shared::of_url(&url, Pace::Virtual))?,
            Err(_) => Shared::of_link(Box::new(PythonLink::over(bus)?))?,
        };
        Ok(Network { shared })
    }

    /// Adds a node with a data sheet: a file, a device that lexican knows, or the result of `load`.
    #[pyo3(signature = (id, sheet, overlays = Vec::new(), name = None))]
    fn add_node(
        &self,
        id: u8,
        sheet: &Bound<'_, PyAny>,
        overlays: Vec<PathBuf>,
        name: Option<String>,
    ) -> PyResult<Node> {
        let (sheet, mut known) = match sheet.cast::<DataSheet>() {
            Ok(sheet) => (sheet.get().name.clone(), sheet.get().overlays.clone()),
            Err(_) => (sheet.extract::<PathBuf>()?.to_string_lossy().into_owned(), Vec::new()),
        };
        known.extend(overlays);
        let overlays: Vec<_> = known.iter().map(|path| path.to_string_lossy().into_owned()).collect();
        let name = name.unwrap_or_else(|| format!("node{id}"));
        self.shared.with(|opened| opened.name(&name, id, &sheet, &overlays))?;
        self.find(&name)
    }

    /// The node with this name or node-ID.
    fn node(&self, name_or_id: &Bound<'_, PyAny>) -> PyResult<Node> {
        if let Ok(name) = name_or_id.extract::<String>() {
            return self.find(&name);
        }
        let id: u8 = name_or_id.extract()?;
        let all = self.nodes()?;
        all.into_iter().find(|node| node.id == id).ok_or_else(|| {
            wrong(format_args!(
                "node-ID {id} has no data sheet: add_node({id}, \"x.eds\"), or read_bytes({id}, 0x1018, 1)"
            ))
        })
    }

    fn __getitem__(&self, name_or_id: &Bound<'_, PyAny>) -> PyResult<Node> {
        self.node(name_or_id)
    }

    /// All nodes with a data sheet and a node-ID.
    fn nodes(&self) -> PyResult<Vec<Node>> {
        let Some(machine) = self.shared.with(|opened| Ok(opened.machine.clone()))? else { return Ok(Vec::new()) };
        let names = machine.file().buses().flat_map(|bus| &bus.nodes).map(|node| node.name.value.clone());
        Ok(names.filter_map(|name| self.find(&name).ok()).collect())
    }

    /// The node-IDs that respond to reading 1000h within a time in seconds. Changes nothing.
    #[pyo3(signature = (timeout = 0.5))]
    fn scan(&self, py: Python<'_>, timeout: f64) -> PyResult<Vec<u16>> {
        let (network, runner) = self.shared.network()?;
        let found = wait(py, &runner, shell::scan(&network, seconds(timeout)?))?;
        Ok(found.into_iter().map(|id| id.get().into()).collect())
    }

    /// Reads the bytes of an entry, by block transfer if that is faster. No data sheet is needed.
    ///
    /// Raises SdoAborted, NoAnswer.
    #[pyo3(signature = (node, index, sub = 0))]
    fn read_bytes<'py>(&self, py: Python<'py>, node: u8, index: u16, sub: u8) -> PyResult<Bound<'py, PyBytes>> {
        let (network, runner) = self.shared.network()?;
        let node = node_id(node)?;
        ask(py, &runner, network.read_bytes(node, Address::new(index, sub))).map(|bytes| PyBytes::new(py, &bytes))
    }

    /// Writes the bytes of an entry, by block transfer if that is faster. No data sheet is needed.
    ///
    /// Raises SdoAborted, NoAnswer.
    fn write_bytes(&self, py: Python<'_>, node: u8, index: u16, sub: u8, data: Vec<u8>) -> PyResult<()> {
        let (network, runner) = self.shared.network()?;
        let node = node_id(node)?;
        ask(py, &runner, network.write_bytes(node, Address::new(index, sub), &data))
    }

    /// Sends NMT "start", "stop", "pre-operational", "reset-node" or "reset-communication" to a node, or to all.
    #[pyo3(signature = (command, node = None))]
    fn nmt(&self, py: Python<'_>, command: &str, node: Option<u8>) -> PyResult<()> {
        let command = match command {
            "start" => NmtCommand::Start,
            "stop" => NmtCommand::Stop,
            "pre-operational" => NmtCommand::EnterPreOperational,
            "reset-node" => NmtCommand::ResetNode,
            "reset-communication" => NmtCommand::ResetCommunication,
            _ => return Err(PyValueError::new_err(format!("{command:?} is no command of NMT"))),
        };
        let (network, runner) = self.shared.network()?;
        let node = node.map(node_id).transpose()?;
        ask(py, &runner, network.command(command, node))
    }

    /// Sends a raw frame.
    #[pyo3(signature = (cob_id, data = Vec::new()))]
    fn send(&self, py: Python<'_>, cob_id: u32, data: Vec<u8>) -> PyResult<()> {
        let (network, runner) = self.shared.network()?;
        ask(py, &runner, network.send(frame(cob_id, cob_id > 0x7FF, &data, None)?))
    }

    /// Sends SYNC (080h) with this period in seconds from now on; 0 ends it. Counts up to `overflow`, unless that is 0.
    #[pyo3(signature = (period, overflow = 0))]
    fn produce_sync(&self, py: Python<'_>, period: f64, overflow: u8) -> PyResult<()> {
        let (network, runner) = self.shared.network()?;
        let period = seconds(period)?;
        let sync = network.with_manager(move |manager, now| manager.produce_sync(now, CobId::SYNC, period, overflow));
        ask(py, &runner, sync)
    }

    /// Sends a heartbeat as `node` with this period in seconds from now on; 0 ends it.
    fn produce_heartbeat(&self, py: Python<'_>, node: u8, period: f64) -> PyResult<()> {
        let (network, runner) = self.shared.network()?;
        let (node, period) = (node_id(node)?, seconds(period)?);
        ask(py, &runner, network.with_manager(move |manager, now| manager.produce_heartbeat(now, node, period)))
    }

    /// Watches a node: it is lost after `timeout` seconds without heartbeat.
    fn watch_heartbeat(&self, py: Python<'_>, node: u8, timeout: f64) -> PyResult<()> {
        let (network, runner) = self.shared.network()?;
        let remote = Remote::new(node_id(node)?).with_heartbeat(seconds(timeout)?);
        let watch =
            network.with_manager(move |manager, now| manager.add(now, remote).expect("it has room for 127 nodes"));
        ask(py, &runner, watch)
    }

    /// The events of all named nodes from now on.
    fn events(&self) -> PyResult<Events> {
        let (machine, _) = self.shared.machine()?;
        Ok(Events { events: Arc::new(tokio::sync::Mutex::new(machine.events())), shared: Arc::clone(&self.shared) })
    }

    /// Calls `function` with each event from now on, or only with those of a kind, such as "emergency". The calls are
    /// made in a separate thread, soon after the event. Exceptions go to `sys.unraisablehook`, and `close` raises the
    /// first one.
    #[pyo3(signature = (what, function))]
    fn on(&self, what: Option<String>, function: Py<PyAny>) -> PyResult<()> {
        let (machine, _) = self.shared.machine()?;
        let of =
            move |event| Some(Event::from(event)).filter(|event| what.as_ref().is_none_or(|what| event.what == what));
        lock(&self.shared.callbacks).push(Callback::new(machine.events(), of, function)?);
        Ok(())
    }

    /// Lets this many seconds pass, by the time of the bus. Virtual time does not pass between calls.
    fn sleep(&self, py: Python<'_>, span: f64) -> PyResult<()> {
        let (network, runner) = self.shared.network()?;
        let span = seconds(span)?;
        let sleep = async { network.sleep_until(network.now().await? + span).await };
        ask(py, &runner, sleep).map(drop)
    }

    /// The time of the bus, in seconds.
    fn now(&self, py: Python<'_>) -> PyResult<f64> {
        let (network, runner) = self.shared.network()?;
        let now = ask(py, &runner, network.now())?;
        Ok(now.since(lexican_runtime::Instant::ZERO).as_secs_f64())
    }

    /// Another link to a simulated bus, for frames; python-can's interface `lexican` uses it. The simulation must run
    /// in real time: `simulate(..., pace="real")`.
    fn frames(&self) -> PyResult<Frames> {
        Frames::over(self.shared.another_link()?, Some(Arc::clone(&self.shared)))
    }

    /// Stops all its drives that may be moving, waits for their standstill, and closes the network. By then, callbacks
    /// have been called with all events.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        self.shared.close(py)
    }

    fn __enter__(this: Py<Self>) -> Py<Self> {
        this
    }

    #[pyo3(signature = (*_exception))]
    fn __exit__(&self, py: Python<'_>, _exception: &Bound<'_, PyTuple>) -> PyResult<()> {
        self.close(py)
    }
}

/// A machine in one file, `machine.toml`: a network whose nodes have names. `machine.feeder` is `machine.node("feeder")`.
///
/// Raises MachineFileError with all mistakes in the file.
#[pyclass(module = "lexican", frozen, extends = Network)]
pub(crate) struct Machine;

#[pymethods]
impl Machine {
    #[new]
    fn new(py: Python<'_>, path: PathBuf) -> PyResult<PyClassInitializer<Self>> {
        Ok(Machine::over(py.detach(|| Shared::of_machine(&path))?))
    }

    /// Boots the machine as in its file (CiA 302-2), and keeps it running from now on.
    ///
    /// Raises LexicanError with the nodes that have not booted.
    fn boot(this: &Bound<'_, Self>) -> PyResult<()> {
        let (machine, runner) = this.as_super().get().shared.machine()?;
        ask(this.py(), &runner, machine.boot())
    }

    /// Saves the parameters of all nodes in one file (tar), in the format of `lexican backup`. Returns a sentence for
    /// everything that is missing. `progress` is called as in `Node.backup`.
    ///
    /// Raises LexicanError if no node can be read.
    #[pyo3(signature = (path, progress = None))]
    fn backup(this: &Bound<'_, Self>, path: PathBuf, progress: Call) -> PyResult<Vec<String>> {
        let (machine, runner) = this.as_super().get().shared.machine()?;
        let made = time_of_day::of_unix((unix_time() * 1e3) as u64).unwrap_or_default();
        let archive = seen(this.py(), &runner, progress, |runner, see| backup_machine(&machine, runner, made, see))?;
        std::fs::write(path, archive.to_bytes()?)?;
        Ok(archive.missing().collect())
    }

    /// Writes parameters that differ from a backup into its nodes, one node after the other, as `Node.restore` does.
    /// All nodes are checked before anything is written.
    #[pyo3(signature = (path, store = false, force = false, progress = None))]
    fn restore<'py>(
        this: &Bound<'py, Self>,
        path: PathBuf,
        store: bool,
        force: bool,
        progress: Call,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (machine, runner) = this.as_super().get().shared.machine()?;
        let archive = Archive::read(&std::fs::read(path)?).map_err(wrong)?;
        let options = Options { store, ..Options::default() };
        let restored = seen(this.py(), &runner, progress, |runner, see| {
            restore_machine(&machine, runner, &archive, options, force, see)
        })?;
        restored.into_iter().map(|it| (it.node.clone(), Restored::from(it))).into_py_dict(this.py())
    }

    /// Gives a simulated device a command, and returns its answer: `carry_out("feeder", "blocked = true")`, "emcy 3120
    /// 04", "power off", "get 6041".
    fn carry_out(this: &Bound<'_, Self>, node: &str, line: &str) -> PyResult<String> {
        this.as_super().get().shared.carry_out(node, line)
    }

    /// Switches a simulated device off for the duration of `with machine.power_off("feeder"):`, as all faults do.
    fn power_off(this: &Bound<'_, Self>, node: String) -> Fault {
        Machine::fault(this, node, None)
    }

    /// Loses all frames of a simulated device, by the predefined COB-IDs of its node-ID.
    fn mute(this: &Bound<'_, Self>, node: String) -> Fault {
        Machine::fault(this, node, Some(Fate::Lose))
    }

    /// Delays all frames of a simulated device by this many seconds.
    fn delay(this: &Bound<'_, Self>, node: String, span: f64) -> PyResult<Fault> {
        Ok(Machine::fault(this, node, Some(Fate::Delay(seconds(span)?))))
    }

    fn __getattr__(this: &Bound<'_, Self>, name: &str) -> PyResult<Node> {
        // Names that Python itself looks for are no nodes.
        let found = if name.starts_with('_') { Err(wrong(name)) } else { this.as_super().get().find(name) };
        found.map_err(|error| PyAttributeError::new_err(error.value(this.py()).to_string()))
    }
}

impl Machine {
    fn fault(this: &Bound<'_, Self>, node: String, fate: Option<Fate>) -> Fault {
        Fault { shared: Arc::clone(&this.as_super().get().shared), node, fate }
    }

    fn over(shared: Arc<Shared>) -> PyClassInitializer<Self> {
        PyClassInitializer::from(Network { shared }).add_subclass(Machine)
    }
}

/// Simulates the devices in a machine's file, or one device with a node-ID, in this process. Virtual time passes only
/// during calls, as fast as possible; or the pace is real.
#[pyfunction]
#[pyo3(signature = (source, node = 1, pace = "virtual"))]
pub(crate) fn simulate(py: Python<'_>, source: PathBuf, node: u8, pace: &str) -> PyResult<Py<Machine>> {
    let pace = self::pace(pace)?;
    let source = source.to_string_lossy().into_owned();
    Py::new(py, Machine::over(py.detach(|| Shared::simulated(&source, node, pace))?))
}

/// A node with its data sheet. Objects are called by name, by index, or by index and sub-index.
#[pyclass(module = "lexican", frozen)]
pub(crate) struct Node {
    shared: Arc<Shared>,
    #[pyo3(get)]
    name: String,
    /// From 1 to 127.
    #[pyo3(get)]
    id: u8,
}

impl Node {
    fn found(&self) -> PyResult<(shell::Node, Run)> {
        let (machine, runner) = self.shared.machine()?;
        Ok((machine.node(&self.name).map_err(Raise::raise)?, runner))
    }
}

#[pymethods]
impl Node {
    /// Reads an object.
    ///
    /// Raises ObjectUnknown, SdoAborted, NoAnswer.
    fn read(&self, py: Python<'_>, object: ObjectName) -> PyResult<Value> {
        let (node, runner) = self.found()?;
        Value::of(py, ask(py, &runner, node.get(&object.text()))?)
    }

    /// Reads all readable entries of an object, in order.
    fn read_all(&self, py: Python<'_>, object: ObjectName) -> PyResult<Vec<Value>> {
        let (node, runner) = self.found()?;
        let read = ask(py, &runner, node.get_all(&object.text()))?;
        read.into_iter().map(|value| Value::of(py, value)).collect()
    }

    /// Writes an object. The value is a text as users write it ("2.5 mm", "profile velocity"), a number in counts of
    /// the device, or raw bytes, which use block transfer if that is faster.
    ///
    /// Raises ObjectUnknown, ValueRefused before anything is sent, SdoAborted, NoAnswer.
    fn write(&self, py: Python<'_>, object: ObjectName, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let (node, runner) = self.found()?;
        let object = object.text();
        match value.cast::<PyBytes>() {
            Ok(bytes) => ask(py, &runner, node.set_bytes(&object, bytes.as_bytes())),
            Err(_) => ask(py, &runner, node.set(&object, &words(value)?)),
        }
    }

    /// The drive of CiA 402 at this node. If it can notice the loss of this program, its protection is armed.
    ///
    /// Raises DriveError if it is no drive.
    fn drive(this: Bound<'_, Self>) -> PyResult<Drive> {
        let py = this.py();
        let node = this.get();
        let (machine, runner) = node.shared.machine()?;
        let drive = ask(py, &runner, machine.drive(&node.name))?;
        let slot = Arc::new(Slot::new(drive, runner));
        note(&node.shared.drives, &slot);
        Ok(Drive { slot, name: node.name.clone(), node: this.clone().into_any().unbind() })
    }

    /// The PDOs that it sends, by its data sheet or the machine's file. Values on which units depend are read now.
    ///
    /// Raises NoAnswer.
    fn pdos(&self, py: Python<'_>) -> PyResult<Vec<Pdo>> {
        let (node, runner) = self.found()?;
        let (machine, _) = self.shared.machine()?;
        let (it, network) = (node.stated(), node.network());
        let Some(device) = it.device() else { return Ok(Vec::new()) };
        let bus = machine.file().buses().position(|bus| bus.nodes.iter().any(|other| other.name.value == self.name));
        let heard = self.shared.with(|opened| Ok(opened.heard[bus.unwrap_or_default()].clone()))?;
        let sent = node.sent_pdos();
        let mapped = sent.iter().flat_map(|pdo| &pdo.mapping).map(|mapped| mapped.address);
        let seen = ask(py, &runner, node.conditions(mapped))?.into();
        let device = Arc::new(device.clone());
        let pdo = |state| {
            let live = Some((Arc::clone(&self.shared), heard.clone(), network.clone()));
            Pdo { live, device: Arc::clone(&device), seen: Arc::clone(&seen), state }
        };
        Ok(sent.into_iter().map(pdo).collect())
    }

    /// Saves its parameters as a DCF; with `domains`, DOMAINs as well, in files beside it. Returns a sentence for
    /// everything that the node did not give. `progress` is called before each entry, with the step, the number of the
    /// entry, and their total.
    ///
    /// Raises NoAnswer, LinkFailed, and what `progress` raises; then nothing is saved.
    #[pyo3(signature = (path, domains = false, progress = None))]
    fn backup(&self, py: Python<'_>, path: PathBuf, domains: bool, progress: Call) -> PyResult<Vec<String>> {
        let (node, runner) = self.found()?;
        let mut backup = seen(py, &runner, progress, |runner, see| backup_node(&node, runner, domains, see))?;
        for (file, data) in backup.domain_files(&path.file_stem().unwrap_or_default().to_string_lossy()) {
            std::fs::write(path.with_file_name(file), data)?;
        }
        std::fs::write(path, backup.dcf())?;
        Ok(backup.left_out.iter().map(|(address, why)| format!("{address}: {why}")).collect())
    }

    /// Writes the parameters that differ from a DCF in the required order, and reads each back. The node is
    /// PRE-OPERATIONAL afterwards. With `store`, it stores them at the end; with `force`, it may be another product.
    ///
    /// Raises LexicanError if it is another device, before anything is written; and if it refuses anything, restarts or
    /// is gone, or `progress` raises. The text says what was written by then; the same call continues from there.
    #[pyo3(signature = (path, store = false, force = false, progress = None))]
    fn restore(&self, py: Python<'_>, path: PathBuf, store: bool, force: bool, progress: Call) -> PyResult<Restored> {
        let (node, runner) = self.found()?;
        let dcf = Sheet::load_unjudged(&path.to_string_lossy(), &[]).map_err(Raise::raise)?.device;
        let mut settings = configured(&dcf, node.id());
        settings.extend(files(&dcf, node.id(), path.parent().unwrap_or(Path::new(""))).map_err(wrong)?);
        let options = Options { store, ..Options::default() };
        let what = (&dcf, &settings);
        seen(py, &runner, progress, |runner, see| restore_node(&node, runner, what, options, force, see))
            .map(Restored::from)
    }

    fn __repr__(&self) -> String {
        format!("<Node {} at node-ID {}>", self.name, self.id)
    }
}

/// The events of a network's nodes: an iterator that waits.
#[pyclass(module = "lexican", frozen)]
pub(crate) struct Events {
    events: Arc<tokio::sync::Mutex<shell::Events>>,
    shared: Arc<Shared>,
}

#[pymethods]
impl Events {
    /// Waits for the next event, at most this many seconds by the time of the bus.
    #[pyo3(signature = (timeout = None))]
    fn next(&self, py: Python<'_>, timeout: Option<f64>) -> PyResult<Option<Event>> {
        let (network, runner) = self.shared.network()?;
        let timeout = timeout.map(seconds).transpose()?;
        let next = async { self.events.lock().await.next().await };
        Ok(ask(py, &runner, within(&network, timeout, next))?.map(Event::from))
    }

    fn __iter__(this: Py<Self>) -> Py<Self> {
        this
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Event>> {
        self.next(py, None)
    }
}

/// An event. Its text is one line.
#[pyclass(module = "lexican", frozen, str = "{text}")]
pub(crate) struct Event {
    /// The name of the node, or of the bus if it has one.
    #[pyo3(get)]
    node: Option<String>,
    /// One word: "booted-up", "booted", "failed", "ready", "state", "lost", "emergency", "pdo", "bus", "missed".
    #[pyo3(get)]
    pub(crate) what: &'static str,
    /// The error code of an emergency.
    #[pyo3(get)]
    code: Option<u16>,
    text: String,
    pdo: Vec<ValueReport>,
}

impl From<lexican_machine::Event> for Event {
    fn from(event: lexican_machine::Event) -> Self {
        let (text, what) = (event.to_string(), event.what.name());
        let (code, pdo) = match event.what {
            What::Emergency(emergency) => (Some(emergency.code.0), Vec::new()),
            What::Pdo(reports) => (None, reports),
            _ => (None, Vec::new()),
        };
        Event { node: event.node, what, code, text, pdo }
    }
}

#[pymethods]
impl Event {
    /// The values in a PDO, by the names of their entries.
    #[getter]
    fn values<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        by_name(py, self.pdo.clone())
    }

    fn __repr__(&self) -> String {
        format!("<Event {}>", self.text)
    }
}

/// A fault of a simulated device, for the duration of a `with`.
#[pyclass(module = "lexican", frozen)]
pub(crate) struct Fault {
    pub(crate) shared: Arc<Shared>,
    pub(crate) node: String,
    /// `None` for no power.
    pub(crate) fate: Option<Fate>,
}

impl Fault {
    fn turn(&self, on: bool) -> PyResult<()> {
        let Some(fate) = self.fate else {
            return self.shared.carry_out(&self.node, if on { "power off" } else { "power on" }).map(drop);
        };
        let it = (self.shared.machine()?.0.node(&self.node).map_err(Raise::raise)?.id(), fate);
        self.shared.with(|opened| {
            let mut faults = lock(&opened.simulation(&self.node)?.faults);
            match faults.iter().rposition(|other| *other == it) {
                Some(at) if !on => drop(faults.remove(at)),
                _ if on => faults.push(it),
                _ => {}
            }
            Ok(())
        })
    }
}

#[pymethods]
impl Fault {
    fn __enter__(&self, py: Python<'_>) -> PyResult<()> {
        py.detach(|| self.turn(true))
    }

    #[pyo3(signature = (*_exception))]
    fn __exit__(&self, py: Python<'_>, _exception: &Bound<'_, PyTuple>) -> PyResult<()> {
        py.detach(|| self.turn(false))
    }
}
