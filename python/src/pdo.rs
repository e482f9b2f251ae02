//! The PDOs of a node: the last values with their age, and decoding of many frames at once.

use std::borrow::Cow;
use std::path::PathBuf;
use std::sync::Arc;

use lexican_eds::model::{Device, Mapped, Value as Known};
use lexican_machine::Heard;
use lexican_runtime::host::tokio as shell;
use lexican_runtime::object::Address;
use lexican_runtime::{Frame, Instant, manager};
use lexican_toolbox::decode::columns::{Column, Numbers, of_log, word};
use lexican_toolbox::decode::content;
use lexican_toolbox::log::Reader;
use lexican_toolbox::pdo::PdoState;
use lexican_toolbox::values::DeviceValues;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyByteArray, PyBytes, PyDict, PyMemoryView};
use tokio::sync::broadcast::error::RecvError;

use crate::error::wrong;
use crate::opened::Shared;
use crate::value::by_name;
use crate::wait::{ask, seconds, within};

/// A PDO as in its data sheet or the machine's file.
#[pyclass(module = "lexican", frozen)]
pub(crate) struct Pdo {
    /// Where it is received; `None` for a PDO of a data sheet alone.
    pub(crate) live: Option<(Arc<Shared>, Heard, shell::Network)>,
    pub(crate) device: Arc<Device>,
    /// The values on which its units depend.
    pub(crate) seen: Arc<[(Address, i128)]>,
    pub(crate) state: PdoState,
}

impl Pdo {
    fn live(&self) -> PyResult<&(Arc<Shared>, Heard, shell::Network)> {
        self.live.as_ref().ok_or_else(|| wrong("a PDO of a data sheet is on no bus: network.node(5).pdos()"))
    }

    fn seen(&self) -> DeviceValues<'_> {
        let mut values = DeviceValues::new(&self.device);
        self.seen.iter().for_each(|(address, number)| values.set(*address, &Known::Integer(*number)));
        values
    }

    fn values<'py>(&self, py: Python<'py>, frame: &Frame) -> PyResult<Bound<'py, PyDict>> {
        let mapped = self.state.mapping.iter();
        let mapped = mapped.map(|it| Mapped { index: it.address.index(), sub: it.address.sub(), bits: it.bits });
        by_name(py, content(&mut self.seen(), &mapped.collect::<Vec<_>>(), frame.data()))
    }
}

#[pymethods]
impl Pdo {
    /// `TPDO1`.
    #[getter]
    fn name(&self) -> String {
        self.state.name.to_string()
    }

    /// The COB-ID for this node.
    #[getter]
    fn cob_id(&self) -> u32 {
        self.state.cob_id.id().raw()
    }

