//! Drives of CiA 402.

use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;

use lexican_machine::{MachineError, tokio as shell};
use lexican_toolbox::drive::{Ending, Order};
use pyo3::prelude::*;

use crate::error::{Closed, OrRaise, also};
use crate::slot::{Slot, stopped};
use crate::value::words;
use crate::wait::{seconds, wait};

type Doing<'a, T> = Pin<Box<dyn Future<Output = Result<T, MachineError>> + Send + 'a>>;

/// A drive of CiA 402. Positions and velocities are texts with a unit, "50 mm", or numbers as the drive counts.
///
/// A call that Ctrl-C, or another signal whose handler raises, ends, stops the drive and waits until it stands; so do `close()`,
/// the end of a `with`, and the end of the interpreter. One that is collected as garbage while it may be moving is sent a stop,
/// and standard error says so.
#[pyclass(module = "lexican", frozen, weakref)]
pub(crate) struct Drive {
    slot: Arc<Slot>,
    name: String,
    node: Py<PyAny>,
}

impl Drive {
    pub(crate) fn new(slot: Arc<Slot>, name: &str, node: Py<PyAny>) -> Self {
        Drive { slot, name: name.to_owned(), node }
    }

    /// Carries something out; it is stopped when a signal or another thread ends that.
    fn call<T: Send>(
        &self,
        py: Python<'_>,
        order: impl for<'a> FnOnce(&'a mut shell::Drive) -> Doing<'a, T>,
    ) -> PyResult<T> {
        let mut slot = wait(py, &self.slot.runner, Arc::clone(&self.slot.drive).lock_owned())?;
        let drive = slot.as_mut().ok_or_else(|| Closed::new_err("the drive was closed"))?;
        let done = wait(py, &self.slot.runner, self.slot.stop.unless_stopped(order(drive.inner())));
        match done {
            Ok(Some(done)) => done.or_raise(),
            Ok(None) => Err(py.detach(|| stopped(drive, &self.slot.stop))).or_raise(),
            Err(signal) => {
                let ended = py.detach(|| stopped(drive, &self.slot.stop));
                Err(also(py, signal, &ended.to_string()))
            }
        }
    }

    fn carry_out(&self, py: Python<'_>, order: Order) -> PyResult<Outcome> {
        self.call(py, |drive| Box::pin(drive.carry_out(order, None))).map(Outcome::from)
    }
}

#[pymethods]
impl Drive {
    /// The node that it is.
    #[getter]
    fn node(&self, py: Python<'_>) -> Py<PyAny> {
        self.node.clone_ref(py)
    }

    /// The state of its state machine: "OPERATION ENABLED".
    fn state(&self, py: Python<'_>) -> PyResult<String> {
        self.call(py, |drive| Box::pin(async { Ok(drive.state().await?.to_string()) }))
    }

    /// Where it is, as it counts (6064h).
    fn position(&self, py: Python<'_>) -> PyResult<i32> {
        self.call(py, |drive| Box::pin(async { Ok(drive.position().await?) }))
    }

    /// How fast it is, as it counts (606Ch).
    fn velocity(&self, py: Python<'_>) -> PyResult<i32> {
        self.call(py, |drive| Box::pin(async { Ok(drive.velocity().await?) }))
    }

    /// Leads it to OPERATION ENABLED: it has torque, and nothing moves.
    ///
    /// Raises DriveError without supply, say.
    fn enable(&self, py: Python<'_>) -> PyResult<Outcome> {
        self.carry_out(py, Order::Enable)
    }

    /// Stops it, then takes its torque away.
    fn disable(&self, py: Python<'_>) -> PyResult<Outcome> {
        self.carry_out(py, Order::Disable)
    }

    /// Resets a fault.
    ///
    /// Raises DriveError when its cause is still there.
    fn reset_fault(&self, py: Python<'_>) -> PyResult<Outcome> {
        self.carry_out(py, Order::ResetFault)
    }

