//! Calls Python functions when events happen.

use std::sync::{Arc, Mutex};
use std::thread::{JoinHandle, spawn};

use lexican_machine::tokio as shell;
use pyo3::prelude::*;
use tokio::sync::oneshot;

use crate::wait::lock;

/// Threads that may still be inside a Python function: they are joined before the interpreter ends.
pub(crate) static LEFT: Mutex<Vec<JoinHandle<()>>> = Mutex::new(Vec::new());

/// The thread that calls a function; it ends when this is dropped.
pub(crate) struct Callback {
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
    failed: Arc<Mutex<Option<PyErr>>>,
}

impl Callback {
    /// Calls a function with the result of `of` for each event.
    pub(crate) fn new<E: for<'py> IntoPyObject<'py> + Send>(
        mut events: shell::Events,
        of: impl Fn(lexican_machine::Event) -> Option<E> + Send + 'static,
        function: Py<PyAny>,
    ) -> PyResult<Self> {
        // It only waits for events that others receive, so it needs no timers.
        let waiting = tokio::runtime::Builder::new_current_thread().build()?;
        let (stop, mut stopped) = oneshot::channel();
        let failed = Arc::new(Mutex::new(None));
        let first = Arc::clone(&failed);
        let thread = spawn(move || {
            let mut next = async || {
                tokio::select! {
                    biased;
                    event = events.next() => event,
                    _ = &mut stopped => None,
                }
            };
            while let Some(event) = waiting.block_on(next()) {
                let Some(event) = of(event) else { continue };
                // After the end of the interpreter, there is nothing to attach to.
                let called = Python::try_attach(|py| {
                    let called = function.call1(py, (event,));
                    called.map(drop).inspect_err(|error| {
                        error.clone_ref(py).write_unraisable(py, Some(function.bind(py)));
                    })
                });
                match called {
                    Some(Ok(())) => {}
                    Some(Err(error)) => drop(lock(&first).get_or_insert(error)),
                    None => return,
                }
            }
        });
        Ok(Callback { stop: Some(stop), thread: Some(thread), failed })
    }

    /// Delivers all events so far, and waits for that. Raises the first exception of the function.
    pub(crate) fn end(mut self) -> PyResult<()> {
        self.stop = None;
        // A callback that ends its own network cannot wait for itself.
        if let Some(thread) = self.thread.take_if(|it| it.thread().id() != std::thread::current().id()) {
            let _ = thread.join();
        }
        lock(&self.failed).take().map_or(Ok(()), Err)
    }
}

impl Drop for Callback {
    /// Does not wait: garbage is collected in any thread, even in another callback's, with the interpreter's lock.
    fn drop(&mut self) {
        let mut left = lock(&LEFT);
        left.retain(|thread| !thread.is_finished());
        left.extend(self.thread.take());
    }
}