    /// The units of the numbers from `decode`, by the names of the entries; `None` for entries without unit.
    #[getter]
    fn units<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let columns = Column::of_pdo(&self.seen(), &self.state);
        columns.into_iter().map(|column| (column.name, column.unit)).into_py_dict(py)
    }

    /// The last values by the names of their entries, and their age in seconds; `None` if none were received. They may
    /// be outdated: a PDO may be lost, or its node off.
    fn latest<'py>(&self, py: Python<'py>) -> PyResult<Option<(Bound<'py, PyDict>, f64)>> {
        let (shared, heard, network) = self.live()?;
        let (_, runner) = shared.network()?;
        let Some((at, frame)) = heard.latest(self.state.cob_id.id()) else { return Ok(None) };
        let now = ask(py, &runner, network.now())?;
        Ok(Some((self.values(py, &frame)?, now.since(at).as_secs_f64())))
    }

    /// Waits for the next PDO from now on, at most `timeout` seconds by the time of the bus; `None` if none came.
    #[pyo3(signature = (timeout = None))]
    fn next<'py>(&self, py: Python<'py>, timeout: Option<f64>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let (shared, _, network) = self.live()?;
        let (_, runner) = shared.network()?;
        let (mut events, id) = (network.events(), self.state.cob_id.id());
        let next = async {
            loop {
                match events.recv().await {
                    Ok(shell::Event::Manager(manager::Event::Pdo { frame, .. })) if frame.id() == id => {
                        return Some(frame);
                    }
                    Err(RecvError::Closed) => return None,
                    _ => {}
                }
            }
        };
        let frame = ask(py, &runner, within(network, timeout.map(seconds).transpose()?, next))?;
        frame.map(|frame| self.values(py, &frame)).transpose()
    }

    /// Decodes many frames at once to a memoryview of numbers for each entry, by name; numpy and pandas accept these
    /// without conversion. Numbers are floats in the unit given by `units`, or counts of the device.
    ///
    /// `frames` is the path of a log in any format, from which the PDO's own frames are taken (then "time" has their
    /// times in seconds); a buffer with 8 bytes per frame, such as a numpy array; or an iterable of bytes. Frames in a
    /// log that are shorter than the mapping are left out, as receivers ignore them.
    ///
    /// Raises LexicanError if the log cannot be read; ValueError if a buffer has a wrong length or a frame too few bytes.
    fn decode<'py>(&self, py: Python<'py>, frames: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyDict>> {
        let decoded = PyDict::new(py);
        let words = if let Ok(path) = frames.extract::<PathBuf>() {
            let of_log = || of_log(Reader::open(&path, None)?, &self.state);
            let (times, words) = py.detach(of_log).map_err(wrong)?;
            let times = times.iter().map(|at| at.since(Instant::ZERO).as_secs_f64()).collect();
            decoded.set_item("time", array(py, Numbers::Reals(times))?)?;
            words
        } else if let Some(view) = PyMemoryView::from(frames).ok().filter(|view| !has(view, "format", "O")) {
            let bytes = view.call_method0("tobytes")?.cast_into::<PyBytes>()?;
            let no_frames = || PyValueError::new_err("a buffer of frames has 8 bytes for each");
            let is_whole = has(&view, "itemsize", 1) || has(&view, "itemsize", 8);
            let (frames, []) = bytes.as_bytes().as_chunks::<8>() else { return Err(no_frames()) };
            let frames = Some(frames).filter(|_| is_whole).ok_or_else(no_frames)?;
            py.detach(|| frames.iter().copied().map(u64::from_le_bytes).collect())
        } else {
            let needed = self.state.bits().div_ceil(8) as usize;
            let frames = frames.try_iter()?.enumerate().map(|(at, frame)| {
                let frame = frame?;
                let data = frame.extract::<Cow<'_, [u8]>>()?;
                let short = || format!("frame {at} has {} bytes, and {} has {needed}", data.len(), self.state.name);
                if data.len() < needed { Err(PyValueError::new_err(short())) } else { Ok(word(&data)) }
            });
            frames.collect::<PyResult<Vec<_>>>()?
        };
        let columns = Column::of_pdo(&self.seen(), &self.state);
        let numbers: Vec<_> = py.detach(|| columns.iter().map(|column| column.numbers(&words)).collect());
        for (column, numbers) in columns.into_iter().zip(numbers) {
            decoded.set_item(column.name, array(py, numbers)?)?;
        }
        Ok(decoded)
    }

    fn __repr__(&self) -> String {
        format!("<Pdo {} at {:X}h>", self.state.name, self.cob_id())
    }
}

/// Whether an attribute of a buffer has this value. References to objects cannot be bytes of frames.
fn has<'py>(view: &Bound<'py, PyMemoryView>, attribute: &str, is: impl IntoPyObject<'py>) -> bool {
    view.getattr(attribute).is_ok_and(|it| it.eq(is).unwrap_or_default())
}

/// Numbers as an array that Python can share.
fn array(py: Python<'_>, numbers: Numbers) -> PyResult<Bound<'_, PyAny>> {
    let fill = |numbers: &mut dyn ExactSizeIterator<Item = [u8; 8]>| {
        PyByteArray::new_with(py, 8 * numbers.len(), |bytes| {
            bytes.as_chunks_mut::<8>().0.iter_mut().zip(numbers).for_each(|(to, number)| *to = number);
            Ok(())
        })
    };
    let (format, bytes) = match numbers {
        Numbers::Integers(all) => ("q", fill(&mut all.into_iter().map(i64::to_ne_bytes))),
        Numbers::Unsigned(all) => ("Q", fill(&mut all.into_iter().map(u64::to_ne_bytes))),
        Numbers::Reals(all) => ("d", fill(&mut all.into_iter().map(f64::to_ne_bytes))),
    };
    PyMemoryView::from(bytes?.as_any())?.call_method1("cast", (format,))
}
