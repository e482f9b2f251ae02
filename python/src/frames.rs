//! Raw frames, for python-can in both directions.

use std::io;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, TryRecvError, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration as WallTime, Instant as WallInstant};

use lexican_machine::BoxedLink;
use lexican_runtime::host::{Incoming, Link, LinkError, Pace};
use lexican_runtime::{CobId, Duration, Frame, Instant};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::error::{Closed, Raise};
use crate::opened::{Shared, bus_url};
use crate::wait::{SLICE, Unlocked, lock, seconds};

/// How long to wait for a frame before looking for frames to send.
const LISTENING: Duration = Duration::from_millis(1);

/// A frame; with `length`, a remote frame.
pub(crate) fn frame(id: u32, is_extended: bool, data: &[u8], length: Option<u8>) -> PyResult<Frame> {
    let cob_id = match is_extended {
        true => CobId::extended(id),
        false => u16::try_from(id).ok().and_then(CobId::standard),
    };
    let frame = cob_id.and_then(|id| match length {
        Some(length) => Frame::remote(id, length),
        None => Frame::new(id, data),
    });
    let wrong = || format!("CAN has no frame with the identifier {id:X}h and {} bytes", data.len());
    frame.ok_or_else(|| PyValueError::new_err(wrong()))
}

/// A bus frame by frame, for python-can's interface `lexican`. A thread owns the link.
#[pyclass(module = "lexican", frozen)]
pub(crate) struct Frames {
    outgoing: Mutex<Option<Sender<Frame>>>,
    incoming: Mutex<Receiver<Result<(f64, Frame), LinkError>>>,
    /// Kept alive if the bus is simulated.
    _simulation: Option<Arc<Shared>>,
}

impl Frames {
    pub(crate) fn over(link: BoxedLink, simulation: Option<Arc<Shared>>) -> PyResult<Self> {
        let (outgoing, asked) = channel();
        let (received, incoming) = channel();
        std::thread::Builder::new().spawn(move || carry(link, &asked, &received))?;
        Ok(Frames { outgoing: Mutex::new(Some(outgoing)), incoming: Mutex::new(incoming), _simulation: simulation })
    }
}

/// Sends requested frames and passes on received ones, until the other side is dropped.
fn carry(mut link: BoxedLink, asked: &Receiver<Frame>, received: &Sender<Result<(f64, Frame), LinkError>>) {
    loop {
        let sent = loop {
            match asked.try_recv() {
                Ok(frame) => match link.send(&frame) {
                    Ok(()) => {}
                    Err(error) => break Err(error),
                },
                Err(TryRecvError::Empty) => break Ok(()),
                Err(TryRecvError::Disconnected) => return,
            }
        };
        let until = link.now() + LISTENING;
        let outcome = match sent.and_then(|()| link.receive(until)) {
            Ok(Some(Incoming::Frame(frame))) => Ok((unix_time(), frame)),
            Ok(_) => continue,
            Err(error) => Err(error),
        };
        let is_final = outcome.as_ref().is_err_and(LinkError::is_final);
        if received.send(outcome).is_err() || is_final {
            return;
        }
    }
}

#[expect(clippy::disallowed_methods, reason = "for programs that ask the wall for the time")]
pub(crate) fn unix_time() -> f64 {
    std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).map_or(0.0, |time| time.as_secs_f64())
}

#[pymethods]
impl Frames {
    /// The bus of a URL; simulated devices run in real time.
    #[new]
    fn new(py: Python<'_>, url: &str) -> PyResult<Self> {
        let (link, simulation) = py.detach(|| Shared::lone_link(&bus_url(url)?, Pace::RealTime))?;
        Frames::over(link, simulation)
    }

    /// Sends a frame; with `length`, a remote frame.
    #[pyo3(signature = (id, extended, data, length = None))]
    fn send(&self, id: u32, extended: bool, data: Vec<u8>, length: Option<u8>) -> PyResult<()> {
        let frame = frame(id, extended, &data, length)?;
        let outgoing = lock(&self.outgoing);
        let sent = outgoing.as_ref().map(|outgoing| outgoing.send(frame));
        sent.and_then(Result::ok).ok_or_else(|| Closed::new_err("the bus is gone, or was closed"))
    }

