//! Drives of CiA 402, and how they are stopped when they are closed.

use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;

use lexican_driver::shared::{self, StopHandle};
use lexican_driver::{Any, Error};
use lexican_machine::{MachineError, tokio as shell};
use lexican_runtime::host::tokio::Runner;
use lexican_toolbox::drive::{Ending, Order};
use pyo3::prelude::*;
use tokio::sync::Mutex;

use crate::error::{Closed, Raise, also};
use crate::value::words;
use crate::wait::{Run, Unlocked, seconds, wait};

type Doing<'a, T> = Pin<Box<dyn Future<Output = Result<T, MachineError>> + Send + 'a>>;

/// A drive of CiA 402. Positions and velocities are texts with a unit, "50 mm", or numbers in counts of the drive.
///
/// If Ctrl-C, or another signal whose handler raises, ends a call, the drive is stopped, and the call waits for its
/// standstill; so do `close()`, the end of a `with`, and the end of the interpreter. If the drive is collected as
/// garbage while it may be moving, it is sent a stop, and standard error says so.
#[pyclass(module = "lexican", frozen, weakref)]
pub(crate) struct Drive {
    pub(crate) slot: Arc<Slot>,
    pub(crate) name: String,
    /// The node of the drive.
    #[pyo3(get)]
    pub(crate) node: Py<PyAny>,
}

impl Drive {
    /// Carries out an operation. If a signal or another thread ends it, the drive is stopped.
    fn call<T: Send>(
        &self,
        py: Python<'_>,
        order: impl for<'a> FnOnce(&'a mut shell::Drive) -> Doing<'a, T>,
    ) -> PyResult<T> {
        let mut slot = wait(py, &self.slot.runner, Arc::clone(&self.slot.drive).lock_owned())?;
        let drive = slot.as_mut().ok_or_else(|| Closed::new_err("the drive was closed"))?;
        let done = wait(py, &self.slot.runner, self.slot.stop.unless_stopped(order(drive.inner())));
        match done {
            Ok(Some(done)) => done.map_err(Raise::raise),
            Ok(None) => Err(py.detach(|| stopped(drive, &self.slot.stop)).raise()),
            Err(signal) => {
                let ended = py.detach(|| stopped(drive, &self.slot.stop));
                Err(also(py, signal, &ended.to_string()))
            }
        }
    }
}

/// The methods of a drive: first a row for each order, with its arguments in Python's types, then the others.
macro_rules! drive {
    ({$(
        $(#[$attribute:meta])*
        $name:ident($($word:ident: $taken:ty $(= $argument:expr)?),*) -> $end:ty = |$drive:ident| $order:expr;
    )*} $($other:tt)*) => {
        #[pymethods]
        impl Drive {
            $($(#[$attribute])*
            fn $name(&self, py: Python<'_>, $($word: $taken),*) -> PyResult<$end> {
                $($(let $word = $argument;)?)*
                self.call(py, |$drive| Box::pin(async move { Ok($order) })).map(<$end>::from)
            })*
            $($other)*
        }
    };
}

drive! {
    {
        /// The state of CiA 402: "OPERATION ENABLED".
        state() -> String = |drive| drive.state().await?.to_string();
        /// The position in counts of the drive (6064h).
        position() -> i32 = |drive| drive.position().await?;
        /// The velocity in counts of the drive (606Ch).
        velocity() -> i32 = |drive| drive.velocity().await?;
        /// Enables it (OPERATION ENABLED): it has torque, and nothing moves.
        ///
        /// Raises DriveError, for example without supply.
        enable() -> Outcome = |drive| drive.carry_out(Order::Enable, None).await?;
        /// Stops it, then disables it.
        disable() -> Outcome = |drive| drive.carry_out(Order::Disable, None).await?;
        /// Resets a fault.
        ///
        /// Raises DriveError if the cause is still there.
        reset_fault() -> Outcome = |drive| drive.carry_out(Order::ResetFault, None).await?;
        /// Moves to a position, and waits for the end.
        ///
        /// Raises DriveError with every condition that is not met; then nothing has moved.
        move_to(position: &Bound<'_, PyAny> = words(position)?) -> Outcome = |drive| drive.move_to(&position).await?;
        /// Starts to move to a position; `finish()` waits for the end.
        start_moving_to(position: &Bound<'_, PyAny> = words(position)?) -> () =
            |drive| drive.start_moving_to(&position).await?;
        /// Waits for the end of the current motion.
        finish() -> Outcome = |drive| Ending::from(drive.finish().await?);
        /// Runs at a velocity for a time in seconds, then stops.
        run_at(velocity: &Bound<'_, PyAny> = words(velocity)?, lasting: f64 = seconds(lasting)?) -> Outcome =
            |drive| drive.run_at(&velocity, lasting).await?;
        /// Homes it, by a method of 6098h or the one that is set.
        #[pyo3(signature = (method = None))]
        home(method: Option<i8>) -> Outcome = |drive| drive.carry_out(Order::Home(method), None).await?;
        /// Stops it with the programmed deceleration; `resume()` continues.
        stop() -> Outcome = |drive| drive.carry_out(Order::Stop, None).await?;
        /// Stops it with full deceleration.
        quick_stop() -> Outcome = |drive| drive.carry_out(Order::QuickStop, None).await?;
        /// Continues an interrupted motion.
        resume() -> Outcome = |drive| drive.carry_out(Order::Resume, None).await?;
    }

    /// Cancels a call in another thread, which raises DriveError once the drive stands still. Returns at once.
    fn cancel(&self) {
        self.slot.stop.stop();
    }

    /// Stops it if it may be moving, waits for its standstill, and releases it.
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

/// The end of an order. True if the order has been carried out.
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

type Described = shared::Drive<Any, shell::Drive>;

/// Holds the drive until it is closed.
pub(crate) struct Slot {
    pub(crate) drive: Unlocked<Arc<Mutex<Option<Described>>>>,
    pub(crate) runner: Run,
    pub(crate) stop: StopHandle,
}

impl Slot {
    pub(crate) fn new(drive: shell::Drive, runner: Run) -> Self {
        let stop = StopHandle::default();
        let drive = shared::Drive::new(drive, Runner::clone(&runner), stop.clone());
        Slot { drive: Unlocked::new(Arc::new(Mutex::new(Some(drive)))), runner, stop }
    }

    /// Stops it if it may be moving, waits for its standstill, and releases it.
    pub(crate) fn end(&self) -> PyResult<()> {
        self.stop.stop();
        let drive = self.runner.block_on(self.drive.lock()).take();
        match drive.map(|mut drive| stopped(&mut drive, &self.stop)) {
            None | Some(MachineError::Drive(Error::Cancelled { .. })) => Ok(()),
            Some(error) => Err(error.raise()),
        }
    }
}

/// Stops a drive that may be moving, and waits for its standstill; returns the error to raise.
pub(crate) fn stopped(drive: &mut Described, stop: &StopHandle) -> MachineError {
    stop.stop();
    let nothing: Result<(), MachineError> = drive.call(async |_| std::future::pending().await);
    nothing.expect_err("what has no end was cancelled")
}
