//! Functions of Python that are called when something happens.

use std::sync::{Arc, Mutex};
use std::thread::{JoinHandle, spawn};

use lexican_machine::tokio as shell;
use pyo3::prelude::*;
use tokio::sync::oneshot;

use crate::wait::lock;

/// Threads that may still be inside a function, and that nobody has waited for: none may be when the interpreter ends.
pub(crate) static LEFT: Mutex<Vec<JoinHandle<()>>> = Mutex::new(Vec::new());

/// The thread that calls a function, until this is gone.
pub(crate) struct Callback {
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
    failed: Arc<Mutex<Option<PyErr>>>,
}

impl Callback {
    /// Calls a function with what `of` makes of each event.
    pub(crate) fn new<E: for<'py> IntoPyObject<'py> + Send>(
        mut events: shell::Events,
        of: impl Fn(lexican_machine::Event) -> Option<E> + Send + 'static,
        function: Py<PyAny>,
    ) -> PyResult<Self> {
        // It waits for what others receive, and lets no time of its own pass.
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
                // There is no interpreter any more when it ends.
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

    /// Lets it have what has happened until now, and waits for that. The first exception of the function.
    pub(crate) fn end(mut self) -> PyResult<()> {
        self.stop = None;
        // One that ends its own network cannot wait for itself.
        if let Some(thread) = self.thread.take_if(|it| it.thread().id() != std::thread::current().id()) {
            let _ = thread.join();
        }
        lock(&self.failed).take().map_or(Ok(()), Err)
    }
}

impl Drop for Callback {
    /// What collects garbage has the interpreter's lock, and may be in any thread, another function's too: it waits for none.
    fn drop(&mut self) {
        let mut left = lock(&LEFT);
        left.retain(|thread| !thread.is_finished());
        left.extend(self.thread.take());
    }
}