    /// Waits for a frame for at most `timeout` seconds: its Unix time, its identifier, whether that has 29 bits,
    /// whether it is a remote frame, its length, its data.
    #[pyo3(signature = (timeout = None))]
    fn receive<'py>(&self, py: Python<'py>, timeout: Option<f64>) -> PyResult<Option<Received<'py>>> {
        let mut left = timeout.map(seconds).transpose()?.map(|left| WallTime::from_micros(left.as_micros()));
        loop {
            let slice = left.map_or(SLICE, |left| left.min(SLICE));
            match py.detach(|| lock(&self.incoming).recv_timeout(slice)) {
                Ok(received) => {
                    let (time, frame) = received.map_err(Raise::raise)?;
                    let (id, data) = (frame.id(), PyBytes::new(py, frame.data()));
                    return Ok(Some((time, id.raw(), id.is_extended(), frame.is_remote(), frame.dlc(), data)));
                }
                Err(RecvTimeoutError::Disconnected) => return Err(Closed::new_err("the bus is gone, or was closed")),
                Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            }
            left = left.map(|left| left - slice);
            if left.is_some_and(|left| left.is_zero()) {
                return Ok(None);
            }
        }
    }

    /// Closes the bus.
    fn close(&self) {
        lock(&self.outgoing).take();
    }
}

type Received<'py> = (f64, u32, bool, bool, u8, Bound<'py, PyBytes>);

/// A link over a bus of python-can. A thread receives from it.
pub(crate) struct PythonLink {
    bus: Py<PyAny>,
    /// The module `lexican.can`, which creates python-can's messages.
    can: Py<PyModule>,
    incoming: Receiver<Result<Frame, LinkError>>,
    began: WallInstant,
    _receiving: Unlocked<Receiving>,
}

/// The receiving thread, joined on drop: no thread may be inside Python when the interpreter ends.
struct Receiving(Option<(Arc<()>, JoinHandle<()>)>);

impl Drop for Receiving {
    fn drop(&mut self) {
        if let Some((open, thread)) = self.0.take() {
            drop(open);
            // A panic of the thread has been reported already.
            let _ = thread.join();
        }
    }
}

impl PythonLink {
    #[expect(clippy::disallowed_methods, reason = "a bus has the time of the wall")]
    pub(crate) fn over(bus: &Bound<'_, PyAny>) -> PyResult<Self> {
        let py = bus.py();
        for method in ["recv", "send"] {
            if !bus.hasattr(method)? {
                let what = format!("a network is over a URL or a bus of python-can, and not over {}", bus.repr()?);
                return Err(PyTypeError::new_err(what));
            }
        }
        let can = py.import("lexican.can")?.unbind();
        let (received, incoming) = channel();
        let receiver = (can.clone_ref(py), bus.clone().unbind());
        let open = Arc::new(());
        let is_open = Arc::downgrade(&open);
        let thread = std::thread::Builder::new()
            .spawn(move || while is_open.strong_count() > 0 && receive(&receiver, &received) {})?;
        let (bus, _receiving) = (bus.clone().unbind(), Unlocked::new(Receiving(Some((open, thread)))));
        Ok(PythonLink { bus, can, incoming, began: WallInstant::now(), _receiving })
    }
}

/// Passes on one frame; returns whether to continue.
fn receive((can, bus): &(Py<PyModule>, Py<PyAny>), received: &Sender<Result<Frame, LinkError>>) -> bool {
    let read = |py: Python<'_>| {
        let fields = can.bind(py).call_method1("receive", (bus,))?;
        let fields: Option<(u32, bool, Vec<u8>, Option<u8>)> = fields.extract()?;
        fields.map(|(id, is_extended, data, length)| frame(id, is_extended, &data, length)).transpose()
    };
    match Python::try_attach(read) {
        Some(Ok(Some(frame))) => received.send(Ok(frame)).is_ok(),
        Some(Ok(None)) => true,
        Some(Err(error)) => {
            let _ = received.send(Err(io::Error::other(error.to_string()).into()));
            false
        }
        // The interpreter has ended.
        None => false,
    }
}

impl Link for PythonLink {
    fn now(&self) -> Instant {
        Instant::from_micros(u64::try_from(self.began.elapsed().as_micros()).unwrap_or(u64::MAX))
    }

    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        let send = |py: Python<'_>| {
            let (id, data) = (frame.id(), PyBytes::new(py, frame.data()));
            let fields = (&self.bus, id.raw(), id.is_extended(), frame.is_remote(), frame.dlc(), data);
            self.can.bind(py).call_method1("send", fields).map(drop)
        };
        match Python::try_attach(send) {
            Some(sent) => sent.map_err(|error: PyErr| io::Error::other(error.to_string()).into()),
            None => Err(LinkError::Closed),
        }
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        let left = WallTime::from_micros(until.since(self.now()).as_micros());
        match self.incoming.recv_timeout(left) {
            Ok(frame) => frame.map(|frame| Some(Incoming::Frame(frame))),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(LinkError::Closed),
        }
    }

    fn is_real_time(&self) -> bool {
        true
    }
}
