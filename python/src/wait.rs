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

/// Drops a value without the interpreter's lock: dropping a network waits for its thread, which may wait for that lock.
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
        // After the end of the interpreter, there is nothing to attach to.
        let _ = Python::try_attach(|py| py.detach(|| drop(it)));
    }
}

/// Runs a network. Each waiting call has a clone, so that the network cannot end before it.
pub(crate) type Run = Arc<Unlocked<Runner>>;

/// The interval of checking for Ctrl-C.
pub(crate) const SLICE: WallTime = WallTime::from_millis(50);

/// Runs a network until `future` is done, while other Python threads run. If the handler of a signal raises, as that of
/// Ctrl-C does, the future is dropped.
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

/// The same; raises errors as exceptions.
pub(crate) fn ask<T: Send, E: Raise + Send>(
    py: Python<'_>,
    runner: &Runner,
    future: impl Future<Output = Result<T, E>> + Send,
) -> PyResult<T> {
    wait(py, runner, future)?.map_err(Raise::raise)
}

/// The result of a future; `None` after `timeout`, by the time of the bus.
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

/// Parses a time in seconds.
pub(crate) fn seconds(seconds: f64) -> PyResult<Duration> {
    if !(0.0..1e12).contains(&seconds) {
        return Err(PyValueError::new_err(format!("{seconds} s is no time to wait")));
    }
    Ok(Duration::from_micros((seconds * 1e6).round() as u64))
}

/// Locks a mutex and ignores poisoning: its contents are replaced as a whole, so they are consistent.
pub(crate) fn lock<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