    /// Travels to a position, and waits for the end.
    ///
    /// Raises DriveError with every condition that is not met; nothing has moved then.
    fn move_to(&self, py: Python<'_>, position: &Bound<'_, PyAny>) -> PyResult<Outcome> {
        let position = words(position)?;
        self.call(py, |drive| Box::pin(async move { drive.move_to(&position).await })).map(Outcome::from)
    }

    /// Starts to travel; `finish()` waits for the end.
    fn start_moving_to(&self, py: Python<'_>, position: &Bound<'_, PyAny>) -> PyResult<()> {
        let position = words(position)?;
        self.call(py, |drive| Box::pin(async move { drive.start_moving_to(&position).await }))
    }

    /// Waits until the travel under way is over.
    fn finish(&self, py: Python<'_>) -> PyResult<Outcome> {
        self.call(py, |drive| Box::pin(async { Ok(Ending::from(drive.finish().await?)) })).map(Outcome::from)
    }

    /// Runs at a velocity for a time in seconds, and stops.
    fn run_at(&self, py: Python<'_>, velocity: &Bound<'_, PyAny>, lasting: f64) -> PyResult<Outcome> {
        let (velocity, lasting) = (words(velocity)?, seconds(lasting)?);
        self.call(py, |drive| Box::pin(async move { drive.run_at(&velocity, lasting).await })).map(Outcome::from)
    }

    /// Finds the reference point, by a method of 6098h or the one that it is set to.
    #[pyo3(signature = (method = None))]
    fn home(&self, py: Python<'_>, method: Option<i8>) -> PyResult<Outcome> {
        self.carry_out(py, Order::Home(method))
    }

    /// Stops what moves, with the programmed deceleration; `resume()` goes on.
    fn stop(&self, py: Python<'_>) -> PyResult<Outcome> {
        self.carry_out(py, Order::Stop)
    }

    /// Stops what moves, with full deceleration.
    fn quick_stop(&self, py: Python<'_>) -> PyResult<Outcome> {
        self.carry_out(py, Order::QuickStop)
    }

    /// Goes on with a travel that is interrupted.
    fn resume(&self, py: Python<'_>) -> PyResult<Outcome> {
        self.carry_out(py, Order::Resume)
    }

    /// Ends the call that another thread has made, which raises DriveError once the drive stands. Returns at once.
    fn cancel(&self) {
        self.slot.stop.stop();
    }

    /// Stops it, if it may be moving, waits until it stands, and lets it go.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        py.detach(|| self.slot.end())
    }

    fn __enter__(this: Py<Self>) -> Py<Self> {
        this
    }

    #[pyo3(signature = (*_exception))]
    fn __exit__(&self, py: Python<'_>, _exception: &Bound<'_, pyo3::types::PyTuple>) -> PyResult<()> {
        self.close(py)
    }

    fn __repr__(&self) -> String {
        format!("<Drive {}>", self.name)
    }
}

/// How an order has ended. It is true if the order has been carried out.
#[pyclass(module = "lexican", frozen, str = "{text}")]
pub(crate) struct Outcome {
    /// One word: "reached", "blocked", "fault".
    #[pyo3(get)]
    word: &'static str,
    /// What to do about it.
    #[pyo3(get)]
    remedy: Option<&'static str>,
    is_success: bool,
    text: String,
}

impl From<Ending> for Outcome {
    fn from(ending: Ending) -> Self {
        let (word, remedy, is_success) = (ending.word(), ending.remedy(), ending.is_success());
        let what_to_do = remedy.map(|remedy| format!("; {remedy}")).unwrap_or_default();
        Outcome { word, remedy, is_success, text: format!("{ending}{what_to_do}") }
    }
}

#[pymethods]
impl Outcome {
    fn __bool__(&self) -> bool {
        self.is_success
    }

    fn __repr__(&self) -> String {
        format!("<Outcome {}>", self.word)
    }
}
