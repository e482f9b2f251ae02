//! Waiting without the interpreter's lock.

use std::future::Future;
use std::ops::Deref;
use std::pin::pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration as WallTime;

use lexican_runtime::Duration;
use lexican_runtime::host::LinkError;
use lexican_runtime::host::tokio::{Network, Runner};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::error::Raise;

/// What is dropped without the interpreter's lock: a network's thread, which its end waits for, may wait for that lock.
pub(crate) struct Unlocked<T: Send>(Option<T>);

impl<T: Send> Unlocked<T> {
    pub(crate) const fn new(it: T) -> Self {
        Unlocked(Some(it))
    }
}

impl<T: Send> Deref for Unlocked<T> {
    type Target = T;

    fn deref(&self) -> &T {
        self.0.as_ref().expect("it is not dropped yet")
    }
}

impl<T: Send> Drop for Unlocked<T> {
    fn drop(&mut self) {
        let it = self.0.take();
        // There is no interpreter any more when it ends.
        let _ = Python::try_attach(|py| py.detach(|| drop(it)));
    }
}

/// Runs a network. Each call that waits has a clone, so that the network cannot end before it.
pub(crate) type Run = Arc<Unlocked<Runner>>;

/// How soon Ctrl-C is noticed.
pub(crate) const SLICE: WallTime = WallTime::from_millis(50);

/// Runs a network until `future` is done, while other threads of Python go on. A signal whose handler raises, as that of Ctrl-C
/// does, drops the future.
pub(crate) fn wait<T: Send>(py: Python<'_>, runner: &Runner, future: impl Future<Output = T> + Send) -> PyResult<T> {
    let mut future = pin!(future);
    loop {
        let slice = async {
            tokio::select! {
                biased;
                done = &mut future => Some(done),
                () = tokio::time::sleep(SLICE) => None,
            }
        };
        match py.detach(|| runner.block_on(slice)) {
            Some(done) => return Ok(done),
            None => py.check_signals()?,
        }
    }
}

/// As [`wait`]; an error is raised as an exception.
pub(crate) fn ask<T: Send, E: Raise + Send>(
    py: Python<'_>,
    runner: &Runner,
    future: impl Future<Output = Result<T, E>> + Send,
) -> PyResult<T> {
    wait(py, runner, future)?.map_err(Raise::raise)
}

/// What a future returns; `None` if that takes longer than `timeout`, by the time of the bus.
pub(crate) async fn within<T>(
    network: &Network,
    timeout: Option<Duration>,
    next: impl Future<Output = Option<T>>,
) -> Result<Option<T>, LinkError> {
    let Some(timeout) = timeout else { return Ok(next.await) };
    let until = network.now().await? + timeout;
    tokio::select! {
        biased;
        event = next => Ok(event),
        over = network.sleep_until(until) => over.map(|_| None),
    }
}

/// A time in seconds, as Python counts.
pub(crate) fn seconds(seconds: f64) -> PyResult<Duration> {
    if !(0.0..1e12).contains(&seconds) {
        return Err(PyValueError::new_err(format!("{seconds} s is no time to wait")));
    }
    Ok(Duration::from_micros((seconds * 1e6).round() as u64))
}

/// A lock whose holder may have panicked: what it holds is put in place as one.
pub(crate) fn lock<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
